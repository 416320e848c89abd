/* SPDX-License-Identifier: MIT */
/* Lights against the planes of the camera's frustum, and against what it shows. */
#include "renderer/lights/light_reach.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/frustum.h"

enum { TESTS_MAX = 1 << 18 }; /* of a light against a box: half a millisecond */

/* Outside when the whole bound lies behind one side plane; the planes pass through the eye, or lie
 * beside it where the camera is orthographic. */
static bool meets_frustum(const struct light_bound *bound, const struct camera *camera)
{
    const double half[2] = {camera->half_width, camera->half_height};
    for (int axis = 0; axis < 2; axis++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            double inward[3] = {0, 0, 0}, offset = 0;
            inward[axis] = sign;
            if (camera->is_orthographic) {
                offset = half[axis];
            } else {
                double length = hypot(1, half[axis]);
                inward[axis] /= length;
                inward[2] = half[axis] / length;
            }
            if (light_bound_support(bound, inward) + offset < 0)
                return false;
        }
    }
    return true;
}

static bool reserve(struct light_reach *reach, size_t lights, size_t boxes, struct error *err)
{
    if (lights > reach->capacity) {
        bool *grown = realloc(reach->is_in_view, lights * sizeof *grown);
        if (!grown)
            return error_set(err, ERROR_NO_MEMORY, "reach of %zu lights", lights);
        reach->is_in_view = grown;
        reach->capacity = lights;
    }
    if (boxes > reach->box_capacity) {
        struct light_reach_box *grown = realloc(reach->boxes, boxes * sizeof *grown);
        if (!grown)
            return error_set(err, ERROR_NO_MEMORY, "reach to %zu drawables", boxes);
        reach->boxes = grown;
        reach->box_capacity = boxes;
    }
    reach->light_count = lights;
    return true;
}

/* Adds the item's box to the last one, or as a new one. */
static void add_box(struct light_reach *reach, const struct state_item *item, const double eye[3],
                    bool is_new)
{
    double center[3];
    vec3_sub(item->center, eye, center);
    double margin = FRUSTUM_MARGIN * (item->radius_m + vec3_length(center));
    if (is_new)
        reach->boxes[reach->box_count++] = (struct light_reach_box){
            {INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    struct light_reach_box *box = &reach->boxes[reach->box_count - 1];
    for (int k = 0; k < 3; k++) {
        box->low[k] = fmin(box->low[k], item->bounds_min[k] - eye[k] - margin);
        box->high[k] = fmax(box->high[k], item->bounds_max[k] - eye[k] + margin);
    }
}

static void add_grids(struct light_reach *reach, const struct scene_state *state,
                      const double eye[3])
{
    for (size_t i = 0; i < state->grid_count; i++) {
        const struct state_grid *grid = &state->grids[i];
        struct light_reach_box *box = &reach->boxes[reach->box_count++];
        for (int k = 0; k < 3; k++) {
            double low = grid->bounds_min[k] - eye[k], high = grid->bounds_max[k] - eye[k];
            double margin = FRUSTUM_MARGIN * (high - low + fabs(low) + fabs(high));
            box->low[k] = low - margin;
            box->high[k] = high + margin;
        }
    }
}

/* As many boxes as may be tested for each light; more drawables than these share some. Density
 * grids have one each. */
static void collect_boxes(struct light_reach *reach, const struct scene_state *state,
                          const struct camera *camera)
{
    const struct camera_window whole = {0};
    struct frustum frustum;
    size_t most = TESTS_MAX / (state->light_count + 1) + 1;
    size_t per_box = state->item_count / most + 1, in_box = per_box;
    frustum_init(&frustum, camera, &whole);
    reach->box_count = 0;
    for (size_t i = 0; i < state->item_count; i++) {
        if (!frustum_meets(&frustum, &state->items[i]))
            continue;
        in_box = in_box == per_box ? 1 : in_box + 1;
        add_box(reach, &state->items[i], camera->eye, in_box == 1);
    }
    add_grids(reach, state, camera->eye);
}

/* Whether the bound's own box, in the world's axes, meets that of a drawable. */
static bool meets_drawables(const struct light_reach *reach, const struct light_bound *bound,
                            const struct camera *camera)
{
    double low[3], high[3];
    for (int k = 0; k < 3; k++) {
        const double up[3] = {camera->right[k], camera->up[k], -camera->back[k]};
        const double down[3] = {-up[0], -up[1], -up[2]};
        high[k] = light_bound_support(bound, up);
        low[k] = -light_bound_support(bound, down);
    }
    for (size_t i = 0; i < reach->box_count; i++) {
        const struct light_reach_box *box = &reach->boxes[i];
        bool meets = true;
        for (int k = 0; k < 3; k++)
            meets = meets && low[k] <= box->high[k] && high[k] >= box->low[k];
        if (meets)
            return true;
    }
    return false;
}

bool light_reach_collect(struct light_reach *reach, const struct scene_state *state,
                         const struct camera *camera, struct error *err)
{
    size_t lights = state->light_count;
    reach->light_count = reach->unseen_count = 0;
    if (!reserve(reach, lights, lights ? state->item_count + state->grid_count : 0, err) ||
        !light_bounds_collect(&reach->bounds, state->lights, lights, camera, err))
        return false;
    if (!lights)
        return true;
    collect_boxes(reach, state, camera);
    memset(reach->is_in_view, 0, lights * sizeof *reach->is_in_view);
    for (size_t i = 0; i < reach->bounds.global_count; i++)
        reach->is_in_view[reach->bounds.global[i]] = reach->box_count > 0;
    for (size_t i = 0; i < reach->bounds.count; i++) {
        const struct light_bound *bound = &reach->bounds.items[i];
        reach->is_in_view[bound->light] =
            meets_frustum(bound, camera) && meets_drawables(reach, bound, camera);
    }
    for (size_t i = 0; i < lights; i++)
        reach->unseen_count += !reach->is_in_view[i];
    return true;
}

void light_reach_finish(struct light_reach *reach)
{
    free(reach->is_in_view);
    free(reach->boxes);
    light_bounds_finish(&reach->bounds);
    *reach = (struct light_reach){0};
}
