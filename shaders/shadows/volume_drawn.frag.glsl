// SPDX-License-Identifier: MIT
// What the way from the eye to a pixel's surface, and to its nearest layer, gains where it crosses
// a face: as published, a logarithm that is added up, or a factor that is multiplied, in a picture
// of half floats. The device's rasteriser tells which pixels a face covers. Needs: those of
// volume.glsl; IS_PRODUCT: factors.
#include "shadows/volume.glsl"
#include "shadows/volume_faces.glsl"
#include "shadows/volume_way.glsl"
#include "shadows/volume_octaves.glsl"
layout(std430, binding = BIND_VOLUME_FACES) readonly buffer face_buffer { volume_face faces[]; };
layout(std430, binding = BIND_VOLUME_STARTS) readonly buffer start_buffer { vec4 starts[]; };
layout(std430, binding = BIND_TRACED_HEADS) readonly buffer head_buffer { uint heads[]; };
layout(std430, binding = BIND_VOLUME_ENDS) readonly buffer end_buffer { uint layer_ends[]; };
uniform uvec2 u_size_px;
uniform uint u_layers; // points of layers, which come first; 0: there are no ends
flat in uint v_face;
layout(location = 0) out vec4 out_surface;
layout(location = 1) out vec4 out_layer;

bool is_crossed(volume_face face, vec4 corners[3], vec4 start)
{
    if (start.w == 0.0)
        return false;
    vec2 slope = way_slope(start.xyz);
    corner p = corner_of(corners[0], slope), q = corner_of(corners[1], slope);
    corner r = corner_of(corners[2], slope);
    vec3 share = float(way_sign(face.side)) * vec3(cross_of(q, r), cross_of(r, p), cross_of(p, q));
    return is_before_end(share, p, q, r, start.z);
}

vec4 gain_of(volume_face face, bool is_in)
{
    vec4 gain = vec4(0.0);
    for (uint k = 0u; k < 3u && is_in; k++)
        gain[k] = volume_octaves(face.side * face.log2[k], face.side * face.stops[k]);
#ifdef IS_PRODUCT
    gain = exp2(-gain);
#endif
    return gain;
}

void main()
{
    volume_face face = faces[v_face];
    bool is_side = v_face < u_edges;
    uvec3 v = is_side ? uvec3(edges[face.edge].xy, 0u) : triangles[v_face - u_edges].xyz;
    vec4 corners[3] = vec4[](volume_vertex(v.x), volume_vertex(v.y),
                             is_side ? u_light : volume_vertex(v.z));
    uvec2 at = uvec2(gl_FragCoord.xy);
    uint pixel = at.y * u_size_px.x + at.x;
    uint head = heads[pixel], layer = u_layers > 0u && pixel > 0u ? layer_ends[pixel - 1u] : 0u;
    bool has_surface = (head & 7u) > 0u, has_layer = u_layers > 0u && layer_ends[pixel] > layer;
    vec4 surface = has_surface ? starts[u_layers + (head >> 3)] : vec4(0.0);
    vec4 nearest = has_layer ? starts[layer] : vec4(0.0);
    out_surface = gain_of(face, is_crossed(face, corners, surface));
    out_layer = gain_of(face, is_crossed(face, corners, nearest));
}
