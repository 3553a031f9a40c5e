// SPDX-License-Identifier: MIT
/* srbfCombineEnvironmentRow: one row's part of W_i, the integral of an environment's radiance times R_i over the captured domain.
   use:    vec3 srbfCombineEnvironmentRow(sampler2D environment, int row, sampler2D rTable, vec4 center,
                                         vec4 assetFromMap[3], int domain)
   domain: environment as in srbfEnvironmentTexel; center as srbfCenterWeight takes it; assetFromMap: the rows of the
           matrix that turns the map into the asset's frame; domain SRBF_SPHERE, SRBF_HEMISPHERE where the map is
           upright in that frame, else SRBF_TURNED_HEMISPHERE
   twin:   srbf.methods.projected_weights
   cite:   Wong2005, "Directional-Source Relighting" */
#include "combine/center_weight.glsl"
#include "lights/environment_texel.glsl"

#define SRBF_SPHERE 0
#define SRBF_HEMISPHERE 1
#define SRBF_TURNED_HEMISPHERE 2

vec3 srbfCombineEnvironmentRow(highp sampler2D environment, int row, highp sampler2D rTable, vec4 center,
                               vec4 assetFromMap[3], int domain) {
    ivec2 size = textureSize(environment, 0);
    vec3 sum = vec3(0.0);
    for (int column = 0; column < size.x; ++column) {
        vec4 texel = srbfEnvironmentTexel(ivec2(column, row), size, domain == SRBF_HEMISPHERE);
        vec3 d = texel.xyz;
        vec3 direction = vec3(dot(assetFromMap[0].xyz, d), dot(assetFromMap[1].xyz, d), dot(assetFromMap[2].xyz, d));
        float solidAngle = domain == SRBF_TURNED_HEMISPHERE && direction.z <= 0.0 ? 0.0 : texel.w;
        vec3 radiance = texelFetch(environment, ivec2(column, row), 0).rgb;
        sum += radiance * (solidAngle * srbfCenterWeight(rTable, direction, center));
    }
    return sum;
}
