// SPDX-License-Identifier: MIT
// Faces of shadow volumes as quads of the window, for the stages that draw them, as Lexolights
// (Peciva) has it: a face is drawn as often as it counts, and by patches of so many quads at most.
// A quad lies about all pixels whose ways may cross the face; fragments tell which of these do
// (volume_counted.frag.glsl). Needs: those of volume.glsl, with HAS_GROUPS.
#include "shadows/volume.glsl"
#include "shadows/volume_faces.glsl"
#include "shadows/volume_counts.glsl"
#include "shadows/volume_told.glsl"
#include "shadows/volume_window.glsl"
layout(std430, binding = BIND_STATISTICS) readonly buffer counter_buffer { uint counters[]; };
layout(std430, binding = BIND_VOLUME_PARTS) readonly buffer part_buffer { uvec2 parts[]; };
uniform uvec2 u_size_px;    // of the window
uniform uint u_edge_count;

// ---- where it is seen ----

// Homogeneous, in the box of all pixels with points: from (0, 0) to (1, 1).
const int OUTLINE_MOST = 12;
vec3 outline[OUTLINE_MOST];
int outline_count = 0;
bool is_outline_sure = true; // rounding leaves it where it is

float largest(vec3 p)
{
    return max(abs(p.x), max(abs(p.y), abs(p.z)));
}

vec3 scaled(vec3 p)
{
    return p / max(largest(p), 1e-30);
}

// Leaves what is on the line's side where the product is not negative.
void cut_outline(vec3 line)
{
    vec3 kept[OUTLINE_MOST];
    int count = 0;
    for (int i = 0; i < outline_count; i++) {
        vec3 p = outline[i], q = outline[i + 1 < outline_count ? i + 1 : 0];
        float x = dot(line, p), y = dot(line, q);
        if (x >= 0.0 && count < OUTLINE_MOST)
            kept[count++] = p;
        if ((x >= 0.0) != (y >= 0.0) && count < OUTLINE_MOST) {
            vec3 between = mix(p, q, x / (x - y));
            is_outline_sure = is_outline_sure && largest(between) > 0.05;
            kept[count++] = scaled(between);
        }
    }
    is_outline_sure = is_outline_sure && count < OUTLINE_MOST; // a convex outline has eight corners
    outline = kept;
    outline_count = count;
}

void find_outline(vec4 corners[4], vec2 first, vec2 size, float border)
{
    outline_count = 4;
    is_outline_sure = true;
    for (int i = 0; i < 4; i++) {
        float h = height_of(corners[i]);
        vec2 pixel = (corners[i].xy - u_window.xy * h) / u_window.zw - vec2(u_window_first) * h;
        outline[i] = scaled(vec3((pixel - first * h) / size, h));
    }
    vec2 beside = border / size;
    cut_outline(vec3(1.0, 0.0, beside.x));
    cut_outline(vec3(-1.0, 0.0, 1.0 + beside.x));
    cut_outline(vec3(0.0, 1.0, beside.y));
    cut_outline(vec3(0.0, -1.0, 1.0 + beside.y));
    for (int i = 0; i < outline_count; i++) {
        is_outline_sure = is_outline_sure && outline[i].z > 0.2;
        outline[i].xy = first + size * outline[i].xy / outline[i].z;
    }
}

// From the vertex away from the light, at infinity.
vec4 away(vec4 a)
{
    return vec4(a.xyz * u_light.w - u_light.xyz, 0.0);
}

struct volume_quad { // a strip, in clip space
    vec2 corners[4];
    bool is_seen;
};

vec2 longest_side()
{
    vec2 longest = vec2(1.0, 0.0);
    float most = 0.0;
    for (int i = 0; i < outline_count; i++) {
        vec2 side = outline[i + 1 < outline_count ? i + 1 : 0].xy - outline[i].xy;
        float length_2 = dot(side, side);
        if (length_2 > most) {
            most = length_2;
            longest = side;
        }
    }
    return most > 1e-6 ? longest / sqrt(most) : vec2(1.0, 0.0);
}

// About the outline, along an axis: the least and the greatest of both coordinates.
vec4 extent_along(vec2 axis, float border)
{
    vec4 found = vec4(1e9, 1e9, -1e9, -1e9);
    for (int i = 0; i < outline_count; i++) {
        vec2 at = vec2(dot(outline[i].xy, axis), dot(outline[i].xy, vec2(-axis.y, axis.x)));
        found = vec4(min(found.xy, at), max(found.zw, at));
    }
    float beside = border * (abs(axis.x) + abs(axis.y));
    return found + vec4(-beside, -beside, beside, beside);
}

float area_of(vec4 extent)
{
    return (extent.z - extent.x) * (extent.w - extent.y);
}

