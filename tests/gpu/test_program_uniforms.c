/* SPDX-License-Identifier: MIT */
/* Uniforms reach their programs, their locations are asked for while programs are built alone, and
 * values that a program has are not sent again. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "renderer/gl/context.h"
#include "renderer/gl/program.h"
#include "tests/support/gl_hooks.h"
#include "tests/support/render_support.h"

struct fixture {
    struct gl_context *context;
    struct program_cache *programs;
};

static const struct gl_program *build(const struct fixture *fixture, const char *compute,
                                      const char *defines)
{
    struct error err = {0};
    const struct program_desc desc = {
        .label = "test.uniforms", .compute = compute, .defines = defines};
    const struct gl_program *program = program_cache_get(fixture->programs, &desc, &err);
    if (!program)
        fail_msg("%s", err.message);
    return program;
}

static uint32_t value_of(const struct gl_program *program, const char *name)
{
    GLuint value = 0;
    glGetUniformuiv(program->name, glGetUniformLocation(program->name, name), &value);
    return value;
}

static void values_reach_the_program(void **state)
{
    const struct gl_program *program = build(*state, "selftest.comp.glsl", NULL);
    static const char *const names[] = {"u_step", "u_items", "u_width", "u_behind"};
    for (uint32_t value = 0; value < 3; value++) {
        for (uint32_t i = 0; i < 4; i++)
            gl_program_set_u(program, names[i], 10 * value + i);
        for (uint32_t i = 0; i < 4; i++)
            assert_int_equal(value_of(program, names[i]), 10 * value + i);
    }
    gl_program_set_u(program, "u_nobody_has_this", 7);
}

static void elements_of_arrays_have_their_own_values(void **state)
{
    static const char *const names[] = {"u_sample_positions[0]", "u_sample_positions[1]",
                                        "u_sample_positions[2]", "u_sample_positions[3]"};
    const struct gl_program *program = build(*state, "shadow_points_pixels.comp.glsl", "SAMPLES=4");
    for (int i = 0; i < 4; i++)
        gl_program_set_f2(program, names[i], (const float[2]){(float)i, 0.5f * (float)i});
    for (int i = 0; i < 4; i++) {
        float value[2] = {-1, -1};
        glGetUniformfv(program->name, glGetUniformLocation(program->name, names[i]), value);
        assert_true(value[0] == (float)i && value[1] == 0.5f * (float)i);
    }
}

static int locations_asked;

static GLint count_location(GLuint program, const GLchar *name)
{
    (void)program, (void)name;
    locations_asked++;
    return -1;
}

static void setters_ask_for_no_location(void **state)
{
    const struct gl_program *program = build(*state, "selftest.comp.glsl", NULL);
    PFNGLGETUNIFORMLOCATIONPROC kept;
    locations_asked = 0;
    GL_SPY_BEGIN(GetUniformLocation, kept, count_location);
    gl_program_set_u(program, "u_items", 4711);
    gl_program_set_u(program, "u_nobody_has_this", 1);
    GL_SPY_END(GetUniformLocation, kept);
    assert_int_equal(locations_asked, 0);
    assert_int_equal(value_of(program, "u_items"), 4711);
}

static int values_sent;
static PFNGLPROGRAMUNIFORM1UIPROC send_value;

static void count_value(GLuint program, GLint location, GLuint value)
{
    values_sent++;
    send_value(program, location, value);
}

static void a_value_is_sent_where_it_changes_alone(void **state)
{
    const struct gl_program *program = build(*state, "selftest.comp.glsl", NULL);
    gl_program_set_u(program, "u_items", 1);
    values_sent = 0;
    GL_SPY_BEGIN(ProgramUniform1ui, send_value, count_value);
    gl_program_set_u(program, "u_items", 5);
    gl_program_set_u(program, "u_items", 5);
    gl_program_set_u(program, "u_items", 6);
    gl_program_set_u(program, "u_items", 5);
    GL_SPY_END(ProgramUniform1ui, send_value);
    assert_int_equal(values_sent, 3);
    assert_int_equal(value_of(program, "u_items"), 5);
}

int main(void)
{
    struct error err = {0};
    struct fixture fixture = {.context = render_rig_context(true)};
    fixture.programs = program_cache_create(NULL, &err);
    if (!fixture.programs)
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_prestate(values_reach_the_program, &fixture),
        cmocka_unit_test_prestate(elements_of_arrays_have_their_own_values, &fixture),
        cmocka_unit_test_prestate(setters_ask_for_no_location, &fixture),
        cmocka_unit_test_prestate(a_value_is_sent_where_it_changes_alone, &fixture),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    program_cache_destroy(fixture.programs);
    gl_context_destroy(fixture.context);
    return failed;
}
