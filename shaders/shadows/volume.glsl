// SPDX-License-Identifier: MIT
// Shadow volumes of transparent casters: Kim, Kim and Turk, "Real Time Shadow of Transparent
// Casters Using Shadow Volume" (docs/explanation/shading.md, "Shadow volumes"). The volume of a
// triangle is what the light sees behind it. Between the eye and a point the faces of volumes are
// crossed: light caps, which are the triangles, and side faces, which go from an edge away from the
// light. Needs: IS_ORTHOGRAPHIC; HAS_GROUPS: casters are counted by their filters, and weights are
// numbers of groups.
//
// Points are homogeneous, in view space; the light at infinity has w = 0, and so has the eye of an
// orthographic camera. Signs of determinants decide all, and are taken of the same numbers in the
// same order wherever the same vertices meet.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
layout(std430, binding = BIND_VOLUME_VERTICES) readonly buffer vertex_buffer { vec4 vertices[]; };
uniform vec4 u_light;
uniform float u_eye; // orthographic: 1: the way begins before all that is seen; -1: behind it

#include "shadows/exact_sign.glsl"

// The sign of the determinant of p, a, b, c: on which side of the plane through the last three, of
// which a is a vertex, the first one is. By floats where they can tell: the bound is that of
// Shewchuk's ORIENT3D (exact_sign.glsl), rounded up.
// 0: they cannot.
int volume_side_by_floats(vec4 p, vec4 a, vec4 b, vec4 c)
{
    vec3 u = p.xyz - p.w * a.xyz, v = b.xyz - b.w * a.xyz, w = c.xyz - c.w * a.xyz;
    vec3 left = v.yzx * w.zxy, right = v.zxy * w.yzx;
    float found = dot(u, left - right), most = dot(abs(u), abs(left) + abs(right));
    return abs(found) > 1e-6 * most && most > 1e-30 ? (found > 0.0 ? 1 : -1) : 0;
}

int volume_side(vec4 p, vec4 a, vec4 b, vec4 c)
{
    int found = volume_side_by_floats(p, a, b, c);
    return found != 0 ? found : exact_sign_of_products(vec4[](p, a, b, c));
}

vec4 volume_eye()
{
#ifdef IS_ORTHOGRAPHIC
    return vec4(0.0, 0.0, u_eye, 0.0);
#else
    return vec4(0.0, 0.0, 0.0, 1.0);
#endif
}

// On which side of the plane through three points the eye is; in the plane, it is taken for a hair
// off it, the same way for all.
int volume_side_of_eye(vec4 a, vec4 b, vec4 c)
{
#ifdef IS_ORTHOGRAPHIC
    vec4 hairs[4] = vec4[](volume_eye(), vec4(1.0, 0.0, 0.0, 0.0),
                             vec4(0.0, 1.0, 0.0, 0.0), vec4(0.0, 0.0, 0.0, 1.0));
#else
    vec4 hairs[4] = vec4[](volume_eye(), vec4(1.0, 0.0, 0.0, 0.0),
                             vec4(0.0, 1.0, 0.0, 0.0), vec4(0.0, 0.0, 1.0, 0.0));
#endif
    int found = 0;
    for (int i = 0; i < 4 && found == 0; i++)
        found = volume_side(hairs[i], a, b, c);
    return found;
}

vec4 volume_vertex(uint i)
{
    return vec4(vertices[i].xyz, 1.0);
}

// What light loses to triangles: of the items of renderer/shadows/volume_casters.h. With groups:
// which of six groups of casters of one filter is met.
struct volume_loss {
    ivec3 log2;
    ivec3 stops;
};
layout(std430, binding = BIND_VOLUME_WEIGHTS) readonly buffer weight_buffer { uvec4 weights[]; };
layout(std430, binding = BIND_VOLUME_REACH) readonly buffer reach_buffer { uint reached[]; };
uniform uint u_reach; // the first word of the light's

// Whether the light meets what the triangle is of.
bool volume_is_reached(uint item)
{
    return (reached[u_reach + (item >> 5)] >> (item & 31u) & 1u) != 0u;
}

#ifdef HAS_GROUPS
uniform uint u_first_group;

volume_loss volume_loss_of(uint item)
{
    uint group = weights[item].x - u_first_group;
    ivec3 low = ivec3(equal(uvec3(group), uvec3(0u, 1u, 2u)));
    return volume_loss(low, ivec3(equal(uvec3(group), uvec3(3u, 4u, 5u))));
}
#else
volume_loss volume_loss_of(uint item)
{
    uvec4 w = weights[item];
    return volume_loss(ivec3(w.xyz), ivec3(w.w & 1u, w.w >> 1 & 1u, w.w >> 2 & 1u));
}
#endif
