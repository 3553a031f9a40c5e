// SPDX-License-Identifier: MIT
using UnityEngine;

namespace Srbf
{
    /// <summary>An imported asset: its textures, and the data for the weights of a frame.</summary>
    public sealed class SrbfAsset : ScriptableObject
    {
        public string method, quantity, transport;
        public Texture2DArray layers;  // relighting maps, or components four per layer: row 0 is the image's top
        public Texture2D table;        // pairs of r_table, or w_table
        public Texture2D clusters;     // of clustered eigen maps only
        public Texture2D ambient;      // black where the scene emits nothing
        public int scalars, clusterCount;
        public double[] centers, spreads, assetFromWorld;
        public float[] rTable, lightCoefficients;
        public SrbfLightTable lightTable;        // of named lights
        public SrbfPositionTable positionTable;  // of a light cloud
        public SrbfSurfels surfels;              // of lights that passes measure: its textures are
        public Texture2D places, normals, ranges, corners;
        public Texture2D[] surfelTables;
        public Texture2D cells, environmentTable;         // of a scene that is open
        public Texture2D gather, sent, feedback, series;  // of surfaces that change

        public bool IsMaps { get { return method == "relighting-map"; } }

        public bool IsNamed { get { return lightTable != null && lightTable.names != null && lightTable.names.Length > 0; } }

        public bool IsCloud { get { return positionTable != null && positionTable.rank > 0; } }

        /// <summary>Whether passes can measure lights, by shadows of the asset's own triangles.</summary>
        public bool HasSurfels { get { return surfels != null && surfels.tables != null && surfels.tables.Length > 0; } }

        /// <summary>Texels in a row of weights: of a cluster the mean's and each component's, or one per map.</summary>
        public int WeightColumns { get { return scalars > 0 ? scalars + 1 : layers.depth; } }
    }
}
