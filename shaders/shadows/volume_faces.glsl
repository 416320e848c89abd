// SPDX-License-Identifier: MIT
// Faces of shadow volumes: those of the edges that are listed come first, then triangles.
struct volume_face {
    ivec3 log2; // what the way from the eye gains where it crosses the face, times side
    int side;   // volume_side_of_eye
    ivec3 stops;
    uint edge;
};
layout(std430, binding = BIND_VOLUME_EDGES) readonly buffer edge_buffer { uvec4 edges[]; };
layout(std430, binding = BIND_VOLUME_TRIANGLES) readonly buffer triangle_buffer {
    uvec4 triangles[];
};
uniform uint u_edges; // that are listed

// A face whose box of pixels has no side longer than this, nor more pixels, is small.
const uint VOLUME_SMALL_SIDE_PX = 15u, VOLUME_SMALL_PIXELS = 64u;
uint volume_small_box(uvec2 first, uvec2 size)
{
    return first.x | first.y << 12 | size.x << 24 | size.y << 28;
}

// Windows have at most 4096 pixels a side: rows and columns of tiles take 10 bits, an end as well.
uint volume_span(uint row, uint first, uint end)
{
    return row << 20 | first << 10 | end;
}
