/* SPDX-License-Identifier: MIT */
/* Suite `foliage`: shadows of thousands of leaves and strands thinner than a texel, exact,
 * averaged over several rays per texel, and compressed: error, memory, build, frame. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "renderer/accuracy/metrics.h"
#include "tests/bench/frames.h"
#include "tests/support/foliage_scene.h"

enum { BLOCK = 8 /* pixels whose mean is compared, too: what is seen from afar */ };

struct setting {
    const char *name;
    enum shadow_technique shadows;
    int resolution, prefilter;
    double compression;
};

/* In groups that take turns. */
static const struct setting settings[] = {
    {"none", SHADOWS_NONE, 256, 1, 0},
    {"map 512", SHADOWS_MAP, 512, 1, 0},
    {"exact 256", SHADOWS_DEEP, 256, 1, 0},
    {"exact 512", SHADOWS_DEEP, 512, 1, 0},
    {"exact 1024", SHADOWS_DEEP, 1024, 1, 0},
    {"512, e 0.005", SHADOWS_DEEP, 512, 1, 0.005},
    {"512, e 0.02", SHADOWS_DEEP, 512, 1, 0.02},
    {"512, e 0.05", SHADOWS_DEEP, 512, 1, 0.05},
    {"256, k 2", SHADOWS_DEEP, 256, 2, 0},
    {"256, k 4", SHADOWS_DEEP, 256, 4, 0},
    {"256, k 4, e 0.02", SHADOWS_DEEP, 256, 4, 0.02},
    {"512, k 2", SHADOWS_DEEP, 512, 2, 0},
    {"512, k 4", SHADOWS_DEEP, 512, 4, 0},
    {"512, k 4, e 0.02", SHADOWS_DEEP, 512, 4, 0.02},
    {"512, k 4, e 0.05", SHADOWS_DEEP, 512, 4, 0.05},
};
enum { SETTINGS = sizeof settings / sizeof *settings, GROUP = VARIANTS_MAX / 2 };

static struct view foliage_view(const int size[2], const struct setting *setting,
                                const struct view_light *light)
{
    return (struct view){.width_px = size[0],
                         .height_px = size[1],
                         .camera = foliage_camera(),
                         .lights = light,
                         .light_count = 1,
                         .quality = {.shadows = setting->shadows,
                                     .shadow_resolution = setting->resolution,
                                     .shadow_prefilter = setting->prefilter,
                                     .shadow_compression = setting->compression,
                                     .shadow_taps = 4,
                                     .samples = 4}};
}

/* The mean of each block in place of its pixels. */
static void average(struct image *image)
{
    float *pixels = image->pixels;
    for (int y = 0; y + BLOCK <= image->height_px; y += BLOCK)
        for (int x = 0; x + BLOCK <= image->width_px; x += BLOCK)
            for (int c = 0; c < image->channels; c++) {
                double sum = 0;
                for (int i = 0; i < BLOCK * BLOCK; i++)
                    sum += (double)pixels[((y + i / BLOCK) * image->width_px + x + i % BLOCK) *
                                              image->channels +
                                          c];
                for (int i = 0; i < BLOCK * BLOCK; i++)
                    pixels[((y + i / BLOCK) * image->width_px + x + i % BLOCK) * image->channels +
                           c] = (float)(sum / (BLOCK * BLOCK));
            }
}

static bool state_error(struct bench *bench, const char *name, struct image *image,
                        struct image *reference, const char *what, struct error *err)
{
    struct image_metrics metrics;
    struct image_metrics_desc desc = {.image = image, .reference = reference, .channels = 7};
    if (!image_metrics_measure(&desc, &metrics, err))
        return false;
    bench_check(bench, &(struct check){.scene = "foliage",
                                       .subject = name,
                                       .name = what,
                                       .value = metrics.overall.rmse,
                                       .p = NAN});
    return true;
}

/* Errors of one setting against the reference, of pixels and of blocks. */
static bool state_errors(struct bench *bench, const struct rig_scene *scene,
                         const struct frame_variant *variant, struct image *reference,
                         struct image *reference_means, struct error *err)
{
    struct frame frame;
    bool ok = renderer_render(bench_renderer(bench), scene->key, &variant->view, &frame, err);
    struct image *image = &frame.outputs[VIEW_OUTPUT_COLOR];
    ok = ok && state_error(bench, variant->name, image, reference, "RMSE", err);
    if (ok)
        average(image);
    ok = ok && state_error(bench, variant->name, image, reference_means, "RMSE of blocks", err);
    frame_finish(&frame);
    return ok;
}

