/* SPDX-License-Identifier: MIT */
/* A texture view of a buffer shows the storage that the buffer has now, whatever names the driver
 * gives: this program asks Mesa to give names of deleted buffers again, as its releases from 25.0
 * on do unasked. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "renderer/gl/context.h"
#include "renderer/gl/object.h"
#include "tests/support/render_support.h"

static uint64_t texels_of(const struct gl_texture *view)
{
    GLint bytes = 0;
    glGetTextureLevelParameteriv(view->name, 0, GL_TEXTURE_BUFFER_SIZE, &bytes);
    return (uint64_t)bytes / 4;
}

/* Of its storage, which may have a little more than was asked for. */
static uint64_t bytes_of(const struct gl_buffer *buffer)
{
    GLint64 bytes = 0;
    glGetNamedBufferParameteri64v(buffer->name, GL_BUFFER_SIZE, &bytes);
    assert_true((uint64_t)bytes >= buffer->size_bytes &&
                (uint64_t)bytes <= buffer->size_bytes + 256);
    return (uint64_t)bytes;
}

static void grow(struct gl_buffer *buffer, uint64_t texels, bool keep)
{
    struct error err = {0};
    const struct gl_buffer_desc desc = {
        .label = "test.grown", .size_bytes = texels * 4, .is_dynamic = true};
    if (!gl_buffer_reserve(buffer, &desc, keep, &err))
        fail_msg("%s", err.message);
}

static void follow(struct gl_texture *view, const struct gl_buffer *buffer)
{
    struct error err = {0};
    if (!gl_texture_follow_buffer(view, "test.grown", GL_R32UI, buffer, &err))
        fail_msg("%s", err.message);
}

static void a_view_follows_a_buffer_that_grows(void **state)
{
    (void)state;
    for (int keep = 0; keep < 2; keep++) {
        struct gl_buffer buffer = {0};
        struct gl_texture view = {0};
        for (uint64_t texels = 8; texels <= 8192; texels *= 4) {
            grow(&buffer, texels, keep);
            follow(&view, &buffer);
            assert_true(texels_of(&view) >= texels);
            assert_int_equal(texels_of(&view) * 4, bytes_of(&buffer));
        }
        gl_texture_finish(&view);
        gl_buffer_finish(&buffer);
    }
}

/* A buffer that was given back shows nothing to who made a view of it before. */
static void a_view_follows_a_buffer_that_is_made_again(void **state)
{
    (void)state;
    struct gl_buffer buffer = {0};
    struct gl_texture view = {0};
    grow(&buffer, 512, false);
    follow(&view, &buffer);
    gl_buffer_finish(&buffer);
    grow(&buffer, 16, false);
    follow(&view, &buffer);
    assert_int_equal(texels_of(&view) * 4, bytes_of(&buffer));
    gl_texture_finish(&view);
    gl_buffer_finish(&buffer);
}

static void a_view_of_the_same_storage_stays(void **state)
{
    (void)state;
    struct gl_buffer buffer = {0};
    struct gl_texture view = {0};
    grow(&buffer, 64, false);
    follow(&view, &buffer);
    glObjectLabel(GL_TEXTURE, view.name, -1, "test.kept");
    grow(&buffer, 32, false);
    follow(&view, &buffer);
    char label[32] = "";
    glGetObjectLabel(GL_TEXTURE, view.name, sizeof label, NULL, label);
    assert_string_equal(label, "test.kept");
    gl_texture_finish(&view);
    gl_buffer_finish(&buffer);
}

/* The environment has the effect that is meant: else the tests above prove less. */
static void names_of_deleted_buffers_are_given_again(void **state)
{
    (void)state;
    GLuint first = 0, second = 0;
    glCreateBuffers(1, &first);
    glDeleteBuffers(1, &first);
    glCreateBuffers(1, &second);
    glDeleteBuffers(1, &second);
    if (first != second)
        print_message("this driver counts names up: views are tested by their storages alone\n");
    if (first != second)
        skip();
}

int main(void)
{
    setenv("force_gl_names_reuse", "true", 1); /* Mesa 22 */
    setenv("reuse_gl_names", "true", 1);       /* Mesa 25 */
    struct gl_context *context = render_rig_context(true);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(names_of_deleted_buffers_are_given_again),
        cmocka_unit_test(a_view_follows_a_buffer_that_grows),
        cmocka_unit_test(a_view_follows_a_buffer_that_is_made_again),
        cmocka_unit_test(a_view_of_the_same_storage_stays),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    gl_context_destroy(context);
    return failed;
}
