/* SPDX-License-Identifier: MIT */
/* Textures beyond their budget: levels come as views need them, images are those of a renderer that
 * holds all levels, what is withheld is said, and frames in motion wait for little. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "tests/support/image_checks.h"

enum {
    SIDE = 8,      /* panels, in rows and columns */
    TEXTURE = 512, /* px; 1.4 MiB with its levels */
    SMALL_TEXTURES = 200 << 10,
    TINY_TEXTURES = 20 << 10, /* levels are missing that pixels need, not only their bounds */
    MIB = 1 << 20,
};

/* GPUs choose a level in f32 by the size of the finest one that is there. Coarser levels of noise
 * differ more. */
static const double ROUNDING = 2e-4, ROUNDING_FAR = 4e-4, DARK = 0.05;

static const uint64_t budget = 12 * MIB; /* of 64 textures of 85 MiB together */

/* ---- the scene ---- */

static uint32_t next_random(uint32_t *seed)
{
    return (*seed = *seed * 1664525 + 1013904223) >> 24;
}

/* Noise of 8 px over a gradient, so that every level looks different. */
static void paint(uint8_t *pixels, int width, int height, uint32_t seed, bool is_leaf)
{
    uint8_t cells[64][64];
    for (int i = 0; i < 64 * 64; i++)
        cells[i / 64][i % 64] = (uint8_t)next_random(&seed);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            uint8_t *p = pixels + 4 * (y * width + x);
            uint8_t cell = cells[y / 8 % 64][x / 8 % 64];
            p[0] = (uint8_t)(cell / 2 + 100);
            p[1] = (uint8_t)(255 * x / width);
            p[2] = (uint8_t)(next_random(&seed) / 4 + 150 * y / height);
            p[3] = is_leaf && cell > 150 ? 0 : 255;
        }
}

static int add_texture(struct glb_builder *b, int width, int height, uint32_t seed, bool is_leaf)
{
    uint8_t *pixels = malloc(4ull * (size_t)width * (size_t)height);
    assert_non_null(pixels);
    paint(pixels, width, height, seed, is_leaf);
    int image = glb_builder_add_image(b, "panel", pixels, width, height);
    free(pixels);
    return glb_builder_add_texture(b, &(struct glb_texture_desc){.image = image});
}

/* A square metre that faces the sky. */
static int add_panel(struct glb_builder *b, int texture, bool is_leaf)
{
    static const float positions[] = {0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1};
    static const float normals[] = {0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0};
    static const float texcoords[] = {0, 0, 1, 0, 1, 1, 0, 1};
    static const uint32_t indices[] = {0, 2, 1, 0, 3, 2};
    int material = glb_builder_add_material(
        b, &(struct glb_material_desc){.name = is_leaf ? "leaf" : "panel",
                                       .roughness = 1,
                                       .is_double_sided = true,
                                       .alpha_mode = is_leaf ? GLB_MASK : GLB_OPAQUE,
                                       .base_color_texture = {.texture = texture}});
    return glb_builder_add_mesh(b, "panel",
                                &(struct glb_primitive_desc){.material = material,
                                                             .vertex_count = 4,
                                                             .positions = positions,
                                                             .normals = normals,
                                                             .texcoords = texcoords,
                                                             .indices = indices,
                                                             .index_count = 6},
                                1);
}

