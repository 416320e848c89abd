/* SPDX-License-Identifier: MIT */
/* Skins and morph targets in pictures: rasterised and traced ones agree in every pose, what frames
 * keep changes no bit, and picks, edges and sections are those of the pose. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/deformed_scene.h"
#include "tests/support/image_checks.h"

/* An opaque bar and one of glass, both bent by the joints of one skin and widened by the same
 * weights, the glass one by the skin's twin beside it, above a floor that is a flat bar without a
 * skin. A mast is higher than all of it, so that the bounds stand. Knee bends from 0 to 1 s and
 * back until 2 s. */
static const char document[] =
    "'extensionsUsed':['KHR_materials_transmission'],'scenes':[{'nodes':[0,1,3,4,5]}],'nodes':["
    "{'name':'Bar','mesh':0,'skin':0,'weights':[0.5],'translation':[9,9,9]},"
    "{'name':'Foot','children':[2]},{'name':'Knee','translation':[0,1,0]},"
    "{'name':'Pane','mesh':1,'skin':1},"
    "{'name':'Other foot','translation':[1,0,0.5],'children':[6]},"
    "{'name':'Floor','mesh':2,'translation':[0,-0.2,0],'scale':[12,0.1,12],'children':[7]},"
    "{'name':'Other knee','translation':[0,1,0],'scale':[1,0.5,1]},"
    "{'name':'Mast','mesh':2,'translation':[-0.2,0,-0.2],'scale':[0.01,22,0.01]}],"
    "'materials':[{'pbrMetallicRoughness':{'baseColorFactor':[0.8,0.6,0.4,1],'metallicFactor':0}},"
    "{'doubleSided':true,'pbrMetallicRoughness':{'baseColorFactor':[0.3,0.9,0.4,1],"
    "'metallicFactor':0},'extensions':{'KHR_materials_transmission':{'transmissionFactor':1}}}],"
    "'meshes':[{'primitives':[{'attributes':{" BAR_ATTRIBUTES
    "},'indices':4,'material':0,'targets':[{'POSITION':8}]}]},"
    "{'primitives':[{'attributes':{" BAR_ATTRIBUTES "},'indices':4,'material':1}]},"
    "{'primitives':[{'attributes':{'POSITION':0,'NORMAL':1},'indices':4,'material':0}]}],"
    "'skins':[{'joints':[1,2],'inverseBindMatrices':5},{'joints':[4,6],'inverseBindMatrices':5}],"
    "'animations':[{'channels':[{'sampler':0,'target':{'node':2,'path':'rotation'}},"
    "{'sampler':0,'target':{'node':6,'path':'rotation'}}],'samplers':[{'input':6,'output':7}]}]";

static const struct view_light lamp = {
    .type = SCENE_LIGHT_POINT, .position = {1.5, 4, 2}, .color = {1, 1, 1}, .intensity = 60};

static struct view make_view(double time_s, enum shadow_technique shadows)
{
    return (struct view){.width_px = 160,
                         .height_px = 120,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {0.5, 2.2, 4.5},
                                    .target = {0.2, 0.7, 0},
                                    .fov_y_deg = 45},
                         .lights = &lamp,
                         .light_count = 1,
                         .has_environment = true,
                         .sky = {0.2f, 0.2f, 0.2f},
                         .is_animated = time_s >= 0,
                         .animation_time_s = fmax(time_s, 0),
                         .quality = {.shadows = shadows, .samples = 4, .shadow_resolution = 512}};
}

static void open_scene(struct rig_scene *rig, struct renderer *renderer)
{
    struct bar bar;
    char json[16 << 10];
    bar_fill(&bar);
    bar_write_head(json, sizeof json);
    size_t length = strlen(json), size;
    snprintf(json + length, sizeof json - length, "%s}", document);
    void *glb = glb_make(json, &bar, sizeof bar, &size);
    rig_scene_open(rig, renderer, "deformed", glb, size);
    free(glb);
}

