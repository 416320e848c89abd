/* SPDX-License-Identifier: MIT */
/* Start-up self-test of the GL device. */
#include "renderer/gl/selftest.h"

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

#include "renderer/base/wall_clock.h"
#include "renderer/gl/object.h"
#include "shaders/shared/bindings.h"

enum {
    SIDE_PX = 192, /* 3x3 of the 64 px tiles that llvmpipe bins fragments in */
    PIXELS = SIDE_PX * SIDE_PX,
    LAYERS = 4, /* triangles on top of each other: the defect looked for drops all but the last */
    ITEMS = 70000, /* more than 65,535, and no multiple of the group size */
    GROUP = 64,
    MASK_SIDE_PX = 64,
    ID_FRONT = 7,
    ID_BEHIND = 9,
    TIMER_WORK_MS = 10, /* long against latency, short against a start */
    TIMER_REPEATS_MAX = 1 << 14,
    TIMER_ATTEMPTS = 3,
};

struct results { /* shaders/probes/selftest.glsl */
    uint32_t fragments, sum, mask_errors, partly, texels, pad;
};

struct selftest {
    struct gl_context *context;
    const struct gl_program *raster, *compute;
    struct gl_buffer results, values, texels;
    struct gl_texture texels_view, color, depth, samples, sample_depth;
    struct gl_framebuffer empty, masked, multisampled;
    struct gl_vertex_array vertex_array;
};

static bool init_programs(struct selftest *test, struct program_cache *programs, struct error *err)
{
    bool has_coverage = gl_context_limits(test->context)->has_post_depth_coverage;
    test->raster = program_cache_get(
        programs,
        &(struct program_desc){.label = "selftest.raster",
                               .vertex = "selftest.vert.glsl",
                               .fragment = "selftest.frag.glsl",
                               .defines = has_coverage ? "POST_DEPTH_COVERAGE" : NULL},
        err);
    test->compute = program_cache_get(
        programs,
        &(struct program_desc){.label = "selftest.compute", .compute = "selftest.comp.glsl"}, err);
    return test->raster && test->compute;
}

static bool init_buffers(struct selftest *test, struct error *err)
{
    static const float texels[6] = {1, 2, 3, 0.5f, 0.25f, 0.125f};
    gl_vertex_array_init(&test->vertex_array, "selftest");
    return gl_buffer_init(
               &test->results,
               &(struct gl_buffer_desc){.label = "selftest.results",
                                        .size_bytes = sizeof(struct results) + PIXELS * 4,
                                        .is_dynamic = true},
               err) &&
           gl_buffer_init(&test->values,
                          &(struct gl_buffer_desc){.label = "selftest.values",
                                                   .size_bytes = ITEMS * 4,
                                                   .is_dynamic = true},
                          err) &&
           gl_buffer_init(&test->texels,
                          &(struct gl_buffer_desc){.label = "selftest.texels",
                                                   .size_bytes = sizeof texels,
                                                   .data = texels},
                          err) &&
           gl_texture_init_buffer(&test->texels_view, "selftest.texels", GL_RGB32F, &test->texels,
                                  err);
}

static bool init_target(struct gl_texture *texture, const char *label, uint32_t format, int side,
                        int samples, struct error *err)
{
    return gl_texture_init(
        texture,
        &(struct gl_texture_desc){
            .label = label, .format = format, .width = side, .height = side, .samples = samples},
        err);
}

static bool init_targets(struct selftest *test, struct error *err)
{
    return init_target(&test->color, "selftest.color", GL_R32UI, SIDE_PX, 0, err) &&
           init_target(&test->depth, "selftest.depth", GL_DEPTH_COMPONENT32F, SIDE_PX, 0, err) &&
           gl_framebuffer_init(&test->empty,
                               &(struct gl_framebuffer_desc){
                                   .label = "selftest.empty", .width = SIDE_PX, .height = SIDE_PX},
                               err) &&
           gl_framebuffer_init(&test->masked,
                               &(struct gl_framebuffer_desc){.label = "selftest.masked",
                                                             .colors = {&test->color},
                                                             .depth = &test->depth},
                               err);
}

static bool init_multisampled(struct selftest *test, struct error *err)
{
    return init_target(&test->samples, "selftest.samples", GL_R32UI, MASK_SIDE_PX, 4, err) &&
           init_target(&test->sample_depth, "selftest.sample_depth", GL_DEPTH_COMPONENT32F,
                       MASK_SIDE_PX, 4, err) &&
           gl_framebuffer_init(&test->multisampled,
                               &(struct gl_framebuffer_desc){.label = "selftest.multisampled",
                                                             .colors = {&test->samples},
                                                             .depth = &test->sample_depth},
                               err);
}

