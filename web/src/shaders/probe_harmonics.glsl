// SPDX-License-Identifier: MIT
// Nine RGB harmonics of the light of every node of a grid of probes, in seven texels each, from the picture of its facets: `harmonics` of
// srbf/relighting/probe_light.py.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D facets;
uniform sampler2D places;
uniform int width;           // nodes in a row
uniform float weights[108];  // of facet and harmonic

out vec4 harmonics;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    int source = int(texelFetch(places, ivec2(at.x % width, at.y), 0).w + 0.5);
    int first = at.x / width * 4;
    vec4 sum = vec4(0.0);
    for (int facet = 0; facet < 12; ++facet) {
        vec3 light = texelFetch(facets, ivec2(facet * width + source % width, source / width), 0).rgb;
        for (int i = 0; i < 4; ++i) {
            int number = first + i;
            if (number < 27) sum[i] += weights[facet * 9 + number / 3] * light[number % 3];
        }
    }
    harmonics = sum;
}
