/* SPDX-License-Identifier: MIT */
/* Passes are timed without waiting for a device that is not our own processors: by timestamps where
 * those are true, which no measurement decides by chance, and else not at all. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "renderer/base/wall_clock.h"
#include "renderer/gl/scope.h"
#include "renderer/gl/selftest.h"
#include "tests/support/gl_hooks.h"
#include "tests/support/render_support.h"

enum { ANSWERS = 3 };

/* Stamps tell a share of the time that passed between the calls of glFinish around them. */
static struct {
    PFNGLFINISHPROC finish;
    PFNGLGETQUERYOBJECTUI64VPROC get_stamp;
    /* Of work that lasted long enough, one after the other; the last stays. */
    double shares[ANSWERS];
    double began_ms, lasted_ms;
    int finishes, stamps, answers;
} device;

static void finish_and_note(void)
{
    device.finish();
    device.finishes++;
    device.lasted_ms = wall_ms() - device.began_ms;
    device.began_ms = wall_ms();
}

static void tell_stamp(GLuint query, GLenum name, GLuint64 *value)
{
    (void)query, (void)name;
    bool is_first = device.stamps++ % 2 == 0;
    *value = is_first ? 0 : (GLuint64)(device.shares[device.answers] * device.lasted_ms * 1e6);
    if (!is_first && device.lasted_ms > 10 && device.answers < ANSWERS - 1)
        device.answers++;
}

static struct gl_context *create(bool poses_as_hardware)
{
    struct error err = {0};
    struct gl_context *context = gl_context_create(
        &(struct gl_context_desc){.is_strict = true, .poses_as_hardware = poses_as_hardware}, &err);
    if (!context)
        fail_msg("%s", err.message);
    return context;
}

static bool verdict(bool poses_as_hardware, const double shares[ANSWERS])
{
    struct error err = {0};
    struct gl_context *context = create(poses_as_hardware);
    struct program_cache *programs = program_cache_create(NULL, &err);
    memcpy(device.shares, shares, sizeof device.shares);
    device.stamps = device.answers = 0;
    GL_SPY_BEGIN(Finish, device.finish, finish_and_note);
    GL_SPY_BEGIN(GetQueryObjectui64v, device.get_stamp, tell_stamp);
    bool ok = gl_selftest(context, programs, &err);
    GL_SPY_END(Finish, device.finish);
    GL_SPY_END(GetQueryObjectui64v, device.get_stamp);
    if (!ok)
        fail_msg("%s", err.message);
    bool is_true = gl_context_limits(context)->has_true_timers;
    program_cache_destroy(programs);
    gl_context_destroy(context);
    return is_true;
}

static void stamps_of_quick_devices_are_believed(void **state)
{
    (void)state;
    assert_true(verdict(true, (double[]){0.15, 0.15, 0.15})); /* most was recording */
    assert_true(verdict(true, (double[]){1, 1, 1}));
    assert_true(verdict(true, (double[]){0.02, 0.02, 0.4})); /* another process was in the way */
}

static void stamps_that_lie_are_not_believed(void **state)
{
    (void)state;
    assert_false(verdict(true, (double[]){0.001, 0.001, 0.001}));
    assert_false(verdict(true, (double[]){0, 0, 0}));
    assert_false(verdict(true, (double[]){40, 40, 40}));
}

static void skip_without_software(void)
{
    struct gl_context *context = create(false);
    bool is_software = gl_context_limits(context)->is_software;
    gl_context_destroy(context);
    if (!is_software)
        skip();
}

static void no_stamp_decides_where_the_device_is_our_processors(void **state)
{
    (void)state;
    skip_without_software();
    assert_false(verdict(false, (double[]){1, 1, 1}));
    assert_int_equal(device.stamps, 0);
}

/* How often the device is waited for in a frame of three passes, and what is told of their times.
 */
static int time_passes(bool poses_as_hardware, bool has_true_timers, struct frame_report *report)
{
    struct error err = {0};
    struct gl_context *context = create(poses_as_hardware);
    gl_context_set_true_timers(context, has_true_timers);
    struct gpu_timeline *timeline = gpu_timeline_create(context, &err);
    memset(report, 0, sizeof *report);
    glFinish();
    device.finishes = 0;
    GL_SPY_BEGIN(Finish, device.finish, finish_and_note);
    for (int i = 0; i < 3; i++) {
        gpu_scope_begin(timeline,
                        &(struct gpu_scope_desc){.pass = i ? "gbuffer" : "shadow.deep",
                                                 .because = "a test",
                                                 .stage = i ? REPORT_SHADE : REPORT_SHADOW});
        gpu_scope_end(timeline);
    }
    gpu_timeline_collect(timeline, report);
    GL_SPY_END(Finish, device.finish);
    gpu_timeline_destroy(timeline);
    gl_context_destroy(context);
    assert_int_equal(report->pass_count, 2);
    return device.finishes;
}

static void nothing_is_waited_for_where_no_time_is_measured(void **state)
{
    (void)state;
    struct frame_report report;
    assert_int_equal(time_passes(true, false, &report), 0);
    for (int i = 0; i < 2; i++)
        assert_true(isnan(report.passes[i].ms));
    assert_true(isnan(report.stage_ms[REPORT_SHADE]) && isnan(report.stage_ms[REPORT_SHADOW]));
    assert_true(report.stage_ms[REPORT_READBACK] == 0);
}

static void nothing_is_waited_for_where_stamps_are_true(void **state)
{
    (void)state;
    struct frame_report report;
    assert_int_equal(time_passes(true, true, &report), 0);
    for (int i = 0; i < 2; i++)
        assert_true(report.passes[i].ms >= 0);
}

static void passes_are_fenced_where_the_device_is_our_processors(void **state)
{
    (void)state;
    struct frame_report report;
    skip_without_software();
    assert_int_equal(time_passes(false, false, &report), 6);
    for (int i = 0; i < 2; i++)
        assert_true(report.passes[i].ms >= 0);
}

static void count_call(void *context)
{
    ++*(int *)context;
}

static void a_scope_calls_nobody_and_a_wait_calls_the_waiter(void **state)
{
    struct error err = {0};
    (void)state;
    for (int poses_as_hardware = 0; poses_as_hardware < 2; poses_as_hardware++) {
        int calls = 0;
        struct gl_context *context = create(poses_as_hardware);
        struct gpu_timeline *timeline = gpu_timeline_create(context, &err);
        struct frame_report report = {0};
        gpu_timeline_set_wait_callback(
            timeline, &(struct gpu_wait_callback){.context = &calls, .before_wait = count_call});
        gpu_scope_begin(timeline, &(struct gpu_scope_desc){.pass = "gbuffer", .because = "a test"});
        gpu_scope_end(timeline);
        gpu_timeline_collect(timeline, &report);
        assert_int_equal(calls, 0);
        gpu_timeline_will_wait(timeline);
        assert_int_equal(calls, 1);
        gpu_timeline_destroy(timeline);
        gl_context_destroy(context);
    }
}

int main(void)
{
    gl_context_destroy(render_rig_context(true));
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stamps_of_quick_devices_are_believed),
        cmocka_unit_test(stamps_that_lie_are_not_believed),
        cmocka_unit_test(no_stamp_decides_where_the_device_is_our_processors),
        cmocka_unit_test(nothing_is_waited_for_where_no_time_is_measured),
        cmocka_unit_test(nothing_is_waited_for_where_stamps_are_true),
        cmocka_unit_test(passes_are_fenced_where_the_device_is_our_processors),
        cmocka_unit_test(a_scope_calls_nobody_and_a_wait_calls_the_waiter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
