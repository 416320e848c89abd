// SPDX-License-Identifier: MIT
// Shadow volumes of transparent casters: Kim, Kim and Turk, "Real Time Shadow of Transparent
// Casters Using Shadow Volume" (docs/explanation/shading.md, "Shadow volumes"). The volume of a
// triangle is what the light sees behind it. Between the eye and a point the faces of volumes are
// crossed: light caps, which are the triangles, and side faces, which go from an edge away from the
// light. Needs: IS_ORTHOGRAPHIC.
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

// Of the plane through three points: P lies on the side that the sign of dot(plane, P) says, which
// is that of the determinant of P, a, b, c.
dvec4 volume_plane(vec4 a, vec4 b, vec4 c)
{
    dvec4 p = dvec4(a), q = dvec4(b), r = dvec4(c);
    return dvec4(determinant(dmat3(p.yzw, q.yzw, r.yzw)), -determinant(dmat3(p.xzw, q.xzw, r.xzw)),
                 determinant(dmat3(p.xyw, q.xyw, r.xyw)), -determinant(dmat3(p.xyz, q.xyz, r.xyz)));
}

int volume_sign(double x)
{
    return x > 0.0LF ? 1 : x < 0.0LF ? -1 : 0;
}

// On which side of the plane through three points the eye is; in the plane, it is taken for a hair
// off it, the same way for all.
int volume_side_of_eye(vec4 a, vec4 b, vec4 c)
{
#ifdef IS_ORTHOGRAPHIC
    int found = volume_sign(
        double(u_eye) * determinant(dmat3(dvec3(a.xyw), dvec3(b.xyw), dvec3(c.xyw))));
#else
    int found =
        -volume_sign(determinant(dmat3(dvec3(a.xyz), dvec3(b.xyz), dvec3(c.xyz))));
#endif
    if (found != 0)
        return found;
    dvec4 plane = volume_plane(a, b, c);
    found = volume_sign(plane.x);
    found = found != 0 ? found : volume_sign(plane.y);
#ifdef IS_ORTHOGRAPHIC
    return found != 0 ? found : volume_sign(plane.w);
#else
    return found != 0 ? found : volume_sign(plane.z);
#endif
}

vec4 volume_vertex(uint i)
{
    return vec4(vertices[i].xyz, 1.0);
}

// On which side of a triangle of sorted vertices the light is; 0: in its plane, where it casts no
// shadow.
int volume_side_of_light(uvec3 v)
{
    dvec3 a = dvec3(vertices[v.x].xyz), b = dvec3(vertices[v.y].xyz), c = dvec3(vertices[v.z].xyz);
    dvec4 l = dvec4(u_light);
    return volume_sign(determinant(dmat3(l.xyz - l.w * a, b - a, c - a)));
}

// On which side of the plane through a sorted edge and the light the eye is.
int volume_side_of_edge(uvec2 edge)
{
    return volume_side_of_eye(volume_vertex(edge.x), volume_vertex(edge.y), u_light);
}

// What light loses to triangles: of the items of renderer/shadows/volume_casters.h.
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

volume_loss volume_loss_of(uint item)
{
    uvec4 w = weights[item];
    return volume_loss(ivec3(w.xyz), ivec3(w.w & 1u, w.w >> 1 & 1u, w.w >> 2 & 1u));
}
