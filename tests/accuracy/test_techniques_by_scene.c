/* SPDX-License-Identifier: MIT */
/* Every technique on every scene against the ray-traced reference: error and time for the report,
 * and the tolerances that docs/reference/accuracy.md promises ("Techniques by scene"). */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <cmocka.h>

#include "renderer/accuracy/difference_map.h"
#include "renderer/accuracy/flip.h"
#include "renderer/image/tone_map.h"
#include "tests/support/accuracy_log.h"
#include "tests/support/asset_checks.h"
#include "tests/support/closed_form_scenes.h"

enum { WIDTH_PX = 160, HEIGHT_PX = 120, REFERENCE_SAMPLES = 64, SMALL_MAP = 64, NAME_BYTES = 96 };

/* How a technique is asked. */
enum comparison {
    SAME_SAMPLES, /* one sample per pixel on both sides: the error of the shadows */
    PICTURES,     /* against REFERENCE_SAMPLES: that of the picture, antialiasing and all */
    STRAIGHT,     /* as SAME_SAMPLES without refraction: that of drawing what is transparent */
    COMPARISONS
};

/* What is in a scene decides what can be promised. */
enum content {
    PLAIN,       /* plain colours: only the edges of shadows and of things can differ */
    TEXTURED,    /* and textures, which the reference samples without mipmaps */
    AREA_LIGHT,  /* a rectangle of light: a map takes its centre alone */
    HAZE,        /* beams behind glass */
    SMOKE,       /* a density grid */
    STACK,       /* panes behind one another, lit without shadows: what drawing them leaves */
    INTERLOCKED, /* the same of panes that go through one another */
    CONTENTS
};

enum drawing {
    ANEW,       /* in a scene that has just come */
    IF_OPAQUE,  /* the same; of a technique that knows no transparent caster */
    KEEPS_MAPS, /* of the row before, which is of the same technique; so it is not timed */
};

struct technique {
    const char *name;
    enum comparison comparison;
    struct view_quality quality;
    /* Promised; 0: such a scene is not asked of the technique. */
    double flip[CONTENTS]; /* mean of HDR-FLIP */
    double mae[CONTENTS];  /* with the same samples: mean |d| over the reference's mean */
    enum drawing drawing;
};

#define MAP .shadows = SHADOWS_MAP
#define DEEP .shadows = SHADOWS_DEEP
#define LINKED .shadows = SHADOWS_DEEP_LINKED
#define TRANSLUCENT .shadows = SHADOWS_TRANSLUCENT
#define COMPOSITED .shadows = SHADOWS_COMPOSITED
#define MOMENTS .shadows = SHADOWS_MOMENTS
#define CHANCE .shadows = SHADOWS_STOCHASTIC
#define COLORED .shadows = SHADOWS_COLORED_STOCHASTIC
#define RAYS .shadows = SHADOWS_RAYTRACED_SHADOWS
#define TRACED .shadows = SHADOWS_RAYTRACED
#define AREA .shadows = SHADOWS_AREA
#define VOLUME .shadows = SHADOWS_VOLUME
#define SILHOUETTE .shadows = SHADOWS_SILHOUETTE

/* Mean of HDR-FLIP and MAE / mean of a stack, of what interlocks and of spheres. */
#define LAYERS_BY(name, method, stack_flip, stack_mae, locked_flip, locked_mae, spheres_flip,  \
                  spheres_mae)                                                                 \
    {                                                                                          \
        name, STRAIGHT,                                                                        \
            {DEEP, .transparency = TRANSPARENCY_##method, .samples = 1,                        \
             .refraction = VIEW_REFRACTION_OFF},                                               \
            {[STACK] = (stack_flip), [INTERLOCKED] = (locked_flip), [PLAIN] = (spheres_flip)}, \
            {[STACK] = (stack_mae), [INTERLOCKED] = (locked_mae), [PLAIN] = (spheres_mae)},    \
            KEEPS_MAPS                                                                         \
    }

