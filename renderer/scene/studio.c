/* SPDX-License-Identifier: MIT */
/* Which views the studio lights, and how much of its light comes from the key and from the map. */
#include "renderer/scene/studio.h"

/* From the upper left before the scene, out of the middle of the map's brightest box. Chosen by eye
 * over sample models: white that lies flat has the radiance 1.1, a third of it in its shadow. */
static const double key_direction[3] = {0.46, -0.76, -0.46};
static const float key_lx = 2.2f;
static const double map_intensity = 0.27;

static bool has_light(const struct scene *scene, const struct view *view)
{
    bool has_any = view->light_count > 0 || view->has_environment || view_has_environment(view);
    for (uint32_t i = 0; !has_any && !view->ignore_scene_lights && i < scene->node_count; i++)
        has_any = scene->nodes[i].light >= 0;
    return has_any;
}

enum view_studio studio_of(const struct scene *scene, const struct view *view)
{
    if (view->studio != VIEW_STUDIO_AUTO)
        return view->studio;
    bool is_dark_on_purpose = view->ignore_scene_lights;
    return is_dark_on_purpose || has_light(scene, view) ? VIEW_STUDIO_OFF : VIEW_STUDIO_BY_DEFAULT;
}

void studio_apply(const struct scene *scene, struct view *view)
{
    view->studio = studio_of(scene, view);
    if (view->studio == VIEW_STUDIO_OFF || view_has_environment(view))
        return;
    view->environment_key = VIEW_STUDIO_KEY;
    view->environment_rotation_deg = 0;
    view->environment_intensity = map_intensity;
    view->environment_is_background = false;
}

struct view_light studio_key_light(void)
{
    struct view_light key = {
        .type = SCENE_LIGHT_DIRECTIONAL, .color = {1, 1, 1}, .intensity = key_lx};
    for (int k = 0; k < 3; k++)
        key.direction[k] = key_direction[k];
    return key;
}
