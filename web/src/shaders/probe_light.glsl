// SPDX-License-Identifier: MIT
// An engine's material for what moves between probes: its uniforms, and the irradiance at a place and unit normal of the asset's frame.
#include "probes/probe_irradiance.glsl"

uniform highp sampler2D srbfProbeLight;
uniform highp sampler2D srbfProbePlaces;
uniform highp sampler2D srbfProbeNearness;
uniform vec4 srbfProbeGrid;
uniform ivec3 srbfProbeCounts;

vec3 srbfProbeLit(vec3 place, vec3 normal) {
    return srbfProbeIrradiance(srbfProbeLight, srbfProbePlaces, srbfProbeNearness, srbfProbeGrid, srbfProbeCounts, place, normal);
}