static const struct technique techniques[] = {
    {"map", SAME_SAMPLES, {MAP, .samples = 1}, {0.001, 0.11}, {5e-4, 0.15}, IF_OPAQUE},
    {"deep",
     SAME_SAMPLES,
     {DEEP, .samples = 1},
     {0.025, 0.11, 0.4, 0.025, 0.02},
     {0.0075, 0.15, 0.55, 0.01, 0.0065},
     ANEW},
    {"deep, 1 tap",
     SAME_SAMPLES,
     {DEEP, .samples = 1, .shadow_taps = 1},
     {0.025, 0.11},
     {0.0055, 0.15},
     KEEPS_MAPS},
    {"deep, 16 taps",
     SAME_SAMPLES,
     {DEEP, .samples = 1, .shadow_taps = 16},
     {0.11, 0.12},
     {0.015, 0.15},
     KEEPS_MAPS},
    {"deep", PICTURES, {DEEP, .samples = 4}, {0.12, 0.13}, {0}, KEEPS_MAPS},
    {"deep, 1 sample", PICTURES, {DEEP, .samples = 1}, {0.12, 0.2}, {0}, KEEPS_MAPS},
    LAYERS_BY("lists", LISTS, 4e-4, 5e-5, 0.0014, 5e-4, 1e-4, 4e-5),
    LAYERS_BY("depth-peeling", DEPTH_PEELING, 4e-4, 5e-5, 0.0014, 5e-4, 1e-4, 4e-5),
    LAYERS_BY("dual-depth-peeling", DUAL_DEPTH_PEELING, 4e-4, 5e-5, 0.0014, 5e-4, 1e-4, 4e-5),
    LAYERS_BY("moment-based", MOMENT_BASED, 0.007, 0.005, 0.0032, 0.0021, 1e-4, 4e-5),
    LAYERS_BY("stochastic", STOCHASTIC, 0.018, 0.035, 0.016, 0.026, 4e-4, 8e-5),
    LAYERS_BY("sorted", SORTED, 4e-4, 5e-5, 0.019, 0.042, 1.5e-4, 6e-5),
    LAYERS_BY("weighted-blended", WEIGHTED_BLENDED, 0.11, 0.13, 0.12, 0.17, 0.0015, 2e-4),
    {"deep, 256 texels",
     SAME_SAMPLES,
     {DEEP, .samples = 1, .shadow_resolution = 256},
     {0.12, 0.14},
     {0.025, 0.17},
     ANEW},
    {"deep-linked",
     SAME_SAMPLES,
     {LINKED, .samples = 1},
     {0.025, 0.11, 0, 0.025, 0.02},
     {0.0075, 0.15, 0, 0.01, 0.0065},
     ANEW},
    {"translucent",
     SAME_SAMPLES,
     {TRANSLUCENT, .samples = 1},
     {0.025, 0.11, 0, 0.04, 0.065},
     {0.0075, 0.15, 0, 0.02, 0.024},
     ANEW},
    {"composited",
     SAME_SAMPLES,
     {COMPOSITED, .samples = 1},
     {0.025, 0.11, 0, 0.03, 0.02},
     {0.0075, 0.15, 0, 0.012, 0.0065},
     ANEW},
    {"moments",
     SAME_SAMPLES,
     {MOMENTS, .samples = 1},
     {0.025, 0.11, 0, 0.03, 0.022},
     {0.0075, 0.15, 0, 0.012, 0.0065},
     ANEW},
    {"stochastic",
     SAME_SAMPLES,
     {CHANCE, .samples = 1},
     {0.55, 0.2, 0, 0.16, 0.23},
     {0.43, 0.3, 0, 0.08, 0.14},
     ANEW},
    {"colored-stochastic",
     SAME_SAMPLES,
     {COLORED, .samples = 1},
     {0.2, 0.2, 0, 0.06, 0.09},
     {0.16, 0.2, 0, 0.035, 0.05},
     ANEW},
    {"raytraced-shadows",
     SAME_SAMPLES,
     {RAYS, .samples = 1},
     {4e-4, 0.11, 0.045, 0.013},
     {5e-5, 0.15, 0.085, 0.006},
     ANEW},
    {"area", SAME_SAMPLES, {AREA, .samples = 1}, {4e-4, 0.11, 0.045}, {5e-5, 0.15, 0.085}, ANEW},
    {"volume", SAME_SAMPLES, {VOLUME, .samples = 1}, {0.0015, 0.11}, {0.001, 0.15}, ANEW},
    {"silhouette", SAME_SAMPLES, {SILHOUETTE, .samples = 1}, {0.0015, 0.11}, {0.001, 0.15}, ANEW},
    {"raytraced",
     SAME_SAMPLES,
     {TRACED, .samples = 1},
     {0.001, 0.11, 0.045, 0.013, 0.004},
     {0.001, 0.15, 0.085, 0.006, 0.001},
     ANEW},
    {"raytraced, 256 points of light",
     SAME_SAMPLES,
     {TRACED, .samples = 1, .area_samples = 256},
     {[AREA_LIGHT] = 4e-4},
     {[AREA_LIGHT] = 5e-5},
     ANEW},
    {"raytraced-shadows", PICTURES, {RAYS, .samples = 4}, {0.12, 0.13}, {0}, ANEW},
    {"raytraced", PICTURES, {TRACED, .samples = 4}, {0.12, 0.13}, {0}, ANEW},
    {"raytraced, 16 samples", PICTURES, {TRACED, .samples = 16}, {0.025, 0.08}, {0}, ANEW},
};

