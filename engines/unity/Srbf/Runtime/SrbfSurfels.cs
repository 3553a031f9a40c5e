// SPDX-License-Identifier: MIT
// Data of the passes that light surfels, and a light as they read it. Without Unity types.
using System;
using System.Collections.Generic;

namespace Srbf
{
    /// <summary>A table of an asset: a row of weights is the sum over its entries times numbers.</summary>
    [Serializable]
    public sealed class SrbfSurfelTable
    {
        const int Part = 64;  // entries that one texel of a pass adds up

        public string file;
        public int rows, columns, channels;
        public double scale;

        public int Blocks { get { return Math.Max(1, (columns + Part - 1) / Part); } }
    }

    /// <summary>A point or spot light, or a directional one, in the asset's frame less the middle of the cells.</summary>
    public struct SrbfLook
    {
        public bool Distant;
        public Vector Place;  // m, or the unit direction to the light
        public Vector Color;  // irradiance at a0, or of a directional light, linear
        public Vector Axis;   // where a spot shines, unit
        public double A0, Radius, VersineInner, VersineOuter;
        public bool Linear;
    }

    [Serializable]
    public sealed class SrbfSurfels
    {
        public string placesFile, normalsFile, rangesFile, cornersFile, emissionFile, cellsFile;
        public double[] middle;     // m, the asset's frame
        public double reach, lift;  // m: of all cells and triangles about the middle; of a cell above its surface
        public int patches, triangles;
        public SrbfSurfelTable[] tables;
        public string[] objects;    // that can emit
        public float[] emission;    // RGB of every object and row of the first table, for a radiance of 1
        public SrbfMatrix environment = new SrbfMatrix();  // from the radiance of cells of directions to what is added to the first table's rows
        public int environmentSide;                        // cells per side of the octahedral map
        public SrbfChanges changes = new SrbfChanges();

        /// <summary>A point light's cone: 1 everywhere.</summary>
        public static readonly double[] NoCone = { 3, 4 };

        /// <summary>The axes of face 0 to 5 of a cube, +x, -x, +y, -y, +z, -z: of its columns, of its rows, and the way it looks.</summary>
        public static Vector[] Face(int face)
        {
            int axis = face / 2;
            return new[] { Along(axis + 1, 1), Along(axis + 2, 1), Along(axis, face % 2 == 0 ? 1 : -1) };
        }

        /// <summary>The axes of a directional light's map.</summary>
        public static Vector[] Frame(Vector toLight)
        {
            Vector pole = Math.Abs(toLight.Z) < 0.9 ? new Vector(0, 0, 1) : new Vector(1, 0, 0);
            Vector across = Cross(pole, toLight).Normalized();
            return new[] { across, Cross(toLight, across), toLight };
        }

        public Vector LessMiddle(Vector place) { return new Vector(place.X - middle[0], place.Y - middle[1], place.Z - middle[2]); }

        /// <summary>RGBA for every row of the first table: what objects of these radiances, one for each name or fewer, add; `known`: for a radiance of 1.</summary>
        public float[] Emitted(IList<KeyValuePair<string, Vector>> radiances, float[] known)
        {
            int rows = tables[0].rows;
            var added = new float[4 * rows];
            foreach (KeyValuePair<string, Vector> entry in radiances)
            {
                int found = objects == null ? -1 : Array.IndexOf(objects, entry.Key);
                if (found < 0) throw new ArgumentException("expected an object that can emit, found " + entry.Key + "; there are " + (objects == null || objects.Length == 0 ? "none: fit with --editable" : string.Join(", ", objects)));
                for (int row = 0; row < rows; row++)
                {
                    int at = 3 * (found * rows + row);
                    added[4 * row] += (float)(entry.Value.X * known[at]);
                    added[4 * row + 1] += (float)(entry.Value.Y * known[at + 1]);
                    added[4 * row + 2] += (float)(entry.Value.Z * known[at + 2]);
                }
            }
            return added;
        }

        static Vector Along(int axis, double value)
        {
            return new Vector(axis % 3 == 0 ? value : 0, axis % 3 == 1 ? value : 0, axis % 3 == 2 ? value : 0);
        }

        static Vector Cross(Vector a, Vector b) { return new Vector(a.Y * b.Z - a.Z * b.Y, a.Z * b.X - a.X * b.Z, a.X * b.Y - a.Y * b.X); }
    }
}
