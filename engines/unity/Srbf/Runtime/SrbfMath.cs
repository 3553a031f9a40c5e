// SPDX-License-Identifier: MIT
// Relighting on the host, without Unity types: axes, light functions, weights. Doubles; meters, radians.
using System;
using System.Collections.Generic;

namespace Srbf
{
    public struct Vector
    {
        public double X, Y, Z;

        public Vector(double x, double y, double z) { X = x; Y = y; Z = z; }

        public double Dot(Vector other) { return X * other.X + Y * other.Y + Z * other.Z; }

        public Vector Normalized()
        {
            double length = Math.Sqrt(Dot(this));
            return length > 0 ? new Vector(X / length, Y / length, Z / length) : this;
        }
    }

    /// <summary>A directional light in the asset's frame: the unit direction towards it, and its irradiance as linear RGB.</summary>
    public struct DistantLight
    {
        public Vector ToLight;
        public Vector Color;
    }

    public static class SrbfMath
    {
        /// <summary>
        /// The asset's frame (Blender's: right-handed, z up) from Unity's (left-handed, y up), as Blender's FBX and glTF files are imported:
        /// Unity's x is Blender's -x, its y Blender's z, its z Blender's -y.
        /// </summary>
        public static Vector AssetFromUnity(Vector v) { return new Vector(-v.X, -v.Z, v.Y); }

        public static Vector UnityFromAsset(Vector v) { return new Vector(-v.X, v.Z, -v.Y); }

        /// <summary>Row-major 4 x 4 of AssetFromUnity, to be multiplied from the left on Unity's matrices.</summary>
        public static readonly double[] Axes = { -1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1 };

        /// <summary>R at a cosine from the asset's table: entry j at -1 + 2 j / (n - 1), interpolated as in the shader.</summary>
        public static double Weight(float[] table, double cosine)
        {
            double place = (Math.Min(1, Math.Max(-1, cosine)) + 1) * 0.5 * (table.Length - 1);
            int j = Math.Min((int)place, table.Length - 2);
            return table[j] + (table[j + 1] - table[j]) * (place - j);
        }

        /// <summary>The R table from its end, with the difference to the next entry, 0 in the last: the shader reads both in one fetch.</summary>
        public static float[] Pairs(float[] table)
        {
            var pairs = new float[2 * table.Length];
            for (int j = 0; j < table.Length; j++)
            {
                int at = table.Length - 1 - j;
                pairs[2 * j] = table[at];
                pairs[2 * j + 1] = at > 0 ? table[at - 1] - table[at] : 0;
            }
            return pairs;
        }

        /// <summary>The sum over distant lights of color times R_i, RGBA per map with A = 1: the content of _SrbfWeights.</summary>
        public static float[] MapWeights(double[] centers, float[] table, IList<DistantLight> lights)
        {
            int count = centers.Length / 3;
            var sums = new double[count * 3];
            foreach (DistantLight light in lights)
                for (int i = 0; i < count; i++)
                {
                    var center = new Vector(centers[3 * i], centers[3 * i + 1], centers[3 * i + 2]).Normalized();
                    Add(sums, i, light.Color, Weight(table, center.Dot(light.ToLight)));
                }
            return WithAlpha(sums);
        }

        /// <summary>
        /// The sum over distant lights of color times w_f(L), RGBA per function with A = 1: a row of (components + 1) texels per cluster.
        /// w_f(L) is the sum over b of coefficients[f, b] exp(-acos(L.Q_b)^2 / (2 spread_f^2)).
        /// </summary>
        public static float[] PlaneWeights(double[] centers, double[] spreads, float[] coefficients, IList<DistantLight> lights)
        {
            int count = centers.Length / 3;
            var sums = new double[spreads.Length * 3];
            foreach (DistantLight light in lights)
            {
                var angles = new double[count];
                for (int b = 0; b < count; b++)
                {
                    var center = new Vector(centers[3 * b], centers[3 * b + 1], centers[3 * b + 2]).Normalized();
                    angles[b] = Math.Acos(Math.Min(1, Math.Max(-1, center.Dot(light.ToLight))));
                }
                var gaussians = new Dictionary<double, double[]>();  // few spreads serve many functions
                for (int f = 0; f < spreads.Length; f++)
                {
                    double[] values;
                    if (!gaussians.TryGetValue(spreads[f], out values))
                    {
                        values = Array.ConvertAll(angles, angle => Math.Exp(-angle * angle / (2 * spreads[f] * spreads[f])));
                        gaussians[spreads[f]] = values;
                    }
                    double red = 0, green = 0, blue = 0;
                    for (int b = 0; b < count; b++)
                    {
                        int at = 3 * (f * count + b);
                        red += coefficients[at] * values[b];
                        green += coefficients[at + 1] * values[b];
                        blue += coefficients[at + 2] * values[b];
                    }
                    Add(sums, f, new Vector(light.Color.X * red, light.Color.Y * green, light.Color.Z * blue), 1);
                }
            }
            return WithAlpha(sums);
        }

        /// <summary>1 - cos of a spot's half-angle, precise for narrow ones; the shader's versineInner and versineOuter.</summary>
        public static double Versine(double halfAngle) { return 2 * Math.Sin(halfAngle / 2) * Math.Sin(halfAngle / 2); }

        /// <summary>
        /// The share of a point light's flux that a spot sends out, by Unity's full cone angles in degrees: a smooth step between them lets half
        /// through. With it a light cloud follows a spot as a point light, a rough approximation: the bounces lack the cone's
        /// direction. In a small room they are off by 0.4 for a half-angle of 45 degrees, by 0.6 for 20 (relative rms).
        /// </summary>
        public static double FluxShare(double innerDegrees, double outerDegrees)
        {
            return (Versine(innerDegrees * 0.5 * Math.PI / 180) + Versine(outerDegrees * 0.5 * Math.PI / 180)) / 4;
        }

        /// <summary>
        /// Sixteen floats of a point light in the asset's frame, as srbfUnpackPointLight takes them: its color becomes the irradiance at 1 m.
        /// Angles are Unity's full cone angles in degrees; below 0 for a light without a cone.
        /// </summary>
        public static float[] PackedPointLight(Vector place, Vector color, Vector axis, double a0, double radius, bool linear, double innerDegrees, double outerDegrees)
        {
            double atOne = linear ? a0 : a0 * a0;
            double inner = outerDegrees < 0 ? 3 : Versine(innerDegrees * 0.5 * Math.PI / 180), outer = outerDegrees < 0 ? 4 : Versine(outerDegrees * 0.5 * Math.PI / 180);
            Func<double, float> low = value => (float)(value - (float)value);
            return Array.ConvertAll(new[]
            {
                place.X, place.Y, place.Z, radius,
                low(place.X), low(place.Y), low(place.Z), linear ? 0 : 1,
                color.X * atOne, color.Y * atOne, color.Z * atOne, inner,
                axis.X, axis.Y, axis.Z, outer,
            }, value => (float)value);
        }

        static void Add(double[] sums, int i, Vector color, double weight)
        {
            sums[3 * i] += color.X * weight;
            sums[3 * i + 1] += color.Y * weight;
            sums[3 * i + 2] += color.Z * weight;
        }

        static float[] WithAlpha(double[] sums)
        {
            var rows = new float[sums.Length / 3 * 4];
            for (int i = 0; i < sums.Length / 3; i++)
            {
                for (int c = 0; c < 3; c++) rows[4 * i + c] = (float)sums[3 * i + c];
                rows[4 * i + 3] = 1;
            }
            return rows;
        }
    }
}
