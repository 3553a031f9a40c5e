// SPDX-License-Identifier: MIT
#version 330 core
// A surface with a lightmap: where its corners are in the picture, in the asset's frame and on the lightmap.
precision highp float;

uniform mat4 worldFromObject;
uniform mat4 assetFromWorld;  // asset_from_world, the identity until an instance moves the asset
uniform mat4 clipFromWorld;

layout(location = 0) in vec3 position;
layout(location = 1) in vec2 lightmapUv;  // v upwards, as meshes have it

out vec3 receiver;
out vec2 uv;

void main() {
    vec4 world = worldFromObject * vec4(position, 1.0);
    receiver = (assetFromWorld * world).xyz;
    uv = vec2(lightmapUv.x, 1.0 - lightmapUv.y);
    gl_Position = clipFromWorld * world;
}
