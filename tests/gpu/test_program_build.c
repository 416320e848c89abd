/* SPDX-License-Identifier: MIT */
/* Programs that are known beforehand are begun together: a driver with threads of its own compiles
 * them at a time, and is asked for each when it is needed. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "tests/support/gl_hooks.h"
#include "tests/support/image_checks.h"
#include "tests/support/render_support.h"

static struct {
    PFNGLLINKPROGRAMPROC link;
    PFNGLGETPROGRAMIVPROC ask;
    int links, questions;
    int together; /* the most links between two questions */
    int since;
} driver;

static void link_program(GLuint program)
{
    driver.links++;
    driver.since++;
    if (driver.since > driver.together)
        driver.together = driver.since;
    driver.link(program);
}

static void ask_program(GLuint program, GLenum what, GLint *value)
{
    if (what == GL_LINK_STATUS) {
        driver.questions++;
        driver.since = 0;
    }
    driver.ask(program, what, value);
}

static void watch(void)
{
    memset(&driver, 0, sizeof driver);
    GL_SPY_BEGIN(LinkProgram, driver.link, link_program);
    GL_SPY_BEGIN(GetProgramiv, driver.ask, ask_program);
}

static void stop_watching(void)
{
    GL_SPY_END(LinkProgram, driver.link);
    GL_SPY_END(GetProgramiv, driver.ask);
}

struct fixture {
    struct gl_context *context;
    struct program_cache *programs;
};

static int setup(void **state)
{
    struct error err = {0};
    struct fixture *fixture = calloc(1, sizeof *fixture);
    assert_non_null(fixture);
    fixture->context = /* not strict: one program does not compile */
        gl_context_create(&(struct gl_context_desc){.device = 0}, &err);
    fixture->programs = program_cache_create(NULL, &err);
    assert_true(fixture->context && fixture->programs);
    *state = fixture;
    return 0;
}

static int teardown(void **state)
{
    struct fixture *fixture = *state;
    program_cache_destroy(fixture->programs);
    gl_context_destroy(fixture->context);
    free(fixture);
    return 0;
}

static struct program_desc program_of(const char *defines)
{
    return (struct program_desc){
        .label = "test.build", .compute = "selftest.comp.glsl", .defines = defines};
}

static struct program_cache_stats stats_of(const struct program_cache *programs)
{
    struct program_cache_stats stats;
    program_cache_get_stats(programs, &stats);
    return stats;
}

static void nothing_is_asked_before_programs_are_needed(void **state)
{
    static const char *const defines[] = {"A", "B", "C"};
    const struct fixture *fixture = *state;
    struct error err = {0};
    watch();
    for (int i = 0; i < 3; i++) {
        const struct program_desc desc = program_of(defines[i]);
        program_cache_prepare(fixture->programs, &desc);
        program_cache_prepare(fixture->programs, &desc);
        assert_int_equal(program_cache_find(fixture->programs, &desc), PROGRAM_ABSENT);
    }
    stop_watching();
    assert_int_equal(driver.links, 3);
    assert_int_equal(driver.questions, 0);
    assert_int_equal(stats_of(fixture->programs).misses, 0);
    for (int i = 0; i < 3; i++) {
        const struct program_desc desc = program_of(defines[i]);
        const struct gl_program *program = program_cache_get(fixture->programs, &desc, &err);
        if (!program)
            fail_msg("%s", err.message);
        gl_program_set_u(program, "u_items", 3);
        gl_program_use(program);
        assert_ptr_equal(program_cache_get(fixture->programs, &desc, &err), program);
        assert_int_equal(program_cache_find(fixture->programs, &desc), PROGRAM_IN_MEMORY);
    }
    const struct program_cache_stats stats = stats_of(fixture->programs);
    assert_int_equal(stats.misses, 3);
    assert_int_equal(stats.hits, 3);
    assert_true(stats.compile_ms > 0);
}

static void a_program_that_fails_is_reported_when_it_is_needed(void **state)
{
    const struct fixture *fixture = *state;
    const struct program_desc desc = program_of("main=3");
    program_cache_prepare(fixture->programs, &desc);
    for (int i = 0; i < 2; i++) {
        struct error err = {0};
        assert_null(program_cache_get(fixture->programs, &desc, &err));
        assert_int_equal(err.code, ERROR_INTERNAL);
        assert_non_null(strstr(err.message, "selftest.comp.glsl:"));
    }
    assert_int_equal(stats_of(fixture->programs).misses, 0);
}

static void programs_that_nobody_needs_leave_nothing(void **state)
{
    const struct fixture *fixture = *state;
    const struct program_desc desc = program_of("UNUSED");
    program_cache_prepare(fixture->programs, &desc);
}

/* The most programs that were begun together for the first picture of the demonstration scene. */
static int render_first(bool poses_as_hardware, struct frame *frame, bool *is_parallel)
{
    struct renderer_info info;
    struct rig_scene demo;
    const struct view view = {
        .width_px = 64,
        .height_px = 48,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {3, 4.5, 3}, .target = {0, 1.5, 0}},
        .quality = {.shadow_resolution = 64}};
    struct renderer *renderer = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .hooks.poses_as_hardware = poses_as_hardware});
    rig_demo_open(&demo, renderer, "demo", 64);
    renderer_get_info(renderer, &info);
    *is_parallel = !info.is_software && /* else threads of the driver take the frame's own time */
                   (epoxy_has_gl_extension("GL_KHR_parallel_shader_compile") ||
                    epoxy_has_gl_extension("GL_ARB_parallel_shader_compile"));
    watch();
    shoot(renderer, &demo, &view, frame);
    stop_watching();
    assert_true(frame->report.counts.programs_built > 3); /* others are those of the start */
    rig_scene_finish(&demo, renderer);
    renderer_destroy(renderer);
    return driver.together;
}

static void a_frame_begins_its_programs_together(void **state)
{
    struct frame alone, together;
    bool is_parallel;
    (void)state;
    for (int poses = 0; poses < 2; poses++) {
        int most = render_first(poses, poses ? &together : &alone, &is_parallel);
        if (is_parallel ? most < 2 : most != 1)
            fail_msg("%d programs were begun together", most);
    }
    assert_int_equal(alone.outputs[VIEW_OUTPUT_COLOR].width_px,
                     together.outputs[VIEW_OUTPUT_COLOR].width_px);
    frame_finish(&alone);
    frame_finish(&together);
}

int main(void)
{
    gl_context_destroy(render_rig_context(false));
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(nothing_is_asked_before_programs_are_needed, setup,
                                        teardown),
        cmocka_unit_test_setup_teardown(a_program_that_fails_is_reported_when_it_is_needed, setup,
                                        teardown),
        cmocka_unit_test_setup_teardown(programs_that_nobody_needs_leave_nothing, setup, teardown),
        cmocka_unit_test(a_frame_begins_its_programs_together),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
