// SPDX-License-Identifier: MIT
// What is left of a light at each point: the triangles of the point's cell are rasterised onto the
// light's samples (Wang et al. 2014, section 3.2), opaque ones into a bit of each, transparent ones
// into the sum of the logarithms of what they let through, which is the same in any order.
// Needs: GROUPS, of four samples each: 1 or 4; optionally HAS_FILTERS, HAS_PLANES, IS_PARALLEL, and
// HAS_AREA_SAMPLES, without which the light has one sample, in its middle. Nothing but the walk of
// the cell is a loop: each step of one counts (renderer/shading/loop_steps.h).
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "base/pack.glsl"
#include "shadows/area_triangle.glsl"
#include "lights/light_area.glsl"
layout(local_size_x = 64) in;

layout(std430, binding = BIND_TRACED_POINTS) readonly buffer point_buffer {
    shadow_point points[];
};
layout(std430, binding = BIND_AREA_STARTS) readonly buffer start_buffer { area_start starts[]; };
layout(std430, binding = BIND_AREA_PLACES) readonly buffer place_buffer { uvec2 places[]; };
layout(std430, binding = BIND_AREA_FIRSTS) readonly buffer first_buffer { uint firsts[]; };
layout(std430, binding = BIND_AREA_PAIRS) readonly buffer pair_buffer { uint pairs[]; };
layout(std430, binding = BIND_AREA_FILTERS) writeonly buffer filter_buffer { uvec2 filters[]; };

uniform uint u_points, u_width;
uniform uvec2 u_cells;
uniform uint u_light, u_samples, u_first_sample; // of the light, and of this pass
uniform vec3 u_center, u_toward;                 // unit, of parallel light: against it
uniform vec3 u_facing; // along the light, of one that shines to one side; else 0
uniform vec3 u_half_u, u_half_v;
uniform uint u_is_disk;
uniform uvec2 u_origin; // as u_area_origin
uniform vec3 u_right, u_up, u_back, u_eye;
uniform float u_pixel, u_size_m, u_nudge_m, u_is_orthographic;
#ifdef HAS_PLANES
uniform vec4 u_plane[8]; // cut casters: what remains is where dot(xyz, position) + w >= 0
#endif

const float LEAP_MAX = 20.0;  // renderer/raytrace/rt_shadow_rays.c, with all that follows
const float EPSILON = 2e-5;   // relative: "strictly nearer"

struct sample_group {
    vec4 x, y, z;         // from the start to the samples
    vec4 rest;            // how far the rays begin aside of the start, along its normal
    vec4 least, most;     // of a hit, in units of the way
    uvec4 is_open;        // 0: nothing is to be found there, or it is blocked
#ifdef HAS_FILTERS
    uvec4 r, g, b; // sums of logarithms
#endif
};

vec3 start_point = vec3(0.0), start_normal = vec3(0.0);
bool has_rest = false;
uint excluded = 0u; // a node, and one

vec3 sample_place(uint index, uint pixel)
{
#ifdef HAS_AREA_SAMPLES
    uvec2 place = uvec2(u_origin.x + pixel % u_width, u_origin.y - pixel / u_width);
    light_area area = light_area(u_half_u, u_half_v, u_is_disk != 0u,
                                 scatter_bits(light_area_seed(u_light, place) + 0x9e3779b9u));
    return u_center + light_area_offset(area, index);
#else
    return u_center;
#endif
}

struct viewed { // of the point, what all samples share
    vec3 normal; // for shading
    float offset, footprint;
    bool transmits;
    uint pixel;
};

void put_sample(inout sample_group g, uint lane, uint index, viewed v)
{
#ifdef IS_PARALLEL
    vec3 way = u_toward;
    float distance = 1.0, limit = u_size_m, far = 3e38;
#else
    vec3 way = sample_place(index, v.pixel) - start_point;
    float distance = length(way), limit = min(distance, u_size_m), far = distance;
#endif
    float inverse = 1.0 / max(distance, 1e-30), cosine = dot(start_normal, way) * inverse;
    float along = v.offset / max(abs(cosine), 1.0 / LEAP_MAX);
    float rest = v.offset - along * abs(cosine);
    rest = rest <= 1e-6 * v.offset ? 0.0 : cosine < 0.0 ? -rest : rest;
    bool faces_away = !v.transmits && dot(v.normal, way) * inverse < -1e-3 - v.footprint / far;
    bool arrives = dot(u_facing, u_facing) == 0.0 || dot(u_facing, way) < 0.0;
    g.x[lane] = way.x;
    g.y[lane] = way.y;
    g.z[lane] = way.z;
    g.rest[lane] = rest;
    g.least[lane] = (along + EPSILON * limit) * inverse;
#ifdef IS_PARALLEL
    g.most[lane] = u_size_m;
#else
    g.most[lane] = (distance - 8.0 * u_nudge_m) * inverse;
#endif
    g.is_open[lane] = index < u_samples && arrives && !faces_away ? 1u : 0u;
    has_rest = has_rest || rest != 0.0;
}

