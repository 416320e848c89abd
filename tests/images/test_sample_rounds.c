/* SPDX-License-Identifier: MIT */
/* Eight and sixteen samples of the rasteriser, in rounds of four: each sample shows what is at its
 * place, edges come nearer to their closed form, and all that has to do with no edge is as with
 * four samples. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/sample_pattern.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/half_plane.h"
#include "tests/support/image_checks.h"

enum { SIDE = 64, EDGES = 10 };

/* What covers the half plane. */
enum cover { COVER_OPAQUE, COVER_LAYER, COVER_CAP, COVERS };
static const char *const cover_names[COVERS] = {"opaque", "layer", "cap"};

/* An edge in pixels, y up, about the picture's middle. */
static struct half_plane edge_of(int index)
{
    double angle = 0.13 + index * 6.283185307179586 / EDGES;
    return (struct half_plane){.normal = {cos(angle), sin(angle)}, .offset = 0.37 * index - 1.6};
}

/* A prism in z from -1 to 1 whose section is a triangle with one side on the edge, in pixels. */
static void add_prism(struct glb_builder *builder, const struct half_plane *edge, int material)
{
    static const uint32_t indices[24] = {0, 1, 2, 5, 4, 3, 0, 3, 1, 1, 3, 4,
                                         1, 4, 2, 2, 4, 5, 2, 5, 0, 0, 5, 3};
    const double along[3] = {-300, 300, 0}, behind[3] = {0, 0, 600};
    float positions[6][3];
    for (int i = 0; i < 6; i++) {
        double depth = edge->offset - behind[i % 3];
        positions[i][0] = (float)(depth * edge->normal[0] - along[i % 3] * edge->normal[1]);
        positions[i][1] = (float)(depth * edge->normal[1] + along[i % 3] * edge->normal[0]);
        positions[i][2] = i < 3 ? 1 : -1;
    }
    int mesh = glb_builder_add_mesh(builder, "Prism",
                                    &(struct glb_primitive_desc){.material = material,
                                                                 .vertex_count = 6,
                                                                 .positions = positions[0],
                                                                 .indices = indices,
                                                                 .index_count = 24},
                                    1);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Prism", .mesh = mesh});
}

static void open_edge(struct rig_scene *rig, struct renderer *renderer, enum cover cover,
                      const struct half_plane *edge)
{
    struct closed_form_scene scene;
    struct error err = {0};
    struct glb_builder *builder = closed_form_begin(&scene, "Edge", 0);
    const struct glb_material_desc stuff = {.base_color = {1, 1, 1, cover == COVER_LAYER ? 0.5 : 1},
                                            .alpha_mode =
                                                cover == COVER_LAYER ? GLB_BLEND : GLB_OPAQUE,
                                            .is_unlit = true};
    add_prism(builder, edge, glb_builder_add_material(builder, &stuff));
    closed_form_end(&scene, builder);
    if (!rig_scene_from_glb(rig, renderer, "edge", scene.glb, scene.size_bytes, &err))
        fail_msg("%s", err.message);
    closed_form_scene_finish(&scene);
}

/* A pixel is as wide as one unit of the scene. */
static struct view edge_view(enum cover cover)
{
    static const double plane[1][4] = {{0, 0, -1, 0}};
    static const struct view_cut cut = {.has_cap = true};
    return (struct view){
        .width_px = SIDE,
        .height_px = SIDE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 9}, .ortho_height = SIDE},
        .has_environment = true, /* black, in place of default lights */
        .clip_planes = plane,
        .clip_plane_count = cover == COVER_CAP,
        .cuts = &cut,
        .quality = {.shadows = SHADOWS_MAP},
    };
}

/* Distances of a pixel's centre, y up. */
static void centre_of(int x, int y, double at[2])
{
    at[0] = x + 0.5 - SIDE / 2.0;
    at[1] = SIDE / 2.0 - y - 0.5;
}

struct coverage {
    double square;
    double most; /* errors against the closed form, of pixels at the edge */
    int pixels;
};

/* full: what the whole half plane shows. */
static void add_errors(const struct image *image, const struct half_plane *edge, double full,
                       struct coverage *sum)
{
    for (int i = 0; i < SIDE * SIDE; i++) {
        double at[2];
        centre_of(i % SIDE, i / SIDE, at);
        double share = half_plane_share(edge, at[0], at[1]);
        double off = (double)image_pixel_f32(image, i % SIDE, i / SIDE)[0] / full - share;
        if (share == 0 || share == 1) {
            assert_true(fabs(off) < 1e-4);
            continue;
        }
        sum->square += off * off;
        sum->most = fmax(sum->most, fabs(off));
        sum->pixels++;
    }
}

/* Each sample is lit if it lies in the half plane; those so near to the edge that vertices of f32,
 * snapped to 1/256 pixel, decide may show either. */
