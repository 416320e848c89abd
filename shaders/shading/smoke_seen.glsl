// SPDX-License-Identifier: MIT
// What the camera sees of density grids and haze: the light that they scatter from the eye to a
// depth, and what they let through. The ray of a pixel is followed once, from one depth that is
// asked for to the next. Cells are summed up as in density_grids.glsl; the light in them is that of
// the nodes around (smoke_light.comp.glsl).
// Needs: atmosphere_seen.glsl for the haze, lights/density_grids.glsl; HAS_LIGHTS where
// lamps light the grids; HAS_GRID_BOXES: grids are seen as published (Lindbeck 2015, figure 3.7),
// by the back faces of their boxes, so that an opaque surface before it hides all of the grid.
// Provides: smoke_begin(vec2 at, float depth), smoke_follow(float view_z), and what it found:
// smoke_light, smoke_through.
#include "shading/smoke_nodes.glsl"
uniform vec3 u_smoke_ambient; // what a full albedo sends on of the light from all around [nt]
#ifdef HAS_LIGHTS
layout(binding = UNIT_SMOKE_LIGHT) uniform samplerBuffer u_smoke_light;
#endif

const float SMOKE_DARK = 2e-9; // nothing is seen through what lets less through

vec2 smoke_at;             // pixel
vec3 smoke_origin, smoke_way;
float smoke_per_depth;     // metres along the ray per metre of view depth
vec2 smoke_range;          // [m] along the ray: what clip planes leave of it
grid_way smoke_ways[GRID_COUNT];
float smoke_first, smoke_last; // [m]: where grids are met
float smoke_t;             // [m]: how far it has been followed
vec3 smoke_light, smoke_through;
vec3 smoke_haze_light, smoke_haze_through; // of the haze up to where it was added last
int smoke_cell;            // between the nodes whose light is at hand
vec3 smoke_near, smoke_far;

void smoke_restart()
{
    smoke_t = 0.0;
    smoke_light = vec3(0.0);
    smoke_through = vec3(1.0);
    smoke_haze_light = vec3(0.0);
    smoke_haze_through = vec3(1.0);
}

// depth: of the opaque surface there; 0: none.
void smoke_begin(vec2 at, float depth)
{
    smoke_at = at;
    smoke_origin = view_position(at, 0.0);
    smoke_way = view_position(at, 1.0) - smoke_origin;
    smoke_per_depth = length(smoke_way);
    smoke_way /= smoke_per_depth;
    smoke_range = grid_kept(smoke_origin, smoke_way, vec2(0.0, GRID_FAR), GRID_CUTS_ALL);
    smoke_first = GRID_FAR;
    smoke_last = 0.0;
    for (uint g = 0u; g < uint(GRID_COUNT); g++) {
        smoke_ways[g] = grid_meet(g, smoke_origin, smoke_way, smoke_range);
#ifdef HAS_GRID_BOXES
        if (depth > 0.0 && smoke_ways[g].end > view_depth(depth) * smoke_per_depth)
            smoke_ways[g].end = smoke_ways[g].begin;
#endif
        if (smoke_ways[g].begin < smoke_ways[g].end) {
            smoke_first = min(smoke_first, smoke_ways[g].begin);
            smoke_last = max(smoke_last, smoke_ways[g].end);
        }
    }
    smoke_cell = -1;
    smoke_near = smoke_far = vec3(0.0);
    smoke_restart();
}

#ifdef HAS_LIGHTS
// At a node, between the four columns around.
vec3 smoke_node(int node)
{
    vec2 place = (smoke_at + vec2(u_window_first)) / u_atmosphere_side_px - 0.5 -
                 vec2(u_atmosphere_first);
    ivec2 columns = ivec2(u_atmosphere_grid.xy);
    ivec2 low = clamp(ivec2(floor(place)), ivec2(0), columns - 2);
    vec2 f = clamp(place - vec2(low), 0.0, 1.0);
    int at = (node * columns.y + low.y) * columns.x + low.x;
    vec3 below = mix(texelFetch(u_smoke_light, at).rgb, texelFetch(u_smoke_light, at + 1).rgb, f.x);
    at += columns.x;
    vec3 above = mix(texelFetch(u_smoke_light, at).rgb, texelFetch(u_smoke_light, at + 1).rgb, f.x);
    return mix(below, above, f.y);
}
#endif

