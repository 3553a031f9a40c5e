// SPDX-License-Identifier: MIT
// asset.json as fields.
using System;
using System.Collections.Generic;

namespace Srbf
{
    public sealed class SrbfManifest
    {
        public string Method, Quantity, Transport;
        public int Width, Height, Scalars, Clusters, TableSize;
        public string[] LayerFiles;
        public double[] Centers;           // of the maps' Gaussians, or of the light functions': 3 per center
        public double[] Spreads;           // one for relighting maps, one per light function for coefficient maps
        public double[] AssetFromWorld;    // row-major 4 x 4
        public string TableFile, CoefficientsFile, ClusterFile, AmbientFile;

        /// <summary>Read asset.json's text; FormatException with what was expected and found.</summary>
        public static SrbfManifest Read(string text)
        {
            var json = SrbfJson.Parse(text) as Dictionary<string, object>;
            if (json == null || Text(json, "format") != "srbf-asset") throw new FormatException("expected an asset.json of format srbf-asset, found another file");
            if (Number(json, "version") != 1) throw new FormatException("expected version 1 of srbf-asset, found " + Number(json, "version") + "; update the Srbf folder");
            var manifest = new SrbfManifest
            {
                Method = Text(json, "method"),
                Quantity = Text(json, "quantity"),
                Transport = json.ContainsKey("transport") ? Text(json, "transport") : "combined",
                Width = (int)Number(json, "width"),
                Height = (int)Number(json, "height"),
                Clusters = json.ContainsKey("clusters") ? (int)Number(json, "clusters") : 1,
                AmbientFile = json.ContainsKey("ambient") ? Text(json, "ambient") : null,
                AssetFromWorld = json.ContainsKey("asset_from_world") ? Numbers(json["asset_from_world"]) : new double[] { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 },
            };
            bool maps = manifest.Method == "relighting-map";
            var layers = (List<object>)json[maps ? "maps" : "planes"];
            manifest.LayerFiles = layers.ConvertAll(layer => Text(Member(layer), "file")).ToArray();
            var basis = Member(json[maps ? "basis" : "light_basis"]);
            if (Text(basis, "kind") != "gaussian") throw new FormatException("expected Gaussians, found " + Text(basis, "kind") + ": no shader relights them");
            manifest.Centers = Numbers(basis["centers"]);
            var table = Member(json[maps ? "r_table" : "w_table"]);
            manifest.TableFile = Text(table, "file");
            manifest.TableSize = (int)Number(table, "size");
            if (maps)
            {
                manifest.Spreads = new[] { Number(basis, "spread") };
                return manifest;
            }
            manifest.Spreads = Numbers(basis["spreads"]);
            manifest.Scalars = (int)Number(json, "scalars");
            manifest.CoefficientsFile = Text(Member(json["light_coefficients"]), "file");
            manifest.ClusterFile = json.ContainsKey("cluster_index") ? Text(Member(json["cluster_index"]), "file") : null;
            return manifest;
        }

        /// <summary>All numbers of a list, nested lists flattened.</summary>
        public static double[] Numbers(object value)
        {
            var found = new List<double>();
            Gather(value, found);
            return found.ToArray();
        }

        static void Gather(object value, List<double> found)
        {
            if (value is double) { found.Add((double)value); return; }
            var list = value as List<object>;
            if (list == null) throw new FormatException("expected numbers in asset.json, found " + value);
            foreach (object item in list) Gather(item, found);
        }

        static Dictionary<string, object> Member(object value)
        {
            var members = value as Dictionary<string, object>;
            if (members == null) throw new FormatException("expected an object in asset.json, found " + value);
            return members;
        }

        static string Text(Dictionary<string, object> json, string name)
        {
            object value;
            if (!json.TryGetValue(name, out value) || !(value is string)) throw new FormatException("expected a text for \"" + name + "\" in asset.json, found " + value);
            return (string)value;
        }

        static double Number(Dictionary<string, object> json, string name)
        {
            object value;
            if (!json.TryGetValue(name, out value) || !(value is double)) throw new FormatException("expected a number for \"" + name + "\" in asset.json, found " + value);
            return (double)value;
        }
    }
}
