// SPDX-License-Identifier: MIT
using UnityEngine;
using UnityEngine.Rendering;

namespace Srbf
{
    /// <summary>
    /// Beside SrbfRelitRenderer, in URP: its weights come from URP's own lights and shadow maps. A camera of its own looks at the whole asset, so that
    /// URP prepares all lights and shadows that reach it, and one triangle over the camera's target lights the surfels. Give that camera a renderer of
    /// the Forward path; URP's limits of lights per object, shadow distance and ranges hold.
    /// </summary>
    [ExecuteAlways]
    [RequireComponent(typeof(SrbfRelitRenderer))]
    public sealed class SrbfUrpLights : MonoBehaviour
    {
        SrbfSurfelPasses passes;
        SrbfAsset measured;
        Camera view;
        Material material;
        MaterialPropertyBlock block;
        CommandBuffer buffer;

        /// <summary>As the asset's shaders take them; null before the first frame.</summary>
        public Texture Weights { get { return passes == null ? null : passes.Weights; } }

        void OnEnable() { RenderPipelineManager.endCameraRendering += Finish; }

        void OnDisable()
        {
            RenderPipelineManager.endCameraRendering -= Finish;
            if (view != null) DestroyImmediate(view.gameObject);
            if (material != null) DestroyImmediate(material);
            if (passes != null) passes.Dispose();
            if (buffer != null) buffer.Release();
            passes = null;
            buffer = null;
        }

        void LateUpdate()
        {
            SrbfRelitRenderer relit = GetComponent<SrbfRelitRenderer>();
            if (relit.asset == null || !relit.asset.HasSurfels) return;
            if (passes == null || measured != relit.asset) Prepare(relit.asset);
            SrbfSurfels surfels = relit.asset.surfels;
            Matrix4x4 unityFromCell = relit.UnityFromAsset() * Matrix4x4.Translate(new Vector3((float)surfels.middle[0], (float)surfels.middle[1], (float)surfels.middle[2]));
            Vector3 middle = unityFromCell.MultiplyPoint3x4(Vector3.zero);
            float reach = (float)surfels.reach * unityFromCell.MultiplyVector(Vector3.right).magnitude;
            view.transform.position = middle - reach * view.transform.forward;
            view.orthographicSize = reach;
            view.nearClipPlane = 0;
            view.farClipPlane = 2 * reach;
            block.SetTexture("_SrbfPlaces", relit.asset.places);
            block.SetTexture("_SrbfNormals", relit.asset.normals);
            block.SetMatrix("_SrbfWorldFromCell", unityFromCell);
            block.SetFloat("_SrbfLift", (float)surfels.lift);
            var bounds = new Bounds(middle, 2 * reach * Vector3.one);
            Graphics.DrawProcedural(material, bounds, MeshTopology.Triangles, 3, 1, view, block, ShadowCastingMode.Off, false, gameObject.layer);
        }

        void Prepare(SrbfAsset asset)
        {
            if (passes != null) passes.Dispose();
            passes = new SrbfSurfelPasses(asset, 1);  // without shadow maps of its own
            measured = asset;
            if (block == null) block = new MaterialPropertyBlock();
            if (buffer == null) buffer = new CommandBuffer { name = "Srbf surfels" };
            if (material == null) material = new Material(Shader.Find("Hidden/Srbf/Urp irradiance")) { hideFlags = HideFlags.HideAndDontSave };
            if (view == null) view = new GameObject("Srbf surfels", typeof(Camera)) { hideFlags = HideFlags.HideAndDontSave }.GetComponent<Camera>();
            view.targetTexture = passes.Irradiance;
            view.orthographic = true;
            view.clearFlags = CameraClearFlags.SolidColor;
            view.backgroundColor = Color.clear;
            view.cullingMask = ~0;  // what it does not see casts no shadow
            view.depth = -100;      // before the cameras that show the asset
            view.allowMSAA = false;
            view.useOcclusionCulling = false;
        }

        void Finish(ScriptableRenderContext context, Camera rendered)
        {
            if (rendered != view || passes == null) return;
            buffer.Clear();
            passes.Finish(buffer, GetComponent<SrbfRelitRenderer>().Surroundings());
            context.ExecuteCommandBuffer(buffer);
            context.Submit();
        }
    }
}
