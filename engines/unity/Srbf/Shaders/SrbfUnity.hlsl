// SPDX-License-Identifier: MIT
// Relighting in Unity: the uniforms that SrbfRelitRenderer sets, and the functions that a shader or a Custom Function node calls.
// Included by an asset's SrbfAsset.hlsl, after its own functions.
#ifndef SRBF_UNITY
#define SRBF_UNITY


Texture2DArray _SrbfLayers;
SamplerState sampler_SrbfLayers;
#ifndef SRBF_WEIGHTS_ALONE
Texture2D _SrbfTable;
#endif
Texture2D _SrbfAmbient;
SamplerState sampler_SrbfAmbient;
#ifdef SRBF_CLUSTERED
Texture2D _SrbfClusters;
#endif
#if defined(SRBF_K) && !defined(SRBF_WEIGHTS_ALONE)
float4 _SrbfWeights[SRBF_K];
#else
Texture2D _SrbfWeightRows;
#endif
#ifndef SRBF_WEIGHTS_ALONE
float4x4 _SrbfAssetFromWorld;
float4 _SrbfPointLights[4 * SRBF_POINT_LIGHTS];  // four per light, as srbfUnpackPointLight takes them, in the asset's frame
float _SrbfPointLightCount;
#endif

// The light that leaves a white surface, in Unity's units: a white Lambert surface that faces a light of intensity 1 gives 1.
// uv: the lightmap's, v upwards as in Unity; worldPosition: absolute, meters. Only in fragment shaders: it takes derivatives.
float3 SrbfRelitFrom(Texture2DArray layers, SamplerState layersSampler, float2 uv, float3 worldPosition)
{
    float2 place = float2(uv.x, 1.0 - uv.y);
#ifndef SRBF_CLUSTERED  // clusters have no mip levels
    float2 size = float2(srbfTextureSize(layers).xy);
    float level = srbfMipLevel(ddx(place) * size, ddy(place) * size);
#endif
#ifdef SRBF_WEIGHTS_ALONE  // named lights, and lights of a cloud: a pixel costs the same under any number of them
#if defined(SRBF_K)
    float3 sum = srbfAssetDirectional(layers, layersSampler, place, level, _SrbfWeightRows);
#elif defined(SRBF_CLUSTERED)
    float3 sum = srbfAssetDirectional(layers, layersSampler, _SrbfClusters, place, _SrbfWeightRows);
#else
    float3 sum = srbfAssetDirectional(layers, layersSampler, place, _SrbfWeightRows);
#endif
#else
    float3 receiver = mul(_SrbfAssetFromWorld, float4(worldPosition, 1.0)).xyz;
#if defined(SRBF_K)
    float3 sum = srbfAssetLights(layers, layersSampler, place, level, _SrbfWeights, _SrbfTable, receiver, _SrbfPointLights, int(_SrbfPointLightCount));
#elif defined(SRBF_CLUSTERED)
    float3 sum = srbfAssetLights(layers, layersSampler, _SrbfClusters, place, _SrbfWeightRows, _SrbfTable, receiver, _SrbfPointLights, int(_SrbfPointLightCount));
#else
    float3 sum = srbfAssetLights(layers, layersSampler, place, level, _SrbfWeightRows, _SrbfTable, receiver, _SrbfPointLights, int(_SrbfPointLightCount));
#endif
#endif
    float3 ambient = _SrbfAmbient.SampleLevel(sampler_SrbfAmbient, place, 0.0).rgb / 3.14159265;  // in Blender's units
    return srbfFinish(sum, ambient) * SRBF_UNITY_SCALE;
}

float3 SrbfRelit(float2 uv, float3 worldPosition)
{
    return SrbfRelitFrom(_SrbfLayers, sampler_SrbfLayers, uv, worldPosition);
}

// Custom Function node, type File: name SrbfRelight, inputs UV (Vector 2) and WorldPosition (Vector 3, absolute world),
// output Relit (Vector 3).
void SrbfRelight_float(float2 UV, float3 WorldPosition, out float3 Relit)
{
    Relit = SrbfRelit(UV, WorldPosition);
}

void SrbfRelight_half(float2 UV, float3 WorldPosition, out float3 Relit)
{
    Relit = SrbfRelit(UV, WorldPosition);
}

#ifdef UNITY_TEXTURE_INCLUDED  // where UnityTexture2DArray is known: in Shader Graph, not in the built-in pipeline
// The same with the graph's own texture array and sampler, under another reference than _SrbfLayers: name SrbfRelightFrom.
void SrbfRelightFrom_float(UnityTexture2DArray Layers, UnitySamplerState LayersSampler, float2 UV, float3 WorldPosition, out float3 Relit)
{
    Relit = SrbfRelitFrom(Layers.tex, LayersSampler.samplerstate, UV, WorldPosition);
}
#endif

#endif
