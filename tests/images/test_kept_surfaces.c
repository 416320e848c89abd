/* SPDX-License-Identifier: MIT */
/* What a window keeps for the next frame: drawn again when its own inputs changed, else not, and
 * the image is the same as if all had been drawn. Counters tell, not clocks. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"

enum { FRAMES_MAX = 16 };

/* One renderer at work. Every series of frames is run twice: by one that keeps, counted, and by one
 * that draws all again, whose bits must be the same. */
struct series {
    struct renderer *renderer;
    struct rig_scene rig;
    bool redraws;
    uint64_t hashes[FRAMES_MAX]; /* of the colors so far */
    int count;
};

static void series_begin(struct series *series, bool redraws)
{
    series->redraws = redraws;
    series->count = 0;
    series->renderer = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .hooks.redraws_surfaces = redraws});
    rig_demo_open(&series->rig, series->renderer, "demo", 64);
}

static void run(void (*frames)(struct series *series))
{
    struct series series = {0};
    for (int i = 0; i < 2; i++) {
        series_begin(&series, i);
        frames(&series);
        rig_scene_finish(&series.rig, series.renderer);
        renderer_destroy(series.renderer);
    }
}

struct expected { /* to be kept */
    bool gbuffer, lists, state;
};

static const struct expected none = {false, false, false};
static const struct expected all = {true, true, true};

static void check(struct series *series, const struct view *view, struct expected kept)
{
    struct frame frame;
    shoot(series->renderer, &series->rig, view, &frame);
    const struct frame_report *report = &frame.report;
    uint64_t hash = image_hash(&frame.outputs[VIEW_OUTPUT_COLOR]);
    bool has_gbuffer = kept.gbuffer && !series->redraws, has_lists = kept.lists && !series->redraws;
    assert_int_equal(report->counts.gbuffers_reused, has_gbuffer);
    assert_int_equal(report->counts.gbuffers_drawn, !has_gbuffer);
    assert_int_equal(report->counts.pixel_lists_reused, has_lists);
    assert_int_equal(report->counts.pixel_lists_built, !has_lists);
    assert_int_equal(report->counts.states_reused, kept.state);
    assert_int_equal(report->counts.draws == 0, has_gbuffer && has_lists);
    assert_true(report->counts.transparent_fragments > 0 || series->count > 2);
    assert_true(series->count < FRAMES_MAX);
    if (series->redraws)
        assert_true(series->hashes[series->count] == hash);
    series->hashes[series->count++] = hash;
    frame_finish(&frame);
}

static struct view small_view(void)
{
    return (struct view){.width_px = 96, .height_px = 64, .quality = {.shadow_resolution = 64}};
}

static void rest(struct series *series)
{
    struct view view = small_view();
    check(series, &view, none);
    check(series, &view, all);
    view.outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_NODE; /* of the same samples */
    check(series, &view, all);
}

static void a_view_at_rest_draws_nothing_again(void **state)
{
    (void)state;
    run(rest);
}

static void edit_lights(struct series *series)
{
    struct view view = small_view();
    struct view_light lamp = {
        .type = SCENE_LIGHT_POINT, .position = {0, 2, 1}, .color = {1, 1, 1}, .intensity = 80};
    const struct expected seen = {true, true, false};
    check(series, &view, none);
    view.lights = &lamp;
    view.light_count = 1;
    check(series, &view, seen);
    lamp.intensity = 20;
    check(series, &view, seen);
    view.has_environment = true;
    view.sky[2] = 0.5f;
    check(series, &view, seen);
    view.background[0] = 0.5f;
    view.background[3] = 1;
    check(series, &view, all);
    view.quality.shadow_resolution = 128;
    check(series, &view, all);
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS; /* asks of the same surfaces by rays */
    check(series, &view, all);
    lamp.position[0] = 0.5;
    check(series, &view, seen);
}

static void an_edit_of_light_alone_keeps_what_is_seen(void **state)
{
    (void)state;
    run(edit_lights);
}

/* Maps are looked up above smooth surfaces, rays find that place by themselves. */
static void turn_to_maps(struct series *series)
{
    struct view view = small_view();
    const struct expected stood = {false, false, true};
    struct renderer_info info;
    renderer_get_info(series->renderer, &info);
    /* rays ask for the exact sizes of lists, which other devices only guessed for the map */
    const struct expected sized = {true, info.is_software, true};
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    check(series, &view, none);
    view.quality.shadows = SHADOWS_DEEP;
    check(series, &view, stood);
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    check(series, &view, sized);
    view.quality.shadows = SHADOWS_MAP;
    check(series, &view, all);
}

static void surfaces_drawn_for_rays_are_drawn_anew_for_maps(void **state)
{
    (void)state;
    run(turn_to_maps);
}

static void look_at_lists(const struct series *series, const struct view *view, bool is_kept)
{
    struct frame frame;
    shoot(series->renderer, &series->rig, view, &frame);
    bool keeps = is_kept && !series->redraws;
    assert_int_equal(frame.report.counts.light_lists_reused, keeps);
    assert_int_equal(frame.report.counts.light_lists_built, !keeps);
    assert_true(frame.report.counts.light_list_entries > 0);
    assert_int_equal(report_has_pass(&frame.report, "light_list", NULL), !keeps);
    frame_finish(&frame);
}