sample_group group_of(uint first, viewed v)
{
    sample_group g;
    g.x = g.y = g.z = g.rest = g.least = g.most = vec4(0.0);
    g.is_open = uvec4(0u);
#ifdef HAS_FILTERS
    g.r = g.g = g.b = uvec4(0u);
#endif
    put_sample(g, 0u, first, v);
    put_sample(g, 1u, first + 1u, v);
    put_sample(g, 2u, first + 2u, v);
    put_sample(g, 3u, first + 3u, v);
    return g;
}

vec4 along_ways(sample_group g, vec3 v)
{
    precise vec4 sum = g.x * v.x + g.y * v.y + g.z * v.z;
    return sum;
}

// For each sample, on which side of the edge's plane it lies, in the order of the triangle; e: out,
// how far.
uvec4 side_of(sample_group g, vec3 normal, vec3 way, uint turned, out vec4 e)
{
    e = along_ways(g, normal);
    if (has_rest) {
        precise vec4 moved = g.rest * along_ways(g, cross(way, start_normal));
        e += moved;
    }
    uvec4 side = uvec4(greaterThanEqual(e, vec4(0.0))) ^ uvec4(turned);
    e = turned != 0u ? -e : e;
    return side;
}

#ifdef HAS_PLANES
float height_over(uint plane, vec3 at)
{
    return dot(u_plane[plane].xyz, at) + u_plane[plane].w;
}

// 0 where what is met there was cut away.
uint keep_sample(sample_group g, vec4 t, uint lane)
{
    vec3 at = start_point + vec3(g.x[lane], g.y[lane], g.z[lane]) * t[lane] +
              start_normal * g.rest[lane];
    vec4 low = vec4(height_over(0u, at), height_over(1u, at), height_over(2u, at),
                    height_over(3u, at));
    vec4 high = vec4(height_over(4u, at), height_over(5u, at), height_over(6u, at),
                     height_over(7u, at));
    return any(lessThan(min(low, high), vec4(0.0))) ? 0u : 1u;
}
#endif

void block(inout sample_group g, area_edges edges, area_caster caster)
{
    vec4 e0, e1, e2;
    uvec4 sides = side_of(g, edges.normal[0], edges.way[0], edges.turned[0], e0) +
                  side_of(g, edges.normal[1], edges.way[1], edges.turned[1], e1) +
                  side_of(g, edges.normal[2], edges.way[2], edges.turned[2], e2);
    uvec4 met = g.is_open * (uvec4(equal(sides, uvec4(0u))) | uvec4(equal(sides, uvec4(3u))));
    if (met == uvec4(0u))
        return;
    vec4 total = e0 + e1 + e2, square = g.x * g.x + g.y * g.y + g.z * g.z;
    vec4 t = (e0 * along_ways(g, edges.corner[0]) + e1 * along_ways(g, edges.corner[1]) +
              e2 * along_ways(g, edges.corner[2])) / total;
    t = (t - g.rest * along_ways(g, start_normal)) / square;
    met *= uvec4(greaterThan(t, g.least)) * uvec4(lessThan(t, g.most)); // none of 0 / 0
#ifdef HAS_PLANES
    if ((caster.flags & AREA_CASTER_WHOLE) == 0u)
        met *= uvec4(keep_sample(g, t, 0u), keep_sample(g, t, 1u), keep_sample(g, t, 2u),
                     keep_sample(g, t, 3u));
#endif
    if ((caster.flags & AREA_CASTER_OPAQUE) != 0u) {
        g.is_open &= ~met;
#ifdef HAS_FILTERS
        g.r |= met * AREA_LOG_MOST;
        g.g |= met * AREA_LOG_MOST;
        g.b |= met * AREA_LOG_MOST;
    } else if (excluded == 0u || caster.flags >> AREA_CASTER_NODE != excluded) {
        g.r = min(g.r + met * caster.log_r, uvec4(AREA_LOG_MOST));
        g.g = min(g.g + met * caster.log_g, uvec4(AREA_LOG_MOST));
        g.b = min(g.b + met * caster.log_b, uvec4(AREA_LOG_MOST));
#endif
    }
}

