/* SPDX-License-Identifier: MIT */
/* Where lamps are seen, and how bright they glow. */
#include "renderer/scene/haze_glow.h"

#include <math.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/atmosphere.h"

/* What lamps are chosen for. */
struct sight {
    const struct view *view;
    const struct camera *camera;
    int side_px;
};

/* False: behind the eye, or too far outside for a column of the picture to be near. depth: of the
 * view [m]. */
static bool find_place(const struct sight *sight, const struct state_light *light, double place[2],
                       double *depth)
{
    const struct camera *camera = sight->camera;
    const double half[2] = {camera->half_width, camera->half_height};
    const double size_px[2] = {sight->view->width_px, sight->view->height_px};
    double seen[3], side = sight->side_px;
    camera_to_view(camera, light->position, seen);
    *depth = seen[2];
    if (!(seen[2] > 1e-6))
        return false;
    for (int i = 0; i < 2; i++) {
        double across = camera->is_orthographic ? seen[i] : seen[i] / seen[2];
        place[i] = 0.5 * (across / half[i] + 1) * size_px[i] / side;
        if (!(place[i] > -4 && place[i] < size_px[i] / side + 4))
            return false;
    }
    return true;
}

static double find_strength(const struct sight *sight, const struct state_light *light,
                            double depth)
{
    const struct view_atmosphere *air = &sight->view->atmosphere;
    const struct camera *camera = sight->camera;
    double way[3], sum = 0, apart = camera->is_orthographic ? 1 : depth;
    vec3_sub(light->position, camera->eye, way);
    double length = vec3_length(way);
    double lost = atmosphere_depth(air, camera->eye[1], length > 0 ? way[1] / length : 0, length);
    for (int k = 0; k < 3; k++)
        sum += (double)light->color[k] * (double)air->color[k];
    return sum * atmosphere_extinction(air, light->position[1]) * exp(-lost) / apart;
}

/* The strongest come first; what finds no room among them is left to the columns. */
static int insert(struct haze_glow glows[HAZE_GLOWS_MOST], int count, const struct haze_glow *glow)
{
    int at = count;
    while (at > 0 && glows[at - 1].strength < glow->strength)
        at--;
    if (at == HAZE_GLOWS_MOST)
        return count;
    count += count < HAZE_GLOWS_MOST;
    for (int i = count - 1; i > at; i--)
        glows[i] = glows[i - 1];
    glows[at] = *glow;
    return count;
}

int haze_glows_find(const struct view *view, const struct scene_state *state,
                    const struct camera *camera, int side_px,
                    struct haze_glow glows[HAZE_GLOWS_MOST])
{
    const struct sight sight = {view, camera, side_px};
    int count = 0;
    for (size_t i = 0; i < state->light_count; i++) {
        const struct state_light *light = &state->lights[i];
        struct haze_glow glow = {.light = (uint32_t)i};
        double depth;
        if (light->type == SCENE_LIGHT_DIRECTIONAL || state_light_is_area(light) ||
            !find_place(&sight, light, glow.place, &depth))
            continue;
        glow.strength = find_strength(&sight, light, depth);
        if (glow.strength > 0)
            count = insert(glows, count, &glow);
    }
    return count;
}
