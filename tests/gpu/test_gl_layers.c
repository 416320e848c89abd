/* SPDX-License-Identifier: MIT */
/* Claims about the layers between tests and GL, shown with pairs of dispatches that are racy on
 * purpose: a barrier that is missing, or has the wrong bit, is named; another order shows in the
 * result; what is ordered or independent is left alone; waits and bytes are counted. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/gl/context.h"
#include "renderer/gl/object.h"
#include "tests/support/gl_counts.h"
#include "tests/support/render_support.h"

enum { ITEMS = 256, BUFFERS = 3, TO = 0, FROM = 1 /* bindings */ };

/* A kernel that adds a constant on the way from one buffer to another. */
static const char from_block[] =
    "#version 450 core\n"
    "layout(local_size_x = 64) in;\n"
    "layout(std430, binding = 0) writeonly buffer to_block { uint to[]; };\n"
    "layout(std430, binding = 1) readonly buffer from_block { uint from[]; };\n"
    "uniform uint u_add;\n"
    "void main() { uint i = gl_GlobalInvocationID.x; to[i] = from[i] + u_add; }\n";
static const char from_texture[] =
    "#version 450 core\n"
    "layout(local_size_x = 64) in;\n"
    "layout(std430, binding = 0) writeonly buffer to_block { uint to[]; };\n"
    "layout(binding = 1) uniform usamplerBuffer u_from;\n"
    "uniform uint u_add;\n"
    "void main() { int i = int(gl_GlobalInvocationID.x); to[i] = texelFetch(u_from, i).x + u_add; "
    "}\n";

struct rig {
    struct gl_context *context;
    struct gl_buffer buffers[BUFFERS]; /* the first one counts from 0, the others are 0 */
    GLuint add, add_texels;            /* programs */
};

static GLuint link_kernel(const char *text, const char *label)
{
    GLuint shader = glCreateShader(GL_COMPUTE_SHADER), program = glCreateProgram();
    GLint linked = 0;
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    glAttachShader(program, shader);
    glDeleteShader(shader);
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    assert_true(linked);
    glObjectLabel(GL_PROGRAM, program, -1, label);
    return program;
}

/* *state is the layers, and then the rig on them. */
static int open_rig(void **state)
{
    static const char *const labels[BUFFERS] = {"test.a", "test.b", "test.c"};
    struct error err = {0};
    uint32_t items[ITEMS];
    struct rig *rig = calloc(1, sizeof *rig);
    assert_non_null(rig);
    gl_hooks_install(*state);
    rig->context = render_rig_context(true);
    for (int b = 0; b < BUFFERS; b++) {
        for (uint32_t i = 0; i < ITEMS; i++)
            items[i] = b ? 0 : i;
        assert_true(gl_buffer_init(
            &rig->buffers[b],
            &(struct gl_buffer_desc){.label = labels[b], .size_bytes = sizeof items, .data = items},
            &err));
    }
    rig->add = link_kernel(from_block, "test.add");
    rig->add_texels = link_kernel(from_texture, "test.add_texels");
    *state = rig;
    return 0;
}

static int close_rig(void **state)
{
    struct rig *rig = *state;
    glDeleteProgram(rig->add);
    glDeleteProgram(rig->add_texels);
    for (int b = 0; b < BUFFERS; b++)
        gl_buffer_finish(&rig->buffers[b]);
    gl_context_destroy(rig->context);
    gl_hooks_install(&(struct gl_hooks_desc){0});
    free(rig);
    return 0;
}

static void add(const struct rig *rig, int from, int to, uint32_t constant)
{
    glUseProgram(rig->add);
    glProgramUniform1ui(rig->add, glGetUniformLocation(rig->add, "u_add"), constant);
    gl_buffer_bind_storage(&rig->buffers[from], FROM);
    gl_buffer_bind_storage(&rig->buffers[to], TO);
    glDispatchCompute(ITEMS / 64, 1, 1);
}

static void add_texels(const struct rig *rig, const struct gl_texture *from, int to)
{
    glUseProgram(rig->add_texels);
    gl_texture_bind(from, FROM);
    gl_buffer_bind_storage(&rig->buffers[to], TO);
    glDispatchCompute(ITEMS / 64, 1, 1);
}

/* Of the last item, which is ITEMS - 1 in the first buffer. */
static uint32_t last_item(const struct rig *rig, int buffer)
{
    uint32_t item;
    gl_buffer_read(&rig->buffers[buffer], sizeof item * (ITEMS - 1), sizeof item, &item);
    return item;
}

/* One fault at least; its message has all of these words, NULL ends them. */
static void expect_fault(const char *const *words)
{
    char text[512];
    assert_true(gl_faults_take(text, sizeof text) > 0);
    for (; *words; words++)
        if (!strstr(text, *words))
            fail_msg("'%s' does not name '%s'", text, *words);
}

