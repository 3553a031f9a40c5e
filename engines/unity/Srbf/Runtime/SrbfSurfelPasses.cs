// SPDX-License-Identifier: MIT
using System;
using System.Collections.Generic;
using UnityEngine;
using UnityEngine.Rendering;

namespace Srbf
{
    /// <summary>
    /// Weights of lights inside a scene by passes of the GPU: for each light a shadow map of the asset's own triangles and its irradiance on
    /// cells of the surfaces, then the means of patches and the asset's tables. In any render pipeline; nothing is read back.
    /// </summary>
    public sealed class SrbfSurfelPasses : IDisposable
    {
        const int OnCube = 0, OnMap = 1, ByCube = 2, ByMap = 3, Means = 4, Parts = 5, Sums = 6;  // of SrbfSurfels.shader
        const int MapSides = 4;  // sides of a cube's face on one of a directional light's map

        readonly SrbfAsset asset;
        readonly Material material;
        readonly CommandBuffer buffer = new CommandBuffer { name = "Srbf surfels" };
        readonly RenderTexture irradiance, received, cube, map;
        readonly RenderTexture[] parts, sums;
        readonly Texture2D nothing;
        readonly SrbfShapePasses shapes;
        readonly List<SrbfLook> known = new List<SrbfLook>();
        SrbfSurroundings surroundings;
        bool drawn;

        public int ShadowSize { get; private set; }

        public bool IsDisposed { get; private set; }

        /// <summary>Whether the GPU adds up, and takes the largest of, 32-bit floats in a target.</summary>
        public static bool IsSupported
        {
            get { return SystemInfo.SupportsBlendingOnRenderTextureFormat(RenderTextureFormat.ARGBFloat) && SystemInfo.SupportsBlendingOnRenderTextureFormat(RenderTextureFormat.RFloat); }
        }

        public SrbfSurfelPasses(SrbfAsset asset, int shadowSize)
        {
            this.asset = asset;
            ShadowSize = shadowSize;
            material = new Material(Shader.Find("Hidden/Srbf/Surfels")) { hideFlags = HideFlags.HideAndDontSave };
            irradiance = Target(asset.places.width, asset.places.height, RenderTextureFormat.ARGBFloat, 0);
            received = Target(asset.ranges.width, asset.ranges.height, RenderTextureFormat.ARGBFloat, 0);
            cube = Target(shadowSize, shadowSize, RenderTextureFormat.RFloat, 6);
            map = Target(MapSides * shadowSize, MapSides * shadowSize, RenderTextureFormat.RFloat, 1);
            SrbfSurfelTable[] tables = asset.surfels.tables;
            parts = new RenderTexture[tables.Length];
            sums = new RenderTexture[tables.Length];
            for (int i = 0; i < tables.Length; i++)
            {
                parts[i] = Target(Side(tables[i].rows * tables[i].Blocks), Rest(tables[i].rows * tables[i].Blocks), RenderTextureFormat.ARGBFloat, 0);
                bool last = i == tables.Length - 1;  // in the rows of the asset's shaders
                sums[i] = last
                    ? Target(asset.WeightColumns, asset.clusterCount, RenderTextureFormat.ARGBFloat, 0)
                    : Target(Side(tables[i].rows), Rest(tables[i].rows), RenderTextureFormat.ARGBFloat, 0);
            }
            nothing = Numbers(1, 1);
            shapes = new SrbfShapePasses(asset, material);
        }

        /// <summary>As the asset's shaders take them.</summary>
        public Texture Weights { get { return sums[sums.Length - 1]; } }

        /// <summary>Irradiance of cells, to be drawn by another, such as a render pipeline's own lights, before Finish.</summary>
        public RenderTexture Irradiance { get { return irradiance; } }

        /// <summary>Draw the weights if a light or the surroundings have changed.</summary>
        public void Draw(List<SrbfLook> looks, SrbfSurroundings now)
        {
            if (drawn && Same(looks, known) && surroundings.Equals(now)) return;
            Keep(looks, known);
            buffer.Clear();
            buffer.SetRenderTarget(irradiance);
            buffer.ClearRenderTarget(false, true, Color.clear);
            foreach (SrbfLook look in looks) Add(look);
            Finish(buffer, now);
            Graphics.ExecuteCommandBuffer(buffer);
        }

        /// <summary>Add the passes from Irradiance to Weights to a buffer.</summary>
        public void Finish(CommandBuffer commands, SrbfSurroundings now)
        {
            if (!drawn || !surroundings.Equals(now)) shapes.Draw(commands, now);
            surroundings = now;
            drawn = true;
            commands.SetGlobalTexture("_SrbfNormals", asset.normals);
            commands.SetGlobalTexture("_SrbfRanges", asset.ranges);
            commands.SetGlobalTexture("_SrbfIrradiance", irradiance);
            Fill(commands, received, Means);
            RenderTexture numbers = received;
            for (int i = 0; i < sums.Length; i++)
            {
                SrbfSurfelTable table = asset.surfels.tables[i];
                commands.SetGlobalVector("_SrbfTable", new Vector4(table.rows, table.columns, table.Blocks, table.channels == 1 ? 1 : 0));
                Texture repainted = i == 0 ? shapes.Table : null;
                commands.SetGlobalFloat("_SrbfScale", repainted != null ? 1 : (float)table.scale);
                commands.SetGlobalTexture("_SrbfEntries", repainted != null ? repainted : asset.surfelTables[i]);
                commands.SetGlobalTexture("_SrbfNumbers", numbers);
                Fill(commands, parts[i], Parts);
                commands.SetGlobalTexture("_SrbfParts", parts[i]);
                commands.SetGlobalTexture("_SrbfAdded", i == 0 ? shapes.Added : nothing);
                Fill(commands, sums[i], Sums);
                numbers = sums[i];
            }
        }

