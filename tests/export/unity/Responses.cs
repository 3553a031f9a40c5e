// SPDX-License-Identifier: MIT
// Runs the engine-free files on an exported asset and prints what they found, a name and numbers a line, for the tests to compare.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using Srbf;

static class Responses
{
    static void Main(string[] arguments)
    {
        CultureInfo.DefaultThreadCurrentCulture = CultureInfo.CurrentCulture = new CultureInfo("de-DE");  // a comma is a decimal point there
        string folder = arguments[0];
        SrbfManifest manifest;
        try { manifest = SrbfManifest.Read(File.ReadAllText(Path.Combine(folder, "asset.json"))); }
        catch (FormatException error) { Console.WriteLine("refused " + error.Message); return; }
        Print("size", manifest.Width, manifest.Height, manifest.LayerFiles.Length, manifest.Scalars, manifest.Clusters, manifest.TableSize);
        if (!manifest.IsWeighted) Print("centers", manifest.Centers);
        string first = Path.Combine(folder, manifest.LayerFiles[0]);
        SrbfDds blocks = first.EndsWith(".dds") ? SrbfDds.Read(File.ReadAllBytes(first), first) : null;
        if (blocks != null) Print("blocks", blocks.Width, blocks.Height, blocks.Layers, blocks.Levels, blocks.Format);
        for (int i = 0; blocks != null && i < blocks.Layers; i++)
            for (int level = 0; level < blocks.Levels; level++) Print("level" + level, Array.ConvertAll(blocks.Data(i, level), b => (double)b));
        for (int i = 0; blocks == null && i < manifest.LayerFiles.Length; i++) Show("layer" + i, SrbfImage.Read(Path.Combine(folder, manifest.LayerFiles[i])));
        if (manifest.IsWeighted) { Weighted(folder, manifest, arguments); return; }
        SrbfImage table = SrbfImage.Read(Path.Combine(folder, manifest.TableFile));
        Show("table", table);
        if (manifest.ClusterFile != null) Show("clusters", SrbfImage.Read(Path.Combine(folder, manifest.ClusterFile)));
        var lights = new List<DistantLight>();
        for (int i = 1; i + 5 < arguments.Length; i += 6)
        {
            var n = new double[6];
            for (int j = 0; j < 6; j++) n[j] = double.Parse(arguments[i + j], CultureInfo.InvariantCulture);
            lights.Add(new DistantLight { ToLight = new Vector(n[0], n[1], n[2]).Normalized(), Color = new Vector(n[3], n[4], n[5]) });
        }
        Print("pairs", SrbfMath.Pairs(table.Values));
        if (manifest.Method == "relighting-map") Print("weights", SrbfMath.MapWeights(manifest.Centers, table.Values, lights));
        else Print("weights", SrbfMath.PlaneWeights(manifest.Centers, manifest.Spreads, SrbfImage.Read(Path.Combine(folder, manifest.CoefficientsFile)).Values, lights));
        foreach (Vector axis in new[] { new Vector(1, 0, 0), new Vector(0, 1, 0), new Vector(0, 0, 1) })
        {
            Vector moved = SrbfMath.AssetFromUnity(axis), back = SrbfMath.UnityFromAsset(moved);
            Print("axis", moved.X, moved.Y, moved.Z, back.X, back.Y, back.Z);
        }
        Print("axes", SrbfMath.Axes);
        Print("versines", SrbfMath.Versine(0.001), SrbfMath.Versine(0.3), SrbfMath.Versine(2));
        Print("pointLight", SrbfMath.PackedPointLight(new Vector(0.4, -0.3, 1.1), new Vector(0.5, 1, 2), new Vector(0, 0.6, -0.8), 0.8, 0.05, false, 40, 70));
        Print("pointLight", SrbfMath.PackedPointLight(new Vector(0.4, -0.3, 1.1), new Vector(0.5, 1, 2), new Vector(0, 0, 1), 0.7, 0.01, true, -1, -1));
        var halves = new List<double>();
        for (int bits = 0; bits < 65536; bits++)
            if ((bits & 0x7C00) != 0x7C00 && SrbfImage.ToHalf(SrbfImage.FromHalf((ushort)bits)) != bits) halves.Add(bits);
        Print("wronghalves", halves.ToArray());
        Print("halves", SrbfImage.ToHalf(1.00048828125f), SrbfImage.ToHalf(1.0009766f), SrbfImage.ToHalf(-0.3333333f), SrbfImage.ToHalf(65519), SrbfImage.ToHalf(65520), SrbfImage.ToHalf(3e-8f), SrbfImage.ToHalf(0.99999f));
    }