// The light at a place of the ray.
vec3 smoke_source(float place)
{
    vec3 source = u_smoke_ambient;
#ifdef HAS_LIGHTS
    int cell = min(int(place), int(u_smoke_nodes.w) - 1);
    if (cell != smoke_cell) {
        smoke_near = cell == smoke_cell + 1 && smoke_cell >= 0 ? smoke_far : smoke_node(cell);
        smoke_far = smoke_node(cell + 1);
        smoke_cell = cell;
    }
    source += mix(smoke_near, smoke_far, clamp(place - float(cell), 0.0, 1.0));
#endif
    return source;
}

// The haze up to a place, behind the smoke before it.
void smoke_add_haze(float t)
{
    if (u_atmosphere.x == 0.0)
        return;
    vec3 light = haze_look(smoke_at, t / smoke_per_depth).light;
    vec3 seen = sqrt(smoke_haze_through * smoke_through); // in the mean
    smoke_light += max(light - smoke_haze_light, 0.0) * seen;
    smoke_haze_light = light;
    smoke_haze_through = smoke_through;
}

// What the grids scatter between two places of the ray, in whose cells they are.
void smoke_cross(grid_cell cells[GRID_COUNT], float t, float next)
{
    vec3 depth = vec3(0.0), scatters = vec3(0.0);
    for (uint g = 0u; g < uint(GRID_COUNT); g++) {
        if (cells[g].values < 0)
            continue;
        float begin = smoke_ways[g].begin;
        float deep = grid_mean(smoke_ways[g], cells[g], t - begin, next - begin) * (next - t);
        vec3 sigma = grid_word(g, 4u).rgb * deep;
        depth += sigma;
        scatters += sigma * grid_word(g, 5u).rgb;
    }
    float middle = 0.5 * (t + next);
    vec3 sent = smoke_source(smoke_node_at(middle / smoke_per_depth)) * smoke_through;
    if (u_atmosphere.x > 0.0)
        sent *= atmosphere_transmittance(smoke_origin, smoke_origin + middle * smoke_way);
    for (int k = 0; k < 3; k++)
        if (depth[k] > 0.0)
            smoke_light[k] += sent[k] * scatters[k] / depth[k] * atmosphere_loss(depth[k]);
    smoke_through *= exp(-depth);
}

void smoke_follow(float view_z)
{
    float to = view_z * smoke_per_depth;
    if (to < smoke_t)
        smoke_restart();
    float end = min(to, smoke_last), t = max(smoke_t, smoke_first);
    int haze_cell = -1;
    if (t < end && smoke_t < smoke_first)
        smoke_add_haze(t);
    while (t < end) {
        grid_cell cells[GRID_COUNT];
        float next = end;
        bool is_in = false;
        for (uint g = 0u; g < uint(GRID_COUNT); g++) {
            grid_way w = smoke_ways[g];
            cells[g].values = -1;
            if (t + w.ahead < w.begin) {
                next = w.begin < w.end ? min(next, w.begin) : next;
            } else if (t < w.end) {
                cells[g] = grid_cell_at(w, t - w.begin);
                next = min(next, min(w.begin + cells[g].end, w.end));
                is_in = is_in || cells[g].values >= 0;
            }
        }
        next = max(next, t + 1e-6 * end); // rounding may hold it where it is: it goes on
        if (is_in)
            smoke_cross(cells, t, min(next, end));
        t = next;
        int cell = int(smoke_node_at(t / smoke_per_depth));
        if (u_atmosphere.x > 0.0 && cell != haze_cell) {
            smoke_add_haze(min(t, end));
            haze_cell = cell;
        }
        if (max(smoke_through.r, max(smoke_through.g, smoke_through.b)) < SMOKE_DARK)
            t = end;
    }
    smoke_t = max(smoke_t, to);
    smoke_add_haze(to);
}