/* Panels of 1 m beside each other from the origin on, a leaf above them, and a lamp above that. */
static void *make_scene(int width, int height, uint32_t seed, size_t *size)
{
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("panels", &err);
    assert_non_null(b);
    for (int i = 0; i < SIDE * SIDE; i++) {
        int mesh =
            add_panel(b, add_texture(b, width, height, seed + (uint32_t)i + 1, false), false);
        glb_builder_add_node(b, &(struct glb_node_desc){
                                    .mesh = mesh, .translation = {i % SIDE, 0, -(i / SIDE) - 1}});
    }
    int leaf = add_panel(b, add_texture(b, width, height, 99, true), true);
    glb_builder_add_node(b, &(struct glb_node_desc){.mesh = leaf, .translation = {3, 0.5, -3}});
    struct glb_node_desc lamp = {
        .light = glb_builder_add_light(b, &(struct glb_light_desc){.type = GLB_LIGHT_SPOT,
                                                                   .intensity = 200,
                                                                   .outer_cone_deg = 60})};
    glb_node_look_at(&lamp, (double[3]){3.2, 4, -2.2}, (double[3]){3.5, 0, -2.5});
    glb_builder_add_node(b, &lamp);
    void *glb;
    if (!glb_builder_finish(b, &glb, size, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(b);
    return glb;
}

struct file { /* made once */
    void *glb;
    size_t size;
    uint32_t seed;
};

static void open_scene(struct rig_scene *rig, struct renderer *renderer, struct file *file,
                       int width, int height)
{
    if (!file->glb)
        file->glb = make_scene(width, height, file->seed, &file->size);
    rig_scene_open(rig, renderer, "panels", file->glb, file->size);
}

static struct renderer *open_renderer(uint64_t texture_budget, uint64_t upload)
{
    return render_rig_create_as(&(struct renderer_desc){.is_strict = true,
                                                        .texture_budget_bytes = texture_budget,
                                                        .texture_upload_bytes = upload,
                                                        .texture_upload_ms = 1000});
}

static struct view look(double x, double y, double z, double to_x, double to_z)
{
    return (struct view){
        .width_px = 160,
        .height_px = 120,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {x, y, z}, .target = {to_x, 0, to_z}},
        .quality = {.shadow_resolution = 256, .shadows = SHADOWS_MAP}};
}

enum { VIEWS = 5 };

/* Far, near and grazing, from above, through parallel rays. */
static struct view view_number(int i)
{
    static const double places[VIEWS][5] = {{4, 6, 6, 4, -4},
                                            {3.5, 1.2, -1.2, 3.5, -2.2},
                                            {1, 0.6, 1.5, 6, -6},
                                            {4, 12, -4, 4.01, -4.01},
                                            {4, 9, 2, 4, -4}};
    const double *p = places[i];
    struct view view = look(p[0], p[1], p[2], p[3], p[4]);
    if (i == 4)
        view.camera.ortho_height = 9;
    return view;
}

/* ---- what is promised ---- */

static void check_report(const struct report_textures *report, uint64_t most)
{
    assert_int_equal(report->budget_bytes, most);
    assert_true(report->resident_bytes <= most);
    assert_true(report->resident_bytes > 0 && report->wanted_bytes > 0);
}

/* Views with all levels, by a renderer of its own: a thread has one at a time. */
static void shoot_whole(struct file *file, const struct view *views, int count,
                        struct image *references)
{
    struct renderer *whole = open_renderer(0, 0);
    struct rig_scene rig;
    open_scene(&rig, whole, file, TEXTURE, TEXTURE);
    for (int i = 0; i < count; i++) {
        struct frame frame;
        shoot(whole, &rig, &views[i], &frame);
        if (views[i].quality.shadows == SHADOWS_MAP)
            assert_true(frame.report.textures.resident_bytes > 64ull * TEXTURE * TEXTURE * 4);
        references[i] = frame.outputs[VIEW_OUTPUT_COLOR];
        frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
        frame_finish(&frame);
    }
    rig_scene_finish(&rig, whole);
    renderer_destroy(whole);
}

static void levels_on_demand_show_what_all_levels_show(void **state)
{
    struct view views[VIEWS];
    struct image references[VIEWS], seen[VIEWS];
    for (int i = 0; i < VIEWS; i++)
        views[i] = view_number(i);
    shoot_whole(*state, views, VIEWS, references);
    struct renderer *little = open_renderer(budget, 0);
    struct rig_scene little_rig;
    open_scene(&little_rig, little, *state, TEXTURE, TEXTURE);
    for (int i = 0; i < VIEWS; i++) {
        struct frame frame;
        shoot(little, &little_rig, &views[i], &frame);
        check_report(&frame.report.textures, budget);
        assert_int_equal(frame.report.textures.level_bias, 0);
        assert_int_equal(frame.report.textures.pending_bytes, 0);
        assert_int_equal(frame.report.textures.coarse_count, 0);
        assert_images_close(&references[i], &frame.outputs[VIEW_OUTPUT_COLOR], DARK, ROUNDING);
        image_finish(&references[i]);
        seen[i] = frame.outputs[VIEW_OUTPUT_COLOR];
        frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
        frame_finish(&frame);
    }
    for (int i = VIEWS - 1; i >= 0; i--) { /* whatever else is resident by now */
        struct image again = shoot_color(little, &little_rig, &views[i]);
        assert_same_bits(&seen[i], &again);
        image_finish(&again);
        image_finish(&seen[i]);
    }
    rig_scene_finish(&little_rig, little);
    renderer_destroy(little);
}

/* 380 is halved twice; the third half is rounded. */
static void sides_that_are_no_powers_of_two_keep_their_levels(void **state)
{
    (void)state;
    struct file file = {0};
    struct view view = view_number(0);
    struct image pictures[2];
    for (int i = 0; i < 2; i++) {
        struct renderer *renderer = open_renderer(i ? budget : 0, 0);
        struct rig_scene rig;
        open_scene(&rig, renderer, &file, 600, 380);
        pictures[i] = shoot_color(renderer, &rig, &view);
        rig_scene_finish(&rig, renderer);
        renderer_destroy(renderer);
    }
    free(file.glb);
    assert_images_close(&pictures[0], &pictures[1], DARK, ROUNDING);
    image_finish(&pictures[0]);
    image_finish(&pictures[1]);
}

static bool has_warning(const struct frame_report *report, const char *text)
{
    for (int i = 0; i < report->warning_count; i++)
        if (strstr(report->warnings[i], text))
            return true;
    return false;
}

static void what_exceeds_the_budget_is_withheld_and_said(void **state)
{
    struct renderer *renderer = open_renderer(SMALL_TEXTURES, 0);
    struct rig_scene rig;
    open_scene(&rig, renderer, *state, TEXTURE, TEXTURE);
    struct view view = view_number(0), other = view_number(1);
    struct frame frame, again;
    shoot(renderer, &rig, &view, &frame);
    const struct report_textures *report = &frame.report.textures;
    check_report(report, SMALL_TEXTURES);
    assert_true(report->wanted_bytes > SMALL_TEXTURES);
    assert_int_in_range(report->level_bias, 1, 4);
    assert_true(report->coarse_count > 0);
    assert_true(has_warning(&frame.report, "level bias"));
    assert_true(report->resident_bytes > SMALL_TEXTURES * 3 / 4); /* what there is, is used */
    struct image elsewhere = shoot_color(renderer, &rig, &other);
    image_finish(&elsewhere);
    shoot(renderer, &rig, &view, &again);
    assert_same_bits(&frame.outputs[VIEW_OUTPUT_COLOR], &again.outputs[VIEW_OUTPUT_COLOR]);
    assert_int_equal(again.report.textures.level_bias, report->level_bias);
    frame_finish(&frame);
    frame_finish(&again);
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
}

/* The leaf's mask is read at its finest level, 1 MiB, whatever is withheld from the camera; where
 * it is hidden, pictures are the same. */
static void check_traced(struct renderer *little, const struct rig_scene *little_rig,
                         const struct image *unlimited, struct view *view)
{
    struct frame drawn, traced;
    uint64_t mask = view->node_override_count ? 0 : 4ull * TEXTURE * TEXTURE;
    view->quality = (struct view_quality){.shadows = SHADOWS_RAYTRACED_SHADOWS, .samples = 1};
    shoot(little, little_rig, view, &drawn);
    view->quality.shadows = SHADOWS_RAYTRACED;
    shoot(little, little_rig, view, &traced);
    const struct report_textures *a = &drawn.report.textures, *b = &traced.report.textures;
    assert_int_in_range(a->level_bias, 2, 5);
    assert_int_equal(b->level_bias, a->level_bias);
    assert_int_equal(b->coarse_count, a->coarse_count);
    assert_int_equal(b->budget_bytes, TINY_TEXTURES);
    assert_int_equal(b->wanted_bytes, a->wanted_bytes + mask);
    assert_true(b->resident_bytes > mask && b->resident_bytes <= TINY_TEXTURES + mask);
    assert_int_equal(b->pending_bytes + b->written_bytes, 0);
    assert_true(has_warning(&traced.report, "level bias"));
    double same = mean_error(&traced.outputs[VIEW_OUTPUT_COLOR], &drawn.outputs[VIEW_OUTPUT_COLOR]);
    double lost = mean_error(&traced.outputs[VIEW_OUTPUT_COLOR], unlimited);
    printf("MAE / mean %.4f against drawn, %.4f against all levels\n", same, lost);
    if (!mask)
        assert_true(same < 0.004 && lost > 3 * same);
    frame_finish(&drawn);
    frame_finish(&traced);
}

static void traced_pictures_are_withheld_the_same_levels(void **state)
{
    static const struct view_node_override hidden = {.node = "#64", .has_visible = true};
    struct view views[4];
    struct image unlimited[4];
    for (int i = 0; i < 4; i++) {
        views[i] = view_number(i / 2 * 3);
        views[i].nodes = &hidden;
        views[i].node_override_count = (size_t)(i % 2);
        views[i].quality = (struct view_quality){.shadows = SHADOWS_RAYTRACED, .samples = 1};
    }
    shoot_whole(*state, views, 4, unlimited);
    struct renderer *little = open_renderer(TINY_TEXTURES, 0);
    struct rig_scene little_rig;
    open_scene(&little_rig, little, *state, TEXTURE, TEXTURE);
    for (int i = 0; i < 4; i++) {
        check_traced(little, &little_rig, &unlimited[i], &views[i]);
        image_finish(&unlimited[i]);
    }
    struct view view = view_number(0);
    struct frame truth;
    view.quality = (struct view_quality){.reference = true, .samples = 1};
    shoot(little, &little_rig, &view, &truth); /* all in view, at the finest level */
    assert_int_equal(truth.report.textures.level_bias, 0);
    assert_true(truth.report.textures.wanted_bytes > 30ull * 4 * TEXTURE * TEXTURE);
    assert_int_equal(truth.report.textures.wanted_bytes % (4 * TEXTURE * TEXTURE), 0);
    frame_finish(&truth);
    rig_scene_finish(&little_rig, little);
    renderer_destroy(little);
}

static void a_budget_below_the_coarsest_levels_is_refused(void **state)
{
    (void)state;
    struct file file = {0};
    struct error err = {0};
    struct renderer *renderer = open_renderer(64, 0);
    struct rig_scene rig;
    struct frame frame;
    open_scene(&rig, renderer, &file, 16, 16);
    free(file.glb);
    struct view view = view_number(0);
    assert_false(renderer_render(renderer, "panels", &view, &frame, &err));
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err.message, "textures"));
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
}