enum { TECHNIQUES = sizeof techniques / sizeof *techniques };

/* ---- pictures ---- */

/* "8 panes: deep, 1 tap" becomes "8_panes__deep__1_tap". */
static void file_name(const char *scene, const char *technique, const char *kind, const char *what,
                      char *path, size_t capacity)
{
    int start = snprintf(path, capacity, "accuracy/");
    snprintf(path + start, capacity - (size_t)start, "%s_%s%s%s", scene, technique, kind, what);
    for (char *c = path + start; *c; c++)
        if (!strchr("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-", *c))
            *c = '_';
    size_t length = strlen(path);
    snprintf(path + length, capacity - length, ".png");
}

static void save_png(const struct image *image, const char *path)
{
    struct error err = {0};
    char whole[sizeof VITRAIL_BINARY_DIR + 2 * NAME_BYTES + 40];
    void *bytes;
    size_t size_bytes;
    mkdir(VITRAIL_BINARY_DIR "/accuracy", 0777);
    snprintf(whole, sizeof whole, "%s/%s", VITRAIL_BINARY_DIR, path);
    if (!image_encode(image, &(struct image_encode_desc){.format = IMAGE_FORMAT_PNG}, &bytes,
                      &size_bytes, &err))
        fail_msg("%s: %s", path, err.message);
    FILE *file = fopen(whole, "wb");
    if (!file || fwrite(bytes, 1, size_bytes, file) != size_bytes || fclose(file) != 0)
        fail_msg("cannot write %s", whole);
    free(bytes);
}

static void save_color(const struct image *color, const char *path)
{
    struct error err = {0};
    struct image shown;
    if (!tone_map(color, &(struct tone_map_desc){0}, &shown, &err))
        fail_msg("%s", err.message);
    save_png(&shown, path);
    image_finish(&shown);
}

static void save_difference(const struct image *flip, const char *path)
{
    struct error err = {0};
    struct image shown;
    double scale;
    if (!difference_map_draw(
            &(struct difference_map_desc){.kind = DIFFERENCE_MAP_FLIP, .flip = flip}, &shown,
            &scale, &err))
        fail_msg("%s", err.message);
    save_png(&shown, path);
    image_finish(&shown);
}

