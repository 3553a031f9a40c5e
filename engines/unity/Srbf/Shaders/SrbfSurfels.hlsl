// SPDX-License-Identifier: MIT
// The passes that compute the weights of lights inside a scene: shadow maps of the asset's triangles, irradiance on cells of the surfaces, means of patches, products
// with the asset's tables. SrbfSurfelPasses draws them; all places are in the asset's frame, minus the middle of the cells.
#ifndef SRBF_SURFELS
#define SRBF_SURFELS
#include "SrbfSurfelPack.hlsl"

Texture2D _SrbfPlaces;      // place, area
Texture2D _SrbfNormals;     // normal, share of the patch's area
Texture2D _SrbfRanges;      // first cell of a patch, how many
Texture2D _SrbfCorners;     // of triangles that cast shadows
Texture2DArray _SrbfNearness;  // six faces of a cube, or one map of a directional light
Texture2D _SrbfIrradiance;  // of cells
Texture2D _SrbfEntries;     // of a table
Texture2D _SrbfNumbers;     // that it is multiplied by
Texture2D _SrbfParts;       // of its sums
Texture2D _SrbfAdded;       // to the sums: a texel per row of the table
Texture2D _SrbfLeft;        // of a product of matrices
Texture2D _SrbfRight;
Texture2D _SrbfAddend;
Texture2D _SrbfAlbedo;      // of every surfel now, and of the bake
Texture2D _SrbfCells;       // numbers of cells of directions
Texture2D _SrbfEnvironment; // an equirectangular map
float4 _SrbfMatrix;         // columns of the left one; scales of the product, of the addend, of the former series
float4 _SrbfAtMiddle;       // of the environment: the direction at its middle; w: cells per side
float4 _SrbfAtLeft;
float4 _SrbfAtRowZero;      // w: its energy
float4 _SrbfLightPlace;     // or the direction to a directional light
float4 _SrbfLightColor;
float4 _SrbfLightAxis;      // w: falloff, 0 linear, 1 inverse-square
float4 _SrbfLightShape;     // a0, radius (m), 1 - cos of a spot's half-angles, or 3 and 4
float4 _SrbfAcross;         // of the map that is drawn or read
float4 _SrbfUp;
float4 _SrbfAhead;          // away from a light; towards a directional one
float _SrbfReach;           // m: half a side of a directional light's map
float _SrbfLift;            // m: of a cell above its surface
float4 _SrbfTable;          // rows, columns, blocks, 1 for one channel
float _SrbfScale;           // of its entries
float _SrbfTargetWidth;

static const float SRBF_NEAREST = 5e-3;  // m: what is nearer to a light casts no shadow

struct SrbfOccluder
{
    float4 position : SV_Position;
    float height : TEXCOORD0;  // depth before a light, or height towards a directional one
};

float3 SrbfCorner(uint id)
{
    int width = srbfTextureSize(_SrbfCorners).x;
    return _SrbfCorners.Load(int3(int(id) % width, int(id) / width, 0)).xyz;
}

// Rows of the target from y = -1 on, on every API: where the first row is the top one, y is turned.
float4 SrbfInRows(float4 position)
{
#if !defined(SHADER_API_GLCORE) && !defined(SHADER_API_GLES3)
    position.y = -position.y;
#endif
    return position;
}

SrbfOccluder SrbfOccluderOnCube(uint id : SV_VertexID)
{
    float3 fromLight = SrbfCorner(id) - _SrbfLightPlace.xyz;
    SrbfOccluder corner;
    corner.height = dot(fromLight, _SrbfAhead.xyz);
#if defined(SHADER_API_GLCORE) || defined(SHADER_API_GLES3)
    float clipped = corner.height - 2.0 * SRBF_NEAREST;  // of -w to w
#else
    float clipped = corner.height - SRBF_NEAREST;  // of 0 to w
#endif
    corner.position = SrbfInRows(float4(dot(fromLight, _SrbfAcross.xyz), dot(fromLight, _SrbfUp.xyz), clipped, corner.height));
    return corner;
}

SrbfOccluder SrbfOccluderOnMap(uint id : SV_VertexID)
{
    float3 place = SrbfCorner(id);
    SrbfOccluder corner;
    corner.height = dot(place, _SrbfAhead.xyz) + 2.0 * _SrbfReach;
    corner.position = SrbfInRows(float4(float2(dot(place, _SrbfAcross.xyz), dot(place, _SrbfUp.xyz)) / _SrbfReach, 0.5, 1.0));
    return corner;
}

// Blended by MAX.
float4 SrbfNearness(SrbfOccluder corner) : SV_Target
{
    return float4(1.0 / corner.height, 0.0, 0.0, 0.0);
}

float4 SrbfHeight(SrbfOccluder corner) : SV_Target
{
    return float4(corner.height, 0.0, 0.0, 0.0);
}

float4 SrbfFullscreen(uint id : SV_VertexID) : SV_Position
{
    return float4(id == 1 ? 3.0 : -1.0, id == 2 ? 3.0 : -1.0, 0.5, 1.0);
}

