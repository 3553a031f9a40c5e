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
        public string[] Names;             // of named lights
        public string ValuesFile;          // light_values; null where each light has a map
        public double ValuesScale;
        public SrbfPositionTable Positions;  // of a light cloud, still without what its files hold
        public string NodesFile, BasisFile, VisibilityFile;
        public SrbfSurfels Surfels;        // of lights inside a scene, still without emission; null where no passes measure them

        /// <summary>Whether every light enters through the weights of a frame: named lights, and lights of a cloud.</summary>
        public bool IsWeighted { get { return Names != null || Positions != null; } }

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
            bool maps = json.ContainsKey("maps");
            var layers = (List<object>)json[maps ? "maps" : "planes"];
            manifest.LayerFiles = layers.ConvertAll(layer => Text(Member(layer), "file")).ToArray();
            manifest.Scalars = maps ? 0 : (int)Number(json, "scalars");
            manifest.ClusterFile = json.ContainsKey("cluster_index") ? Text(Member(json["cluster_index"]), "file") : null;
            if (json.ContainsKey("light_domain") && manifest.ReadLights(json)) return manifest;
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
            manifest.CoefficientsFile = Text(Member(json["light_coefficients"]), "file");
            return manifest;
        }

        /// <summary>The tables of named lights or of a cloud; false of another domain.</summary>
        bool ReadLights(Dictionary<string, object> json)
        {
            string domain = Text(json, "light_domain");
            if (domain == "named")
            {
                Names = ((List<object>)json["lights"]).ConvertAll(light => Text(Member(light), "name")).ToArray();
                if (!json.ContainsKey("light_values")) return true;
                ValuesFile = Text(Member(json["light_values"]), "file");
                ValuesScale = Number(Member(json["light_values"]), "scale");
            }
            else if (domain == "cloud" || domain == "surfels")
            {
                if (json.ContainsKey("surfel_passes")) ReadSurfels(Member(json["surfel_passes"]));
                var table = Member(json["position_table"]);
                Positions = new SrbfPositionTable
                {
                    origin = Numbers(table["origin"]),
                    spacing = Number(table, "spacing"),
                    nodes = Array.ConvertAll(Numbers(table["nodes"]), n => (int)n),
                    fine = (int)Number(table, "fine"),
                    rank = (int)Number(table, "rank"),
                };
                NodesFile = Text(Member(json["position_nodes"]), "file");
                BasisFile = Text(Member(json["position_basis"]), "file");
                VisibilityFile = Text(Member(json["position_visibility"]), "file");
            }
            return IsWeighted;
        }

        void ReadSurfels(Dictionary<string, object> told)
        {
            Surfels = new SrbfSurfels
            {
                placesFile = Text(told, "places"),
                normalsFile = Text(told, "normals"),
                rangesFile = Text(told, "ranges"),
                cornersFile = Text(told, "corners"),
                cellsFile = told.ContainsKey("cells") ? Text(told, "cells") : null,
                emissionFile = told.ContainsKey("emission") ? Text(told, "emission") : null,
                middle = Numbers(told["middle"]),
                reach = Number(told, "reach"),
                lift = Number(told, "lift"),
                patches = (int)Number(told, "patches"),
                triangles = (int)Number(told, "triangles"),
                objects = told.ContainsKey("objects") ? ((List<object>)told["objects"]).ConvertAll(name => (string)name).ToArray() : new string[0],
                tables = ((List<object>)told["tables"]).ConvertAll(table => SurfelTable(Member(table))).ToArray(),
            };
            if (told.ContainsKey("environment"))
            {
                Surfels.environment = Matrix(told["environment"]);
                Surfels.environmentSide = (int)Number(Member(told["environment"]), "side");
            }
            if (told.ContainsKey("changes")) ReadChanges(Member(told["changes"]));
        }

        void ReadChanges(Dictionary<string, object> told)
        {
            SrbfChanges changes = Surfels.changes;
            changes.gather = Matrix(told["gather"]);
            changes.sent = Matrix(told["sent"]);
            changes.feedback = Matrix(told["feedback"]);
            changes.seriesFile = Text(told, "series");
            changes.firstFile = Text(told, "first");
            changes.sharesFile = Text(told, "shares");
            changes.albedoFile = Text(told, "albedo");
            changes.terms = (int)Number(told, "terms");
        }

        static SrbfMatrix Matrix(object told)
        {
            Dictionary<string, object> entry = Member(told);
            return new SrbfMatrix { file = Text(entry, "file"), columns = (int)Number(entry, "columns"), scale = Number(entry, "scale") };
        }

        static SrbfSurfelTable SurfelTable(Dictionary<string, object> told)
        {
            return new SrbfSurfelTable
            {
                file = Text(told, "file"),
                rows = (int)Number(told, "rows"),
                columns = (int)Number(told, "columns"),
                channels = (int)Number(told, "channels"),
                scale = Number(told, "scale"),
            };
        }

        /// <summary>What passes need, from `folder`; null of another asset.</summary>
        public SrbfSurfels SurfelPasses(string folder)
        {
            if (Surfels == null) return null;
            Func<string, float[]> read = file => SrbfImage.Read(System.IO.Path.Combine(folder, file)).Values;
            Surfels.emission = Surfels.emissionFile == null ? new float[0] : read(Surfels.emissionFile);
            if (!Surfels.changes.Exists) return Surfels;
            Surfels.changes.first = read(Surfels.changes.firstFile);
            Surfels.changes.shares = read(Surfels.changes.sharesFile);
            Surfels.changes.albedo = read(Surfels.changes.albedoFile);
            return Surfels;
        }

        /// <summary>The table of named lights, from `folder`; null of another asset.</summary>
        public SrbfLightTable LightTable(string folder)
        {
            if (Names == null) return null;
            float[] values = ValuesFile == null ? new float[0] : SrbfImage.Read(System.IO.Path.Combine(folder, ValuesFile)).Values;
            return new SrbfLightTable { names = Names, values = Array.ConvertAll(values, value => (float)(value * ValuesScale)) };
        }

        /// <summary>The table of a light cloud, from `folder`; null of another asset.</summary>
        public SrbfPositionTable PositionTable(string folder)
        {
            if (Positions == null) return null;
            Positions.nodeValues = SrbfImage.Read(System.IO.Path.Combine(folder, NodesFile)).Values;
            Positions.basis = SrbfImage.Read(System.IO.Path.Combine(folder, BasisFile)).Values;
            Positions.seen = Array.ConvertAll(SrbfImage.Read(System.IO.Path.Combine(folder, VisibilityFile)).Values, value => (byte)value);
            return Positions;
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