/* ---- one scene ---- */

struct subject {
    struct renderer *renderer;
    const char *name;
    struct rig_scene rig;
    struct view view;
    bool is_opaque; /* nothing transparent casts */
    enum content content;
    bool shows_layers; /* transparent ones, to tell ways of drawing them by */
    struct image references[COMPARISONS];
    int failures;
};

/* The same scene as if it had just come: structures are built anew, programs stay. */
static void attach_again(struct subject *s)
{
    struct error err = {0};
    renderer_detach_scene(s->renderer, s->rig.key);
    if (!renderer_attach_scene(
            s->renderer,
            &(struct renderer_scene_desc){.key = s->rig.key, .scene = &s->rig.imported.scene},
            &err))
        fail_msg("%s", err.message);
}

static const char *kind_of(const struct technique *t)
{
    static const char *const kinds[COMPARISONS] = {"", "_picture", "_straight"};
    return kinds[t->comparison];
}

static void expect(struct subject *s, const struct technique *t, const char *metric, double error,
                   double tolerance, double ms)
{
    char image[2 * NAME_BYTES], difference[2 * NAME_BYTES];
    bool is_pass = error <= tolerance;
    const char *kind = kind_of(t);
    file_name(s->name, t->name, kind, "", image, sizeof image);
    file_name(s->name, t->name, kind, "_flip", difference, sizeof difference);
    accuracy_log(&(struct accuracy_result){
        .suite = t->comparison == STRAIGHT ? "transparency by scene" : "techniques by scene",
        .scene = s->name,
        .technique = t->name,
        .metric = metric,
        .error = error,
        .tolerance = tolerance,
        .ms = ms,
        .is_pass = is_pass,
        .image = image,
        .difference = difference});
    printf("%-26s %-22s %-26s %-9.3g limit %-7.3g %7.1f ms%s\n", s->name, t->name, metric, error,
           tolerance, ms, is_pass ? "" : "  FAIL");
    s->failures += !is_pass;
}

static void save_pictures(const struct subject *s, const struct technique *t,
                          const struct image *color, const struct image *map)
{
    char path[2 * NAME_BYTES];
    const char *kind = kind_of(t);
    file_name(s->name, t->name, kind, "", path, sizeof path);
    save_color(color, path);
    file_name(s->name, t->name, kind, "_flip", path, sizeof path);
    save_difference(map, path);
}

static void measure(struct subject *s, const struct technique *t, const struct image *color,
                    double ms)
{
    struct error err = {0};
    struct image_metrics metrics;
    struct flip flip;
    struct image map;
    const struct image *reference = &s->references[t->comparison];
    if (!image_metrics_measure(
            &(struct image_metrics_desc){.image = color, .reference = reference, .channels = 7},
            &metrics, &err) ||
        !flip_measure(&(struct flip_desc){.image = color, .reference = reference, .is_hdr = true},
                      &flip, &map, &err))
        fail_msg("%s", err.message);
    save_pictures(s, t, color, &map);
    image_finish(&map);
    assert_int_equal(metrics.nonfinite_image + metrics.nonfinite_reference, 0);
    assert_true(metrics.overall.mean_reference > 0);
    double mean = metrics.overall.mean_reference;
    if (t->comparison == PICTURES)
        expect(s, t, "HDR-FLIP of the picture", flip.mean, t->flip[s->content], ms);
    else {
        expect(s, t, "HDR-FLIP", flip.mean, t->flip[s->content], ms);
        expect(s, t, "MAE / mean", metrics.overall.mae / mean, t->mae[s->content], ms);
    }
}

/* False when the technique needs more memory for the scene than there is. */
static bool draw(struct subject *s, const struct view *view, struct frame *frame)
{
    struct error err = {0};
    if (renderer_render(s->renderer, s->rig.key, view, frame, &err))
        return true;
    if (err.code != ERROR_OVER_BUDGET)
        fail_msg("%s: %s", s->name, err.message);
    printf("%-26s refused: %s\n", s->name, err.message);
    return false;
}