/* Built anew for what moves lights or the camera, and not for colours. Both forms alike. */
static void edit_lists(struct series *series)
{
    for (int form = VIEW_LIGHT_LISTS_CLUSTERED; form <= VIEW_LIGHT_LISTS_LINKED; form++) {
        struct view view = small_view();
        struct view_light lamps[2] = {{.type = SCENE_LIGHT_POINT,
                                       .position = {0, 2, 1},
                                       .color = {1, 1, 1},
                                       .intensity = 80,
                                       .range = 3},
                                      {.type = SCENE_LIGHT_SPOT,
                                       .position = {0, 3, 1},
                                       .direction = {0, -1, 0},
                                       .color = {1, 1, 1},
                                       .intensity = 80,
                                       .range = 4}};
        view.lights = lamps;
        view.light_count = 2;
        view.quality.light_lists = form;
        look_at_lists(series, &view, false);
        look_at_lists(series, &view, true);
        lamps[0].intensity = 8;
        lamps[1].color[0] = 0.5f;
        look_at_lists(series, &view, true);
        lamps[0].range = 2;
        look_at_lists(series, &view, false);
        lamps[1].outer_cone_deg = 30;
        look_at_lists(series, &view, false);
        lamps[1].direction[0] = 0.1;
        look_at_lists(series, &view, false);
        view.camera = (struct view_camera){.kind = VIEW_CAMERA_FIT, .fit = VIEW_FIT_TOP};
        look_at_lists(series, &view, false);
        view.width_px = 80;
        look_at_lists(series, &view, false);
        view.light_count = 1;
        look_at_lists(series, &view, false);
        look_at_lists(series, &view, true);
        renderer_drop_structures(series->renderer, series->rig.key);
        look_at_lists(series, &view, false);
    }
}

static void light_lists_stand_while_camera_and_reach_do(void **state)
{
    (void)state;
    run(edit_lists);
}

/* The lists that were kept are those that would be built. */
static void lit_by_kept_lists(struct series *series)
{
    struct view view = small_view();
    struct view_light lamp = {.type = SCENE_LIGHT_POINT,
                              .position = {0, 2, 1},
                              .color = {1, 1, 1},
                              .intensity = 80,
                              .range = 3};
    view.lights = &lamp;
    view.light_count = 1;
    for (int form = VIEW_LIGHT_LISTS_CLUSTERED; form <= VIEW_LIGHT_LISTS_LINKED; form++) {
        view.quality.light_lists = form;
        for (int i = 0; i < 3; i++) {
            struct frame frame;
            lamp.intensity = 20 * (float)(i + 1);
            shoot(series->renderer, &series->rig, &view, &frame);
            uint64_t hash = image_hash(&frame.outputs[VIEW_OUTPUT_COLOR]);
            assert_int_equal(frame.report.counts.light_lists_reused, i > 0 && !series->redraws);
            if (series->redraws)
                assert_true(series->hashes[series->count] == hash);
            series->hashes[series->count++] = hash;
            frame_finish(&frame);
        }
    }
}

static void kept_light_lists_give_the_same_bits(void **state)
{
    (void)state;
    run(lit_by_kept_lists);
}

static void edit_material(struct series *series)
{
    const struct scene *scene = &series->rig.imported.scene;
    struct view view = small_view();
    struct view_material_override edit = {0};
    view.materials = &edit;
    view.material_override_count = 1;
    char name[16] = "";
    for (uint32_t i = 0; i < scene->material_count; i++) /* an opaque one */
        if (material_class(&scene->materials[i]) == STATE_OPAQUE)
            snprintf(name, sizeof name, "#%u", i);
    assert_true(name[0]);
    edit.material = name;
    check(series, &view, none);
    edit.has_ior = true;
    edit.ior = 1.2f; /* read when shading */
    check(series, &view, (struct expected){true, false, false});
    edit.has_roughness = true;
    edit.roughness = 0.9f;
    check(series, &view, none);
    edit.has_base_color = true;
    edit.base_color[1] = 0.9f;
    edit.base_color[3] = 1;
    check(series, &view, none);
    edit.has_transmission = true; /* from here on it is a layer */
    edit.transmission = 0.5f;
    check(series, &view, none);
    check(series, &view, all);
}

static void an_edit_of_a_material_draws_what_shows_it(void **state)
{
    (void)state;
    run(edit_material);
}

static void move(struct series *series)
{
    struct view view = small_view();
    check(series, &view, none);
    view.camera.fov_y_deg = 30;
    check(series, &view, (struct expected){false, false, true});
    view.camera.ortho_height = 5;
    check(series, &view, (struct expected){false, false, true});
    const double plane[1][4] = {{1, 0, 0, 0}};
    view.clip_planes = plane;
    view.clip_plane_count = 1;
    check(series, &view, (struct expected){false, false, true});
    view.quality.samples = 1;
    check(series, &view, (struct expected){false, false, true});
    view.width_px--;
    check(series, &view, (struct expected){false, false, true});
    const struct scene *scene = &series->rig.imported.scene;
    char name[16] = "";
    for (uint32_t i = 0; i < scene->node_count && !name[0]; i++)
        if (scene->nodes[i].mesh >= 0)
            snprintf(name, sizeof name, "#%u", i);
    struct view_node_override hidden = {.node = name, .has_visible = true};
    view.nodes = &hidden;
    view.node_override_count = 1;
    check(series, &view, none);
    check(series, &view, all);
    renderer_drop_structures(series->renderer, series->rig.key);
    check(series, &view, none);
}

static void what_moves_is_drawn(void **state)
{
    (void)state;
    run(move);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_lists_stand_while_camera_and_reach_do),
        cmocka_unit_test(kept_light_lists_give_the_same_bits),
        cmocka_unit_test(a_view_at_rest_draws_nothing_again),
        cmocka_unit_test(an_edit_of_light_alone_keeps_what_is_seen),
        cmocka_unit_test(surfaces_drawn_for_rays_are_drawn_anew_for_maps),
        cmocka_unit_test(an_edit_of_a_material_draws_what_shows_it),
        cmocka_unit_test(what_moves_is_drawn),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
