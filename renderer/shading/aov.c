/* SPDX-License-Identifier: MIT */
/* The pass of the auxiliary outputs, and their way into images. */
#include "renderer/shading/aov.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/shading/atmosphere_light.h"
#include "renderer/shading/smoke.h"
#include "shaders/shared/bindings.h"

enum { DEFINES_BYTES = 640 };
static const uint32_t OPTICAL_DEPTH = 1u << VIEW_OUTPUT_OPTICAL_DEPTH;
static const uint32_t FOLLOW_LISTS = /* outputs that sum or multiply along the lists of layers */
    1u << VIEW_OUTPUT_TRANSMITTANCE | 1u << VIEW_OUTPUT_OPTICAL_DEPTH;

/* name: of its AT_ define in shaders/shading/aov.comp.glsl. */
static const struct {
    const char *name;
    int channels;
    enum image_component component;
} kinds[VIEW_OUTPUT_COUNT] = {
    [VIEW_OUTPUT_COLOR] = {NULL, 4, IMAGE_F32},
    [VIEW_OUTPUT_DEPTH] = {"DEPTH", 1, IMAGE_F32},
    [VIEW_OUTPUT_NORMAL] = {"NORMAL", 3, IMAGE_F32},
    [VIEW_OUTPUT_ALBEDO] = {"ALBEDO", 3, IMAGE_F32},
    [VIEW_OUTPUT_NODE] = {"NODE", 1, IMAGE_U32},
    [VIEW_OUTPUT_MATERIAL] = {"MATERIAL", 1, IMAGE_U32},
    [VIEW_OUTPUT_POSITION] = {"POSITION", 3, IMAGE_F32},
    [VIEW_OUTPUT_TRANSMITTANCE] = {"TRANSMITTANCE", 3, IMAGE_F32},
    [VIEW_OUTPUT_LIGHTS] = {"LIGHTS", 1, IMAGE_U32},
    [VIEW_OUTPUT_LAYERS] = {"LAYERS", 1, IMAGE_U32},
    [VIEW_OUTPUT_OPTICAL_DEPTH] = {"OPTICAL_DEPTH", 3, IMAGE_F32},
};

void aov_shape(enum view_output output, int *channels, enum image_component *component)
{
    *channels = kinds[output].channels;
    *component = kinds[output].component;
}

static bool is_wanted(const struct view *view, int output)
{
    return kinds[output].name && view->outputs & 1u << output;
}

static size_t words_per_pixel(const struct view *view)
{
    size_t words = 0;
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        words += is_wanted(view, i) ? (size_t)kinds[i].channels : 0;
    return words;
}

uint64_t aov_pixel_bytes(const struct view *view)
{
    return words_per_pixel(view) * 4;
}

/* Requirements of the program, in canonical order. */
static void describe(const struct window_frame *frame, const struct shade_facts *facts,
                     char text[DEFINES_BYTES])
{
    const struct view *view = frame->view;
    bool has_layers = facts->has_layers, has_media = has_layers && facts->has_media;
    bool has_lights = view->outputs & 1u << VIEW_OUTPUT_LIGHTS && frame->state->light_count;
    int used = snprintf(text, DEFINES_BYTES, "AOV_WORDS=%zu SAMPLES=%d%s%s%s%s",
                        words_per_pixel(view), frame->targets->samples,
                        has_layers ? " HAS_TRANSPARENT" : "", has_media ? " HAS_MEDIA" : "",
                        has_layers && frame->state->ground_plane.is_there ? " HAS_GROUND" : "",
                        frame->camera->is_orthographic ? " IS_ORTHOGRAPHIC" : "");
    int at = 0;
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        if (is_wanted(view, i)) {
            used +=
                snprintf(text + used, DEFINES_BYTES - (size_t)used, " AT_%s=%d", kinds[i].name, at);
            at += kinds[i].channels;
        }
    if (has_media && view->outputs & FOLLOW_LISTS) {
        if (facts->may_surround)
            used += snprintf(text + used, DEFINES_BYTES - (size_t)used, " MEDIA_SURROUND");
        if (view->clip_plane_count)
            used += snprintf(text + used, DEFINES_BYTES - (size_t)used, " CUT_PLANES=%zu",
                             view->clip_plane_count);
    }
    if (view->outputs & OPTICAL_DEPTH) {
        char grids[SMOKE_DEFINES_BYTES];
        smoke_defines(frame, grids);
        used += snprintf(text + used, DEFINES_BYTES - (size_t)used, "%s%s",
                         view_has_atmosphere(view) ? " HAS_HAZE" : "", grids);
    }
    if (has_lights)
        snprintf(text + used, DEFINES_BYTES - (size_t)used, " HAS_LIGHTS %s", facts->lists);
}

static struct program_desc program_of(const char *defines)
{
    return (struct program_desc){
        .label = "aov.comp.glsl", .compute = "aov.comp.glsl", .defines = defines};
}

void aov_list_programs(const struct window_frame *frame, const struct shade_facts *facts,
                       bool is_conditional, struct program_list *list)
{
    char defines[DEFINES_BYTES];
    describe(frame, facts, defines);
    const struct program_desc desc = program_of(defines);
    program_list_add(list, "aov", &desc, is_conditional);
}