/* What takes the place of the technique would be measured under its name. */
static void refuse_substitutes(const struct subject *s, const struct frame *frame)
{
    for (int i = 0; i < frame->report.warning_count; i++)
        if (strstr(frame->report.warnings[i], "takes its place"))
            fail_msg("%s: %s", s->name, frame->report.warnings[i]);
}

/* Compiles nearly all programs of the technique. */
static bool draw_small(struct subject *s, const struct view *view)
{
    struct frame frame;
    struct view small = *view;
    small.width_px = WIDTH_PX / 4;
    small.height_px = HEIGHT_PX / 4;
    small.quality.shadow_resolution = SMALL_MAP;
    if (!draw(s, &small, &frame))
        return false;
    frame_finish(&frame);
    return true;
}

/* The picture as the technique makes it, and its time in a scene that has just come, without
 * compiling programs: what has still some to compile is drawn again. *ms is 0 of what is not timed.
 */
static bool render(struct subject *s, const struct technique *t, struct image *color, double *ms)
{
    struct frame frame;
    struct view view = s->view;
    view.quality = t->quality;
    bool keeps_maps = t->drawing == KEEPS_MAPS;
    bool is_compiled = keeps_maps || view.quality.reference;
    if (!is_compiled && !draw_small(s, &view))
        return false;
    for (int i = 0; i == 0 || !is_compiled; i++) {
        if (i > 0)
            frame_finish(&frame);
        if (!keeps_maps)
            attach_again(s);
        if (!draw(s, &view, &frame))
            return false;
        is_compiled |= i > 0 || frame.report.counts.programs_built == 0;
    }
    refuse_substitutes(s, &frame);
    *ms = keeps_maps ? 0 : frame.report.total_ms;
    *color = frame.outputs[VIEW_OUTPUT_COLOR];
    frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
    frame_finish(&frame);
    return true;
}

/* A reference of whole pictures takes minutes where light has an area or is scattered. */
static bool has_comparison(const struct subject *s, enum comparison comparison)
{
    return comparison == STRAIGHT   ? s->shows_layers
           : comparison == PICTURES ? s->content <= TEXTURED
                                    : s->content < STACK;
}

static void render_references(struct subject *s)
{
    for (int i = 0; i < COMPARISONS; i++) {
        double ms;
        const struct technique truth = {
            .name = "reference",
            .comparison = (enum comparison)i,
            .quality = {.reference = true,
                        .samples = i == PICTURES ? REFERENCE_SAMPLES : 1,
                        .refraction = i == STRAIGHT ? VIEW_REFRACTION_OFF : VIEW_REFRACTION_AUTO}};
        if (!has_comparison(s, truth.comparison))
            continue;
        assert_true(render(s, &truth, &s->references[i], &ms));
        measure(s, &truth, &s->references[i], ms);
    }
}

/* Renders and compares everything, then fails the test if anything was out of tolerance, so that
 * the report is whole. */
static void compare_techniques(struct subject *s)
{
    double ms;
    s->view.width_px = WIDTH_PX;
    s->view.height_px = HEIGHT_PX;
    s->view.outputs = 1u << VIEW_OUTPUT_COLOR;
    render_references(s);
    for (int i = 0; i < TECHNIQUES; i++) {
        struct image color;
        if ((techniques[i].drawing == IF_OPAQUE && !s->is_opaque) ||
            !techniques[i].flip[s->content] || !has_comparison(s, techniques[i].comparison) ||
            !render(s, &techniques[i], &color, &ms))
            continue;
        measure(s, &techniques[i], &color, ms);
        image_finish(&color);
    }
    for (int i = 0; i < COMPARISONS; i++)
        image_finish(&s->references[i]);
    rig_scene_finish(&s->rig, s->renderer);
    if (s->failures)
        fail_msg("%s: %d errors above the promised tolerance", s->name, s->failures);
}

