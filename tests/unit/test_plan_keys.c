/* SPDX-License-Identifier: MIT */
/* Keys of views: equal content gives equal keys wherever it lies, and every field counts. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/plan/view_key.h"

/* A view with one of everything, in memory of its own. */
struct full_view {
    struct view view;
    struct view_light light;
    struct view_node_override node;
    struct view_material_override material;
    struct view_grid_override grid;
    double planes[1][4];
    struct view_cut cuts[1];
    char node_name[8], material_name[8], grid_name[8], camera_name[8], variant[8];
    char environment_key[8];
};

static struct full_view *full_view_create(void)
{
    struct full_view *full = calloc(1, sizeof *full);
    assert_non_null(full);
    strcpy(full->node_name, "chair");
    strcpy(full->material_name, "glass");
    strcpy(full->camera_name, "front");
    strcpy(full->variant, "day");
    full->node.node = full->node_name;
    full->material.material = full->material_name;
    full->grid.grid = full->grid_name;
    strcpy(full->environment_key, "studio");
    full->planes[0][1] = 1;
    full->view = (struct view){
        .width_px = 64,
        .height_px = 32,
        .outputs = 1,
        .camera = {.kind = VIEW_CAMERA_NODE, .node = full->camera_name},
        .lights = &full->light,
        .light_count = 1,
        .nodes = &full->node,
        .node_override_count = 1,
        .materials = &full->material,
        .material_override_count = 1,
        .grids = &full->grid,
        .grid_override_count = 1,
        .clip_planes = (const double(*)[4])full->planes,
        .clip_plane_count = 1,
        .cuts = full->cuts,
        .variant = full->variant,
        .environment_key = full->environment_key,
        .environment_intensity = 1,
    };
    return full;
}

static struct content_key plan_key(const struct full_view *full)
{
    return view_plan_key(view_state_key("scene", &full->view), &full->view);
}

static void equal_views_have_equal_keys_wherever_they_lie(void **state)
{
    (void)state;
    struct full_view *a = full_view_create(), *b = full_view_create();
    assert_true(content_key_equals(plan_key(a), plan_key(b)));
    assert_true(content_key_is_set(plan_key(a)));
    free(a);
    free(b);
}

/* Changes one thing of the view; whether it is also one of the scene's state. */
#define CHANGES(name, statement)                \
    static void name(struct full_view *changed) \
    {                                           \
        statement;                              \
    }
CHANGES(change_light, changed->light.position[2] = 1)
CHANGES(change_node, changed->node.has_visible = true)
CHANGES(change_node_name, changed->node_name[0] = 'b')
CHANGES(change_material, changed->material.roughness = 0.5f)
CHANGES(change_material_name, changed->material_name[0] = 'b')
CHANGES(change_grid, changed->grid.density = 2)
CHANGES(change_grid_name, changed->grid_name[0] = 'b')
CHANGES(change_variant, changed->variant[0] = 'b')
CHANGES(change_sky, changed->view.sky[1] = 1)
CHANGES(change_default_lights, changed->view.ignore_scene_lights = true)
CHANGES(change_studio, changed->view.studio = VIEW_STUDIO_ON)
CHANGES(change_ground, changed->view.ground_plane.is_shown = true)
CHANGES(change_haze, changed->view.atmosphere.density_per_m = 1)
CHANGES(change_haze_phase, changed->view.atmosphere.anisotropy = 0.5)
CHANGES(change_depth, changed->view.wants_deep = true)
CHANGES(drop_light, changed->view.light_count = 0)
CHANGES(change_camera, changed->view.camera.fov_y_deg = 30)
CHANGES(change_camera_name, changed->camera_name[0] = 'b')
CHANGES(change_plane, changed->planes[0][3] = 2)
CHANGES(change_cut, changed->cuts[0].spares_shadows = true)
CHANGES(change_edges, changed->view.edges.is_drawn = true)
CHANGES(change_highlight, changed->view.highlight.node_count = 1)
CHANGES(change_size, changed->view.width_px++)
CHANGES(change_outputs, changed->view.outputs |= 2)
CHANGES(change_quality, changed->view.quality.shadow_taps = 9)