static void rasterised_and_traced_pictures_agree_in_every_pose(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_scene(&rig, renderer);
    for (int step = -1; step <= 4; step++) {
        struct view view = make_view(step < 0 ? -1 : 0.25 * step, SHADOWS_DEEP);
        view.quality.refraction = VIEW_REFRACTION_OFF; /* images_refraction compares it */
        char name[32];
        struct image drawn = shoot_color(renderer, &rig, &view);
        view.quality.shadows = SHADOWS_RAYTRACED;
        struct image traced = shoot_color(renderer, &rig, &view);
        view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
        struct image mixed = shoot_color(renderer, &rig, &view);
        double share = image_share_differing(&drawn, &traced, 0.1, 0.05);
        double of_mixed = image_share_differing(&mixed, &traced, 0.02, 0.02);
        print_message("step %d: %.4f of the pixels differ, %.4f with traced shadows\n", step, share,
                      of_mixed);
        snprintf(name, sizeof name, "deformed_%d_drawn", step);
        save_picture(&drawn, name);
        snprintf(name, sizeof name, "deformed_%d_traced", step);
        save_picture(&traced, name);
        assert_true(share < 0.03);    /* shadow edges by texels */
        assert_true(of_mixed < 0.02); /* silhouettes, of glass before others too */
        image_finish(&drawn);
        image_finish(&traced);
        image_finish(&mixed);
    }
    rig_scene_finish(&rig, renderer);
}

static const struct view_light panel = {.type = SCENE_LIGHT_RECT,
                                        .position = {1.5, 4, 2},
                                        .direction = {-0.4, -1, -0.5},
                                        .up = {0, 0, 1},
                                        .color = {1, 1, 1},
                                        .intensity = 60,
                                        .width_m = 0.6,
                                        .height_m = 0.4};

/* Shadows by the triangles of the pose, hard ones and soft ones, are those of rays from the same
 * points. Rays begin on the surface that the vertices describe, volumes on facets. */
static void triangles_of_every_pose_cast_the_shadows_of_rays(void **state)
{
    static const enum shadow_technique by_triangles[] = {SHADOWS_VOLUME, SHADOWS_SILHOUETTE,
                                                         SHADOWS_AREA, SHADOWS_AREA};
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_scene(&rig, renderer);
    for (int step = -1; step <= 6; step++)
        for (int t = 0; t < 4; t++) {
            struct view view = make_view(step < 0 ? -1 : 0.25 * step, SHADOWS_RAYTRACED_SHADOWS);
            struct frame frame;
            view.lights = t == 3 ? &panel : &lamp;
            struct image traced = shoot_color(renderer, &rig, &view);
            view.quality.shadows = SHADOWS_NONE;
            struct image open = shoot_color(renderer, &rig, &view);
            view.quality.shadows = by_triangles[t];
            shoot(renderer, &rig, &view, &frame);
            const struct image *drawn = &frame.outputs[VIEW_OUTPUT_COLOR];
            double share = image_share_differing(drawn, &traced, 1e-3, 0.05);
            double shadowed = image_share_differing(&open, &traced, 0.1, 0.05);
            print_message("step %d, %s: %.5f of the pixels differ, %.3f are in shadow\n", step,
                          shadow_technique_name((int)by_triangles[t]), share, shadowed);
            assert_false(report_has_pass(&frame.report, "shadow.trace", NULL));
            assert_true(shadowed > 0.03);
            assert_true(share < (by_triangles[t] == SHADOWS_AREA ? 1e-4 : 1.5e-3));
            save_picture(drawn, "deformed_by_triangles");
            save_picture(&traced, "deformed_by_rays");
            image_finish(&traced);
            image_finish(&open);
            frame_finish(&frame);
        }
    rig_scene_finish(&rig, renderer);
}

static const enum shadow_technique techniques[] = {
    SHADOWS_MAP,    SHADOWS_DEEP,       SHADOWS_DEEP_LINKED, SHADOWS_RAYTRACED,
    SHADOWS_VOLUME, SHADOWS_SILHOUETTE, SHADOWS_AREA,        SHADOWS_RAYTRACED_SHADOWS};

