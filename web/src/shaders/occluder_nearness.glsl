// SPDX-License-Identifier: MIT
// One over the depth before a point light, or the height towards a directional one plus twice the map's reach: 0 is nothing, larger is nearer.
precision highp float;

in float height;

out vec4 nearness;

void main() {
#ifdef SRBF_DISTANT
    nearness = vec4(height);
#else
    nearness = vec4(gl_FragCoord.w);
#endif
}
