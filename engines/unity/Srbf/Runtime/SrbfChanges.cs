// SPDX-License-Identifier: MIT
// What an asset knows of surfaces that change and of the environment. Without Unity types.
using System;
using System.Collections.Generic;

namespace Srbf
{
    /// <summary>A matrix of an asset, divided by its scale: row i is row i of the texture.</summary>
    [Serializable]
    public sealed class SrbfMatrix
    {
        public string file;
        public int columns;
        public double scale = 1;

        /// <summary>Whether the asset has it: Unity makes empty objects of what is null.</summary>
        public bool Exists { get { return columns > 0; } }
    }

    [Serializable]
    public sealed class SrbfChanges
    {
        const double MostReflected = 0.99;  // share of light that a bounce keeps at most

        public SrbfMatrix gather, sent, feedback;
        public string seriesFile, firstFile, sharesFile, albedoFile;
        public int terms;       // powers of the exchange of light that are summed
        public float[] shares;  // of surfels in objects, row by row
        public float[] albedo;  // RGB of every surfel
        public float[] first;   // RGB of every object that emits and row of the first table, without bounces

        public bool Exists { get { return gather != null && gather.Exists; } }

        /// <summary>How the sum of `terms` powers is made of the first: a step doubles the terms where true, and adds one where false.</summary>
        public List<bool> Doublings()
        {
            var steps = new List<bool>();
            for (int left = terms; left > 1; left /= 2)
            {
                if (left % 2 == 1) steps.Insert(0, false);
                steps.Insert(0, true);
            }
            return steps;
        }

        /// <summary>RGBA of every surfel: its albedo where objects have others, linear, and that of the bake.</summary>
        public float[] Repainted(IList<KeyValuePair<string, Vector>> colors, string[] objects)
        {
            int count = albedo.Length / 3;
            var values = new float[8 * count];
            for (int i = 0; i < count; i++)
                for (int c = 0; c < 3; c++) values[8 * i + c] = values[8 * i + 4 + c] = albedo[3 * i + c];
            foreach (KeyValuePair<string, Vector> entry in colors)
            {
                int found = Array.IndexOf(objects, entry.Key);
                if (found < 0) throw new ArgumentException("expected an object that can be repainted, found " + entry.Key + "; there are " + string.Join(", ", objects));
                double[] color = { entry.Value.X, entry.Value.Y, entry.Value.Z };
                for (int i = 0; i < count; i++)
                    for (int c = 0; c < 3; c++) values[8 * i + c] += (float)(shares[found * count + i] * (Limited(color[c]) - albedo[3 * i + c]));
            }
            for (int i = 0; i < count; i++)
                for (int c = 0; c < 3; c++) values[8 * i + c] = (float)Limited(values[8 * i + c]);
            return values;
        }

        static double Limited(double share) { return Math.Max(0, Math.Min(MostReflected, share)); }
    }
}
