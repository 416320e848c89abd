/* SPDX-License-Identifier: MIT */
/* The steps of a measurement, each a frame or two and what is to be known of them. */
#include "server/worker/measure.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "renderer/accuracy/flip.h"
#include "renderer/base/processors.h"
#include "renderer/image/tone_map.h"
#include "server/base/ipc.h"
#include "server/mapping/view_mapping.h"

enum { IMAGE_QUALITY_PERCENT = 92, TIME_TRIES = 4 };

#define TIME_AGAIN_MS 10000. /* of paused frames: what a step may take is six times that */

/* Under which all settings are compared: where the request leaves it open, that of the ray-traced
 * picture. */
static bool find_exposure(const struct measure_desc *desc, double *exposure_ev, struct error *err)
{
    struct view view;
    struct view_storage storage = {0};
    struct exposure_reading reading;
    *exposure_ev = desc->request->exposure_ev;
    if (!desc->request->meters_exposure)
        return true;
    if (!view_from_request(desc->request, &storage, &view, err))
        return false;
    view.quality = (struct view_quality){.shadows = SHADOWS_RAYTRACED,
                                         .area_samples = view.quality.area_samples,
                                         .blend_filter = view.quality.blend_filter};
    bool is_good = renderer_meter(desc->renderer, desc->request->scene, &view, &reading, err);
    view_storage_finish(&storage);
    *exposure_ev = is_good ? (double)reading.ev : 0;
    return is_good;
}

/* Renders the request; the caller finishes the frame. */
static bool render(const struct measure_desc *desc, int first_row, int row_count,
                   struct frame *frame, struct error *err)
{
    struct view view;
    struct view_storage storage = {0};
    *frame = (struct frame){0};
    if (!view_from_request(desc->request, &storage, &view, err))
        return false;
    view.first_row_px = first_row;
    view.row_count_px = row_count;
    bool is_good = renderer_render(desc->renderer, desc->request->scene, &view, frame, err);
    view_storage_finish(&storage);
    return is_good;
}

static json_t *pack_or_fail(json_t *json, struct error *err)
{
    if (!json)
        error_set(err, ERROR_NO_MEMORY, "result of a measurement");
    return json;
}

/* ---- the reference as an image ---- */

struct reference {
    struct image image; /* its pixels are mapped, not owned */
    size_t size_bytes;
};

static bool reference_begin(struct reference *reference, const struct measure_desc *desc,
                            struct error *err)
{
    struct stat file;
    int width = desc->request->width, height = desc->request->height;
    *reference = (struct reference){
        .image = {.width_px = width, .height_px = height, .channels = 4, .component = IMAGE_F32}};
    reference->size_bytes = image_size_bytes(&reference->image);
    if (desc->reference_fd < 0 || fstat(desc->reference_fd, &file) != 0 ||
        (uint64_t)file.st_size != reference->size_bytes)
        return error_set(err, ERROR_INTERNAL, "the reference's file is not of %dx%d pixels", width,
                         height);
    void *pixels = mmap(NULL, reference->size_bytes, PROT_READ | PROT_WRITE, MAP_SHARED,
                        desc->reference_fd, 0);
    if (pixels == MAP_FAILED)
        return error_set(err, ERROR_NO_MEMORY, "reference: %s", strerror(errno));
    reference->image.pixels = pixels;
    return true;
}

static void reference_end(struct reference *reference)
{
    munmap(reference->image.pixels, reference->size_bytes);
}

/* A sealed memory file with the picture as a screen shows it; -1 on failure. */
static int show(const struct measure_desc *desc, const struct image *color, struct error *err)
{
    struct tone_map_desc mapping;
    double exposure_ev;
    struct image shown = {0};
    void *bytes = NULL;
    size_t size_bytes = 0;
    int fd = -1;
    tone_map_from_request(desc->request, &mapping);
    if (!find_exposure(desc, &exposure_ev, err))
        return -1;
    mapping.exposure_ev = (float)exposure_ev;
    if (tone_map(color, &mapping, &shown, err) &&
        image_encode(&shown,
                     &(struct image_encode_desc){.format = IMAGE_FORMAT_WEBP,
                                                 .quality = IMAGE_QUALITY_PERCENT},
                     &bytes, &size_bytes, err))
        fd = ipc_memfd_create("vitrail-measured", bytes, size_bytes, err);
    image_finish(&shown);
    free(bytes);
    return fd;
}

/* ---- steps ---- */