/* ---- scenes ---- */

/* subject: all but the scene; a camera of the scene takes the place of its own. */
static void compare_glb(const struct subject *subject, const char *camera,
                        struct closed_form_scene *scene)
{
    struct subject s = *subject;
    if (camera)
        s.view.camera = (struct view_camera){.kind = VIEW_CAMERA_NODE, .node = camera};
    rig_scene_open(&s.rig, s.renderer, s.name, scene->glb, scene->size_bytes);
    closed_form_scene_finish(scene);
    compare_techniques(&s);
}

static void parallel_panes(void **state)
{
    static const double colors[8][4] = {{1, 0.9, 0.8, 1},    {0.7, 0.9, 1, 1}, {0.9, 0.9, 0.9, 1},
                                        {1, 0.8, 0.9, 1},    {0.8, 1, 0.8, 1}, {0.95, 0.8, 1, 1},
                                        {0.9, 0.95, 0.7, 1}, {1, 1, 0.9, 1}};
    struct closed_form_scene scene;
    panes_scene_build(
        &(struct panes_scene_desc){
            .pane_count = 8, .colors = colors, .light = GLB_LIGHT_SPOT, .has_probes = true},
        &scene);
    compare_glb(&(struct subject){.renderer = *state, .name = "8 parallel panes, spot"}, "Floor",
                &scene);
}

static void random_panes_under_a_point_light(void **state)
{
    struct closed_form_scene scene;
    random_panes_scene_build(
        &(struct random_panes_scene_desc){.pane_count = 12, .seed = 1, .light = GLB_LIGHT_POINT},
        &scene);
    compare_glb(&(struct subject){.renderer = *state, .name = "12 random panes, point"}, "Floor",
                &scene);
}

static void random_panes_under_the_sun(void **state)
{
    struct closed_form_scene scene;
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 40,
                                                               .seed = 5,
                                                               .light = GLB_LIGHT_DIRECTIONAL},
                             &scene);
    compare_glb(&(struct subject){.renderer = *state, .name = "40 random panes, sun"}, "Floor",
                &scene);
}

static void three_overlapping_panes(void **state)
{
    struct closed_form_scene scene;
    overlap_scene_build(&(struct overlap_scene_desc){.is_blend = true}, &scene);
    compare_glb(&(struct subject){.renderer = *state, .name = "3 overlapping panes"}, "Floor",
                &scene);
}

static void texture_projector(void **state)
{
    struct closed_form_scene scene;
    projector_scene_build(&(struct projector_scene_desc){.cells = 6}, &scene);
    compare_glb(&(struct subject){.renderer = *state, .name = "texture projector"}, "Wall", &scene);
}

static void room_of_glass_spheres(void **state)
{
    struct closed_form_scene scene;
    room_scene_build(&(struct room_scene_desc){.light_count = 20, .seed = 3, .glass_spheres = 20},
                     &scene);
    compare_glb(&(struct subject){.renderer = *state,
                                  .name = "room, 20 lights, glass",
                                  .shows_layers = true},
                "Room", &scene);
}

static void room_of_opaque_spheres(void **state)
{
    struct closed_form_scene scene;
    room_scene_build(&(struct room_scene_desc){.light_count = 20, .seed = 3}, &scene);
    compare_glb(
        &(struct subject){.renderer = *state, .name = "room, 20 lights, opaque", .is_opaque = true},
        "Room", &scene);
}

static void demo_chapel(void **state)
{
    struct subject s = {.renderer = *state, .name = "demo chapel", .content = TEXTURED};
    rig_demo_open_fine(&s.rig, *state, s.name, 128);
    compare_techniques(&s);
}