/* Of the light's lists as they stand, with heads and opaque depths. */
static uint64_t map_bytes(const struct frame_report *report, const struct setting *setting)
{
    uint64_t texels = (uint64_t)setting->resolution * (uint64_t)setting->resolution;
    if (setting->shadows == SHADOWS_NONE)
        return 0;
    return 17 * report->counts.events + texels * (setting->shadows == SHADOWS_MAP ? 4 : 8);
}

static bool run_group(struct bench *bench, const struct rig_scene *scene, int first, int count,
                      const int size[2], struct image references[2], struct error *err)
{
    struct frame_variant variants[VARIANTS_MAX] = {0};
    struct view_light spot = foliage_spot();
    char still[GROUP][40];
    for (int i = 0; i < count; i++) {
        const struct setting *setting = &settings[first + i];
        snprintf(still[i], sizeof still[i], "%s, static", setting->name);
        variants[2 * i] = (struct frame_variant){.name = setting->name,
                                                 .view = foliage_view(size, setting, &spot),
                                                 .rebuilds_shadows = true};
        variants[2 * i + 1] = variants[2 * i];
        variants[2 * i + 1].name = still[i];
        variants[2 * i + 1].rebuilds_shadows = false;
    }
    bool ok = frames_run(bench, scene, variants, (size_t)(2 * count), err);
    for (int i = 0; ok && i < 2 * count; i++)
        bench_result(bench,
                     &(struct result){.scene = "foliage",
                                      .subject = "1 spot",
                                      .variant = variants[i].name,
                                      .width = size[0],
                                      .height = size[1],
                                      .stage = i % 2 ? "shade.opaque" : PART_SHADOW,
                                      .structure_bytes = map_bytes(&variants[i].measurement.report,
                                                                   &settings[first + i / 2]),
                                      .measurement = &variants[i].measurement});
    for (int i = 0; ok && i < count; i++)
        ok = state_errors(bench, scene, &variants[2 * i], &references[0], &references[1], err);
    frames_finish(variants, (size_t)(2 * count));
    return ok;
}

static bool render_reference(struct bench *bench, const struct rig_scene *scene, const int size[2],
                             struct frame *frame, struct error *err)
{
    struct view_light spot = foliage_spot();
    struct view view = foliage_view(size, &settings[0], &spot);
    view.quality =
        (struct view_quality){.reference = true, .samples = bench->options.is_quick ? 4 : 16};
    bool ok = renderer_render(bench_renderer(bench), scene->key, &view, frame, err);
    if (ok && bench->options.saves_pictures)
        save_picture(&frame->outputs[VIEW_OUTPUT_COLOR], "bench-foliage-reference");
    return ok;
}

bool suite_foliage(struct bench *bench, struct error *err)
{
    bool is_quick = bench->options.is_quick;
    struct closed_form_scene foliage;
    struct rig_scene scene = {0};
    struct frame sharp = {0}, blurred = {0};
    int size[2];
    if (!bench_wants_scene(bench, "foliage"))
        return true;
    bench_size(bench, 640, 480, size);
    foliage_scene_build(&(struct foliage_scene_desc){.leaves = is_quick ? 400 : 24000,
                                                     .strands = is_quick ? 100 : 12000},
                        &foliage);
    bool ok = rig_scene_from_glb(&scene, bench_renderer(bench), "foliage", foliage.glb,
                                 foliage.size_bytes, err) &&
              render_reference(bench, &scene, size, &sharp, err) &&
              render_reference(bench, &scene, size, &blurred, err);
    struct image references[2] = {sharp.outputs[VIEW_OUTPUT_COLOR],
                                  blurred.outputs[VIEW_OUTPUT_COLOR]};
    if (ok)
        average(&references[1]);
    for (int first = 0; ok && first < SETTINGS; first += GROUP) {
        int count = SETTINGS - first < GROUP ? SETTINGS - first : GROUP;
        ok = run_group(bench, &scene, first, count, size, references, err);
    }
    frame_finish(&sharp);
    frame_finish(&blurred);
    rig_scene_finish(&scene, bench_renderer(bench));
    closed_form_scene_finish(&foliage);
    return ok;
}
