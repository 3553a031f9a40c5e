// SPDX-License-Identifier: MIT
using UnityEngine;

namespace Srbf
{
    /// <summary>An imported asset: its textures, and what the weights of a frame are computed from.</summary>
    public sealed class SrbfAsset : ScriptableObject
    {
        public string method, quantity, transport;
        public Texture2DArray layers;  // relighting maps, or planes four by four: row 0 is the image's top
        public Texture2D table;        // pairs of r_table, or w_table
        public Texture2D clusters;     // of a clustered eigen map alone
        public Texture2D ambient;      // black where the scene emits nothing
        public int scalars, clusterCount;
        public double[] centers, spreads, assetFromWorld;
        public float[] rTable, lightCoefficients;

        public bool IsMaps { get { return method == "relighting-map"; } }
    }
}