static void expect_samples(const struct image *image, const struct half_plane *edge, double full,
                           int samples)
{
    for (int i = 0; i < SIDE * SIDE; i++) {
        double at[2], place[2];
        int least = 0, most = 0;
        centre_of(i % SIDE, i / SIDE, at);
        for (int s = 0; s < samples; s++) {
            sample_pattern_place(samples, s, place);
            double away = half_plane_distance(edge, at[0] + place[0] - 0.5, at[1] + place[1] - 0.5);
            least += away < -1.0 / 128;
            most += away < 1.0 / 128;
        }
        double found = (double)image_pixel_f32(image, i % SIDE, i / SIDE)[0] / full * samples;
        if (!(found > least - 0.01 && found < most + 0.01 && fabs(found - round(found)) < 0.01))
            fail_msg("pixel %d,%d has %.4f of %d samples, expected %d to %d", i % SIDE, i / SIDE,
                     found, samples, least, most);
    }
}

static struct image shoot_edge(struct renderer *renderer, const struct rig_scene *rig,
                               struct view view, int samples, bool is_reference)
{
    view.quality.samples = samples;
    view.quality.reference = is_reference;
    view.quality.shadows = is_reference ? SHADOWS_RAYTRACED : view.quality.shadows;
    return shoot_color(renderer, rig, &view);
}

static double rms_of(const struct coverage *sum)
{
    return sqrt(sum->square / sum->pixels);
}

static void measure_cover(struct renderer *renderer, enum cover cover)
{
    static const int samples[] = {1, 4, 8, 16, 256};
    static const double most[] = {0.27, 0.1, 0.075, 0.057, 0.02};
    const double full = cover == COVER_LAYER ? 0.5 : 1;
    struct coverage sums[5] = {{.pixels = 0}};
    for (int e = 0; e < EDGES; e++) {
        struct half_plane edge = edge_of(e);
        struct rig_scene rig;
        open_edge(&rig, renderer, cover, &edge);
        for (int i = 0; i < 5; i++) {
            struct image image =
                shoot_edge(renderer, &rig, edge_view(cover), samples[i], samples[i] == 256);
            add_errors(&image, &edge, full, &sums[i]);
            if (i < 4)
                expect_samples(&image, &edge, full, samples[i]);
            image_finish(&image);
        }
        rig_scene_finish(&rig, renderer);
    }
    for (int i = 0; i < 5; i++) {
        print_message("%s, %d samples%s: RMS of coverage %.4f, most %.3f\n", cover_names[cover],
                      samples[i], i == 4 ? " of the reference" : "", rms_of(&sums[i]),
                      sums[i].most);
        assert_true(sums[i].pixels > EDGES * SIDE && rms_of(&sums[i]) < most[i]);
    }
}

static void edges_come_near_their_closed_form(void **state)
{
    for (int cover = 0; cover < COVERS; cover++)
        measure_cover(*state, (enum cover)cover);
}

/* So are those of the same samples one by one, where targets have no more. */
static void a_device_without_multisampling_shows_the_same_samples(void **unused)
{
    (void)unused;
    struct renderer *renderer = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .hooks.hides_multisampling = true});
    for (int cover = 0; cover < COVERS; cover++)
        for (int samples = 4; samples <= 16; samples *= 2) {
            struct half_plane edge = edge_of(cover + samples);
            struct rig_scene rig;
            struct frame frame;
            open_edge(&rig, renderer, (enum cover)cover, &edge);
            struct view view = edge_view((enum cover)cover);
            view.quality.samples = samples;
            shoot(renderer, &rig, &view, &frame);
            expect_samples(&frame.outputs[VIEW_OUTPUT_COLOR], &edge, cover == COVER_LAYER ? 0.5 : 1,
                           samples);
            assert_int_equal(frame.report.counts.rounds, samples);
            frame_finish(&frame);
            view.quality.samples = 0; /* its default */
            shoot(renderer, &rig, &view, &frame);
            assert_int_equal(frame.report.counts.rounds, 1);
            frame_finish(&frame);
            rig_scene_finish(&rig, renderer);
        }
    renderer_destroy(renderer);
}

/* ---- what is no edge ---- */

static struct view demo_view(int samples)
{
    return (struct view){
        .width_px = 160,
        .height_px = 90,
        .quality = {.shadows = SHADOWS_DEEP, .shadow_resolution = 256, .samples = samples}};
}