/* An asset under one light of ours; skipped without the assets. */
static void compare_asset(struct subject *s, const char *path, const struct view_light *light)
{
    if (!assets_are_present())
        skip();
    rig_asset_open(&s->rig, s->renderer, path);
    s->view.lights = light;
    s->view.light_count = 1;
    compare_techniques(s);
}

static void flowers_in_glass_vases(void **state)
{
    static const struct view_light light = {.type = SCENE_LIGHT_SPOT,
                                            .position = {0.35, 0.6, 0.4},
                                            .direction = {-0.5, -0.7, -0.5},
                                            .color = {1, 1, 1},
                                            .intensity = 2,
                                            .outer_cone_deg = 30};
    struct subject s = {
        .renderer = *state,
        .name = "flowers in glass vases",
        .content = TEXTURED,
        .view = asset_view((double[]){0.16, 0.16, 0.42}, (double[]){0.055, 0.1, 0}, 32)};
    compare_asset(&s, "GlassVaseFlowers/glTF-Binary/GlassVaseFlowers.glb", &light);
}

static void stained_glass_lamp(void **state)
{
    static const struct view_light light = {.type = SCENE_LIGHT_POINT,
                                            .position = {0, 0.42, 0},
                                            .color = {1, 0.9, 0.8},
                                            .intensity = 1};
    struct subject s = {.renderer = *state,
                        .name = "stained-glass lamp",
                        .content = TEXTURED,
                        .view = asset_view((double[]){0.25, 0.5, 0.9}, (double[]){0, 0.36, 0}, 42)};
    compare_asset(&s, "StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp-transmission.gltf", &light);
}

/* ---- what some techniques alone can do ---- */

/* From the side, so that the air is in view. */
static const struct view_camera from_the_side = {
    .kind = VIEW_CAMERA_LOOK_AT, .eye = {2.5, 2.2, 4.5}, .target = {0, 1.2, 0}, .fov_y_deg = 50};

static void panes_under_a_rectangle(void **state)
{
    static const struct view_light light = {.type = SCENE_LIGHT_RECT,
                                            .position = {0, 4, 0},
                                            .direction = {0, -1, 0},
                                            .color = {1, 1, 1},
                                            .intensity = 60,
                                            .width_m = 1.5,
                                            .height_m = 0.75};
    struct closed_form_scene scene;
    random_panes_scene_build(
        &(struct random_panes_scene_desc){.pane_count = 12, .seed = 9, .light = GLB_LIGHT_POINT},
        &scene);
    compare_glb(&(struct subject){.renderer = *state,
                                  .name = "12 random panes, rectangle",
                                  .content = AREA_LIGHT,
                                  .view = {.camera = from_the_side,
                                           .lights = &light,
                                           .light_count = 1,
                                           .ignore_scene_lights = true}},
                NULL, &scene);
}

static void panes_in_haze(void **state)
{
    static const struct view_atmosphere haze = {
        .density_per_m = 0.08, .color = {0.9F, 0.9F, 1}, .anisotropy = 0.4};
    struct closed_form_scene scene;
    random_panes_scene_build(
        &(struct random_panes_scene_desc){.pane_count = 12, .seed = 9, .light = GLB_LIGHT_SPOT},
        &scene);
    compare_glb(&(struct subject){.renderer = *state,
                                  .name = "12 random panes in haze, spot",
                                  .content = HAZE,
                                  .view = {.camera = from_the_side, .atmosphere = haze}},
                NULL, &scene);
}

static void panes_over_smoke(void **state)
{
    struct closed_form_scene scene;
    random_panes_scene_build(
        &(struct random_panes_scene_desc){
            .pane_count = 12, .seed = 9, .light = GLB_LIGHT_POINT, .has_smoke = true},
        &scene);
    compare_glb(&(struct subject){.renderer = *state,
                                  .name = "12 random panes over smoke, point",
                                  .content = SMOKE,
                                  .view = {.camera = from_the_side}},
                NULL, &scene);
}

