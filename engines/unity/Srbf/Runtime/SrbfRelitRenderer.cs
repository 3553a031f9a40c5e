// SPDX-License-Identifier: MIT
using System;
using System.Collections.Generic;
using UnityEngine;

namespace Srbf
{
    /// <summary>One of the scene's own lights: intensity 1 is as the scene has it set, 0 off; the color is on top of the scene's.</summary>
    [Serializable]
    public sealed class SrbfNamedLight
    {
        public string name;
        public float intensity = 1;
        public Color color = Color.white;
    }

    /// <summary>
    /// Follows Unity's lights and sets the frame's weights in a renderer's material. All directional lights together cost one weight per map;
    /// each of the first eight point and spot lights costs one weight per map and pixel. Area lights, cookies, ranges and skies are ignored.
    /// An asset of named lights has its own, see SetLight. Lights inside a scene are followed in any number at the cost of one: point, spot and
    /// directional lights by passes that light surfels, see SrbfSurfelPasses, or, where the asset has none, point and spot lights by a table
    /// of places, where a spot's bounces are approximate, see SrbfMath.FluxShare, and directional lights add none.
    /// </summary>
    [ExecuteAlways]
    [RequireComponent(typeof(Renderer))]
    public sealed class SrbfRelitRenderer : MonoBehaviour
    {
        public const int MostPointLights = 8;  // SRBF_POINT_LIGHTS of SrbfAsset.hlsl

        public SrbfAsset asset;
        [Tooltip("The imported scene's root, whose space is Blender's world in Unity's axes; none: Unity's world.")]
        public Transform root;
        [Tooltip("The lights to follow; none: all that are enabled in the scene.")]
        public Light[] lights;
        [Tooltip("Distance in meters at which a point light's irradiance equals its color.")]
        public float falloffDistance = 1;
        [Tooltip("a0/|L| instead of its square.")]
        public bool linearFalloff;
        [Tooltip("Meters: least distance of a receiver from a point light.")]
        public float pointLightRadius = 0.05f;

        [Tooltip("Named lights: those that are not as the scene has them set.")]
        public List<SrbfNamedLight> mix = new List<SrbfNamedLight>();

        [Tooltip("Lights inside a scene: measured on surfels by passes of the GPU; otherwise by the table of places.")]
        public bool bySurfels = true;
        [Tooltip("Texels per side of a face of the shadow maps that light surfels.")]
        public int shadowSize = 512;
        [Tooltip("Objects of an editable asset that emit: intensity times color is their radiance.")]
        public List<SrbfNamedLight> emission = new List<SrbfNamedLight>();

        [Tooltip("Objects of an editable asset with another color, in the bounces alone; intensities do nothing.")]
        public List<SrbfNamedLight> albedo = new List<SrbfNamedLight>();
        [Tooltip("An equirectangular map, as Unity's panoramic skyboxes have it, that shines through the windows of a scene.")]
        public Texture environment;
        public float environmentIntensity = 1;

        readonly List<SrbfLook> looks = new List<SrbfLook>();
        SrbfSurfelPasses passes;
        readonly List<DistantLight> far = new List<DistantLight>();
        readonly List<DistantLight> known = new List<DistantLight>();
        readonly Vector4[] pointLights = new Vector4[4 * MostPointLights];
        MaterialPropertyBlock block;
        Vector4[] weights;
        Texture2D rows;
        SrbfAsset weighed;
        string warned;

        /// <summary>Dim, recolor or switch one of the scene's own lights; ArgumentException where the asset has none of that name.</summary>
        public void SetLight(string lightName, float intensity, Color color)
        {
            asset.lightTable.Index(lightName);
            SrbfNamedLight found = mix.Find(light => light.name == lightName);
            if (found == null) mix.Add(found = new SrbfNamedLight { name = lightName });
            found.intensity = intensity;
            found.color = color;
        }

        /// <summary>Let an object of an editable asset emit; ArgumentException, at the next frame, where the asset has none of that name.</summary>
        public void SetEmission(string objectName, float intensity, Color color)
        {
            SrbfNamedLight found = emission.Find(entry => entry.name == objectName);
            if (found == null) emission.Add(found = new SrbfNamedLight { name = objectName });
            found.intensity = intensity;
            found.color = color;
        }

        /// <summary>Give an object of an editable asset another color, in the bounces alone; to end it, take the entry from `albedo`.</summary>
        public void SetAlbedo(string objectName, Color color)
        {
            SrbfNamedLight found = albedo.Find(entry => entry.name == objectName);
            if (found == null) albedo.Add(found = new SrbfNamedLight { name = objectName });
            found.color = color;
        }