// rt_shadow_pack of renderer/raytrace/rt_shadow_rays.c.
uvec2 pack_filter(vec3 passed)
{
    const int bits = TRACED_FILTER_BITS;
    float largest = max(passed.r, max(passed.g, passed.b));
    if (!(largest > 0.0))
        return uvec2(0u);
    int exponent;
    frexp(largest, exponent);
    if (roundEven(ldexp(largest, bits - exponent)) >= float(1 << bits))
        exponent++;
    int e = min(1 - exponent, TRACED_EXPONENT_MAX);
    uvec3 m = uvec3(roundEven(passed * exp2(float(bits - 1 + e))));
    return uvec2(m.r | m.g << bits, m.g >> (32 - bits) | m.b << (2 * bits - 32) |
                                        uint(e) << (3 * bits - 32));
}

void write(sample_group g, uvec4 was_open, uint first_sample, uint first)
{
    for (uint i = 0u; i < 4u; i++) {
        uint index = first_sample + i;
#ifdef HAS_FILTERS
        vec3 logs = vec3(g.r[i], g.g[i], g.b[i]) * (-1.0 / float(AREA_LOG_ONE));
        vec3 passed = vec3(g.r[i] == AREA_LOG_MOST ? 0.0 : exp2(logs.r),
                           g.g[i] == AREA_LOG_MOST ? 0.0 : exp2(logs.g),
                           g.b[i] == AREA_LOG_MOST ? 0.0 : exp2(logs.b));
#else
        vec3 passed = vec3(was_open[i] != 0u && g.is_open[i] == 0u ? 0.0 : 1.0);
#endif
        if (index < u_samples)
            filters[first + index] = pack_filter(passed);
    }
}

bool is_open(sample_group g[GROUPS])
{
#if GROUPS > 1
    return (g[0].is_open | g[1].is_open | g[2].is_open | g[3].is_open) != uvec4(0u);
#else
    return g[0].is_open != uvec4(0u);
#endif
}

void block_all(inout sample_group g[GROUPS], uint triangle)
{
    area_caster caster = casters[owners[triangle]];
    area_edges edges = area_edges_of(triangle, start_point);
    block(g[0], edges, caster);
#if GROUPS > 1
    block(g[1], edges, caster);
    block(g[2], edges, caster);
    block(g[3], edges, caster);
#endif
}

void main()
{
    uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                 gl_LocalInvocationIndex;
    if (index >= u_points)
        return;
    uvec2 place = places[index];
    uint relative = place.x - u_cells.x;
    bool is_placed = place.x != AREA_NOWHERE;
    if (place.y == AREA_NOWHERE || (is_placed ? relative >= u_cells.y : u_cells.x != 0u))
        return;
    area_start start = starts[index];
    shadow_point p = points[index];
    vec3 from_eye = start.origin_offset.xyz - u_eye, n = unpack_unit(p.normal);
    viewed v;
    v.normal = u_right * n.x + u_up * n.y + u_back * n.z;
    v.offset = start.origin_offset.w;
    v.footprint = u_is_orthographic > 0.0 ? u_pixel : u_pixel * -dot(from_eye, u_back);
    v.transmits = (p.flags & SHADOW_POINT_TRANSMITS) != 0u;
    v.pixel = p.pixel_roughness & ((1u << SHADOW_POINT_PIXEL_BITS) - 1u);
    start_point = start.origin_offset.xyz;
    start_normal = vec3(start.normal_x, start.normal_y, start.normal_z);
    has_rest = false;
    excluded = p.flags >> SHADOW_POINT_EXCLUDED_NODE;
    sample_group groups[GROUPS];
    uvec4 was_open[GROUPS];
    for (uint i = 0u; i < GROUPS; i++) {
        groups[i] = group_of(u_first_sample + 4u * i, v);
        was_open[i] = groups[i].is_open;
    }
    uint first = is_placed ? firsts[place.x] - firsts[u_cells.x] : 0u;
    uint count = is_placed ? firsts[place.x + 1u] - firsts[place.x] : 0u;
    for (uint i = 0u; i < count && is_open(groups); i++) {
        uint triangle = pairs[first + i];
        if (triangle != start.skip)
            block_all(groups, triangle);
    }
    for (uint i = 0u; i < GROUPS; i++)
        write(groups[i], was_open[i], u_first_sample + 4u * i, place.y);
}
