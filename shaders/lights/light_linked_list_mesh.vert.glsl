// SPDX-License-Identifier: MIT
// Light geometry (Lindbeck 2015, 2.1): a sphere, or a cone with a spherical cap, from the triangle
// soup of renderer/lights/light_mesh.c, placed in view space. One instance is one light.
#include "lights/light_linked_list_light.glsl"

layout(binding = UNIT_LIGHT_MESH) uniform samplerBuffer u_mesh;

out float v_view_z;
flat out uint v_light;

// Mesh vertex of a cone: xy azimuth (its length is the growth that lets the polygon enclose the
// circle), z fraction of the cone's angle, w growth of the radius in units of 1 / cos(angle * w); w
// < 0: the apex.
vec3 cone_vertex(light_linked_list_light light, vec4 vertex)
{
    if (vertex.w < 0.0)
        return light.apex;
    vec3 side = abs(light.axis.z) < 0.7 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0);
    vec3 u = normalize(cross(side, light.axis)), v = cross(light.axis, u);
    float angle = light.angle * vertex.z;
    vec3 direction = light.axis * cos(angle) + (u * vertex.x + v * vertex.y) * sin(angle);
    return light.apex + direction * (light.range / cos(light.angle * vertex.w));
}

void main()
{
    int at = gl_BaseInstanceARB + gl_InstanceID;
    light_linked_list_light light = light_linked_list_fetch(at);
    vec4 vertex = texelFetch(u_mesh, gl_VertexID);
    vec3 p = light.cos_outer < -1.0 ? light.apex + vertex.xyz * light.range
                                    : cone_vertex(light, vertex);
    v_view_z = p.z;
    v_light = uint(light.index);
    // depth is not tested and must not clip: z stays inside the volume, only the eye's plane cuts
    float w = u_tiles.z > 0.0 ? 1.0 : p.z;
    gl_Position = vec4((2.0 * p.xy - (u_window.xy + u_window.zw) * w) / (u_window.zw - u_window.xy),
                       0.5 * w, w);
}
