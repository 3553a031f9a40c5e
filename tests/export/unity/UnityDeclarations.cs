// SPDX-License-Identifier: MIT
// As much of Unity's interfaces as the thin files use, written by hand so that a compiler without Unity reads them. Nothing of it runs: a
// method that compiles here and is missing or other in Unity would not be found.
using System;

namespace UnityEngine
{
    public class Object { public string name; public HideFlags hideFlags; public static void DestroyImmediate(Object o) { } public static T[] FindObjectsOfType<T>() where T : Object { return null; } }
    public class GameObject : Object { public int layer; public GameObject(string name, params Type[] components) { } public T GetComponent<T>() { return default(T); } }
    [Flags] public enum HideFlags { None = 0, HideAndDontSave = 61 }
    public class Component : Object { public Transform transform { get { return null; } } public GameObject gameObject { get { return null; } } public T GetComponent<T>() { return default(T); } }
    public class Behaviour : Component { public bool isActiveAndEnabled { get { return true; } } }
    public class MonoBehaviour : Behaviour { }
    public class ScriptableObject : Object { public static T CreateInstance<T>() where T : ScriptableObject { return null; } }
    public class Renderer : Component { public void GetPropertyBlock(MaterialPropertyBlock b) { } public void SetPropertyBlock(MaterialPropertyBlock b) { } }
    public class Transform : Component { public Matrix4x4 worldToLocalMatrix { get { return Matrix4x4.identity; } } public Vector3 position, forward; }
    public class Light : Behaviour { public Color color; public float intensity, colorTemperature, spotAngle, innerSpotAngle; public bool useColorTemperature; public LightType type; }
    public enum LightType { Spot, Directional, Point }
    public class Texture : Object { public FilterMode filterMode; public TextureWrapMode wrapMode; public int width, height; }
    public enum FilterMode { Point, Bilinear, Trilinear }
    public enum TextureWrapMode { Clamp }
    public enum TextureFormat { RGBAHalf, RGBAFloat, RGFloat, R8, RHalf, RGBA32, BC7, DXT1 }
    public class Texture2D : Texture
    {
        public Texture2D(int width, int height, TextureFormat format, bool mipChain, bool linear) { }
        public void SetPixelData<T>(T[] data, int mipLevel, int sourceDataStartIndex = 0) { }
        public void Apply(bool updateMipmaps = true, bool makeNoLongerReadable = false) { }
    }
    public class Texture2DArray : Texture
    {
        public int depth { get { return 1; } }
        public Texture2DArray(int width, int height, int depth, TextureFormat format, int mipCount, bool linear) { }
        public void SetPixelData<T>(T[] data, int mipLevel, int element, int sourceDataStartIndex = 0) { }
        public void Apply(bool updateMipmaps = true, bool makeNoLongerReadable = false) { }
    }
    public enum RenderTextureFormat { ARGBFloat, RFloat }
    public enum RenderTextureReadWrite { Default, Linear, sRGB }
    public enum CubemapFace { Unknown = -1 }
    public enum MeshTopology { Triangles }
    public enum CameraClearFlags { SolidColor = 2 }
    public class RenderTexture : Texture
    {
        public Rendering.TextureDimension dimension;
        public int volumeDepth;
        public RenderTexture(int width, int height, int depth, RenderTextureFormat format, RenderTextureReadWrite readWrite) { }
        public bool Create() { return true; }
    }
    public class Shader : Object { public static Shader Find(string name) { return null; } }
    public class Material : Object { public Material(Shader shader) { } }
    public class Camera : Behaviour
    {
        public RenderTexture targetTexture;
        public bool orthographic, allowMSAA, useOcclusionCulling;
        public float orthographicSize, nearClipPlane, farClipPlane, depth;
        public CameraClearFlags clearFlags;
        public Color backgroundColor;
        public int cullingMask;
    }
    public struct Bounds { public Bounds(Vector3 center, Vector3 size) { } }
    public static class SystemInfo { public static bool SupportsBlendingOnRenderTextureFormat(RenderTextureFormat format) { return true; } }
    public static class Graphics
    {
        public static void ExecuteCommandBuffer(Rendering.CommandBuffer buffer) { }
        public static void DrawProcedural(Material material, Bounds bounds, MeshTopology topology, int vertexCount, int instanceCount = 1, Camera camera = null, MaterialPropertyBlock properties = null, Rendering.ShadowCastingMode castShadows = Rendering.ShadowCastingMode.On, bool receiveShadows = true, int layer = 0) { }
    }
    public class MaterialPropertyBlock
    {
        public void SetTexture(string name, Texture t) { }
        public void SetFloat(string name, float f) { }
        public void SetMatrix(string name, Matrix4x4 m) { }
        public void SetVectorArray(string name, Vector4[] v) { }
    }
    public struct Vector3 { public float x, y, z; public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; } public static Vector3 zero, one, right, up, forward; public float magnitude { get { return 0; } } public static Vector3 operator *(float f, Vector3 v) { return v; } public static Vector3 operator -(Vector3 a, Vector3 b) { return a; } public Vector3 normalized { get { return this; } } public static Vector3 operator -(Vector3 v) { return v; } }
    public struct Vector4 { public float x, y, z, w; public Vector4(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; } }
    public struct Color { public float r, g, b, a; public static Color white { get { return new Color(); } } public static Color clear { get { return new Color(); } } public Color linear { get { return this; } } public static Color operator *(Color c, float f) { return c; } public static Color operator *(Color a, Color b) { return a; } }
    public struct Matrix4x4
    {
        public static Matrix4x4 identity { get { return new Matrix4x4(); } }
        public float this[int row, int column] { get { return 0; } set { } }
        public static Matrix4x4 operator *(Matrix4x4 a, Matrix4x4 b) { return a; }
        public static Matrix4x4 Translate(Vector3 v) { return new Matrix4x4(); }
        public Matrix4x4 inverse { get { return this; } }
        public Vector3 MultiplyVector(Vector3 v) { return v; }
        public Vector3 MultiplyPoint3x4(Vector3 v) { return v; }
    }
    public static class Debug { public static void LogWarning(object message, Object context) { } }
    public static class Mathf { public const float PI = 3.14159265f; public static float Max(float a, float b) { return a; } public static Color CorrelatedColorTemperatureToRGB(float kelvin) { return new Color(); } }
    public class TooltipAttribute : Attribute { public TooltipAttribute(string text) { } }
    public class ExecuteAlwaysAttribute : Attribute { }
    public class RequireComponentAttribute : Attribute { public RequireComponentAttribute(Type type) { } }
}