static void finish(struct selftest *test)
{
    gl_vertex_array_finish(&test->vertex_array);
    gl_framebuffer_finish(&test->empty);
    gl_framebuffer_finish(&test->masked);
    gl_framebuffer_finish(&test->multisampled);
    gl_texture_finish(&test->texels_view);
    gl_texture_finish(&test->color);
    gl_texture_finish(&test->depth);
    gl_texture_finish(&test->samples);
    gl_texture_finish(&test->sample_depth);
    gl_buffer_finish(&test->results);
    gl_buffer_finish(&test->values);
    gl_buffer_finish(&test->texels);
}

static bool expect(const char *step, uint64_t expected, uint64_t found, struct error *err)
{
    if (expected == found)
        return true;
    return error_set(err, ERROR_NO_DEVICE, "self-test '%s': expected %llu, found %llu", step,
                     (unsigned long long)expected, (unsigned long long)found);
}

static void clear_results(struct selftest *test)
{
    gl_buffer_clear_u32(&test->results, 0, test->results.size_bytes, 0);
}

static struct results read_results(struct selftest *test)
{
    struct results results;
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    gl_buffer_read(&test->results, 0, sizeof results, &results);
    return results;
}

static void begin_pass(struct selftest *test, const struct gl_framebuffer *target, int side,
                       bool has_depth)
{
    glBindFramebuffer(GL_FRAMEBUFFER, target->name);
    glViewport(0, 0, side, side);
    glBindVertexArray(test->vertex_array.name);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    glDisable(GL_SCISSOR_TEST);
    (has_depth ? glEnable : glDisable)(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glDepthMask(GL_TRUE);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl_program_use(test->raster);
    gl_program_set_u(test->raster, "u_width", (uint32_t)side);
    gl_buffer_bind_storage(&test->results, BIND_STATISTICS);
}

static void draw(struct selftest *test, float z, float scale, uint32_t id)
{
    gl_program_set_f(test->raster, "u_z", z);
    gl_program_set_f(test->raster, "u_scale", scale);
    gl_program_set_u(test->raster, "u_id", id);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

/* Counts before and after differ from the draws when a driver throws commands of covered tiles
 * away. */
static bool check_fragments_without_target(struct selftest *test, struct error *err)
{
    clear_results(test);
    begin_pass(test, &test->empty, SIDE_PX, false);
    for (int i = 0; i < LAYERS; i++)
        draw(test, 0.5f, 1, 1);
    return expect("fragments without attachments", LAYERS * PIXELS, read_results(test).fragments,
                  err);
}

static bool check_fragments_with_depth(struct selftest *test, struct error *err)
{
    const float nothing = 0;
    clear_results(test);
    begin_pass(test, &test->masked, SIDE_PX, true);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glClearNamedFramebufferfv(test->masked.name, GL_DEPTH, 0, &nothing);
    for (int i = 1; i <= LAYERS; i++)
        draw(test, 0.125f * (float)i, 1, 1);
    if (!expect("fragments with depth and masked colour", LAYERS * PIXELS,
                read_results(test).fragments, err))
        return false;
    draw(test, 0.25f, 1, 1);
    return expect("fragments behind depth with early tests", LAYERS * PIXELS,
                  read_results(test).fragments, err);
}

static void dispatch(struct selftest *test, uint32_t step, uint32_t items)
{
    gl_program_use(test->compute);
    gl_program_set_u(test->compute, "u_step", step);
    gl_program_set_u(test->compute, "u_items", items);
    gl_buffer_bind_storage(&test->results, BIND_STATISTICS);
    gl_buffer_bind_storage(&test->values, BIND_SCAN);
    gl_texture_bind(&test->texels_view, UNIT_SHADOW_EVENTS);
    glDispatchCompute((items + GROUP - 1) / GROUP, 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

static uint64_t expected_sum(void)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < ITEMS; i++)
        sum += i % 97;
    return sum;
}

static bool check_compute(struct selftest *test, struct error *err)
{
    clear_results(test);
    dispatch(test, 0, ITEMS);
    dispatch(test, 1, ITEMS);
    struct results results = read_results(test);
    float texels;
    memcpy(&texels, &results.texels, sizeof texels);
    if (!expect("sum over 70,000 items written by another dispatch", expected_sum(), results.sum,
                err))
        return false;
    if (texels != 336.5f) /* (1.5, 2.25, 3.125) . (1, 10, 100) is exact */
        return error_set(err, ERROR_NO_DEVICE,
                         "self-test 'RGB32F buffer texture': expected 336.5, found %.9g",
                         (double)texels);
    return true;
}

/* A triangle in front covers part of the target; a larger one behind notes the samples that depth
 * left to it. */
static bool check_masks(struct selftest *test, struct error *err)
{
    const struct gl_limits *limits = gl_context_limits(test->context);
    if (!limits->has_post_depth_coverage || limits->max_integer_samples < 4)
        return true;
    if (!init_multisampled(test, err))
        return false;
    const float nothing = 0;
    const GLuint no_id[4] = {0};
    clear_results(test);
    begin_pass(test, &test->multisampled, MASK_SIDE_PX, true);
    glClearNamedFramebufferfv(test->multisampled.name, GL_DEPTH, 0, &nothing);
    glClearNamedFramebufferuiv(test->multisampled.name, GL_COLOR, 0, no_id);
    draw(test, 0.5f, 0.37f, ID_FRONT);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT); /* its notes must not arrive after the clear */
    clear_results(test);
    draw(test, 0.25f, 0.45f, ID_BEHIND);
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    gl_texture_bind(&test->samples, UNIT_GBUFFER_0);
    gl_program_set_u(test->compute, "u_width", MASK_SIDE_PX);
    gl_program_set_u(test->compute, "u_behind", ID_BEHIND);
    dispatch(test, 2, MASK_SIDE_PX * MASK_SIDE_PX);
    struct results results = read_results(test);
    if (results.partly < MASK_SIDE_PX) /* two slanted edges cross the target */
        return error_set(err, ERROR_NO_DEVICE,
                         "self-test 'multisampled edges': expected at least %d pixels, found %u",
                         MASK_SIDE_PX, results.partly);
    return expect("coverage masks that differ from samples", 0, results.mask_errors, err);
}

static void work(struct selftest *test, bool is_compute, int repeats)
{
    if (!is_compute)
        begin_pass(test, &test->empty, SIDE_PX, false);
    for (int i = 0; i < repeats; i++) {
        if (is_compute)
            dispatch(test, 1, ITEMS);
        else
            draw(test, 0.5f, 1, 1);
    }
}

/* How much of the wall clock's time two timestamps around the work tell of. */
static double reported_share(struct selftest *test, bool is_compute, int repeats,
                             const GLuint stamps[2], double *elapsed_ms)
{
    GLuint64 begin = 0, end = 0;
    glFinish();
    double begin_ms = wall_ms();
    glQueryCounter(stamps[0], GL_TIMESTAMP);
    work(test, is_compute, repeats);
    glQueryCounter(stamps[1], GL_TIMESTAMP);
    glFinish();
    *elapsed_ms = wall_ms() - begin_ms;
    glGetQueryObjectui64v(stamps[0], GL_QUERY_RESULT, &begin);
    glGetQueryObjectui64v(stamps[1], GL_QUERY_RESULT, &end);
    return end > begin ? (double)(end - begin) * 1e-6 / *elapsed_ms : 0;
}

/* Drivers record first and let the device work at the flush, so that true stamps tell of the work
 * alone: however quick it is, of more than a tenth, once of three times. Stamps that lie are wrong
 * by a factor of hundreds. */
static bool timer_is_true(struct selftest *test, bool is_compute, const GLuint stamps[2])
{
    const double least = 0.1, most = 1.1;
    int repeats = 1, attempts = 0;
    double elapsed_ms = 0;
    while (attempts < TIMER_ATTEMPTS) {
        double share = reported_share(test, is_compute, repeats, stamps, &elapsed_ms);
        if (elapsed_ms < TIMER_WORK_MS && repeats < TIMER_REPEATS_MAX)
            repeats *= 2;
        else if (share >= least && share <= most)
            return true;
        else
            attempts++;
    }
    return false;
}

/* Where our own processors are the device, passes are fenced at little cost: no stamps are needed.
 * (llvmpipe reports 1 ms for 1.6 s of drawing, and nothing for compute, which runs inside the
 * call.)
 */
static void measure_timers(struct selftest *test)
{
    GLuint stamps[2];
    if (gl_context_limits(test->context)->is_software) {
        gl_context_set_true_timers(test->context, false);
        return;
    }
    glCreateQueries(GL_TIMESTAMP, 2, stamps);
    gl_context_set_true_timers(test->context, timer_is_true(test, true, stamps) &&
                                                  timer_is_true(test, false, stamps));
    glDeleteQueries(2, stamps);
}

bool gl_selftest(struct gl_context *context, struct program_cache *programs, struct error *err)
{
    struct selftest test = {.context = context};
    bool ok = init_programs(&test, programs, err) && init_buffers(&test, err) &&
              init_targets(&test, err) && check_fragments_without_target(&test, err) &&
              check_fragments_with_depth(&test, err) && check_compute(&test, err) &&
              check_masks(&test, err);
    if (ok)
        measure_timers(&test);
    ok = ok && gl_context_check(context, "testing the device", err);
    finish(&test);
    return ok;
}
