// SPDX-License-Identifier: MIT
// Faces of shadow volumes: those of edges come first, then triangles.
struct volume_face {
    ivec3 log2; // what the way from the eye gains where it crosses the face
    int side;   // volume_side_of_eye
    ivec3 stops;
    int unused;
};
layout(std430, binding = BIND_VOLUME_EDGES) readonly buffer edge_buffer { uvec4 edges[]; };
layout(std430, binding = BIND_VOLUME_TRIANGLES) readonly buffer triangle_buffer {
    uvec4 triangles[];
};
uniform uint u_edges;

// Windows have at most 4096 pixels a side: rows and columns of tiles take 10 bits, an end as well.
#define VOLUME_TILE_PX 8u
uint volume_span(uint row, uint first, uint end)
{
    return row << 20 | first << 10 | end;
}