/* The request asks for deep maps, whose events are the transparent casters. */
static json_t *probe(const struct measure_desc *desc, struct error *err)
{
    struct renderer_info info;
    struct frame frame;
    /* kept surfaces would count no triangles */
    renderer_drop_structures(desc->renderer, desc->request->scene);
    if (!render(desc, 0, 0, &frame, err))
        return NULL;
    renderer_get_info(desc->renderer, &info);
    bool can_antialias = info.max_samples >= 4;
    json_t *result = json_pack(
        "{s:I,s:I,s:I,s:b,s:b,s:I,s:i,s:I,s:f}", "lights", (json_int_t)frame.report.counts.lights,
        "shadowed_lights", (json_int_t)frame.report.counts.shadowed_lights, "triangles",
        (json_int_t)frame.report.counts.triangles, "transparent_casters",
        frame.report.counts.events > 0, "layers", frame.report.has_layers, "layer_needs",
        (json_int_t)frame.report.layer_needs, "max_samples", can_antialias ? 4 : 1, "processors",
        (json_int_t)processors_usable(), "ms", frame.report.total_ms);
    frame_finish(&frame);
    return pack_or_fail(result, err);
}

static double pass_ms(const struct frame_report *report, const char *pass)
{
    for (int i = 0; i < report->pass_count; i++)
        if (strcmp(report->passes[i].pass, pass) == 0)
            return report->passes[i].ms;
    return 0;
}

static json_t *trace_band(const struct measure_desc *desc, struct error *err)
{
    struct reference reference;
    struct frame frame;
    int first = (int)json_integer_value(json_object_get(desc->step, "first_row"));
    int count = (int)json_integer_value(json_object_get(desc->step, "row_count"));
    if (!reference_begin(&reference, desc, err))
        return NULL;
    json_t *result = NULL;
    if (render(desc, first, count, &frame, err)) {
        size_t row_bytes = (size_t)desc->request->width * 4 * sizeof(float);
        memcpy((char *)reference.image.pixels + (size_t)first * row_bytes,
               (const char *)frame.outputs[VIEW_OUTPUT_COLOR].pixels + (size_t)first * row_bytes,
               (size_t)count * row_bytes);
        double build_ms = pass_ms(&frame.report, "raytrace.build");
        result = pack_or_fail(json_pack("{s:f,s:f}", "build_ms", build_ms, "trace_ms",
                                        frame.report.total_ms - build_ms),
                              err);
        frame_finish(&frame);
    }
    reference_end(&reference);
    return result;
}

static json_t *show_reference(const struct measure_desc *desc, int *image_fd, struct error *err)
{
    struct reference reference;
    if (!reference_begin(&reference, desc, err))
        return NULL;
    *image_fd = show(desc, &reference.image, err);
    reference_end(&reference);
    return *image_fd < 0 ? NULL : pack_or_fail(json_object(), err);
}

static uint64_t all_bytes(const struct frame_report *report)
{
    uint64_t bytes = 0;
    for (int i = 0; i < report->byte_count; i++)
        bytes += report->bytes[i].bytes;
    return bytes;
}

/* A copy as a screen shows it before tone mapping: under the exposure, cut to [0, 1]. NaN stays. */
static bool expose(const struct image *from, double scale, struct image *to, struct error *err)
{
    if (!image_init(to, from->width_px, from->height_px, from->channels, IMAGE_F32, err))
        return false;
    size_t count = image_size_bytes(from) / sizeof(float);
    const float *source = from->pixels;
    float *target = to->pixels;
    for (size_t i = 0; i < count; i++) {
        float value = (float)(scale * (double)source[i]);
        target[i] = value < 0 ? 0 : value > 1 ? 1 : value;
    }
    return true;
}

/* Alpha is left out. */
static json_t *compare_exposed(const struct frame_report *report, const struct image *image,
                               const struct image *reference, struct error *err)
{
    struct image_metrics metrics;
    struct flip flip;
    const struct image_metrics_desc desc = {.image = image, .reference = reference, .channels = 7};
    if (!image_metrics_measure(&desc, &metrics, err) ||
        !flip_measure(&(struct flip_desc){.image = image, .reference = reference}, &flip, NULL,
                      err))
        return NULL;
    if (metrics.nonfinite_mismatch || metrics.nonfinite_image) {
        error_set(err, ERROR_INTERNAL, "the image has %llu values that are not finite",
                  (unsigned long long)(metrics.nonfinite_image + metrics.nonfinite_mismatch));
        return NULL;
    }
    return pack_or_fail(json_pack("{s:f,s:f,s:f,s:f,s:f,s:I}", "ms", report->total_ms, "rmse",
                                  metrics.overall.rmse, "p999", metrics.overall.p999, "max",
                                  metrics.overall.max, "flip", flip.mean, "bytes",
                                  (json_int_t)all_bytes(report)),
                        err);
}

