// SPDX-License-Identifier: MIT
/* srbfCubeFace: the face of a cube about a point light that a place is seen through: 0 to 5 for +x, -x, +y, -y, +z, -z.
   use:    int srbfCubeFace(vec3 fromLight)
   domain: any vector, in the cube's axes; on an edge the earlier axis, so that no place is on two faces or on none
   twin:   srbf.visibility.point_shadow.cube_face
   cite:   - */
int srbfCubeFace(vec3 fromLight) {
    vec3 size = abs(fromLight);
    if (size.x >= size.y && size.x >= size.z) {
        return fromLight.x >= 0.0 ? 0 : 1;
    }
    if (size.y >= size.z) {
        return fromLight.y >= 0.0 ? 2 : 3;
    }
    return fromLight.z >= 0.0 ? 4 : 5;
}