    /// <summary>Named lights: three numbers per light, its color. A cloud: eight per light, its place, its color at 1 m, and a spot's cone angles or -1.</summary>
    static void Weighted(string folder, SrbfManifest manifest, string[] arguments)
    {
        double[] n = Array.ConvertAll(arguments, text => { double value; return double.TryParse(text, NumberStyles.Float, CultureInfo.InvariantCulture, out value) ? value : 0; });
        if (manifest.Surfels != null && n.Length == 4) { Surfels(manifest.SurfelPasses(folder), n); return; }
        var places = new List<Vector>();
        var colors = new List<Vector>();
        SrbfLightTable table = manifest.LightTable(folder);
        for (int i = 1; table != null && i + 2 < n.Length; i += 3) colors.Add(new Vector(n[i], n[i + 1], n[i + 2]));
        if (table != null)
        {
            Print("weights", table.Weights(colors));
            for (int i = 0; i < table.names.Length; i++) Console.WriteLine("index " + table.Index(table.names[i]));
            try { table.Index("none"); } catch (ArgumentException error) { Console.WriteLine("told " + error.Message.Length); }
            return;
        }
        for (int i = 1; i + 7 < n.Length; i += 8)
        {
            double share = n[i + 7] < 0 ? 1 : SrbfMath.FluxShare(n[i + 6], n[i + 7]);
            places.Add(new Vector(n[i], n[i + 1], n[i + 2]));
            colors.Add(new Vector(n[i + 3] * share, n[i + 4] * share, n[i + 5] * share));
        }
        int outside;
        Print("weights", manifest.PositionTable(folder).Weights(places, colors, out outside));
        Print("outside", outside);
    }

    /// <summary>What passes need; three numbers: the radiance of the asset's second object.</summary>
    static void Surfels(SrbfSurfels surfels, double[] n)
    {
        Print("surfels", surfels.patches, surfels.triangles, surfels.reach, surfels.lift, surfels.middle[0], surfels.middle[1], surfels.middle[2]);
        foreach (SrbfSurfelTable table in surfels.tables) Print("table", table.rows, table.columns, table.channels, table.scale, table.Blocks);
        for (int face = 0; face < 6; face++) Axes("face", SrbfSurfels.Face(face));
        Axes("frame", SrbfSurfels.Frame(new Vector(0.48, -0.6, 0.64)));
        Axes("frame", SrbfSurfels.Frame(new Vector(0, 0, 1)));
        var radiance = new KeyValuePair<string, Vector>(surfels.objects[1], new Vector(n[1], n[2], n[3]));
        Print("added", surfels.Emitted(new[] { radiance }, surfels.emission));
        Print("first", surfels.Emitted(new[] { radiance }, surfels.changes.first));
        Print("changes", surfels.changes.terms, surfels.changes.gather.columns, surfels.changes.gather.scale, surfels.changes.sent.scale, surfels.changes.feedback.columns, surfels.changes.feedback.scale);
        Print("doublings", surfels.changes.Doublings().ConvertAll(doubling => doubling ? 1.0 : 0.0).ToArray());
        Print("environment", surfels.environment.columns, surfels.environment.scale, surfels.environmentSide);
        Print("painted", surfels.changes.Repainted(new[] { radiance }, surfels.objects));
        try { surfels.changes.Repainted(new[] { new KeyValuePair<string, Vector>("none", new Vector()) }, surfels.objects); }
        catch (ArgumentException error) { Console.WriteLine("told " + error.Message.Length); }
        try { surfels.Emitted(new[] { new KeyValuePair<string, Vector>("none", new Vector()) }, surfels.emission); }
        catch (ArgumentException error) { Console.WriteLine("told " + error.Message.Length); }
    }

    static void Axes(string name, Vector[] axes) { Print(name, axes[0].X, axes[0].Y, axes[0].Z, axes[1].X, axes[1].Y, axes[1].Z, axes[2].X, axes[2].Y, axes[2].Z); }

    static void Show(string name, SrbfImage image)
    {
        Print(name + "shape", image.Height, image.Width, image.Channels, image.Half ? 1 : 0);
        Print(name, image.Values);
    }

    static void Print(string name, params double[] values) { Console.WriteLine(name + " " + string.Join(" ", Array.ConvertAll(values, v => v.ToString("R", CultureInfo.InvariantCulture)))); }

    static void Print(string name, float[] values) { Print(name, Array.ConvertAll(values, v => (double)v)); }
}
