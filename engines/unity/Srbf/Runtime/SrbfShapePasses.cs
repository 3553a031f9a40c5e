// SPDX-License-Identifier: MIT
using System;
using System.Collections.Generic;
using UnityEngine;
using UnityEngine.Rendering;

namespace Srbf
{
    /// <summary>Objects that emit, objects with other albedo, and the environment.</summary>
    public struct SrbfSurroundings
    {
        public List<KeyValuePair<string, Vector>> Radiances;  // of objects that emit
        public List<KeyValuePair<string, Vector>> Albedo;     // linear, of objects that have another than in the bake
        public Texture Environment;                           // null: none
        public Vector4 AtMiddle, AtLeft, AtRowZero;           // directions in the asset's frame; the last one's w: energy

        public bool Equals(SrbfSurroundings other)
        {
            return Radiances != null && SrbfSurfelPasses.Same(Radiances, other.Radiances) && SrbfSurfelPasses.Same(Albedo, other.Albedo) && Environment == other.Environment && !(Environment is RenderTexture)
                && AtMiddle.Equals(other.AtMiddle) && AtLeft.Equals(other.AtLeft) && AtRowZero.Equals(other.AtRowZero);
        }
    }

    /// <summary>
    /// Adds the light of emissive objects and of an environment to the sums of the first table, and computes that table for changed albedo:
    /// products of small matrices on the GPU, drawn when their input has changed.
    /// </summary>
    public sealed class SrbfShapePasses : IDisposable
    {
        const int Cells = 7, Product = 8, Exchange = 9, Repainted = 10;  // of SrbfSurfels.shader

        readonly SrbfAsset asset;
        readonly Material material;
        readonly Texture2D emitted, nothing;
        readonly RenderTexture radiances, reflected, bounced, sum;
        Texture2D albedo, one;
        readonly RenderTexture[] sums = new RenderTexture[2], powers = new RenderTexture[2];  // drawn in turn
        RenderTexture exchange, table;
        Texture series;
        List<KeyValuePair<string, Vector>> repainted = new List<KeyValuePair<string, Vector>>();

        public SrbfShapePasses(SrbfAsset asset, Material material)
        {
            this.asset = asset;
            this.material = material;
            int rows = asset.surfels.tables[0].rows;
            emitted = SrbfSurfelPasses.Numbers(1, rows);
            nothing = SrbfSurfelPasses.Numbers(1, 1);
            reflected = Target(1, rows);
            bounced = Target(1, rows);
            sum = Target(1, rows);
            if (asset.surfels.environment.Exists) radiances = Target(1, asset.surfels.environment.columns);
            Added = emitted;
        }

        /// <summary>To be added to the sums of the first table: a texel per row.</summary>
        public Texture Added { get; private set; }

        /// <summary>The first table for changed albedo; null while all objects have the albedo of the bake.</summary>
        public Texture Table { get; private set; }

        /// <summary>Add the passes for what has changed to a buffer.</summary>
        public void Draw(CommandBuffer commands, SrbfSurroundings now)
        {
            SrbfSurfels surfels = asset.surfels;
            SrbfChanges changes = surfels.changes;
            if (!SrbfSurfelPasses.Same(now.Albedo, repainted)) Repaint(commands, now.Albedo);
            float[] weights = surfels.Emitted(now.Radiances, Table != null ? changes.first : surfels.emission);
            emitted.SetPixelData(weights, 0);
            emitted.Apply(false);
            Added = emitted;
            if (Table != null && now.Radiances.Count > 0)
            {
                Multiply(commands, reflected, series, emitted, changes.feedback.columns, 1, null, 0);
                Multiply(commands, bounced, exchange, reflected, changes.feedback.columns, 1, emitted, 1);
                Added = bounced;
            }
            if (now.Environment == null || radiances == null) return;
            commands.SetGlobalTexture("_SrbfCells", asset.cells);
            commands.SetGlobalTexture("_SrbfEnvironment", now.Environment);
            commands.SetGlobalVector("_SrbfAtMiddle", new Vector4(now.AtMiddle.x, now.AtMiddle.y, now.AtMiddle.z, surfels.environmentSide));
            commands.SetGlobalVector("_SrbfAtLeft", now.AtLeft);
            commands.SetGlobalVector("_SrbfAtRowZero", now.AtRowZero);
            Fill(commands, radiances, Cells);
            Multiply(commands, sum, asset.environmentTable, radiances, surfels.environment.columns, surfels.environment.scale, Added, 1);
            Added = sum;
        }

