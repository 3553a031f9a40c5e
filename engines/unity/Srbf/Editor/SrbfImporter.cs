// SPDX-License-Identifier: MIT
using System.IO;
using UnityEditor.AssetImporters;
using UnityEngine;

namespace Srbf
{
    /// <summary>
    /// Imports an exported asset by its .srbf file, which lies beside asset.json and the images. It reads the images itself instead of Unity's
    /// texture importer, so that nothing is resized, compressed, flipped or treated as sRGB.
    /// </summary>
    [ScriptedImporter(2, "srbf")]
    public sealed class SrbfImporter : ScriptedImporter
    {
        public override void OnImportAsset(AssetImportContext context)
        {
            string folder = Path.GetDirectoryName(context.assetPath);
            string path = Path.Combine(folder, "asset.json");
            SrbfManifest manifest = SrbfManifest.Read(File.ReadAllText(path));
            var asset = ScriptableObject.CreateInstance<SrbfAsset>();
            asset.method = manifest.Method;
            asset.quantity = manifest.Quantity;
            asset.transport = manifest.Transport;
            asset.scalars = manifest.Scalars;
            asset.clusterCount = manifest.Clusters;
            asset.centers = manifest.Centers;
            asset.spreads = manifest.Spreads;
            asset.assetFromWorld = manifest.AssetFromWorld;
            context.AddObjectToAsset("asset", asset);
            context.SetMainObject(asset);
            asset.layers = Add(context, "layers", Layers(manifest, folder));
            asset.lightTable = manifest.LightTable(folder);
            asset.positionTable = manifest.PositionTable(folder);
            if (manifest.Surfels != null) ReadSurfels(context, asset, manifest, folder);
            if (!manifest.IsWeighted) ReadFunctions(context, asset, manifest, folder);
            if (manifest.ClusterFile != null)
                asset.clusters = Add(context, "clusters", Texture(SrbfImage.Read(Path.Combine(folder, manifest.ClusterFile)), TextureFormat.R8, FilterMode.Point));
            SrbfImage ambient = manifest.AmbientFile != null
                ? SrbfImage.Read(Path.Combine(folder, manifest.AmbientFile))
                : new SrbfImage { Width = 1, Height = 1, Channels = 3, Values = new float[3] };
            asset.ambient = Add(context, "ambient", Texture(ambient, TextureFormat.RGBAHalf, FilterMode.Bilinear));
            context.DependsOnSourceAsset(path);
        }

        /// <summary>What distant and point lights look up.</summary>
        static void ReadFunctions(AssetImportContext context, SrbfAsset asset, SrbfManifest manifest, string folder)
        {
            SrbfImage table = SrbfImage.Read(Path.Combine(folder, manifest.TableFile));
            if (asset.IsMaps)
            {
                asset.rTable = table.Values;
                table = new SrbfImage { Width = table.Width, Height = 1, Channels = 2, Values = SrbfMath.Pairs(table.Values) };
            }
            asset.table = Add(context, "table", Texture(table, asset.IsMaps ? TextureFormat.RGFloat : TextureFormat.RGBAHalf, FilterMode.Point));
            if (!asset.IsMaps) asset.lightCoefficients = SrbfImage.Read(Path.Combine(folder, manifest.CoefficientsFile)).Values;
        }

