// SPDX-License-Identifier: MIT
// Crosses the ways from the eye to all points of a span of tiles with a face: a group for each
// span, an invocation for each pixel of a tile; IS_SMALL: to those of a few pixels, an invocation
// for each face. Needs: those of volume.glsl; IS_SMALL.
#include "shadows/volume.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
#include "shadows/volume_faces.glsl"
#include "shadows/volume_crossing.glsl"
layout(std430, binding = BIND_VOLUME_FACES) readonly buffer face_buffer { volume_face faces[]; };
layout(std430, binding = BIND_VOLUME_SPANS) readonly buffer span_buffer { uvec2 spans[]; };
uniform uvec2 u_size_px;
uniform uint u_spans; // or faces of a few pixels

void cross_pixel(looked_at at, uvec2 pixel, bool is_exact, inout bool is_open)
{
    if (all(lessThan(pixel, u_size_px)))
        cross_points(at, pixel.y * u_size_px.x + pixel.x, is_exact, is_open);
}

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
#ifdef IS_SMALL
    uint i = group * 64u + gl_LocalInvocationIndex;
#else
    uint i = group;
#endif
    if (i >= u_spans)
        return;
    uvec2 span = spans[i];
    bool is_side = span.x < u_edges;
    volume_face face = faces[span.x];
    uvec3 v = is_side ? uvec3(edges[face.edge].xy, 0u) : triangles[span.x - u_edges].xyz;
    vec4 third = is_side ? u_light : volume_vertex(v.z);
    looked_at at = looked_at(vec4[](volume_vertex(v.x), volume_vertex(v.y), third), is_side, face);
#ifdef IS_SMALL
    uvec2 first = uvec2(span.y, span.y >> 12) & 4095u;
    uint width = span.y >> 24 & 15u, count = width * (span.y >> 28);
#define PIXEL(k) (first + uvec2((k) % width, (k) / width))
#else
    uint row = span.y >> 20, tile = span.y >> 10 & 1023u, count = (span.y & 1023u) - tile;
#define PIXEL(k) (uvec2(tile + (k), row) * VOLUME_TILE_PX + gl_LocalInvocationID.xy)
#endif
    bool is_open = false;
    for (uint k = 0u; k < count; k++)
        cross_pixel(at, PIXEL(k), false, is_open);
    uint again = is_open ? count : 0u; // few, and what is exact takes long
    for (uint k = 0u; k < again; k++)
        cross_pixel(at, PIXEL(k), true, is_open);
}