static void every_change_makes_another_key(void **state)
{
    (void)state;
    static const struct {
        void (*apply)(struct full_view *changed);
        bool is_of_state;
    } changes[] = {
        {change_light, true},    {change_node, true},           {change_node_name, true},
        {change_material, true}, {change_material_name, true},  {change_sky, true},
        {change_studio, true},   {change_default_lights, true}, {drop_light, true},
        {change_camera, false},  {change_camera_name, false},   {change_plane, false},
        {change_cut, false},     {change_edges, false},         {change_highlight, false},
        {change_size, false},    {change_outputs, false},       {change_quality, false},
        {change_grid, true},     {change_grid_name, true},      {change_variant, true},
        {change_ground, true},   {change_haze, false},          {change_haze_phase, false},
        {change_depth, false},
    };
    struct full_view *plain = full_view_create();
    for (size_t i = 0; i < sizeof changes / sizeof *changes; i++) {
        struct full_view *changed = full_view_create();
        changes[i].apply(changed);
        assert_false(content_key_equals(plan_key(plain), plan_key(changed)));
        bool is_equal = content_key_equals(view_state_key("scene", &plain->view),
                                           view_state_key("scene", &changed->view));
        assert_int_equal(is_equal, !changes[i].is_of_state);
        free(changed);
    }
    assert_false(content_key_equals(view_state_key("scene", &plain->view),
                                    view_state_key("other", &plain->view)));
    free(plain);
}

static void what_only_colours_pixels_shares_the_plan(void **state)
{
    (void)state;
    struct full_view *plain = full_view_create(), *changed = full_view_create();
    changed->view.background[0] = 1;
    changed->view.screen.channels = 4;
    assert_true(content_key_equals(plan_key(plain), plan_key(changed)));
    free(plain);
    free(changed);
}

/* A map is looked up in no state and no plan; but whether there is one decides about both. */
static void the_map_is_in_the_key_of_the_picture_alone(void **state)
{
    (void)state;
    struct full_view *plain = full_view_create();
    struct content_key state_key = view_state_key("scene", &plain->view);
    struct content_key key = view_picture_key(state_key, &plain->view);
    for (int i = 0; i < 4; i++) {
        struct full_view *changed = full_view_create();
        changed->environment_key[0] = i == 0 ? 'b' : 's';
        changed->view.environment_rotation_deg = i == 1;
        changed->view.environment_intensity = i == 2 ? 2 : 1;
        changed->view.environment_is_background = i == 3;
        assert_true(content_key_equals(view_state_key("scene", &changed->view), state_key));
        assert_true(content_key_equals(view_placement_key("scene", &changed->view),
                                       view_placement_key("scene", &plain->view)));
        assert_int_equal(content_key_equals(plan_key(changed), plan_key(plain)), i < 3);
        assert_false(content_key_equals(view_picture_key(state_key, &changed->view), key));
        free(changed);
    }
    struct full_view *none = full_view_create(), *empty = full_view_create();
    none->view.environment_key = NULL;
    empty->environment_key[0] = 0;
    assert_false(content_key_equals(view_state_key("scene", &none->view), state_key));
    assert_true(content_key_equals(plan_key(none), plan_key(empty)));
    free(none);
    free(empty);
    free(plain);
}

/* So that neither surfaces nor layers nor shadows are made again where it changes. */
static void haze_is_in_no_key_of_what_stands_in_it(void **state)
{
    (void)state;
    struct full_view *plain = full_view_create(), *hazy = full_view_create();
    hazy->view.atmosphere = (struct view_atmosphere){
        .density_per_m = 0.1, .color = {1, 0.5f, 0}, .anisotropy = 0.5, .falloff_m = 2};
    struct content_key state_key = view_state_key("scene", &plain->view);
    assert_true(content_key_equals(view_state_key("scene", &hazy->view), state_key));
    assert_true(content_key_equals(view_placement_key("scene", &hazy->view),
                                   view_placement_key("scene", &plain->view)));
    assert_true(content_key_equals(view_cut_key(&hazy->view), view_cut_key(&plain->view)));
    assert_false(content_key_equals(view_picture_key(state_key, &hazy->view),
                                    view_picture_key(state_key, &plain->view)));
    free(plain);
    free(hazy);
}

static void parts_of_a_key_do_not_run_together(void **state)
{
    (void)state;
    struct content_key a = content_key_begin(), b = a;
    content_key_add_text(&a, "ab");
    content_key_add_text(&a, "c");
    content_key_add_text(&b, "a");
    content_key_add_text(&b, "bc");
    assert_false(content_key_equals(a, b));
    a = b = content_key_begin();
    content_key_add_text(&a, NULL);
    content_key_add_text(&b, "");
    assert_false(content_key_equals(a, b));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equal_views_have_equal_keys_wherever_they_lie),
        cmocka_unit_test(every_change_makes_another_key),
        cmocka_unit_test(what_only_colours_pixels_shares_the_plan),
        cmocka_unit_test(the_map_is_in_the_key_of_the_picture_alone),
        cmocka_unit_test(haze_is_in_no_key_of_what_stands_in_it),
        cmocka_unit_test(parts_of_a_key_do_not_run_together),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