static json_t *compare(const struct measure_desc *desc, const struct frame *frame,
                       const struct reference *reference, struct error *err)
{
    struct image copies[2] = {{0}};
    double exposure_ev;
    json_t *result = NULL;
    if (!find_exposure(desc, &exposure_ev, err))
        return NULL;
    double scale = exp2(exposure_ev);
    if (expose(&frame->outputs[VIEW_OUTPUT_COLOR], scale, &copies[0], err) &&
        expose(&reference->image, scale, &copies[1], err))
        result = compare_exposed(&frame->report, &copies[0], &copies[1], err);
    image_finish(&copies[0]);
    image_finish(&copies[1]);
    return result;
}

/* ms: of a frame that builds its structures and compiles nothing. */
static json_t *measure_error(const struct measure_desc *desc, int *image_fd, struct error *err)
{
    struct reference reference;
    struct frame frame;
    if (!reference_begin(&reference, desc, err))
        return NULL;
    json_t *result = NULL;
    renderer_drop_structures(desc->renderer, desc->request->scene);
    bool is_good = render(desc, 0, 0, &frame, err);
    /* a frame that compiled programs has the time of the compiler */
    if (is_good && frame.report.counts.programs_built + frame.report.counts.programs_loaded > 0) {
        frame_finish(&frame);
        renderer_drop_structures(desc->renderer, desc->request->scene);
        is_good = render(desc, 0, 0, &frame, err);
    }
    if (is_good) {
        result = compare(desc, &frame, &reference, err);
        if (result && json_is_true(json_object_get(desc->step, "keep_image")) &&
            (*image_fd = show(desc, &frame.outputs[VIEW_OUTPUT_COLOR], err)) < 0) {
            json_decref(result);
            result = NULL;
        }
        frame_finish(&frame);
    }
    reference_end(&reference);
    return result;
}

/* Drivers compile a program once more for another state, and forget what others followed, in
 * 0.1 to 0.5 s that no count of programs tells. */
static bool settle(const struct measure_desc *desc, struct error *err)
{
    struct frame frame;
    if (!json_is_true(json_object_get(desc->step, "settles")))
        return true;
    renderer_drop_structures(desc->renderer, desc->request->scene);
    bool is_good = render(desc, 0, 0, &frame, err);
    frame_finish(&frame);
    return is_good;
}

/* A cold and a warm frame. *is_paused: others went before the rest of one, and left what they need
 * in the caches. */
static bool time_frames(const struct measure_desc *desc, double ms[2], bool *is_paused,
                        struct error *err)
{
    struct frame frame;
    *is_paused = false;
    renderer_drop_structures(desc->renderer, desc->request->scene);
    for (int i = 0; i < 2; i++) {
        if (!render(desc, 0, 0, &frame, err))
            return false;
        ms[i] = frame.report.total_ms;
        *is_paused |= frame.report.paused_ms > 0;
        frame_finish(&frame);
    }
    return true;
}

/* A measurement that was paused is repeated. The last repetition does not yield, and where frames
 * take long an early one does not either. */
static json_t *measure_time(const struct measure_desc *desc, struct error *err)
{
    double ms[2], spent_ms = 0;
    bool is_paused = true;
    if (!settle(desc, err))
        return NULL;
    for (int tries = 1; is_paused && tries <= TIME_TRIES; tries++) {
        if (tries == TIME_TRIES || spent_ms > TIME_AGAIN_MS)
            renderer_set_yield_point(desc->renderer, NULL);
        if (!time_frames(desc, ms, &is_paused, err))
            return NULL;
        spent_ms += ms[0] + ms[1];
    }
    return pack_or_fail(json_pack("{s:f,s:f}", "cold_ms", ms[0], "warm_ms", ms[1]), err);
}

json_t *measure_step(const struct measure_desc *desc, int *image_fd, struct error *err)
{
    const char *step = json_string_value(json_object_get(desc->step, "step"));
    *image_fd = -1;
    if (step && strcmp(step, "probe") == 0)
        return probe(desc, err);
    if (step && strcmp(step, "reference") == 0)
        return trace_band(desc, err);
    if (step && strcmp(step, "show") == 0)
        return show_reference(desc, image_fd, err);
    if (step && strcmp(step, "error") == 0)
        return measure_error(desc, image_fd, err);
    if (step && strcmp(step, "time") == 0)
        return measure_time(desc, err);
    error_set(err, ERROR_INTERNAL, "worker: no step '%s' of a measurement", step ? step : "");
    return NULL;
}