static void shoot_series(struct renderer *renderer, enum shadow_technique technique,
                         const double *times, int count, uint64_t *hashes)
{
    struct rig_scene rig;
    open_scene(&rig, renderer);
    for (int i = 0; i < count; i++) {
        struct view view = make_view(times[i], technique);
        struct image image = shoot_color(renderer, &rig, &view);
        hashes[i] = image_hash(&image);
        image_finish(&image);
    }
    rig_scene_finish(&rig, renderer);
}

/* There, back, and there again: each picture as if it had been drawn alone. */
static void what_frames_keep_changes_no_bit(void **state)
{
    static const double times[] = {0.25, 0.75, 0.25, 0.25, -1, 1.25, 0.25};
    enum { COUNT = sizeof times / sizeof *times };
    (void)state;
    for (size_t t = 0; t < sizeof techniques / sizeof *techniques; t++) {
        uint64_t kept[COUNT], alone[COUNT];
        struct renderer *renderer = render_rig_create();
        shoot_series(renderer, techniques[t], times, COUNT, kept);
        renderer_destroy(renderer);
        renderer = render_rig_create_as(
            &(struct renderer_desc){.is_strict = true, .hooks.redraws_surfaces = true});
        for (int i = 0; i < COUNT; i++) /* of a scene that was just opened */
            shoot_series(renderer, techniques[t], &times[i], 1, &alone[i]);
        renderer_destroy(renderer);
        assert_true(kept[0] == kept[2] && kept[0] == kept[3] && kept[0] == kept[6]);
        assert_true(kept[0] != kept[1] && kept[0] != kept[4]);
        for (int i = 0; i < COUNT; i++)
            if (kept[i] != alone[i])
                fail_msg("technique %zu, frame %d is another alone", t, i);
    }
}

/* A lamp that only the floor's far corner has in reach keeps its structure while the bars bend. */
static void lights_that_a_pose_does_not_reach_keep_their_shadows(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene rig;
    const struct view_light lamps[] = {lamp,
                                       {.type = SCENE_LIGHT_POINT,
                                        .position = {-2.5, 0.4, -2.5},
                                        .color = {1, 1, 1},
                                        .intensity = 4,
                                        .range = 1}};
    open_scene(&rig, renderer);
    for (int i = 0; i < 3; i++) {
        struct view view = make_view(0.25 + 0.25 * i, SHADOWS_DEEP);
        struct frame frame;
        view.lights = lamps;
        view.light_count = 2;
        shoot(renderer, &rig, &view, &frame);
        if (i) {
            assert_int_equal(frame.report.counts.shadow_maps_built, 1);
            assert_int_equal(frame.report.counts.shadow_maps_reused, 1);
        }
        frame_finish(&frame);
    }
    rig_scene_finish(&rig, renderer);
}

static uint32_t node_at(struct renderer *renderer, const struct rig_scene *rig, double time_s,
                        const double world[3])
{
    struct view view = make_view(time_s, SHADOWS_NONE);
    struct frame frame;
    view.quality.samples = 1;
    view.outputs = 1u << VIEW_OUTPUT_NODE;
    shoot(renderer, rig, &view, &frame);
    uint32_t id = image_id_at(&frame.outputs[VIEW_OUTPUT_NODE], &view, world);
    frame_finish(&frame);
    struct pick_result result;
    struct error err = {0};
    double pixel[2];
    assert_true(view_project(&view, world, pixel));
    struct pick_desc desc = {.x = floor(pixel[0]) + 0.5, .y = floor(pixel[1]) + 0.5};
    if (!renderer_pick(renderer, rig->key, &view, &desc, &result, &err))
        fail_msg("%s", err.message);
    uint32_t picked = result.layer_count ? result.layers[0].node + 1 : 0;
    pick_result_finish(&result);
    assert_int_equal(id, picked);
    return id;
}

static void picks_find_what_is_there_in_the_pose(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_scene(&rig, renderer);
    uint32_t bar = scene_node_id(&rig, "Bar");
    const double upright[3] = {0, 1.8, 0.25}, bent[3] = {-0.8, 1, 0.25};
    assert_int_equal(node_at(renderer, &rig, 0, upright), bar);
    assert_int_not_equal(node_at(renderer, &rig, 0, bent), bar);
    assert_int_equal(node_at(renderer, &rig, 1, bent), bar);
    assert_int_not_equal(node_at(renderer, &rig, 1, upright), bar);
    rig_scene_finish(&rig, renderer);
}