// The irradiance of a point or spot light on a cell, added to that of other lights.
float4 SrbfIrradianceByCube(float4 at : SV_Position) : SV_Target
{
    int3 texel = int3(int2(at.xy), 0);
    float4 cell = _SrbfPlaces.Load(texel);
    float3 normal = _SrbfNormals.Load(texel).xyz;
    SrbfPointLight pointLight = srbfMakePointLight(
        _SrbfLightPlace.xyz, float3(0.0, 0.0, 0.0), _SrbfLightColor.rgb, _SrbfLightAxis.xyz, _SrbfLightShape.x, _SrbfLightShape.y,
        _SrbfLightShape.z, _SrbfLightShape.w, int(_SrbfLightAxis.w));
    float amount = srbfCellIrradiance(cell, normal, pointLight, 0.0);
    if (amount > 0.0)
    {
        int3 there;
        float3 fromLight = cell.xyz + _SrbfLift * normal - _SrbfLightPlace.xyz;
        float own = srbfCellOnCube(fromLight, normal, srbfTextureSize(_SrbfNearness).x, there);
        amount = _SrbfNearness.Load(int4(there, 0)).r > own ? 0.0 : amount;
    }
    return float4(amount * _SrbfLightColor.rgb, 0.0);
}

// The same of a directional light.
float4 SrbfIrradianceByMap(float4 at : SV_Position) : SV_Target
{
    int3 texel = int3(int2(at.xy), 0);
    float3 normal = _SrbfNormals.Load(texel).xyz;
    float amount = dot(normal, _SrbfLightPlace.xyz);
    if (amount > 0.0)
    {
        int2 there;
        float3 place = _SrbfPlaces.Load(texel).xyz + _SrbfLift * normal;
        int width = srbfTextureSize(_SrbfNearness).x;
        float own = srbfCellOnMap(place, normal, _SrbfLightPlace.xyz, _SrbfAcross.xyz, _SrbfUp.xyz, _SrbfReach, width, there);
        amount = _SrbfNearness.Load(int4(there, 0, 0)).r > own ? 0.0 : amount;
    }
    return float4(max(amount, 0.0) * _SrbfLightColor.rgb, 0.0);
}

float4 SrbfMeans(float4 at : SV_Position) : SV_Target
{
    return float4(srbfPatchMean(_SrbfIrradiance, _SrbfNormals, _SrbfRanges, int2(at.xy)), 1.0);
}

int SrbfIndex(float4 at)
{
    return int(at.y) * int(_SrbfTargetWidth) + int(at.x);
}

float4 SrbfTableParts(float4 at : SV_Position) : SV_Target
{
    int4 table = int4(_SrbfTable);
    float3 sum = srbfTablePart(_SrbfEntries, _SrbfNumbers, table.x, table.y, table.z, table.w > 0, SrbfIndex(at));
    return float4(sum * _SrbfScale, 1.0);
}

float4 SrbfTableSums(float4 at : SV_Position) : SV_Target
{
    int row = SrbfIndex(at);
    return float4(srbfBlockSum(_SrbfParts, int(_SrbfTable.z), row) + _SrbfAdded.Load(int3(0, row % srbfTextureSize(_SrbfAdded).y, 0)).rgb, 1.0);
}

// The passes of SrbfShapePasses.
float3 SrbfWithAddend(float3 product, float4 at)
{
    return product * _SrbfMatrix.y + _SrbfAddend.Load(int3(int2(at.xy) % srbfTextureSize(_SrbfAddend), 0)).rgb * _SrbfMatrix.z;
}

float4 SrbfCells(float4 at : SV_Position) : SV_Target
{
    int cell = int(_SrbfCells.Load(int3(int2(at.xy), 0)).r + 0.5);
    float3 radiance = srbfEnvironmentCell(_SrbfEnvironment, _SrbfAtMiddle.xyz, _SrbfAtLeft.xyz, _SrbfAtRowZero.xyz, cell, int(_SrbfAtMiddle.w));
    return float4(radiance * _SrbfAtRowZero.w, 1.0);
}

float4 SrbfProduct(float4 at : SV_Position) : SV_Target
{
    return float4(SrbfWithAddend(srbfMatrixProduct(_SrbfLeft, _SrbfRight, int(_SrbfMatrix.x), int2(at.xy)), at), 1.0);
}

// Left: gather; right: sent.
float4 SrbfExchange(float4 at : SV_Position) : SV_Target
{
    return float4(SrbfWithAddend(srbfChangedExchange(_SrbfLeft, _SrbfRight, _SrbfAlbedo, int(_SrbfMatrix.x), int2(at.xy)), at), 1.0);
}

// Left and right: the series before and after; the addend is the table.
float4 SrbfRepainted(float4 at : SV_Position) : SV_Target
{
    float3 added = srbfRepaintedEntry(_SrbfLeft, _SrbfRight, _SrbfEntries, _SrbfAlbedo, int(_SrbfMatrix.x), _SrbfMatrix.w, int2(at.xy));
    return float4(SrbfWithAddend(added, at), 1.0);
}

#endif
