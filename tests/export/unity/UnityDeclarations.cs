// SPDX-License-Identifier: MIT
// As much of Unity's interfaces as the thin files use, written by hand so that a compiler without Unity reads them. Nothing of it runs: a
// method that compiles here and is missing or other in Unity would not be found.
using System;

namespace UnityEngine
{
    public class Object { public string name; public HideFlags hideFlags; public static void DestroyImmediate(Object o) { } public static T[] FindObjectsOfType<T>() where T : Object { return null; } }
    [Flags] public enum HideFlags { None = 0, HideAndDontSave = 61 }
    public class Component : Object { public Transform transform { get { return null; } } public T GetComponent<T>() { return default(T); } }
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
    public enum TextureFormat { RGBAHalf, RGBAFloat, RGFloat, R8, RGBA32, BC7, DXT1 }
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
    public class MaterialPropertyBlock
    {
        public void SetTexture(string name, Texture t) { }
        public void SetFloat(string name, float f) { }
        public void SetMatrix(string name, Matrix4x4 m) { }
        public void SetVectorArray(string name, Vector4[] v) { }
    }
    public struct Vector3 { public float x, y, z; public Vector3 normalized { get { return this; } } public static Vector3 operator -(Vector3 v) { return v; } }
    public struct Vector4 { public float x, y, z, w; public Vector4(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; } }
    public struct Color { public float r, g, b, a; public static Color white { get { return new Color(); } } public Color linear { get { return this; } } public static Color operator *(Color c, float f) { return c; } public static Color operator *(Color a, Color b) { return a; } }
    public struct Matrix4x4
    {
        public static Matrix4x4 identity { get { return new Matrix4x4(); } }
        public float this[int row, int column] { get { return 0; } set { } }
        public static Matrix4x4 operator *(Matrix4x4 a, Matrix4x4 b) { return a; }
        public Vector3 MultiplyVector(Vector3 v) { return v; }
        public Vector3 MultiplyPoint3x4(Vector3 v) { return v; }
    }
    public static class Mathf { public static float Max(float a, float b) { return a; } public static Color CorrelatedColorTemperatureToRGB(float kelvin) { return new Color(); } }
    public class TooltipAttribute : Attribute { public TooltipAttribute(string text) { } }
    public class ExecuteAlwaysAttribute : Attribute { }
    public class RequireComponentAttribute : Attribute { public RequireComponentAttribute(Type type) { } }
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
