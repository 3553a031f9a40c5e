// SPDX-License-Identifier: MIT
// Weights of point lights by where they stand, without rays: RGB light functions at the nodes of a grid, mixed by what a light sees of them.
// A light takes eight nodes; then one product of a vector and a matrix gives the weights of all lights together. Without Unity types.
using System;
using System.Collections.Generic;

namespace Srbf
{
    [Serializable]
    public sealed class SrbfPositionTable
    {
        const double Seen = 1e-4;  // sum of its cell's weights below which a light sees no node

        public double[] origin;    // m
        public double spacing;     // m
        public int[] nodes;        // along x, y, z
        public int fine, rank;     // places per cell and axis at which it is known which corners are seen; numbers per node
        public float[] nodeValues; // rank numbers of every node, x fastest
        public float[] basis;      // red, green, blue of function f on axis r: 3 (r F + f)
        public byte[] seen;        // how much of each corner of its cell a fine place sees: rows by z and y, columns by x and corner

        /// <summary>
        /// RGBA per light function of all lights together, with A = 1. Places in the asset's frame, m; colors the irradiance at 1 m, linear.
        /// `outside` is how many lights see no node, as in a wall: their weights are those of the nodes around.
        /// </summary>
        public float[] Weights(IList<Vector> places, IList<Vector> colors, out int outside)
        {
            outside = 0;
            var mixed = new double[3 * rank];
            var corners = new int[8];
            var shares = new double[8];
            for (int n = 0; n < places.Count; n++)
            {
                if (!Corners(places[n], corners, shares)) outside++;
                for (int c = 0; c < 8; c++)
                    for (int r = 0; r < rank && shares[c] != 0; r++)
                    {
                        double value = shares[c] * nodeValues[rank * corners[c] + r];
                        mixed[3 * r] += colors[n].X * value;
                        mixed[3 * r + 1] += colors[n].Y * value;
                        mixed[3 * r + 2] += colors[n].Z * value;
                    }
            }
            int functions = basis.Length / (3 * rank);
            var sums = new double[3 * functions];
            for (int r = 0; r < rank; r++)
                for (int i = 0, at = 3 * r * functions; i < sums.Length; i += 3, at += 3)
                {
                    sums[i] += mixed[3 * r] * basis[at];
                    sums[i + 1] += mixed[3 * r + 1] * basis[at + 1];
                    sums[i + 2] += mixed[3 * r + 2] * basis[at + 2];
                }
            var rows = new float[4 * functions];
            for (int f = 0; f < functions; f++)
            {
                for (int c = 0; c < 3; c++) rows[4 * f + c] = (float)sums[3 * f + c];
                rows[4 * f + 3] = 1;
            }
            return rows;
        }

        /// <summary>The eight nodes about a place and their weights; whether the place sees any of them.</summary>
        bool Corners(Vector place, int[] corners, double[] shares)
        {
            double[] at = { place.X, place.Y, place.Z }, part = new double[3], between = new double[3], amounts = new double[8];
            int[] cell = new int[3], low = new int[3];
            for (int axis = 0; axis < 3; axis++)
            {
                double grid = Math.Min(Math.Max((at[axis] - origin[axis]) / spacing, 0), nodes[axis] - 1);
                cell[axis] = Math.Min((int)grid, nodes[axis] - 2);
                part[axis] = grid - cell[axis];
                int first = cell[axis] * fine;
                double step = Math.Min(Math.Max(grid * fine - 0.5, first), first + fine - 1);  // of the light's own cell alone
                low[axis] = Math.Min((int)step, first + fine - 2);
                between[axis] = step - low[axis];
            }
            int row = 8 * fine * (nodes[0] - 1);
            for (int corner = 0; corner < 8; corner++)
            {
                int start = ((low[2] + (corner >> 2)) * fine * (nodes[1] - 1) + low[1] + (corner >> 1 & 1)) * row + 8 * (low[0] + (corner & 1));
                for (int c = 0; c < 8; c++) amounts[c] += Share(corner, between) * seen[start + c] / 255.0;
            }
            double total = 0;
            for (int c = 0; c < 8; c++)
            {
                corners[c] = ((cell[2] + (c >> 2)) * nodes[1] + cell[1] + (c >> 1 & 1)) * nodes[0] + cell[0] + (c & 1);
                shares[c] = Share(c, part);
                total += shares[c] * amounts[c];
            }
            for (int c = 0; c < 8 && total >= Seen; c++) shares[c] *= amounts[c] / total;
            return total >= Seen;
        }

        static double Share(int corner, double[] part)
        {
            double share = 1;
            for (int axis = 0; axis < 3; axis++) share *= (corner >> axis & 1) == 1 ? part[axis] : 1 - part[axis];
            return share;
        }
    }
}