static void four_samples_keep_their_bits_after_sixteen(void **state)
{
    struct rig_scene demo;
    struct frame frames[5];
    static const int samples[5] = {4, 16, 4, 16, 8};
    rig_demo_open(&demo, *state, "demo", 64);
    for (int i = 0; i < 5; i++) {
        struct view view = demo_view(samples[i]);
        shoot(*state, &demo, &view, &frames[i]);
        assert_int_equal(frames[i].report.counts.rounds, samples[i] / 4);
        assert_int_equal(report_has_pass(&frames[i].report, "accumulate", NULL), samples[i] > 4);
        assert_int_equal(frames[i].report.counts.light_lists_built > 0,
                         samples[i] != samples[0] || i == 0 || i == 2);
        assert_true(i == 0 || report_has_reused(&frames[i].report, "shadow.deep"));
        assert_true(i == 0 || !report_has_pass(&frames[i].report, "shadow.deep", NULL));
    }
    assert_same_bits(&frames[0].outputs[VIEW_OUTPUT_COLOR], &frames[2].outputs[VIEW_OUTPUT_COLOR]);
    assert_same_bits(&frames[1].outputs[VIEW_OUTPUT_COLOR], &frames[3].outputs[VIEW_OUTPUT_COLOR]);
    save_picture(&frames[0].outputs[VIEW_OUTPUT_COLOR], "rounds_demo_4");
    save_picture(&frames[1].outputs[VIEW_OUTPUT_COLOR], "rounds_demo_16");
    for (int i = 0; i < 5; i++)
        frame_finish(&frames[i]);
    rig_scene_finish(&demo, *state);
}

/* Depths, normals and ids have one sample, where they have it with four. */
static void auxiliary_outputs_are_those_of_four_samples(void **state)
{
    struct rig_scene demo;
    struct frame frames[2];
    rig_demo_open(&demo, *state, "demo", 64);
    for (int i = 0; i < 2; i++) {
        struct view view = demo_view(i ? 16 : 4);
        view.outputs = (1u << VIEW_OUTPUT_COUNT) - 1;
        shoot(*state, &demo, &view, &frames[i]);
    }
    struct view alone = demo_view(16);
    struct image color = shoot_color(*state, &demo, &alone);
    assert_same_bits(&frames[1].outputs[VIEW_OUTPUT_COLOR], &color);
    for (int output = VIEW_OUTPUT_COLOR + 1; output < VIEW_OUTPUT_COUNT; output++)
        assert_same_bits(&frames[0].outputs[output], &frames[1].outputs[output]);
    image_finish(&color);
    frame_finish(&frames[0]);
    frame_finish(&frames[1]);
    rig_scene_finish(&demo, *state);
}

/* A picture in windows has no seam, and its memory is that of a window and its sums. */
static void windows_show_what_one_would(void **unused)
{
    (void)unused;
    struct renderer *ample = render_rig_create();
    struct rig_scene demo;
    struct frame frame;
    struct view view = demo_view(16);
    view.quality.shadows = SHADOWS_NONE;
    view.width_px = 640;
    view.height_px = 360;
    rig_demo_open(&demo, ample, "demo", 64);
    struct image whole = shoot_color(ample, &demo, &view);
    rig_scene_finish(&demo, ample);
    renderer_destroy(ample); /* a thread has one */
    struct renderer *tight = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .gpu_budget_bytes = 24 << 20});
    rig_demo_open(&demo, tight, "demo", 64);
    shoot(tight, &demo, &view, &frame);
    assert_true(report_has_warning(&frame.report, "windows"));
    assert_true(frame.report.resident_bytes <= 24 << 20);
    double share = image_share_differing(&frame.outputs[VIEW_OUTPUT_COLOR], &whole, 1e-3, 1);
    print_message("%.3f %% of the pixels differ between windows and one\n", 100 * share);
    assert_true(share < 1e-3);
    image_finish(&whole);
    frame_finish(&frame);
    rig_scene_finish(&demo, tight);
    renderer_destroy(tight);
}

/* Lists of lights stand for all rounds: linked ones, made for each, have the same lights. */
static void no_round_misses_a_light(void **state)
{
    struct closed_form_scene room;
    struct rig_scene rig;
    struct image images[2];
    room_scene_build(&(struct room_scene_desc){.light_count = 60, .seed = 7, .glass_spheres = 9},
                     &room);
    rig_scene_open(&rig, *state, "room", room.glb, room.size_bytes);
    for (int i = 0; i < 2; i++) {
        struct view view = {
            .width_px = 160,
            .height_px = 160,
            .camera = {.kind = VIEW_CAMERA_NODE, .node = "Room"},
            .quality = {.shadows = SHADOWS_NONE,
                        .samples = 16,
                        .light_lists = i ? VIEW_LIGHT_LISTS_LINKED : VIEW_LIGHT_LISTS_CLUSTERED}};
        images[i] = shoot_color(*state, &rig, &view);
    }
    assert_images_close(&images[0], &images[1], 1e-3, 1e-4);
    image_finish(&images[0]);
    image_finish(&images[1]);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&room);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(edges_come_near_their_closed_form),
        cmocka_unit_test(four_samples_keep_their_bits_after_sixteen),
        cmocka_unit_test(auxiliary_outputs_are_those_of_four_samples),
        cmocka_unit_test(no_round_misses_a_light),
    };
    const struct CMUnitTest alone[] = {
        cmocka_unit_test(a_device_without_multisampling_shows_the_same_samples),
        cmocka_unit_test(windows_show_what_one_would),
    };
    int failed = cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
    return failed ? failed : cmocka_run_group_tests(alone, NULL, NULL);
}
