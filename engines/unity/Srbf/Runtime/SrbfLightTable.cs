// SPDX-License-Identifier: MIT
// The scene's own lights by name, and the weights of any mix of them. Without Unity types.
using System;
using System.Collections.Generic;

namespace Srbf
{
    [Serializable]
    public sealed class SrbfLightTable
    {
        public string[] names;
        public float[] values;  // red, green, blue of light function f at light n: 3 (f N + n); empty where each light has a map of its own

        /// <summary>Index of a name; ArgumentException with the names there are.</summary>
        public int Index(string name)
        {
            int found = Array.IndexOf(names, name);
            if (found < 0) throw new ArgumentException("expected a light of the asset, found " + name + "; its lights are " + string.Join(", ", names));
            return found;
        }

        /// <summary>RGBA per light function, or per light, with A = 1; colors are linear, one of every name, 1 as the scene has the light set.</summary>
        public float[] Weights(IList<Vector> colors)
        {
            int count = names.Length, functions = values.Length == 0 ? count : values.Length / (3 * count);
            var rows = new float[4 * functions];
            for (int f = 0; f < functions; f++)
            {
                double red = 0, green = 0, blue = 0;
                for (int n = 0; n < count; n++)
                {
                    int at = 3 * (f * count + n);
                    if (values.Length == 0 && n != f) continue;
                    red += colors[n].X * (values.Length == 0 ? 1 : values[at]);
                    green += colors[n].Y * (values.Length == 0 ? 1 : values[at + 1]);
                    blue += colors[n].Z * (values.Length == 0 ? 1 : values[at + 2]);
                }
                rows[4 * f] = (float)red;
                rows[4 * f + 1] = (float)green;
                rows[4 * f + 2] = (float)blue;
                rows[4 * f + 3] = 1;
            }
            return rows;
        }
    }
}