/* ---- what is transparent, as the camera sees it ---- */

static const struct view_light without_shadows = {.type = SCENE_LIGHT_POINT,
                                                  .position = {0.4, 7, 2},
                                                  .color = {1, 1, 1},
                                                  .intensity = 200,
                                                  .casts_no_shadow = true};

static void stack_of_panes_from_above(void **state)
{
    static const double colors[8][4] = {
        {1, 0.2, 0.1, 0.3},   {0.1, 0.3, 1, 0.5},   {0.9, 0.9, 0.2, 0.4}, {0.1, 0.8, 0.3, 0.6},
        {0.8, 0.1, 0.8, 0.3}, {0.2, 0.9, 0.9, 0.5}, {1, 0.5, 0.1, 0.4},   {0.3, 0.3, 0.4, 0.5}};
    struct closed_form_scene scene;
    panes_scene_build(&(struct panes_scene_desc){.pane_count = 8,
                                                 .colors = colors,
                                                 .is_blend = true,
                                                 .spacing = 0.2,
                                                 .light = GLB_LIGHT_SPOT},
                      &scene);
    compare_glb(&(struct subject){.renderer = *state,
                                  .name = "8 panes from above",
                                  .content = STACK,
                                  .shows_layers = true,
                                  .view = {.camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                                      .eye = {1.5, 4.5, 2.5},
                                                      .target = {0, 1.7, 0},
                                                      .fov_y_deg = 40},
                                           .lights = &without_shadows,
                                           .light_count = 1,
                                           .ignore_scene_lights = true}},
                NULL, &scene);
}

static void panes_through_one_another(void **state)
{
    struct closed_form_scene scene;
    random_panes_scene_build(
        &(struct random_panes_scene_desc){.pane_count = 40, .seed = 9, .light = GLB_LIGHT_SPOT},
        &scene);
    compare_glb(&(struct subject){.renderer = *state,
                                  .name = "40 panes from the side",
                                  .content = INTERLOCKED,
                                  .shows_layers = true,
                                  .view = {.camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                                      .eye = {2.5, 2.8, 4.5},
                                                      .target = {0, 2.4, 0},
                                                      .fov_y_deg = 36},
                                           .lights = &without_shadows,
                                           .light_count = 1,
                                           .ignore_scene_lights = true}},
                NULL, &scene);
}

/* ---- all of them ---- */

/* Says in the report what it was measured on. */
static void tell_device(const struct renderer *renderer)
{
    struct renderer_info info;
    renderer_get_info(renderer, &info);
    mkdir(VITRAIL_BINARY_DIR "/accuracy", 0777);
    FILE *file = fopen(VITRAIL_BINARY_DIR "/accuracy/device.txt", "w");
    assert_non_null(file);
    fprintf(file, "%s, %s\n", info.renderer, info.version);
    assert_int_equal(fclose(file), 0);
}

static int setup(void **state)
{
    *state = render_rig_create();
    tell_device(*state);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parallel_panes),
        cmocka_unit_test(random_panes_under_a_point_light),
        cmocka_unit_test(random_panes_under_the_sun),
        cmocka_unit_test(three_overlapping_panes),
        cmocka_unit_test(texture_projector),
        cmocka_unit_test(room_of_glass_spheres),
        cmocka_unit_test(room_of_opaque_spheres),
        cmocka_unit_test(demo_chapel),
        cmocka_unit_test(flowers_in_glass_vases),
        cmocka_unit_test(stained_glass_lamp),
        cmocka_unit_test(panes_under_a_rectangle),
        cmocka_unit_test(panes_in_haze),
        cmocka_unit_test(panes_over_smoke),
        cmocka_unit_test(stack_of_panes_from_above),
        cmocka_unit_test(panes_through_one_another),
    };
    return cmocka_run_group_tests(tests, setup, render_rig_teardown);
}
