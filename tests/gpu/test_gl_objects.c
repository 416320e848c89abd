/* SPDX-License-Identifier: MIT */
/* Writes, clears, reads and copies of buffers come behind all that shaders wrote; and drivers are
 * asked for errors where storages are large alone, without losing one. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "renderer/gl/context.h"
#include "renderer/gl/object.h"
#include "tests/support/gl_hooks.h"
#include "tests/support/render_support.h"

static struct {
    PFNGLMEMORYBARRIERPROC barrier;
    PFNGLGETERRORPROC get_error;
    GLbitfield bits; /* of barriers so far */
    int errors_asked;
    GLenum error; /* that the driver is made to tell once */
} spy;

static void spy_barrier(GLbitfield bits)
{
    spy.bits |= bits;
    spy.barrier(bits);
}

static GLenum spy_error(void)
{
    GLenum error = spy.error;
    spy.errors_asked++;
    spy.error = GL_NO_ERROR;
    return error;
}

static int begin_spying(void **state)
{
    (void)state;
    memset(&spy, 0, sizeof spy);
    GL_SPY_BEGIN(MemoryBarrier, spy.barrier, spy_barrier);
    GL_SPY_BEGIN(GetError, spy.get_error, spy_error);
    return 0;
}

static int end_spying(void **state)
{
    (void)state;
    GL_SPY_END(MemoryBarrier, spy.barrier);
    GL_SPY_END(GetError, spy.get_error);
    return 0;
}

static bool make(struct gl_buffer *buffer, uint64_t size_bytes, bool is_uploaded, struct error *err)
{
    return gl_buffer_init(buffer,
                          &(struct gl_buffer_desc){.label = "test.buffer",
                                                   .size_bytes = size_bytes,
                                                   .is_dynamic = !is_uploaded,
                                                   .is_uploaded = is_uploaded},
                          err);
}

static bool takes_barrier(GLbitfield bit)
{
    bool has = (spy.bits & bit) != 0;
    spy.bits = 0;
    return has;
}

static void what_shaders_may_write_is_waited_for(void **state)
{
    (void)state;
    const uint32_t word = 3;
    uint32_t back[2] = {0};
    struct error err = {0};
    struct gl_buffer buffer = {0}, other = {0};
    assert_true(make(&buffer, 64, false, &err) && make(&other, 64, true, &err));
    assert_false(takes_barrier(GL_ALL_BARRIER_BITS));
    gl_buffer_clear_u32(&buffer, 0, 64, 7);
    assert_true(takes_barrier(GL_BUFFER_UPDATE_BARRIER_BIT));
    gl_buffer_write(&buffer, 4, 4, &word);
    assert_true(takes_barrier(GL_BUFFER_UPDATE_BARRIER_BIT));
    gl_buffer_copy(&buffer, 0, &other, 8, 8);
    assert_true(takes_barrier(GL_BUFFER_UPDATE_BARRIER_BIT));
    gl_buffer_copy(&other, 8, &buffer, 32, 8);
    assert_true(takes_barrier(GL_BUFFER_UPDATE_BARRIER_BIT));
    gl_buffer_read(&buffer, 32, 8, back);
    assert_true(takes_barrier(GL_BUFFER_UPDATE_BARRIER_BIT));
    assert_int_equal(back[0], 7);
    assert_int_equal(back[1], word);
    const struct gl_buffer_desc grown = {.label = "test.buffer", .size_bytes = 640};
    assert_true(gl_buffer_reserve(&buffer, &grown, true, &err));
    assert_true(takes_barrier(GL_BUFFER_UPDATE_BARRIER_BIT));
    gl_buffer_finish(&buffer);
    gl_buffer_finish(&other);
}

static void what_shaders_read_alone_is_not_waited_for(void **state)
{
    (void)state;
    const uint32_t word = 3;
    struct error err = {0};
    struct gl_buffer buffer = {0};
    assert_true(make(&buffer, 64, true, &err));
    gl_buffer_write(&buffer, 4, 4, &word);
    const struct gl_buffer_desc grown = {
        .label = "test.buffer", .size_bytes = 640, .is_uploaded = true};
    assert_true(gl_buffer_reserve(&buffer, &grown, true, &err));
    gl_buffer_write(&buffer, 636, 4, &word);
    assert_false(takes_barrier(GL_ALL_BARRIER_BITS));
    gl_buffer_finish(&buffer);
}

static void small_storages_ask_for_no_error(void **state)
{
    (void)state;
    struct error err = {0};
    struct gl_buffer buffer = {0};
    struct gl_texture texture = {0};
    assert_true(make(&buffer, 4096, false, &err));
    assert_true(
        gl_texture_init(&texture,
                        &(struct gl_texture_desc){
                            .label = "test.texture", .format = GL_R32F, .width = 64, .height = 64},
                        &err));
    assert_int_equal(spy.errors_asked, 0);
    gl_texture_finish(&texture);
    gl_buffer_finish(&buffer);
}

static void a_large_storage_without_room_is_refused(void **state)
{
    (void)state;
    struct error err = {0};
    struct gl_buffer buffer = {0};
    spy.error = GL_OUT_OF_MEMORY;
    assert_false(make(&buffer, 1 << 20, false, &err));
    assert_int_equal(err.code, ERROR_NO_MEMORY);
    assert_non_null(strstr(err.message, "test.buffer"));
    assert_int_equal(buffer.name, 0);
}

/* Until now it was taken out of the driver, and nobody heard of it. */
static void no_other_error_is_swallowed(void **state)
{
    (void)state;
    static const struct {
        GLenum error;
        enum error_code code;
    } cases[] = {{GL_INVALID_OPERATION, ERROR_INTERNAL}, {GL_CONTEXT_LOST, ERROR_NO_DEVICE}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct error err = {0};
        struct gl_texture texture = {0};
        spy.error = cases[i].error;
        assert_false(gl_texture_init(
            &texture,
            &(struct gl_texture_desc){
                .label = "test.texture", .format = GL_R32F, .width = 1024, .height = 1024},
            &err));
        assert_int_equal(err.code, cases[i].code);
        assert_int_equal(texture.name, 0);
    }
}

int main(void)
{
    struct gl_context *context = render_rig_context(true);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(what_shaders_may_write_is_waited_for, begin_spying,
                                        end_spying),
        cmocka_unit_test_setup_teardown(what_shaders_read_alone_is_not_waited_for, begin_spying,
                                        end_spying),
        cmocka_unit_test_setup_teardown(small_storages_ask_for_no_error, begin_spying, end_spying),
        cmocka_unit_test_setup_teardown(a_large_storage_without_room_is_refused, begin_spying,
                                        end_spying),
        cmocka_unit_test_setup_teardown(no_other_error_is_swallowed, begin_spying, end_spying),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    gl_context_destroy(context);
    return failed;
}
