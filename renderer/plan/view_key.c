/* SPDX-License-Identifier: MIT */
/* Keys of views. Whole structs are taken, with the texts that they point at in the place of the
 * pointers, so that a new field is part of the key from its first day. */
#include "renderer/plan/view_key.h"

static void add_nodes(struct content_key *key, const struct view *view)
{
    content_key_add(key, &view->node_override_count, sizeof view->node_override_count);
    for (size_t i = 0; i < view->node_override_count; i++) {
        struct view_node_override copy = view->nodes[i];
        content_key_add_text(key, copy.node);
        copy.node = NULL;
        content_key_add(key, &copy, sizeof copy);
    }
}

static void add_materials(struct content_key *key, const struct view *view)
{
    content_key_add(key, &view->material_override_count, sizeof view->material_override_count);
    for (size_t i = 0; i < view->material_override_count; i++) {
        struct view_material_override copy = view->materials[i];
        content_key_add_text(key, copy.material);
        copy.material = NULL;
        content_key_add(key, &copy, sizeof copy);
    }
}

static void add_grids(struct content_key *key, const struct view *view)
{
    content_key_add(key, &view->grid_override_count, sizeof view->grid_override_count);
    for (size_t i = 0; i < view->grid_override_count; i++) {
        struct view_grid_override copy = view->grids[i];
        content_key_add_text(key, copy.grid);
        copy.grid = NULL;
        content_key_add(key, &copy, sizeof copy);
    }
}

static void add_parts(struct content_key *key, const struct view *view)
{
    for (size_t i = 0; i < view->part_count; i++) {
        struct view_part copy = view->parts[i];
        content_key_add_text(key, copy.name);
        content_key_add_text(key, copy.scene_key);
        content_key_add_text(key, copy.parent);
        copy.name = copy.scene_key = copy.parent = NULL;
        content_key_add(key, &copy, sizeof copy);
    }
}

/* The view's own fields; its arrays are added to the key separately. */
static struct view without_pointers(const struct view *view)
{
    struct view copy = *view;
    copy.camera.node = NULL;
    copy.animation = NULL;
    copy.variant = NULL;
    copy.environment_key = NULL;
    copy.parts = NULL;
    copy.lights = NULL;
    copy.nodes = NULL;
    copy.materials = NULL;
    copy.grids = NULL;
    copy.clip_planes = NULL;
    copy.cuts = NULL;
    copy.highlight.nodes = NULL;
    copy.choice = NULL;
    return copy;
}

/* The part of the view that has to do with the scene and not with looking at it. */
static struct view scene_part(const struct view *view)
{
    struct view own = without_pointers(view);
    own.width_px = own.height_px = own.first_row_px = own.row_count_px = 0;
    own.tile = (struct view_tile){0};
    own.outputs = 0;
    own.camera = (struct view_camera){0};
    own.clip_plane_count = 0;
    own.highlight = (struct view_highlight){0};
    own.edges = (struct view_edges){0};
    own.screen = (struct view_screen){0};
    own.wants_deep = false;
    own.quality = (struct view_quality){0};
    own.environment_rotation_deg = own.environment_intensity = 0;
    own.environment_is_background = false;
    own.atmosphere = (struct view_atmosphere){0};
    for (int k = 0; k < 4; k++)
        own.background[k] = 0;
    return own;
}

struct content_key view_placement_key(const char *scene_key, const struct view *view)
{
    struct content_key key = content_key_begin();
    struct view own = scene_part(view);
    own.light_count = own.material_override_count = own.grid_override_count = 0;
    own.ignore_scene_lights = own.has_environment = false;
    own.studio = VIEW_STUDIO_AUTO;
    for (int k = 0; k < 3; k++)
        own.sky[k] = own.ground[k] = 0;
    content_key_add_text(&key, scene_key);
    content_key_add(&key, &own, sizeof own);
    content_key_add_text(&key, view->animation);
    content_key_add_text(&key, view->variant);
    add_parts(&key, view);
    add_nodes(&key, view);
    return key;
}

struct content_key view_state_key(const char *scene_key, const struct view *view)
{
    struct content_key key = content_key_begin();
    struct view own = scene_part(view);
    content_key_add_text(&key, scene_key);
    content_key_add(&key, &own, sizeof own);
    content_key_add_text(&key, view->animation);
    content_key_add_text(&key, view->variant);
    add_parts(&key, view);
    add_nodes(&key, view);
    add_materials(&key, view);
    add_grids(&key, view);
    content_key_add(&key, view->lights, view->light_count * sizeof *view->lights);
    content_key_add_word(&key, view_has_environment(view)); /* no default lights then */
    return key;
}

struct content_key view_cut_key(const struct view *view)
{
    struct content_key key = content_key_begin();
    content_key_add(&key, view->clip_planes, view->clip_plane_count * sizeof *view->clip_planes);
    for (size_t i = 0; i < view->clip_plane_count; i++) {
        struct view_cut cut = view->cuts ? view->cuts[i] : (struct view_cut){0};
        content_key_add(&key, &cut, sizeof cut);
    }
    return key;
}

struct content_key view_picture_key(struct content_key state_key, const struct view *view)
{
    struct content_key key = state_key;
    struct view own = without_pointers(view);
    own.highlight = (struct view_highlight){0};
    own.edges = (struct view_edges){0};
    own.screen.channels = 0; /* how it comes back, not what it is */
    content_key_add(&key, &own, sizeof own);
    content_key_add_text(&key, view->camera.node);
    content_key_add_text(&key, view_has_environment(view) ? view->environment_key : NULL);
    struct content_key cut = view_cut_key(view);
    content_key_add(&key, &cut, sizeof cut);
    return key;
}

struct content_key view_plan_key(struct content_key state_key, const struct view *view)
{
    struct content_key key = state_key;
    struct view own = without_pointers(view);
    for (int k = 0; k < 4; k++)
        own.background[k] = 0;        /* decides pixels, no pass */
    own.tile = (struct view_tile){0}; /* its passes are those of the whole */
    own.environment_rotation_deg = own.environment_intensity = 0;
    own.screen = (struct view_screen){/* what lamps add to haze is in the picture that is mapped */
                                      .has_backdrop =
                                          view_has_atmosphere(view) && view->screen.has_backdrop};
    own.quality.may_be_coarse = false;
    own.highlight = (struct view_highlight){.node_count = view->highlight.node_count > 0};
    own.edges = (struct view_edges){.is_drawn = view->edges.is_drawn}; /* how is not planned */
    content_key_add(&key, &own, sizeof own);
    content_key_add_text(&key, view->camera.node);
    struct content_key cut = view_cut_key(view);
    content_key_add(&key, &cut, sizeof cut);
    return key;
}