static bool run(struct aov *aov, const struct shade_desc *desc, struct error *err)
{
    const struct window_frame *frame = desc->frame;
    char defines[DEFINES_BYTES];
    const struct shade_facts facts = shade_facts_of(desc);
    describe(frame, &facts, defines);
    const struct program_desc composed = program_of(defines);
    const struct gl_program *program = program_cache_get(frame->programs, &composed, err);
    if (!program)
        return false;
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){
                                         .pass = "aov",
                                         .because = "auxiliary outputs were asked for",
                                         .stage = REPORT_SHADE,
                                     });
    gl_program_use(program);
    window_set_view_ray(frame, program);
    window_set_clip_planes(frame, 1, program);
    window_set_world_axes(frame, program);
    window_set_samples(frame, program);
    window_bind_targets(frame, program);
    desc->layers->method->bind(desc->layers, program);
    if (strstr(defines, " HAS_HAZE"))
        atmosphere_bind_depth(frame, program);
    if (strstr(defines, " HAS_GRIDS"))
        smoke_bind_values(frame, program);
    if (strstr(defines, " HAS_LIGHTS"))
        light_lists_bind(desc->lists, program);
    uint64_t pixels = (uint64_t)frame->window.width * (uint64_t)frame->window.height;
    gl_buffer_bind_storage_range(&aov->words, 0, pixels * aov_pixel_bytes(frame->view),
                                 BIND_STATISTICS);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    window_dispatch_pixels(frame);
    gpu_scope_end(frame->timeline);
    return true;
}

/* The list is walked for the nearest surface and, twice where a medium may surround the eye, for
 * what it lets through; grids are followed cell by cell; a linked light list is counted by walking
 * it. */
static bool check_loops(const struct shade_desc *desc, struct error *err)
{
    const uint32_t outputs = desc->frame->view->outputs;
    const struct layers *layers = desc->layers;
    bool counts_lights = outputs & 1u << VIEW_OUTPUT_LIGHTS && desc->frame->state->light_count &&
                         !light_lists_clusters(desc->lists);
    uint64_t steps = layers->longest;
    if (outputs & FOLLOW_LISTS)
        steps += loop_steps_of_layers(layers->longest, layers->may_surround);
    if (outputs & OPTICAL_DEPTH)
        steps += smoke_loop_steps(desc->frame->state);
    if (counts_lights)
        steps += light_lists_longest(desc->lists);
    if (steps <= LOOP_STEPS_MAX)
        return true;
    return error_set(
        err, ERROR_OVER_BUDGET,
        "outputs of %llu layers, density grids and linked light lists at one pixel take %llu loop "
        "steps, limit is %d: ask for fewer outputs, or for clustered light lists",
        (unsigned long long)layers->longest, (unsigned long long)steps, LOOP_STEPS_MAX);
}

/* The pixel of the image where a row of the share begins. */
static size_t first_of_row(const struct window_share *share, int row, const struct image *image)
{
    return (size_t)(share->image_y + row) * (size_t)image->width_px + (size_t)share->image_x;
}

/* The first word of the output in each pixel's words is words[0]; the stride is in words. */
static void copy_output(const struct camera_window *w, const struct window_share *share,
                        const uint32_t *words, size_t stride, struct image *image)
{
    uint32_t *pixels = image->pixels; /* f32 and u32 alike are moved as words */
    size_t count = (size_t)image->channels;
    for (int y = 0; y < share->height; y++) { /* GL's first row is at the bottom */
        size_t row = (size_t)(w->height - 1 - share->window_y - y);
        const uint32_t *in = words + (row * (size_t)w->width + (size_t)share->window_x) * stride;
        uint32_t *out = pixels + first_of_row(share, y, image) * count;
        for (int x = 0; x < share->width; x++, in += stride, out += count)
            memcpy(out, in, count * sizeof *out);
    }
}

/* From eye-relative to world space, in f64. */
static void add_eye(const struct window_share *share, const double eye[3], struct image *image)
{
    for (int y = 0; y < share->height; y++) {
        float *row = (float *)image->pixels + first_of_row(share, y, image) * 3;
        for (int i = 0; i < 3 * share->width; i++)
            row[i] = (float)((double)row[i] + eye[i % 3]);
    }
}

bool aov_read(struct aov *aov, const struct shade_desc *desc, struct image *outputs,
              struct error *err)
{
    const struct window_frame *frame = desc->frame;
    const struct camera_window *w = &frame->window;
    const struct window_share share = window_share_of(w, frame->view);
    size_t stride = words_per_pixel(frame->view), at = 0;
    uint64_t bytes = (uint64_t)w->width * (uint64_t)w->height * stride * 4;
    if (!check_loops(desc, err) ||
        !gl_buffer_reserve(
            &aov->words,
            &(struct gl_buffer_desc){.label = "frame.aov", .size_bytes = bytes, .is_dynamic = true},
            false, err) ||
        !run(aov, desc, err))
        return false;
    uint32_t *words = calloc(1, bytes); /* a lost context reads nothing */
    if (!words)
        return error_set(err, ERROR_NO_MEMORY, "reading back %llu bytes",
                         (unsigned long long)bytes);
    gpu_timeline_will_wait(frame->timeline);
    gl_buffer_read(&aov->words, 0, bytes, words);
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        if (is_wanted(frame->view, i)) {
            copy_output(w, &share, words + at, stride, &outputs[i]);
            at += (size_t)kinds[i].channels;
        }
    if (is_wanted(frame->view, VIEW_OUTPUT_POSITION))
        add_eye(&share, frame->camera->eye, &outputs[VIEW_OUTPUT_POSITION]);
    free(words);
    return true;
}

void aov_finish(struct aov *aov)
{
    gl_buffer_finish(&aov->words);
}
