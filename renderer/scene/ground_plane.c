/* SPDX-License-Identifier: MIT */
/* Where the ground plane lies, how far it reaches, and how its shadows end. */
#include "renderer/scene/ground_plane.h"

#include <math.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/state_caps.h"

/* Of the diagonal of the scene's bounding box. What lies on the floor of the box is seen before the
 * plane, and the gap is not. */
static const double BELOW = 1e-4;
/* A box under a lamp 20 degrees above the horizon throws its shadow 1.6 diagonals far. */
static const double REACH = 3;
/* Of the reach: up to here shadows are whole. */
static const double WHOLE = 0.5;

static void place(struct scene_state *state, const struct view_ground_plane *plane)
{
    struct state_ground_plane *ground = &state->ground_plane;
    double diagonal[3];
    vec3_sub(state->bounds_max, state->bounds_min, diagonal);
    const double size = fmax(vec3_length(diagonal), 1e-6 * state->unit_m);
    const double lowest = state->bounds_min[1];
    for (int k = 0; k < 3; k++)
        ground->center[k] = 0.5 * (state->bounds_min[k] + state->bounds_max[k]);
    ground->center[1] = plane->has_height ? plane->height_m : lowest - BELOW * size;
    ground->reach_m = REACH * size + fmax(lowest - ground->center[1], 0);
    ground->whole_m = WHOLE * ground->reach_m;
    ground->is_there = true;
}

/* White, dull, and without an interface: it sends on what arrives. */
static void fill_material(struct state_material *material)
{
    *material = (struct state_material){.catches_shadows = true};
    material->base = (struct scene_material){.base_color = {1, 1, 1, 1},
                                             .roughness = 1,
                                             .normal_scale = 1,
                                             .occlusion_strength = 1,
                                             .ior = 1,
                                             .specular = 1,
                                             .specular_color = {1, 1, 1},
                                             .edge_color = {1, 1, 1},
                                             .edge_exponent = 1};
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        material->base.textures[slot].texture = -1;
}

bool ground_plane_add(struct scene_state *state, const struct view *view, struct error *err)
{
    static const double up[3] = {0, 1, 0};
    static const double corners[6][2] = {{-1, -1}, {-1, 1}, {1, 1}, {-1, -1}, {1, 1}, {1, -1}};
    state->ground_plane = (struct state_ground_plane){0};
    if (!view->ground_plane.is_shown || !state->whole_count)
        return true;
    if (!state_caps_reserve(state, 6, err))
        return false;
    place(state, &view->ground_plane);
    const struct state_ground_plane *ground = &state->ground_plane;
    struct state_cap cap = state_caps_begin(state, ground->center);
    for (int i = 0; i < 6; i++) {
        const double local[3] = {corners[i][0] * ground->reach_m, 0,
                                 corners[i][1] * ground->reach_m};
        state_caps_add_vertex(&state->caps, &cap, local, up);
    }
    struct state_item item = {.node = state->items[0].node,
                              .primitive = state->items[0].primitive,
                              .material = state->material_count++,
                              .class_ = STATE_TRANSPARENT,
                              .is_ground = true};
    fill_material(&state->materials[item.material]);
    cap.source_material = state->items[0].material;
    state_caps_add_item(state, &cap, item);
    return true;
}

void ground_plane_filter(const struct scene_state *state, double distance_m,
                         const double arriving[3], const double unshadowed[3], double filter[3])
{
    const struct state_ground_plane *ground = &state->ground_plane;
    const double x = (distance_m - ground->whole_m) / (ground->reach_m - ground->whole_m);
    const double t = fmin(fmax(x, 0), 1);
    const double fading = t * t * (3 - 2 * t);
    for (int k = 0; k < 3; k++) {
        double share = unshadowed[k] > 0 ? fmin(arriving[k] / unshadowed[k], 1) : 1;
        filter[k] = share + (1 - share) * fading;
    }
}
