// SPDX-License-Identifier: MIT
// The light at a node of a column that smoke there would send on towards the eye: of each listed
// light what arrives, through its shadow and all grids, by the phase function.
// Needs: those of lighting.glsl, IS_ORTHOGRAPHIC; LIGHT_LIST_CLUSTERED, GRID_COUNT;
// SMOKE_DEPTH_CHANNELS where the way through the grids is kept.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "window/view_ray.glsl"
#include "shading/atmosphere.glsl"
#include "shading/atmosphere_slices.glsl"
#include "shading/smoke_nodes.glsl"
#include "lights/density_grids.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_LIGHTS) readonly buffer light_buffer { light_record lights[]; };
layout(std430, binding = BIND_SMOKE_LIGHT) buffer smoke_buffer { vec4 nodes[]; };
#include "lights/light_list.glsl"
#include "lights/light_arriving.glsl"
#ifdef SMOKE_DEPTH_CHANNELS
#include "shading/smoke_depths.glsl"
#else
#include "lights/light_through_grids.glsl"
#endif
#include "shading/lit_points.glsl"
// Its points: nodes of columns.

const float PI = 3.14159265358979;
const int BRICKS_LOOKED_AT = 64; // a node that meets more counts as one in smoke

uint light_lookups = 0u;

// Whether some brick with smoke meets a box of the grid's voxels.
bool has_smoke(uint grid, vec3 low, vec3 high)
{
    uvec4 box = texelFetch(u_grid_records, int(grid * GRID_RECORD_TEXELS + 3u));
    ivec3 size = ivec3(box.xyz), last = max(size, ivec3(2)) - 2;
    if (any(lessThan(high, vec3(0.0))) || any(greaterThan(low, vec3(size))))
        return false;
    ivec3 first = clamp(ivec3(floor(low - 0.5)), ivec3(0), last) >> 3;
    ivec3 extent = (clamp(ivec3(floor(high - 0.5)), ivec3(0), last) >> 3) - first + 1;
    int count = extent.x * extent.y * extent.z;
    bool is_met = count > BRICKS_LOOKED_AT;
    ivec3 along = (last >> 3) + 1;
    for (int i = 0; i < count && !is_met; i++) {
        ivec3 b = first + ivec3(i % extent.x, i / extent.x % extent.y, i / (extent.x * extent.y));
        int at = int(box.w) + b.x + along.x * (b.y + along.y * b.z);
        is_met = texelFetch(u_grid_bricks, at).x != 0u;
    }
    return is_met;
}

// Bits: the grids that have smoke where the node is looked up.
uint grids_near(vec2 at, float node)
{
    vec3 corners[8];
    float near = smoke_node_depth(max(node - 1.0, 0.0));
    float far = smoke_node_depth(min(node + 1.0, u_smoke_nodes.w));
    for (int i = 0; i < 8; i++) {
        vec2 side = vec2(i & 1, i >> 1 & 1) * 2.0 - 1.0;
        corners[i] = view_position(at + side * u_atmosphere_side_px, i < 4 ? near : far);
    }
    uint found = 0u;
    for (uint g = 0u; g < uint(GRID_COUNT); g++) {
        vec4 x = grid_word(g, 0u), y = grid_word(g, 1u), z = grid_word(g, 2u);
        vec3 low = vec3(GRID_FAR), high = vec3(-GRID_FAR);
        for (int i = 0; i < 8; i++) {
            vec4 p = vec4(corners[i], 1.0);
            vec3 v = vec3(dot(x, p), dot(y, p), dot(z, p));
            low = min(low, v);
            high = max(high, v);
        }
        found |= has_smoke(g, low, high) ? 1u << g : 0u;
    }
    return found;
}

// Henyey and Greenstein 1941.
float phase(float g, float cosine)
{
    float d = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (4.0 * PI * d * sqrt(d));
}

// Of grids of several kinds: by what each scatters there; where none does, alike.
float grid_weights[GRID_COUNT];