        /// <summary>What the passes of SrbfSurfelPasses look up.</summary>
        static void ReadSurfels(AssetImportContext context, SrbfAsset asset, SrbfManifest manifest, string folder)
        {
            SrbfSurfels surfels = asset.surfels = manifest.SurfelPasses(folder);
            System.Func<string, string, TextureFormat, Texture2D> read = (name, file, format) =>
                Add(context, name, Texture(SrbfImage.Read(Path.Combine(folder, file)), format, FilterMode.Point));
            asset.places = read("places", surfels.placesFile, TextureFormat.RGBAFloat);
            asset.normals = read("normals", surfels.normalsFile, TextureFormat.RGBAFloat);
            asset.ranges = read("ranges", surfels.rangesFile, TextureFormat.RGBAFloat);
            asset.corners = read("corners", surfels.cornersFile, TextureFormat.RGBAFloat);
            if (surfels.environment.Exists)
            {
                asset.cells = read("cells", surfels.cellsFile, TextureFormat.RGBAFloat);
                asset.environmentTable = read("environment", surfels.environment.file, TextureFormat.RGBAHalf);
            }
            if (surfels.changes.Exists)
            {
                asset.gather = read("gather", surfels.changes.gather.file, TextureFormat.RHalf);
                asset.sent = read("sent", surfels.changes.sent.file, TextureFormat.RHalf);
                asset.feedback = read("feedback", surfels.changes.feedback.file, TextureFormat.RGBAHalf);
                asset.series = read("series", surfels.changes.seriesFile, TextureFormat.RGBAFloat);
            }
            asset.surfelTables = System.Array.ConvertAll(surfels.tables, table =>
                read(Path.GetFileNameWithoutExtension(table.file), table.file, table.channels == 1 ? TextureFormat.RHalf : TextureFormat.RGBAHalf));
        }

        static Texture2DArray Layers(SrbfManifest manifest, string folder)
        {
            string first = Path.Combine(folder, manifest.LayerFiles[0]);
            SrbfDds blocks = first.EndsWith(".dds") ? SrbfDds.Read(File.ReadAllBytes(first), first) : null;
            int levels = blocks == null ? 1 : blocks.Levels;
            var layers = new Texture2DArray(manifest.Width, manifest.Height, manifest.LayerFiles.Length, FormatOf(blocks), levels, true)
            {
                // A component has another meaning in another cluster: the sampler must not mix its layers.
                filterMode = manifest.ClusterFile != null ? FilterMode.Point : levels > 1 ? FilterMode.Trilinear : FilterMode.Bilinear,
                wrapMode = TextureWrapMode.Clamp,
            };
            for (int i = 0; i < manifest.LayerFiles.Length; i++)
            {
                for (int level = 0; blocks != null && level < levels; level++) layers.SetPixelData(blocks.Data(i, level), level, i);
                if (blocks == null) layers.SetPixelData(Halves(SrbfImage.Read(Path.Combine(folder, manifest.LayerFiles[i])).Rgba()), 0, i);
            }
            layers.Apply(false);  // readable, since the imported asset is written from the host's copy
            return layers;
        }

        static TextureFormat FormatOf(SrbfDds blocks)
        {
            switch (blocks == null ? SrbfDds.RgbaHalf : blocks.Format)
            {
                case SrbfDds.Bc7: return TextureFormat.BC7;
                case SrbfDds.Bc1: return TextureFormat.DXT1;
                case SrbfDds.Rgba8: return TextureFormat.RGBA32;
                default: return TextureFormat.RGBAHalf;
            }
        }

        /// <summary>Rows are uploaded in order: the image's top becomes v = 0, and the shader flips v.</summary>
        static Texture2D Texture(SrbfImage image, TextureFormat format, FilterMode filter)
        {
            var texture = new Texture2D(image.Width, image.Height, format, false, true) { filterMode = filter, wrapMode = TextureWrapMode.Clamp };
            if (format == TextureFormat.RGFloat) texture.SetPixelData(image.Values, 0);
            else if (format == TextureFormat.RGBAFloat) texture.SetPixelData(image.Rgba(), 0);
            else if (format == TextureFormat.RHalf) texture.SetPixelData(Halves(image.Values), 0);
            else if (format == TextureFormat.R8) texture.SetPixelData(System.Array.ConvertAll(image.Values, value => (byte)value), 0);
            else texture.SetPixelData(Halves(image.Rgba()), 0);
            texture.Apply(false);
            return texture;
        }

        static ushort[] Halves(float[] values) { return System.Array.ConvertAll(values, SrbfImage.ToHalf); }

        static T Add<T>(AssetImportContext context, string name, T made) where T : Object
        {
            made.name = name;
            context.AddObjectToAsset(name, made);
            return made;
        }
    }
}
