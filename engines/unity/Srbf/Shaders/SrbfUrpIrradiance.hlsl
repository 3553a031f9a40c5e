// SPDX-License-Identifier: MIT
// Irradiance of URP's own lights, with their shadows, on cells of an asset's surfaces: the mean of 4 x 4 points of each. After URP's Lighting.hlsl.
#ifndef SRBF_URP_IRRADIANCE
#define SRBF_URP_IRRADIANCE
#include "SrbfSurfelPack.hlsl"

Texture2D _SrbfPlaces;   // place in the asset's frame less the middle of the cells, area
Texture2D _SrbfNormals;
float4x4 _SrbfWorldFromCell;
float _SrbfLift;         // m: of a cell above its surface

static const int SRBF_PARTS = 4;  // per side of a cell

float4 SrbfFullscreen(uint id : SV_VertexID) : SV_Position
{
    return float4(id == 1 ? 3.0 : -1.0, id == 2 ? 3.0 : -1.0, 0.5, 1.0);
}

float3 SrbfOfLight(Light light, float3 normal, float most)
{
    float amount = max(dot(normal, float3(light.direction)), 0.0) * min(light.distanceAttenuation, most) * light.shadowAttenuation;
    return amount * float3(light.color);
}

float4 SrbfUrpIrradiance(float4 at : SV_Position) : SV_Target
{
    int3 texel = int3(int2(at.xy), 0);
    float4 cell = _SrbfPlaces.Load(texel);
    float3 own = _SrbfNormals.Load(texel).xyz;
    if (cell.w <= 0.0) return 0.0;
    float3 tangent, bitangent;
    srbfTangents(own, tangent, bitangent);
    float3 normal = normalize(mul(_SrbfWorldFromCell, float4(own, 0.0)).xyz);
    float scale = length(mul(_SrbfWorldFromCell, float4(tangent, 0.0)).xyz);
    float most = 6.283185307179586 * float(SRBF_PARTS * SRBF_PARTS) / (cell.w * scale * scale);  // no part takes more than half of a light
    uint count = uint(GetAdditionalLightsCount());
    float3 total = 0.0;
    for (int part = 0; part < SRBF_PARTS * SRBF_PARTS; ++part)
    {
        float2 on = sqrt(cell.w) * ((float2(float(part / SRBF_PARTS), float(part % SRBF_PARTS)) + 0.5) / float(SRBF_PARTS) - 0.5);
        float3 lifted = cell.xyz + on.x * tangent + on.y * bitangent + _SrbfLift * own;
        float3 place = mul(_SrbfWorldFromCell, float4(lifted, 1.0)).xyz;
        total += SrbfOfLight(GetMainLight(TransformWorldToShadowCoord(place)), normal, 1.0);
        for (uint i = 0u; i < count; ++i) total += SrbfOfLight(GetAdditionalLight(i, place, half4(1.0, 1.0, 1.0, 1.0)), normal, most);
    }
    return float4(total / float(SRBF_PARTS * SRBF_PARTS), 1.0);
}

#endif