        public void Dispose()
        {
            foreach (RenderTexture target in new[] { irradiance, received, cube, map }) UnityEngine.Object.DestroyImmediate(target);
            foreach (RenderTexture target in parts) UnityEngine.Object.DestroyImmediate(target);
            foreach (RenderTexture target in sums) UnityEngine.Object.DestroyImmediate(target);
            foreach (UnityEngine.Object one in new UnityEngine.Object[] { nothing, material }) UnityEngine.Object.DestroyImmediate(one);
            shapes.Dispose();
            buffer.Release();
            IsDisposed = true;
        }

        void Add(SrbfLook look)
        {
            buffer.SetGlobalTexture("_SrbfCorners", asset.corners);
            buffer.SetGlobalTexture("_SrbfPlaces", asset.places);
            buffer.SetGlobalTexture("_SrbfNormals", asset.normals);
            buffer.SetGlobalVector("_SrbfLightPlace", Four(look.Place, 0));
            buffer.SetGlobalVector("_SrbfLightColor", Four(look.Color, 0));
            buffer.SetGlobalVector("_SrbfLightAxis", Four(look.Axis, look.Linear ? 0 : 1));
            buffer.SetGlobalVector("_SrbfLightShape", new Vector4((float)look.A0, (float)look.Radius, (float)look.VersineInner, (float)look.VersineOuter));
            buffer.SetGlobalFloat("_SrbfReach", (float)asset.surfels.reach);
            buffer.SetGlobalFloat("_SrbfLift", (float)asset.surfels.lift);
            RenderTexture drawnOn = look.Distant ? map : cube;
            for (int face = 0; face < (look.Distant ? 1 : 6); face++)
            {
                Vector[] axes = look.Distant ? SrbfSurfels.Frame(look.Place) : SrbfSurfels.Face(face);
                buffer.SetGlobalVector("_SrbfAcross", Four(axes[0], 0));
                buffer.SetGlobalVector("_SrbfUp", Four(axes[1], 0));
                buffer.SetGlobalVector("_SrbfAhead", Four(axes[2], 0));
                buffer.SetRenderTarget(new RenderTargetIdentifier(drawnOn, 0, CubemapFace.Unknown, face));
                buffer.ClearRenderTarget(false, true, Color.clear);
                buffer.DrawProcedural(Matrix4x4.identity, material, look.Distant ? OnMap : OnCube, MeshTopology.Triangles, 3 * asset.surfels.triangles, 1);
            }
            buffer.SetGlobalTexture("_SrbfNearness", drawnOn);
            Fill(buffer, irradiance, look.Distant ? ByMap : ByCube);
        }

        void Fill(CommandBuffer commands, RenderTexture target, int pass)
        {
            commands.SetRenderTarget(target);
            commands.SetGlobalFloat("_SrbfTargetWidth", target.width);
            commands.DrawProcedural(Matrix4x4.identity, material, pass, MeshTopology.Triangles, 3, 1);
        }

        internal static bool Same<T>(List<T> now, List<T> before)
        {
            if (now.Count != before.Count) return false;
            for (int i = 0; i < now.Count; i++)
                if (!now[i].Equals(before[i])) return false;
            return true;
        }

        static void Keep<T>(List<T> now, List<T> before)
        {
            before.Clear();
            before.AddRange(now);
        }

        static int Side(int count) { return Math.Max(1, (int)Math.Ceiling(Math.Sqrt(count))); }

        static int Rest(int count) { return (count + Side(count) - 1) / Side(count); }

        static Vector4 Four(Vector v, float w) { return new Vector4((float)v.X, (float)v.Y, (float)v.Z, w); }

        /// <summary>`slices`: of a texture array; 0 for a plain texture.</summary>
        internal static RenderTexture Target(int width, int height, RenderTextureFormat format, int slices)
        {
            var target = new RenderTexture(width, height, 0, format, RenderTextureReadWrite.Linear) { filterMode = FilterMode.Point, hideFlags = HideFlags.HideAndDontSave };
            if (slices > 0)
            {
                target.dimension = TextureDimension.Tex2DArray;
                target.volumeDepth = slices;
            }
            target.Create();
            return target;
        }

        internal static Texture2D Numbers(int width, int height)
        {
            var numbers = new Texture2D(width, height, TextureFormat.RGBAFloat, false, true) { filterMode = FilterMode.Point, hideFlags = HideFlags.HideAndDontSave };
            numbers.SetPixelData(new float[4 * width * height], 0);
            numbers.Apply(false);
            return numbers;
        }
    }
}