        public void Dispose()
        {
            foreach (UnityEngine.Object used in new UnityEngine.Object[] { emitted, nothing, radiances, reflected, bounced, sum, albedo, one, exchange, sums[0], sums[1], powers[0], powers[1], table })
                if (used != null) UnityEngine.Object.DestroyImmediate(used);
        }

        /// <summary>The exchange of light, then the sum of its powers, then the table.</summary>
        void Repaint(CommandBuffer commands, List<KeyValuePair<string, Vector>> now)
        {
            SrbfSurfels surfels = asset.surfels;
            SrbfChanges changes = surfels.changes;
            repainted = new List<KeyValuePair<string, Vector>>(now);
            Table = null;
            if (now.Count == 0) return;
            if (!changes.Exists) throw new ArgumentException("expected an asset whose surfaces can change, found one without; fit with --editable");
            if (changes.terms == 0) return;
            int rank = changes.feedback.columns, count = changes.gather.columns;
            if (table == null) Prepare(rank, count);
            albedo.SetPixelData(changes.Repainted(now, surfels.objects), 0);
            albedo.Apply(false);
            commands.SetGlobalTexture("_SrbfAlbedo", albedo);
            Set(commands, asset.gather, asset.sent, count, changes.gather.scale * changes.sent.scale, asset.feedback, changes.feedback.scale);
            Fill(commands, exchange, Exchange);
            Sum(commands, changes.Doublings(), rank);
            Set(commands, asset.series, series, rank, changes.gather.scale, asset.surfelTables[0], surfels.tables[0].scale);
            commands.SetGlobalTexture("_SrbfEntries", asset.gather);
            Fill(commands, table, Repainted);
            Table = table;
        }

        /// <summary>Powers of the exchange: of n terms 2n by sum + power sum, or n + 1 by one + exchange sum. Hundreds of terms take few passes.</summary>
        void Sum(CommandBuffer commands, List<bool> doublings, int rank)
        {
            Texture power = exchange;
            series = one;
            for (int step = 0; step < doublings.Count; step++)
            {
                Texture left = doublings[step] ? power : exchange;
                Multiply(commands, sums[step % 2], left, series, rank, 1, doublings[step] ? series : one, 1);
                series = sums[step % 2];
                if (step + 1 == doublings.Count) break;
                Multiply(commands, powers[step % 2], left, power, rank, 1, null, 0);
                power = powers[step % 2];
            }
        }

        void Prepare(int rank, int count)
        {
            albedo = SrbfSurfelPasses.Numbers(2, count);
            one = SrbfSurfelPasses.Numbers(rank, rank);
            var values = new float[4 * rank * rank];
            for (int i = 0; i < rank; i++)
                for (int c = 0; c < 3; c++) values[4 * i * (rank + 1) + c] = 1;
            one.SetPixelData(values, 0);
            one.Apply(false);
            exchange = Target(rank, rank);
            for (int i = 0; i < 2; i++)
            {
                sums[i] = Target(rank, rank);
                powers[i] = Target(rank, rank);
            }
            table = Target(count, rank);
        }

        void Multiply(CommandBuffer commands, RenderTexture target, Texture left, Texture right, int count, double scale, Texture addend, double addendScale)
        {
            Set(commands, left, right, count, scale, addend, addendScale);
            Fill(commands, target, Product);
        }

        void Set(CommandBuffer commands, Texture left, Texture right, int count, double scale, Texture addend, double addendScale)
        {
            commands.SetGlobalTexture("_SrbfLeft", left);
            commands.SetGlobalTexture("_SrbfRight", right);
            commands.SetGlobalTexture("_SrbfAddend", addend != null ? addend : nothing);
            commands.SetGlobalVector("_SrbfMatrix", new Vector4(count, (float)scale, (float)addendScale, 1));
        }

        void Fill(CommandBuffer commands, RenderTexture target, int pass)
        {
            commands.SetRenderTarget(target);
            commands.DrawProcedural(Matrix4x4.identity, material, pass, MeshTopology.Triangles, 3, 1);
        }

        static RenderTexture Target(int width, int height) { return SrbfSurfelPasses.Target(width, height, RenderTextureFormat.ARGBFloat, 0); }
    }
}