/* Frames in motion: each writes no more than the limit, one call and the coarsest levels. */
static void frames_in_motion_begin_coarse_and_are_refined(void **state)
{
    enum { LIMIT = 512 << 10, FRAMES = 400 };
    struct renderer *renderer = open_renderer(budget, LIMIT);
    struct rig_scene rig;
    open_scene(&rig, renderer, *state, TEXTURE, TEXTURE);
    struct view view = view_number(1);
    view.quality.may_be_coarse = true;
    struct frame frame;
    uint64_t first_pending = 0;
    int frames = 0;
    for (bool is_done = false; !is_done; frames++) {
        assert_true(frames < FRAMES);
        shoot(renderer, &rig, &view, &frame);
        const struct report_textures *report = &frame.report.textures;
        check_report(report, budget);
        uint64_t begin = frames ? 0 : 65 * 1400;
        assert_true(report->written_bytes <= LIMIT + MIB + begin);
        assert_int_equal(has_warning(&frame.report, "to come"), report->pending_bytes > 0);
        assert_int_equal(report->coarse_count > 0, report->pending_bytes > 0);
        first_pending = frames ? first_pending : report->pending_bytes;
        is_done = !report->pending_bytes;
        if (!is_done)
            frame_finish(&frame);
    }
    assert_true(first_pending > LIMIT);
    assert_true(frames > 2);
    view.quality.may_be_coarse = false;
    struct image exact = shoot_color(renderer, &rig, &view);
    assert_same_bits(&exact, &frame.outputs[VIEW_OUTPUT_COLOR]);
    frame_finish(&frame);
    renderer_drop_structures(renderer, "panels");
    struct image anew = shoot_color(renderer, &rig, &view);
    assert_same_bits(&exact, &anew);
    image_finish(&exact);
    image_finish(&anew);
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
}