namespace UnityEngine.Rendering
{
    public enum TextureDimension { Tex2D, Tex2DArray }
    public enum ShadowCastingMode { Off, On }
    public struct RenderTargetIdentifier
    {
        public RenderTargetIdentifier(Texture texture, int mipLevel = 0, CubemapFace cubeFace = CubemapFace.Unknown, int depthSlice = 0) { }
        public static implicit operator RenderTargetIdentifier(Texture texture) { return new RenderTargetIdentifier(); }
    }
    public class CommandBuffer
    {
        public string name;
        public void Clear() { }
        public void Release() { }
        public void SetRenderTarget(RenderTargetIdentifier target) { }
        public void ClearRenderTarget(bool clearDepth, bool clearColor, Color backgroundColor) { }
        public void SetGlobalTexture(string name, RenderTargetIdentifier value) { }
        public void SetGlobalVector(string name, Vector4 value) { }
        public void SetGlobalFloat(string name, float value) { }
        public void DrawProcedural(Matrix4x4 matrix, Material material, int shaderPass, MeshTopology topology, int vertexCount, int instanceCount) { }
    }
    public struct ScriptableRenderContext
    {
        public void ExecuteCommandBuffer(CommandBuffer buffer) { }
        public void Submit() { }
    }
    public static class RenderPipelineManager { public static event Action<ScriptableRenderContext, Camera> endCameraRendering { add { } remove { } } }
}

namespace UnityEditor.AssetImporters
{
    public abstract class ScriptedImporter : UnityEngine.Object { public abstract void OnImportAsset(AssetImportContext context); }
    public class ScriptedImporterAttribute : Attribute { public ScriptedImporterAttribute(int version, string extension) { } }
    public class AssetImportContext
    {
        public string assetPath;
        public void AddObjectToAsset(string identifier, UnityEngine.Object made) { }
        public void SetMainObject(UnityEngine.Object made) { }
        public void DependsOnSourceAsset(string path) { }
    }
}