/* The plane z = 0 opens both bars; what closes the opaque one shows its front, in both forms. */
static void sections_close_the_pose(void **state)
{
    static const double plane[1][4] = {{0, 0, -1, 0}};
    static const struct view_cut cut = {.has_cap = true, .has_cap_color = true, .cap_color = {1}};
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_scene(&rig, renderer);
    struct view view = make_view(1, SHADOWS_DEEP);
    struct frame frame;
    view.clip_planes = plane;
    view.clip_plane_count = 1;
    view.cuts = &cut;
    view.edges = (struct view_edges){.is_drawn = true, .width_px = 1, .color = {0, 0, 1}};
    shoot(renderer, &rig, &view, &frame);
    save_picture(&frame.outputs[VIEW_OUTPUT_COLOR], "deformed_section");
    assert_false(report_has_warning(&frame.report, "not closed"));
    const float *cap =
        image_at(&frame.outputs[VIEW_OUTPUT_COLOR], &view, (const double[]){-0.6, 1, 0});
    assert_true(cap[0] > 0.02f && cap[1] < 0.3f * cap[0]);
    assert_true(frame.report.counts.feature_edges > 0);
    view.quality.shadows = SHADOWS_RAYTRACED;
    struct image traced = shoot_color(renderer, &rig, &view);
    assert_true(image_share_differing(&frame.outputs[VIEW_OUTPUT_COLOR], &traced, 0.1, 0.05) <
                0.05);
    image_finish(&traced);
    frame_finish(&frame);
    rig_scene_finish(&rig, renderer);
}

/* A camera that fits the scene has the whole bent bar in its picture. */
static void a_fit_is_that_of_the_pose(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_scene(&rig, renderer);
    for (int step = 0; step <= 2; step++) {
        const struct view_node_override hidden[] = {{.node = "Floor", .has_visible = true},
                                                    {.node = "Pane", .has_visible = true}};
        struct view view = make_view(0.5 * step, SHADOWS_NONE);
        struct frame frame;
        view.camera = (struct view_camera){.kind = VIEW_CAMERA_FIT};
        view.nodes = hidden;
        view.node_override_count = 2;
        view.quality.samples = 1;
        view.outputs = 1u << VIEW_OUTPUT_NODE;
        shoot(renderer, &rig, &view, &frame);
        const struct image *ids = &frame.outputs[VIEW_OUTPUT_NODE];
        const uint32_t *pixels = ids->pixels;
        size_t inside = image_count_id(ids, scene_node_id(&rig, "Bar")), border = 0;
        for (int y = 0; y < ids->height_px; y++)
            for (int x = 0; x < ids->width_px; x++)
                if (x == 0 || y == 0 || x == ids->width_px - 1 || y == ids->height_px - 1)
                    border += pixels[y * ids->width_px + x] != 0;
        assert_true(inside > 1000);
        assert_true(border == 0);
        frame_finish(&frame);
    }
    rig_scene_finish(&rig, renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(rasterised_and_traced_pictures_agree_in_every_pose,
                                        render_rig_setup, render_rig_teardown),
        cmocka_unit_test_setup_teardown(triangles_of_every_pose_cast_the_shadows_of_rays,
                                        render_rig_setup, render_rig_teardown),
        cmocka_unit_test(what_frames_keep_changes_no_bit),
        cmocka_unit_test_setup_teardown(lights_that_a_pose_does_not_reach_keep_their_shadows,
                                        render_rig_setup, render_rig_teardown),
        cmocka_unit_test_setup_teardown(picks_find_what_is_there_in_the_pose, render_rig_setup,
                                        render_rig_teardown),
        cmocka_unit_test_setup_teardown(sections_close_the_pose, render_rig_setup,
                                        render_rig_teardown),
        cmocka_unit_test_setup_teardown(a_fit_is_that_of_the_pose, render_rig_setup,
                                        render_rig_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