void weigh_grids(vec3 p, uint near)
{
    for (uint g = 0u; g < uint(GRID_COUNT); g++) {
        grid_weights[g] = (near & 1u << g) != 0u ? 1e-6 : 0.0;
        if (GRID_COUNT == 1 || grid_weights[g] == 0.0)
            continue;
        grid_way w = grid_meet(g, p, vec3(0.0, 0.0, -1.0), vec2(0.0, GRID_FAR));
        if (w.begin > 0.0 || w.end <= 0.0)
            continue;
        grid_cell c = grid_cell_at(w, 0.0);
        vec3 scatters = grid_word(g, 4u).rgb * grid_word(g, 5u).rgb;
        if (c.values >= 0)
            grid_weights[g] += grid_mean(w, c, 0.0, 0.0) * (scatters.r + scatters.g + scatters.b);
    }
}

float mean_phase(float cosine)
{
    float sum = 0.0, all = 0.0;
    for (uint g = 0u; g < uint(GRID_COUNT); g++) {
        if (grid_weights[g] == 0.0)
            continue;
        sum += grid_weights[g] * phase(grid_word(g, 5u).w, cosine);
        all += grid_weights[g];
    }
    return sum / all;
}

#ifdef SMOKE_DEPTH_CHANNELS
smoke_place node_place = smoke_place(0, 0, 0, vec3(0.0)); // of the node at hand
#endif

vec3 sent_on(uint index, vec3 p, vec3 way)
{
    light_record r = lights[index];
    vec3 l;
    vec3 arriving = light_arriving(r, p, l);
    if (max(arriving.r, max(arriving.g, arriving.b)) <= 0.0)
        return vec3(0.0);
    arriving *= mean_phase(dot(l, way)); // -l goes on, -way goes to the eye
#ifdef HAS_SHADOWS
    if (r.shadow != NO_SHADOW) {
        arriving *= shadow_transmittance(r.shadow, p, vec3(0.0), vec2(0.0), NO_OBJECT);
        light_lookups++;
    }
#endif
#ifdef SMOKE_DEPTH_CHANNELS
    if (r.dims_in_grids != 0u)
        arriving *= smoke_place_lets_through(node_place, index);
#else
    if (max(arriving.r, max(arriving.g, arriving.b)) > 0.0)
        arriving *= light_through_grids(r, p);
#endif
    return arriving;
}

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x + u_first;
    if (i >= u_end)
        return;
    uint columns = u_atmosphere_grid.x * u_atmosphere_grid.y;
    uint column = i % columns;
    uvec2 place = uvec2(column % u_atmosphere_grid.x, column / u_atmosphere_grid.x);
    vec2 at = atmosphere_pixel(place);
    float node = float(i / columns), view_z = smoke_node_depth(node);
    uint near = grids_near(at, node);
    vec3 sum = vec3(0.0);
    if (near != 0u) {
        vec3 p = view_position(at, view_z);
        vec3 way = -view_direction(view_position(at, 1.0));
        uvec2 pixel = uvec2(clamp(ivec2(floor(at)), ivec2(0), ivec2(u_size_px) - 1));
        weigh_grids(p, near);
#ifdef SMOKE_DEPTH_CHANNELS
        node_place = smoke_place_of(p);
#endif
        light_cursor cursor = light_list_first(pixel, view_z);
#ifdef HAS_LIGHT_CHUNK
        light_list_chunk(cursor, u_light_chunk.x, u_light_chunk.y);
#endif
        uint index;
        while (light_list_next(cursor, index))
            sum += sent_on(index, p, way);
    }
    nodes[i] = vec4(IS_FIRST_PART ? sum : nodes[i].rgb + sum, 0.0);
#ifdef HAS_SHADOWS
    if (light_lookups > 0u)
        atomicAdd(statistics[STATISTICS_LOOKUPS + (column & 63u)], light_lookups * uint(u_taps));
#endif
}
