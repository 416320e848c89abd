/* SPDX-License-Identifier: MIT */
/* Signs that shaders find by pairs of floats are those that integers of 128 bits have. */
#include <epoxy/gl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/gl/object.h"
#include "shaders/shared/bindings.h"
#include "tests/support/shadow_rig.h"

enum { CASES = 4096, POINTS = 4 };

__extension__ typedef __int128 wide_int;

static struct shadow_rig rig;

static int sign_of(wide_int x)
{
    return (x > 0) - (x < 0);
}

/* Of columns, without one row. */
static wide_int minor_of(const float p[POINTS][4], int column, int row)
{
    wide_int m[3][3];
    for (int c = 0, i = 0; c < POINTS; c++) {
        if (c == column)
            continue;
        for (int r = 0, k = 0; r < 4; r++)
            if (r != row)
                m[i][k++] = (wide_int)p[c][r];
        i++;
    }
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

static int determinant_sign(const float p[POINTS][4])
{
    wide_int sum = 0;
    for (int row = 0; row < 4; row++)
        sum += (row % 2 ? -1 : 1) * (wide_int)p[0][row] * minor_of(p, 0, row);
    return sign_of(sum);
}

static int difference_sign(const float p[POINTS][4])
{
    return sign_of((wide_int)p[0][0] * (wide_int)p[1][1] - (wide_int)p[0][1] * (wide_int)p[1][0]);
}

static float whole(uint64_t *seed, double most)
{
    return (float)rint((2 * rig_random(seed) - 1) * most);
}

/* Whole coordinates: anywhere; or of a plane through three points, or next to it, where floats
 * cannot tell. */
static void make(uint64_t *seed, int i, float p[POINTS][4])
{
    double most = i % 3 == 0 ? 100 : 1 << 23;
    for (int c = 0; c < POINTS; c++) {
        for (int k = 0; k < 3; k++)
            p[c][k] = whole(seed, c > 0 && i % 3 == 2 ? most / 8 : most);
        p[c][3] = c == 0 && i % 5 == 0 ? -1.0F : c % 3 == 0 && i % 4 == 0 ? 0.0F : 1.0F;
    }
    if (i % 3 != 2)
        return;
    int steps[2] = {(int)(3 * rig_random(seed)) - 1, (int)(3 * rig_random(seed)) - 1};
    for (int k = 0; k < 3; k++) {
        double of_c = p[3][k] - p[1][k] * p[3][3];
        p[0][k] = (float)(p[1][k] + steps[0] * (double)(p[2][k] - p[1][k]) + steps[1] * of_c);
    }
    p[0][3] = 1;
    p[0][i % 9 / 3] += (float)((int)(3 * rig_random(seed)) - 1);
}

static void find(const float *points, int32_t *signs)
{
    struct error err = {0};
    const struct program_desc desc = {.label = "test", .compute = "exact_sign_probe.comp.glsl"};
    const struct gl_program *program = program_cache_get(rig.programs, &desc, &err);
    struct gl_buffer in = {0}, out = {0};
    if (!program)
        fail_msg("%s", err.message);
    assert_true(gl_buffer_init(&in,
                               &(struct gl_buffer_desc){.label = "test.points",
                                                        .size_bytes = 64ull * CASES,
                                                        .data = points},
                               &err));
    assert_true(gl_buffer_init(
        &out, &(struct gl_buffer_desc){.label = "test.signs", .size_bytes = 8ull * CASES}, &err));
    gl_buffer_bind_storage(&in, BIND_ENTRY_KEYS);
    gl_buffer_bind_storage(&out, BIND_ENTRY_COLORS);
    gl_program_use(program);
    gl_program_set_u(program, "u_count", CASES);
    glDispatchCompute(CASES / 64, 1, 1);
    gl_buffer_read(&out, 0, 8ull * CASES, signs);
    gl_buffer_finish(&in);
    gl_buffer_finish(&out);
}

/* scale: of all coordinates, a power of two, which changes no sign. */
static void compare(double scale)
{
    static float whole_points[CASES][POINTS][4], points[CASES][POINTS][4];
    static int32_t signs[CASES][2];
    uint64_t seed = 19;
    int zeros = 0, close = 0;
    for (int i = 0; i < CASES; i++) {
        make(&seed, i, whole_points[i]);
        for (int c = 0; c < POINTS; c++)
            for (int k = 0; k < 4; k++)
                points[i][c][k] = (float)(whole_points[i][c][k] * (k < 3 ? scale : 1));
    }
    find(points[0][0], signs[0]);
    for (int i = 0; i < CASES; i++) {
        int expected = determinant_sign(whole_points[i]);
        int difference = difference_sign(whole_points[i]);
        zeros += expected == 0;
        close += i % 3 == 2 && expected != 0;
        if (signs[i][0] != expected || signs[i][1] != difference)
            fail_msg("case %d, scale %g: %d and %d instead of %d and %d", i, scale, signs[i][0],
                     signs[i][1], expected, difference);
    }
    printf("scale %g: %d in one plane, %d beside it\n", scale, zeros, close);
    assert_true(zeros > 100 && close > 100);
}

static void signs_are_those_of_integers(void **state)
{
    (void)state;
    compare(1);
    compare(0x1p-40);
    compare(0x1p12);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {cmocka_unit_test(signs_are_those_of_integers)};
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
