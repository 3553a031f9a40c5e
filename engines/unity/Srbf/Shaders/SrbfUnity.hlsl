// SPDX-License-Identifier: MIT
// Relighting in Unity: the uniforms that SrbfRelitRenderer sets, and the functions that a shader or a Custom Function node calls.
// Included by an asset's SrbfAsset.hlsl, after its own functions.
#ifndef SRBF_UNITY
#define SRBF_UNITY

#define SRBF_LAMPS 8  // SrbfRelitRenderer.MostLamps

Texture2DArray _SrbfLayers;
SamplerState sampler_SrbfLayers;
Texture2D _SrbfTable;
Texture2D _SrbfAmbient;
SamplerState sampler_SrbfAmbient;
#ifdef SRBF_CLUSTERED
Texture2D _SrbfClusters;
#endif
#ifdef SRBF_K
float4 _SrbfWeights[SRBF_K];
#else
Texture2D _SrbfWeightRows;
#endif
float4x4 _SrbfAssetFromWorld;
float _SrbfLampCount;
float4 _SrbfLampPosition[SRBF_LAMPS];  // metres, the asset's frame; a0
float4 _SrbfLampColor[SRBF_LAMPS];     // linear irradiance at a0; radius
float4 _SrbfLampAxis[SRBF_LAMPS];      // where a spot shines; falloff
float4 _SrbfLampCone[SRBF_LAMPS];      // versineInner, versineOuter

SrbfLamp SrbfUnityLamp(int i)
{
    SrbfLamp lamp;
    lamp.position = _SrbfLampPosition[i].xyz;
    lamp.positionLow = float3(0.0, 0.0, 0.0);
    lamp.color = _SrbfLampColor[i].xyz;
    lamp.axis = _SrbfLampAxis[i].xyz;
    lamp.a0 = _SrbfLampPosition[i].w;
    lamp.radius = _SrbfLampColor[i].w;
    lamp.versineInner = _SrbfLampCone[i].x;
    lamp.versineOuter = _SrbfLampCone[i].y;
    lamp.falloff = int(_SrbfLampAxis[i].w);
    return lamp;
}

// The light that leaves a white surface, in Unity's units: a white Lambert surface that faces a light of intensity 1 gives 1.
// uv: the lightmap's, v upwards as Unity has it; worldPosition: absolute, metres.
float3 SrbfRelitFrom(Texture2DArray layers, SamplerState layersSampler, float2 uv, float3 worldPosition)
{
    float2 place = float2(uv.x, 1.0 - uv.y);
    float3 receiver = mul(_SrbfAssetFromWorld, float4(worldPosition, 1.0)).xyz;
#if defined(SRBF_K)
    float3 sum = srbfAssetDirectional(layers, layersSampler, place, _SrbfWeights);
#elif defined(SRBF_CLUSTERED)
    float3 sum = srbfAssetDirectional(layers, layersSampler, _SrbfClusters, place, _SrbfWeightRows);
#else
    float3 sum = srbfAssetDirectional(layers, layersSampler, place, _SrbfWeightRows);
#endif
    for (int i = 0; i < int(_SrbfLampCount); ++i)
    {
#ifdef SRBF_CLUSTERED
        sum += srbfAssetPoint(layers, layersSampler, _SrbfClusters, place, _SrbfTable, receiver, SrbfUnityLamp(i));
#else
        sum += srbfAssetPoint(layers, layersSampler, place, _SrbfTable, receiver, SrbfUnityLamp(i));
#endif
    }
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
// The same with a texture array and a sampler of the graph's own, by another reference than _SrbfLayers: name SrbfRelightFrom.
void SrbfRelightFrom_float(UnityTexture2DArray Layers, UnitySamplerState LayersSampler, float2 UV, float3 WorldPosition, out float3 Relit)
{
    Relit = SrbfRelitFrom(Layers.tex, LayersSampler.samplerstate, UV, WorldPosition);
}
#endif

#endif