// The lesser of two rectangles: along the outline's longest side, and along the window's sides. All
// pixels with points where rounding leaves the outline open.
volume_quad quad_about(vec4 corners[4])
{
    volume_quad quad;
    uvec2 first = ~uvec2(counters[VOLUME_FIRST_PIXEL], counters[VOLUME_FIRST_PIXEL + 1u]);
    uvec2 end = uvec2(counters[VOLUME_END_PIXEL], counters[VOLUME_END_PIXEL + 1u]);
    quad.is_seen = all(lessThan(first, end));
    if (!quad.is_seen)
        return quad;
    // positions are rounded, those of vertices on the device to a 256th of a pixel
    float border = uintBitsToFloat(counters[VOLUME_BORDER]) + 0.05;
    vec2 low = vec2(first), high = vec2(end), axis = vec2(1.0, 0.0);
    vec4 extent = vec4(low, high);
    bool is_near = border < max(high.x - low.x, high.y - low.y);
    if (is_near)
        find_outline(corners, low, high - low, border);
    if (is_near && is_outline_sure) {
        vec2 along = longest_side();
        vec4 straight = extent_along(vec2(1.0, 0.0), border), turned = extent_along(along, border);
        extent = vec4(max(straight.xy, low), min(straight.zw, high));
        quad.is_seen = outline_count > 0 && all(lessThan(extent.xy, extent.zw));
        if (area_of(turned) < area_of(extent)) {
            extent = turned;
            axis = along;
        }
    }
    for (int i = 0; i < 4; i++) {
        vec2 at = vec2(i % 2 == 0 ? extent.x : extent.z, i < 2 ? extent.y : extent.w);
        vec2 pixel = at.x * axis + at.y * vec2(-axis.y, axis.x);
        quad.corners[i] = 2.0 * pixel / vec2(u_size_px) - 1.0;
    }
    return quad;
}

// ---- faces ----

struct drawn_face {
    volume_face face;
    uint element, kind; // as fragments are told
    volume_quad quad;
    uint first, count; // of its quads, those of a patch
};

uint quads_of(volume_face f)
{
    ivec3 sum = abs(f.log2) + abs(f.stops);
    return uint(sum.x + sum.y + sum.z);
}

drawn_face drawn(volume_face f, uint element, uint kind, vec4 corners[4], vec4 third, uint first)
{
    drawn_face d;
    d.element = element;
    d.kind = kind;
    d.first = first;
    uint quads = quads_of(f);
    d.count = quads > first ? min(quads - first, VOLUME_PATCH_QUADS) : 0u;
    if (d.count > 0u)
        f.side = volume_side_of_eye(corners[0], corners[1], third);
    d.count = f.side != 0 ? d.count : 0u;
    if (d.count > 0u) {
        d.quad = quad_about(corners);
        d.count = d.quad.is_seen ? d.count : 0u;
    }
    d.face = f;
    return d;
}

drawn_face drawn_side(volume_face f, uint element, uint kind, uvec2 v, uint first)
{
    vec4 a = volume_vertex(v.x), b = volume_vertex(v.y);
    return drawn(f, element, kind, vec4[](a, b, away(b), away(a)), u_light, first);
}

// All patches of the first quads come first, then those of edges with more.
drawn_face drawn_edge(uint patch_at)
{
    uvec2 part = patch_at < u_edge_count ? uvec2(patch_at, 0u) : parts[patch_at - u_edge_count];
    return drawn_side(volume_side_behind(part.x), part.x, VOLUME_KIND_EDGE, edges[part.x].xy,
                      part.y * VOLUME_PATCH_QUADS);
}

// Behind a side of a triangle alone: that of its first two vertices, the outer ones, the last two;
// or the triangle. All in one way through the program, which compilers repeat for each call.
drawn_face drawn_face_of(uint triangle, uint at)
{
    bool is_cap = at == 3u;
    uvec3 v = triangles[triangle].xyz;
    vec4 a = volume_vertex(at == 2u ? v.y : v.x), c = volume_vertex(v.z);
    vec4 b = at == 0u || is_cap ? volume_vertex(v.y) : c;
    vec4 corners[4] = vec4[](a, b, is_cap ? c : away(b), is_cap ? c : away(a));
    return drawn(volume_cap(triangle, at == 1u ? -1 : 1), triangle, is_cap ? VOLUME_KIND_CAP : at,
                 corners, is_cap ? c : u_light, 0u);
}

drawn_face drawn_cap(uint triangle)
{
    uvec3 v = triangles[triangle].xyz;
    vec4 a = volume_vertex(v.x), b = volume_vertex(v.y), c = volume_vertex(v.z);
    return drawn(volume_cap(triangle, 1), triangle, VOLUME_KIND_CAP, vec4[](a, b, c, c), c, 0u);
}

uvec2 told_of(drawn_face d, uint quad)
{
    return uvec2(d.element, volume_told_at(d.face.log2, d.face.stops, quad) |
                                (d.face.side > 0 ? VOLUME_IS_BEFORE : 0u) |
                                d.kind << VOLUME_KIND_SHIFT);
}