static void expect_none(void)
{
    char text[512];
    if (gl_faults_take(text, sizeof text))
        fail_msg("%s", text);
}

/* ---- the tracker ---- */

static void a_read_of_what_was_just_written_is_named(void **state)
{
    struct rig *rig = *state;
    add(rig, 0, 1, 1);
    add(rig, 1, 2, 10);
    expect_fault((const char *[]){"read after write", "test.add writes 'test.b'",
                                  "test.add reads it", "SHADER_STORAGE_BARRIER_BIT", NULL});
}

static void a_write_over_what_is_still_read_is_named(void **state)
{
    struct rig *rig = *state;
    add(rig, 1, 2, 1);
    add(rig, 0, 1, 1);
    expect_fault((const char *[]){"write after read", "test.add reads 'test.b'",
                                  "test.add writes it", NULL});
}

static void two_writes_of_one_buffer_are_named(void **state)
{
    struct rig *rig = *state;
    add(rig, 0, 2, 1);
    add(rig, 1, 2, 1);
    expect_fault((const char *[]){"write after write", "'test.c'", NULL});
}

static void a_barrier_with_the_right_bit_orders_and_any_other_does_not(void **state)
{
    struct rig *rig = *state;
    struct gl_texture view = {0};
    struct error err = {0};
    assert_true(gl_texture_init_buffer(&view, "test.view", GL_R32UI, &rig->buffers[1], &err));
    add(rig, 0, 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    add(rig, 1, 2, 10);
    expect_none();
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    add_texels(rig, &view, 2); /* 'test.b' is read as a texture, which has a bit of its own */
    expect_fault((const char *[]){"test.add_texels reads it as a texture",
                                  "TEXTURE_FETCH_BARRIER_BIT", NULL});
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    add_texels(rig, &view, 2);
    expect_none();
    gl_texture_finish(&view);
}

static void a_read_back_needs_its_bit(void **state)
{
    struct rig *rig = *state;
    uint32_t item;
    add(rig, 0, 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    glGetNamedBufferSubData(rig->buffers[1].name, 0, sizeof item, &item);
    expect_fault((const char *[]){"glGetNamedBufferSubData reads it", "BUFFER_UPDATE", NULL});
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glGetNamedBufferSubData(rig->buffers[1].name, 0, sizeof item, &item);
    expect_none();
}

/* The whole view of a buffer that was made again with another storage. */
static void a_texture_of_a_deleted_buffer_is_named(void **state)
{
    struct rig *rig = *state;
    struct gl_texture view = {0};
    struct error err = {0};
    assert_true(gl_texture_init_buffer(&view, "test.view", GL_R32UI, &rig->buffers[1], &err));
    gl_buffer_finish(&rig->buffers[1]);
    add_texels(rig, &view, 2);
    expect_fault((const char *[]){"'test.view'", "'test.b' that was deleted", NULL});
    gl_texture_finish(&view);
}

/* ---- the other order ---- */

static void without_a_barrier_the_later_dispatch_runs_first(void **state)
{
    struct rig *rig = *state;
    add(rig, 0, 1, 1);
    add(rig, 1, 2, 10);
    assert_int_equal(last_item(rig, 2), 10); /* the first dispatch had not run yet */
    assert_int_equal(last_item(rig, 1), ITEMS);
}

static void with_a_barrier_the_order_stays(void **state)
{
    struct rig *rig = *state;
    add(rig, 0, 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    add(rig, 1, 2, 10);
    assert_int_equal(last_item(rig, 2), ITEMS - 1 + 11);
}

/* Though uniforms and bindings change while dispatches are held back. */
static void independent_dispatches_give_the_same_in_every_order(void **state)
{
    struct rig *rig = *state;
    add(rig, 0, 1, 1);
    add(rig, 0, 2, 20);
    glProgramUniform1ui(rig->add, glGetUniformLocation(rig->add, "u_add"), 300);
    assert_int_equal(last_item(rig, 1), ITEMS - 1 + 1);
    assert_int_equal(last_item(rig, 2), ITEMS - 1 + 20);
    glDispatchCompute(ITEMS / 64, 1, 1); /* with what was set last */
    assert_int_equal(last_item(rig, 2), ITEMS - 1 + 300);
}

/* ---- counts ---- */

static void waits_bytes_and_calls_are_counted(void **state)
{
    struct rig *rig = *state;
    struct gl_counts before, after, counts;
    gl_counts_get(&before);
    add(rig, 0, 1, 1); /* six calls */
    glFinish();
    last_item(rig, 1); /* done already: two calls and no wait */
    add(rig, 0, 2, 1);
    last_item(rig, 2); /* waits */
    last_item(rig, 2); /* done already */
    gl_counts_get(&after);
    counts = gl_counts_between(&before, &after);
    assert_int_equal(counts.calls, 6 + 1 + 2 + 6 + 2 + 2);
    assert_int_equal(counts.dispatches, 2);
    assert_int_equal(counts.by_function[GL_FUNCTION_Finish], 1);
    assert_int_equal(counts.waits[GL_WAIT_FINISH], 1);
    assert_int_equal(counts.waits[GL_WAIT_BUFFER_READ], 1);
    assert_int_equal(gl_counts_waits(&counts), 2);
    assert_int_equal(counts.bytes_down, 12);
    assert_int_equal(counts.bytes_up, 0);
    assert_true(counts.processor_ns > 0);
}

static void a_fence_that_has_passed_spares_the_wait(void **state)
{
    struct rig *rig = *state;
    struct gl_counts before, after, counts;
    struct gl_fence fence = {0};
    gl_counts_get(&before);
    add(rig, 0, 1, 1);
    gl_fence_set(&fence);
    while (!gl_fence_wait(&fence, 1000000000))
        continue; /* one wait, however often it is asked */
    last_item(rig, 1);
    gl_fence_finish(&fence);
    gl_counts_get(&after);
    counts = gl_counts_between(&before, &after);
    assert_int_equal(counts.waits[GL_WAIT_FENCE], 1);
    assert_int_equal(gl_counts_waits(&counts), 1);
}

/* The driver would refuse: the query never began. */
static void stamps_of_timers_that_are_played_are_not_asked_of_the_driver(void **state)
{
    GLuint query;
    GLuint64 is_there = GL_FALSE, stamp_ns = 1;
    (void)state;
    glCreateQueries(GL_TIMESTAMP, 1, &query);
    glGetQueryObjectui64v(query, GL_QUERY_RESULT_AVAILABLE, &is_there);
    glGetQueryObjectui64v(query, GL_QUERY_RESULT, &stamp_ns);
    assert_int_equal(glGetError(), GL_NO_ERROR);
    assert_true(is_there);
    assert_int_equal(stamp_ns, 0);
    glDeleteQueries(1, &query);
}

/* Of two pieces of work the first is waited for, then the second. */
static void a_wait_while_the_device_has_more_to_do_is_no_stall(void **state)
{
    struct rig *rig = *state;
    struct gl_counts before, after, counts;
    struct gl_fence first = {0}, second = {0};
    gl_counts_get(&before);
    add(rig, 0, 1, 1);
    gl_fence_set(&first);
    add(rig, 0, 2, 1);
    gl_fence_set(&second);
    while (!gl_fence_wait(&first, 1000000000))
        continue;
    gl_counts_get(&after);
    counts = gl_counts_between(&before, &after);
    assert_int_equal(gl_counts_waits(&counts), 1);
    assert_int_equal(counts.stalls, 0);
    add(rig, 0, 1, 1);
    glFinish();
    gl_counts_get(&after);
    counts = gl_counts_between(&before, &after);
    assert_int_equal(gl_counts_waits(&counts), 2);
    assert_int_equal(counts.stalls, 1);
    gl_fence_finish(&first);
    gl_fence_finish(&second);
}

int main(void)
{
    static struct gl_hooks_desc tracking = {.tracks = true}, reordering = {.reorders = true},
                                counting = {.counts = true},
                                lying = {.hostility = {.timers = GL_TIMERS_FALSE}};
    gl_context_destroy(render_rig_context(false));
#define WITH(layers, claim) \
    cmocka_unit_test_prestate_setup_teardown(claim, open_rig, close_rig, &(layers))
    const struct CMUnitTest tests[] = {
        WITH(tracking, a_read_of_what_was_just_written_is_named),
        WITH(tracking, a_write_over_what_is_still_read_is_named),
        WITH(tracking, two_writes_of_one_buffer_are_named),
        WITH(tracking, a_barrier_with_the_right_bit_orders_and_any_other_does_not),
        WITH(tracking, a_read_back_needs_its_bit),
        WITH(tracking, a_texture_of_a_deleted_buffer_is_named),
        WITH(reordering, without_a_barrier_the_later_dispatch_runs_first),
        WITH(reordering, with_a_barrier_the_order_stays),
        WITH(reordering, independent_dispatches_give_the_same_in_every_order),
        WITH(counting, waits_bytes_and_calls_are_counted),
        WITH(counting, a_fence_that_has_passed_spares_the_wait),
        WITH(lying, stamps_of_timers_that_are_played_are_not_asked_of_the_driver),
        WITH(counting, a_wait_while_the_device_has_more_to_do_is_no_stall),
    };
#undef WITH
    return cmocka_run_group_tests(tests, NULL, NULL);
}