/* After coarse frames, also of other views, and over again. */
static void an_exact_frame_waits_for_its_levels(void **state)
{
    struct view views[VIEWS];
    struct image references[VIEWS];
    for (int i = 0; i < VIEWS; i++)
        views[i] = view_number((i + 1) % VIEWS);
    shoot_whole(*state, views, VIEWS, references);
    struct renderer *little = open_renderer(budget, 64 << 10);
    struct rig_scene little_rig;
    open_scene(&little_rig, little, *state, TEXTURE, TEXTURE);
    for (int i = 0; i < VIEWS; i++) {
        struct view coarse = view_number(i);
        struct image moving, found;
        coarse.quality.may_be_coarse = true;
        for (int k = 0; k < 3; k++) {
            moving = shoot_color(little, &little_rig, &coarse);
            image_finish(&moving);
        }
        found = shoot_color(little, &little_rig, &views[i]);
        assert_images_close(&references[i], &found, DARK, ROUNDING);
        image_finish(&found);
        image_finish(&references[i]);
    }
    rig_scene_finish(&little_rig, little);
    renderer_destroy(little);
}

/* However many bytes are allowed: a twentieth of a millisecond and a call more. */
static void frames_in_motion_stop_for_the_clock(void **state)
{
    enum { FRAMES = 2000, QUICK = 3 };
    static const double LIMIT_MS = 0.05;
    struct renderer *renderer =
        render_rig_create_as(&(struct renderer_desc){.is_strict = true,
                                                     .texture_budget_bytes = budget,
                                                     .texture_upload_bytes = 1 << 30,
                                                     .texture_upload_ms = LIMIT_MS});
    struct rig_scene rig;
    struct renderer_info info;
    open_scene(&rig, renderer, *state, TEXTURE, TEXTURE);
    renderer_get_info(renderer, &info);
    assert_true(info.upload_bytes_per_ms > 10000); /* 10 MB/s */
    struct view view = view_number(1);
    view.quality.may_be_coarse = true;
    int writing = 0, quick = 0;
    bool is_done = false;
    for (int frames = 0; !is_done; frames++) {
        struct frame frame;
        assert_true(frames < FRAMES);
        renderer_get_info(renderer, &info);
        shoot(renderer, &rig, &view, &frame);
        const struct report_textures *report = &frame.report.textures;
        assert_true((double)report->written_bytes <=
                    LIMIT_MS * (double)info.upload_bytes_per_ms + MIB);
        assert_true(report->upload_ms >= 0);
        writing += report->written_bytes > 0;
        quick += report->written_bytes > 0 && report->upload_ms < 200 * LIMIT_MS;
        is_done = !report->pending_bytes;
        frame_finish(&frame);
    }
    assert_true(writing > 1);
    assert_true(quick >= writing / QUICK); /* others may have the processors now and then */
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
}