        void LateUpdate()
        {
            if (asset == null) return;
            if (block == null) block = new MaterialPropertyBlock();
            Matrix4x4 assetFromUnity = AssetFromUnity();
            far.Clear();
            looks.Clear();
            int count = 0;
            SrbfUrpLights urp = GetComponent<SrbfUrpLights>();
            Texture ready = urp != null && urp.isActiveAndEnabled ? urp.Weights : null;
            bool measured = ready == null && bySurfels && asset.HasSurfels && SrbfSurfelPasses.IsSupported;
            if (asset.IsNamed) AddNamed();
            foreach (Light pointLight in asset.IsNamed || ready != null ? new Light[0] : lights != null && lights.Length > 0 ? lights : FindObjectsOfType<Light>())
            {
                if (pointLight == null || !pointLight.isActiveAndEnabled) continue;
                Color color = pointLight.color.linear * pointLight.intensity;
                if (pointLight.useColorTemperature) color *= Mathf.CorrelatedColorTemperatureToRGB(pointLight.colorTemperature);
                bool local = pointLight.type == LightType.Point || pointLight.type == LightType.Spot;
                if (measured && (local || pointLight.type == LightType.Directional)) looks.Add(Look(assetFromUnity, pointLight, color));
                else if (asset.IsCloud && local) far.Add(Inside(assetFromUnity, pointLight, color));
                else if (asset.IsCloud) continue;
                else if (pointLight.type == LightType.Directional) far.Add(Far(assetFromUnity, pointLight, color));
                else if (local && count < MostPointLights) SetPointLight(assetFromUnity, pointLight, color, count++);
            }
            if (weighed != asset) GetComponent<Renderer>().SetPropertyBlock(null);  // arrays of a block never grow
            if (measured) Measure();
            else if (ready != null) weighed = asset;
            else if (weighed != asset || (rows == null && !asset.IsMaps) || Changed()) Weigh();
            GetComponent<Renderer>().GetPropertyBlock(block);
            block.SetTexture("_SrbfLayers", asset.layers);
            if (asset.table != null) block.SetTexture("_SrbfTable", asset.table);
            block.SetTexture("_SrbfAmbient", asset.ambient);
            if (asset.clusters != null) block.SetTexture("_SrbfClusters", asset.clusters);
            if (asset.IsMaps) block.SetVectorArray("_SrbfWeights", weights);
            else block.SetTexture("_SrbfWeightRows", ready != null ? ready : measured ? passes.Weights : rows);
            block.SetMatrix("_SrbfAssetFromWorld", assetFromUnity);
            block.SetFloat("_SrbfPointLightCount", count);
            block.SetVectorArray("_SrbfPointLights", pointLights);
            GetComponent<Renderer>().SetPropertyBlock(block);
        }

