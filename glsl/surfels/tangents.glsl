// SPDX-License-Identifier: MIT
/* srbfTangents: two unit vectors across a normal and each other, along the axes for a normal that is one.
   use:    void srbfTangents(vec3 normal, out vec3 tangent, out vec3 bitangent)
   domain: a unit vector
   twin:   srbf.visibility.surface_cells.frames
   cite:   Duff2017 */
void srbfTangents(vec3 normal, out vec3 tangent, out vec3 bitangent) {
    float side = normal.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (side + normal.z);
    float b = normal.x * normal.y * a;
    tangent = vec3(1.0 + side * normal.x * normal.x * a, side * b, -side * normal.x);
    bitangent = vec3(b, side + normal.y * normal.y * a, -normal.y);
}