/* The panels, and others as a part beside them. */
static struct view view_of_two(const struct view_part *part)
{
    struct view view = look(4, 13, 1, 4, 0);
    view.parts = part;
    view.part_count = 1;
    return view;
}

static void open_two(struct rig_scene rigs[2], struct renderer *renderer, struct file *first,
                     struct file *second)
{
    open_scene(&rigs[0], renderer, first, TEXTURE, TEXTURE);
    if (!second->glb)
        second->glb = make_scene(TEXTURE, TEXTURE, second->seed, &second->size);
    rig_scene_open(&rigs[1], renderer, "others", second->glb, second->size);
}

static void close_two(struct rig_scene rigs[2], struct renderer *renderer)
{
    rig_scene_finish(&rigs[1], renderer);
    rig_scene_finish(&rigs[0], renderer);
    renderer_destroy(renderer);
}

/* Each of the two fits the larger budget, but not both. */
static void parts_share_one_budget(void **state)
{
    static const uint64_t budgets[] = {110 * MIB, 12 * MIB};
    const struct view_part part = {.name = "beside",
                                   .scene_key = "others",
                                   .matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, SIDE, 1}};
    struct view alone = view_number(0), both = view_of_two(&part);
    struct file second = {.seed = 1000};
    struct rig_scene rigs[2];
    struct renderer *renderer = open_renderer(0, 0);
    open_two(rigs, renderer, *state, &second);
    struct image expected = shoot_color(renderer, &rigs[0], &both), with_room = {0};
    close_two(rigs, renderer);
    for (int i = 0; i < 2; i++) {
        struct frame first, found, again;
        renderer = open_renderer(budgets[i], 0);
        open_two(rigs, renderer, *state, &second);
        shoot(renderer, &rigs[0], &alone, &first);
        shoot(renderer, &rigs[0], &both, &found);
        shoot(renderer, &rigs[0], &alone, &again);
        check_report(&first.report.textures, budgets[i]);
        check_report(&found.report.textures, budgets[i]);
        check_report(&again.report.textures, budgets[i]);
        assert_int_equal(first.report.textures.wanted_bytes > 64ull * TEXTURE * TEXTURE * 4,
                         i == 0); /* all, or what the view can sample */
        assert_int_equal(found.report.textures.coarse_count, 0);
        assert_images_close(&expected, &found.outputs[VIEW_OUTPUT_COLOR], DARK, ROUNDING_FAR);
        assert_same_bits(&first.outputs[VIEW_OUTPUT_COLOR], &again.outputs[VIEW_OUTPUT_COLOR]);
        if (i == 0) /* on demand with much room and with little: the same levels */
            with_room = found.outputs[VIEW_OUTPUT_COLOR];
        else
            assert_same_bits(&with_room, &found.outputs[VIEW_OUTPUT_COLOR]);
        if (i == 0)
            found.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
        frame_finish(&first);
        frame_finish(&found);
        frame_finish(&again);
        close_two(rigs, renderer);
    }
    image_finish(&with_room);
    image_finish(&expected);
    free(second.glb);
}

static int setup(void **state)
{
    return (*state = calloc(1, sizeof(struct file))) ? 0 : -1;
}

static int teardown(void **state)
{
    struct file *file = *state;
    free(file->glb);
    free(file);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_on_demand_show_what_all_levels_show),
        cmocka_unit_test(sides_that_are_no_powers_of_two_keep_their_levels),
        cmocka_unit_test(what_exceeds_the_budget_is_withheld_and_said),
        cmocka_unit_test(traced_pictures_are_withheld_the_same_levels),
        cmocka_unit_test(a_budget_below_the_coarsest_levels_is_refused),
        cmocka_unit_test(frames_in_motion_begin_coarse_and_are_refined),
        cmocka_unit_test(an_exact_frame_waits_for_its_levels),
        cmocka_unit_test(frames_in_motion_stop_for_the_clock),
        cmocka_unit_test(parts_share_one_budget),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
