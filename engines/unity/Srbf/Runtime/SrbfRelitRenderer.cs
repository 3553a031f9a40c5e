// SPDX-License-Identifier: MIT
using System.Collections.Generic;
using UnityEngine;

namespace Srbf
{
    /// <summary>
    /// Follows Unity's lights and tells a renderer's material the weights of the frame. Directional lights cost one weight a map together;
    /// the first eight point and spot lights a weight a map and pixel each. Areas, cookies, ranges and skies are not looked at.
    /// </summary>
    [ExecuteAlways]
    [RequireComponent(typeof(Renderer))]
    public sealed class SrbfRelitRenderer : MonoBehaviour
    {
        public const int MostLamps = 8;  // SRBF_LAMPS of SrbfAsset.hlsl

        public SrbfAsset asset;
        [Tooltip("The imported scene's root, whose space is Blender's world turned to Unity's axes; none: Unity's world.")]
        public Transform root;
        [Tooltip("The lights to follow; none: all that are enabled in the scene.")]
        public Light[] lights;
        [Tooltip("Distance in metres at which a lamp gives its colour.")]
        public float falloffDistance = 1;
        [Tooltip("a0/|L| instead of its square.")]
        public bool linearFalloff;
        [Tooltip("Metres; a receiver counts as no nearer to a lamp than this.")]
        public float lampRadius = 0.05f;

        readonly List<FarLight> far = new List<FarLight>();
        readonly List<FarLight> known = new List<FarLight>();
        readonly Vector4[] lamps = new Vector4[4 * MostLamps];
        MaterialPropertyBlock block;
        Vector4[] weights;
        Texture2D rows;
        SrbfAsset weighed;

        void LateUpdate()
        {
            if (asset == null) return;
            if (block == null) block = new MaterialPropertyBlock();
            Matrix4x4 assetFromUnity = AssetFromUnity();
            far.Clear();
            int count = 0;
            foreach (Light lamp in lights != null && lights.Length > 0 ? lights : FindObjectsOfType<Light>())
            {
                if (lamp == null || !lamp.isActiveAndEnabled) continue;
                Color color = lamp.color.linear * lamp.intensity;
                if (lamp.useColorTemperature) color *= Mathf.CorrelatedColorTemperatureToRGB(lamp.colorTemperature);
                if (lamp.type == LightType.Directional) far.Add(Far(assetFromUnity, lamp, color));
                else if ((lamp.type == LightType.Point || lamp.type == LightType.Spot) && count < MostLamps) SetLamp(assetFromUnity, lamp, color, count++);
            }
            if (weighed != asset) GetComponent<Renderer>().SetPropertyBlock(null);  // arrays of a block never grow
            if (weighed != asset || Changed()) Weigh();
            GetComponent<Renderer>().GetPropertyBlock(block);
            block.SetTexture("_SrbfLayers", asset.layers);
            block.SetTexture("_SrbfTable", asset.table);
            block.SetTexture("_SrbfAmbient", asset.ambient);
            if (asset.clusters != null) block.SetTexture("_SrbfClusters", asset.clusters);
            if (asset.IsMaps) block.SetVectorArray("_SrbfWeights", weights);
            else block.SetTexture("_SrbfWeightRows", rows);
            block.SetMatrix("_SrbfAssetFromWorld", assetFromUnity);
            block.SetFloat("_SrbfLampCount", count);
            block.SetVectorArray("_SrbfLamps", lamps);
            GetComponent<Renderer>().SetPropertyBlock(block);
        }

        void OnDisable()
        {
            if (rows != null) DestroyImmediate(rows);
            weighed = null;
        }

        Matrix4x4 AssetFromUnity()
        {
            Matrix4x4 turned = Rows(SrbfMath.Axes), instance = Rows(asset.assetFromWorld);
            return instance * turned * (root != null ? root.worldToLocalMatrix : Matrix4x4.identity);
        }

        static Matrix4x4 Rows(double[] values)
        {
            var matrix = Matrix4x4.identity;
            for (int i = 0; i < 16; i++) matrix[i / 4, i % 4] = (float)values[i];
            return matrix;
        }

        static FarLight Far(Matrix4x4 assetFromUnity, Light lamp, Color color)
        {
            Vector3 toLight = assetFromUnity.MultiplyVector(-lamp.transform.forward);  // Unity's lights shine along +z
            return new FarLight { ToLight = new Vector(toLight.x, toLight.y, toLight.z).Normalized(), Color = new Vector(color.r, color.g, color.b) };
        }

        void SetLamp(Matrix4x4 assetFromUnity, Light lamp, Color color, int i)
        {
            Vector3 place = assetFromUnity.MultiplyPoint3x4(lamp.transform.position), axis = assetFromUnity.MultiplyVector(lamp.transform.forward).normalized;
            bool spot = lamp.type == LightType.Spot;
            float[] packed = SrbfMath.PackedLamp(
                new Vector(place.x, place.y, place.z), new Vector(color.r, color.g, color.b), new Vector(axis.x, axis.y, axis.z), falloffDistance,
                Mathf.Max(lampRadius, 1e-4f), linearFalloff, spot ? lamp.innerSpotAngle : -1, spot ? lamp.spotAngle : -1);
            for (int row = 0; row < 4; row++) lamps[4 * i + row] = new Vector4(packed[4 * row], packed[4 * row + 1], packed[4 * row + 2], packed[4 * row + 3]);
        }

        bool Changed()
        {
            if (far.Count != known.Count) return true;
            for (int i = 0; i < far.Count; i++)
                if (!far[i].Equals(known[i])) return true;
            return false;
        }

        void Weigh()
        {
            known.Clear();
            known.AddRange(far);
            weighed = asset;
            float[] values = asset.IsMaps
                ? SrbfMath.MapWeights(asset.centers, asset.rTable, far)
                : SrbfMath.PlaneWeights(asset.centers, asset.spreads, asset.lightCoefficients, far);
            if (asset.IsMaps)
            {
                weights = new Vector4[values.Length / 4];
                for (int i = 0; i < weights.Length; i++) weights[i] = new Vector4(values[4 * i], values[4 * i + 1], values[4 * i + 2], 1);
                return;
            }
            int width = asset.scalars + 1;
            if (rows == null || rows.width != width || rows.height != asset.clusterCount)
            {
                if (rows != null) DestroyImmediate(rows);
                rows = new Texture2D(width, asset.clusterCount, TextureFormat.RGBAFloat, false, true) { filterMode = FilterMode.Point, hideFlags = HideFlags.HideAndDontSave };
            }
            rows.SetPixelData(values, 0);
            rows.Apply(false);
        }
    }
}
