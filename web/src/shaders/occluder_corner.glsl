// SPDX-License-Identifier: MIT
// A triangle as a light sees it through a face of a cube about it or, with SRBF_DISTANT, from its direction.
precision highp float;

uniform vec3 light;
uniform vec3 across;
uniform vec3 up;
uniform vec3 ahead;    // away from the light; towards a directional one
uniform float reach;   // tangent of the face's half-angle; meters of half a directional map's side
uniform float nearest; // meters: what is nearer casts no shadow

in vec3 position;

out float height;

void main() {
#ifdef SRBF_DISTANT
    height = dot(position, ahead) + 2.0 * reach;
    gl_Position = vec4(vec2(dot(position, across), dot(position, up)) / reach, 1.0 - height / (2.0 * reach), 1.0);
#else
    vec3 fromLight = position - light;
    float depth = dot(fromLight, ahead);
    height = 0.0;
    gl_Position = vec4(vec2(dot(fromLight, across), dot(fromLight, up)) / reach, depth - 2.0 * nearest, depth);
#endif
}