        void OnDisable()
        {
            if (rows != null) DestroyImmediate(rows);
            if (passes != null) passes.Dispose();
            passes = null;
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

        static DistantLight Far(Matrix4x4 assetFromUnity, Light pointLight, Color color)
        {
            Vector3 toLight = assetFromUnity.MultiplyVector(-pointLight.transform.forward);  // Unity's lights shine along +z
            return new DistantLight { ToLight = new Vector(toLight.x, toLight.y, toLight.z).Normalized(), Color = new Vector(color.r, color.g, color.b) };
        }

        /// <summary>A light inside the scene: its place instead of a direction, and its irradiance at 1 m.</summary>
        DistantLight Inside(Matrix4x4 assetFromUnity, Light pointLight, Color color)
        {
            Vector3 place = assetFromUnity.MultiplyPoint3x4(pointLight.transform.position);
            double share = pointLight.type == LightType.Spot ? SrbfMath.FluxShare(pointLight.innerSpotAngle, pointLight.spotAngle) : 1;
            double strength = share * falloffDistance * falloffDistance;
            return new DistantLight { ToLight = new Vector(place.x, place.y, place.z), Color = new Vector(color.r * strength, color.g * strength, color.b * strength) };
        }

        /// <summary>A light as passes look at it.</summary>
        SrbfLook Look(Matrix4x4 assetFromUnity, Light pointLight, Color color)
        {
            bool distant = pointLight.type == LightType.Directional, spot = pointLight.type == LightType.Spot;
            Vector3 forward = assetFromUnity.MultiplyVector(pointLight.transform.forward).normalized;
            Vector3 at = distant ? -forward : assetFromUnity.MultiplyPoint3x4(pointLight.transform.position);
            var place = new Vector(at.x, at.y, at.z);
            return new SrbfLook
            {
                Distant = distant,
                Place = distant ? place : asset.surfels.LessMiddle(place),
                Color = new Vector(color.r, color.g, color.b),
                Axis = new Vector(forward.x, forward.y, forward.z),
                A0 = falloffDistance,
                Radius = Mathf.Max(pointLightRadius, 1e-4f),
                VersineInner = spot ? SrbfMath.Versine(pointLight.innerSpotAngle * 0.5 * Math.PI / 180) : SrbfSurfels.NoCone[0],
                VersineOuter = spot ? SrbfMath.Versine(pointLight.spotAngle * 0.5 * Math.PI / 180) : SrbfSurfels.NoCone[1],
                Linear = linearFalloff,
            };
        }

        /// <summary>Weights by passes, where a light or an emission has changed.</summary>
        void Measure()
        {
            if (passes != null && (weighed != asset || passes.ShadowSize != shadowSize)) passes.Dispose();
            if (passes == null || passes.IsDisposed) passes = new SrbfSurfelPasses(asset, shadowSize);
            weighed = asset;
            passes.Draw(looks, Surroundings());
        }

        /// <summary>Objects that emit, those with other colors, and the environment; radiances in Blender's units, as ambient light is.</summary>
        public SrbfSurroundings Surroundings()
        {
            Matrix4x4 assetFromUnity = AssetFromUnity();
            Vector3 x = assetFromUnity.MultiplyVector(Vector3.right).normalized, y = assetFromUnity.MultiplyVector(Vector3.up).normalized, z = assetFromUnity.MultiplyVector(Vector3.forward).normalized;
            if (environment != null && !asset.surfels.environment.Exists) Warn("expected an asset whose surfels see an environment, found one without; its scene is closed, or the asset is older: bake and fit again");
            else if (environment != null && albedo.Count > 0) Warn("expected the albedo of the bake under an environment, found objects that are repainted; its bounces are those of their own albedo");
            return new SrbfSurroundings
            {
                Radiances = emission.ConvertAll(entry => new KeyValuePair<string, Vector>(entry.name, InBlendersUnits(entry.color.linear * entry.intensity))),
                Albedo = albedo.ConvertAll(entry => new KeyValuePair<string, Vector>(entry.name, new Vector(entry.color.linear.r, entry.color.linear.g, entry.color.linear.b))),
                Environment = environment,
                AtMiddle = new Vector4(x.x, x.y, x.z, 0),
                AtLeft = new Vector4(z.x, z.y, z.z, 0),
                AtRowZero = new Vector4(-y.x, -y.y, -y.z, environmentIntensity / Mathf.PI),  // Unity's rows start below
            };
        }

        void Warn(string text)
        {
            if (warned == text) return;
            warned = text;
            Debug.LogWarning(text, this);
        }

        /// <summary>From the asset's frame to Unity's world.</summary>
        public Matrix4x4 UnityFromAsset() { return AssetFromUnity().inverse; }

        static Vector InBlendersUnits(Color color) { return new Vector(color.r / Math.PI, color.g / Math.PI, color.b / Math.PI); }

        /// <summary>The colors of all named lights, in order. Like ambient light they are in Blender's units, an irradiance over pi.</summary>
        void AddNamed()
        {
            foreach (string lightName in asset.lightTable.names)
            {
                SrbfNamedLight found = mix.Find(light => light.name == lightName);
                Color color = found == null ? Color.white : found.color.linear * found.intensity;
                far.Add(new DistantLight { Color = InBlendersUnits(color) });
            }
        }

        void SetPointLight(Matrix4x4 assetFromUnity, Light pointLight, Color color, int i)
        {
            Vector3 place = assetFromUnity.MultiplyPoint3x4(pointLight.transform.position), axis = assetFromUnity.MultiplyVector(pointLight.transform.forward).normalized;
            bool spot = pointLight.type == LightType.Spot;
            float[] packed = SrbfMath.PackedPointLight(
                new Vector(place.x, place.y, place.z), new Vector(color.r, color.g, color.b), new Vector(axis.x, axis.y, axis.z), falloffDistance,
                Mathf.Max(pointLightRadius, 1e-4f), linearFalloff, spot ? pointLight.innerSpotAngle : -1, spot ? pointLight.spotAngle : -1);
            for (int row = 0; row < 4; row++) pointLights[4 * i + row] = new Vector4(packed[4 * row], packed[4 * row + 1], packed[4 * row + 2], packed[4 * row + 3]);
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
            float[] values = Values();
            if (asset.IsMaps)
            {
                weights = new Vector4[values.Length / 4];
                for (int i = 0; i < weights.Length; i++) weights[i] = new Vector4(values[4 * i], values[4 * i + 1], values[4 * i + 2], 1);
                return;
            }
            int width = asset.WeightColumns;
            if (rows == null || rows.width != width || rows.height != asset.clusterCount)
            {
                if (rows != null) DestroyImmediate(rows);
                rows = new Texture2D(width, asset.clusterCount, TextureFormat.RGBAFloat, false, true) { filterMode = FilterMode.Point, hideFlags = HideFlags.HideAndDontSave };
            }
            rows.SetPixelData(values, 0);
            rows.Apply(false);
        }

        float[] Values()
        {
            int outside;
            if (asset.IsNamed) return asset.lightTable.Weights(far.ConvertAll(light => light.Color));
            if (asset.IsCloud) return asset.positionTable.Weights(far.ConvertAll(light => light.ToLight), far.ConvertAll(light => light.Color), out outside);
            return asset.IsMaps
                ? SrbfMath.MapWeights(asset.centers, asset.rTable, far)
                : SrbfMath.PlaneWeights(asset.centers, asset.spreads, asset.lightCoefficients, far);
        }
    }
}
