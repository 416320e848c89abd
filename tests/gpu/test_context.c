/* SPDX-License-Identifier: MIT */
/* Claims about the context that a renderer draws in: which messages it asks the driver for. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "renderer/gl/context.h"
#include "tests/support/render_support.h"

static bool asks_for_messages(bool is_strict)
{
    struct error err = {0};
    struct gl_context *context =
        gl_context_create(&(struct gl_context_desc){.is_strict = is_strict}, &err);
    assert_non_null(context);
    bool asks = glIsEnabled(GL_DEBUG_OUTPUT);
    gl_context_destroy(context);
    return asks;
}

static void a_context_in_service_asks_for_no_messages(void **unused)
{
    (void)unused;
    assert_false(asks_for_messages(false));
    assert_true(asks_for_messages(true));
}

static void an_error_without_messages_is_found_by_the_next_check(void **unused)
{
    (void)unused;
    struct error err = {0};
    struct gl_context *context = gl_context_create(&(struct gl_context_desc){0}, &err);
    assert_non_null(context);
    assert_true(gl_context_check(context, "beginning", &err));
    glEnable(GL_TEXTURE_2D); /* no enumerant of a core context */
    assert_false(gl_context_check(context, "testing", &err));
    assert_int_equal(err.code, ERROR_INTERNAL);
    err = (struct error){0};
    assert_true(gl_context_check(context, "going on", &err));
    gl_context_destroy(context);
}

int main(void)
{
    gl_context_destroy(render_rig_context(false));
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_context_in_service_asks_for_no_messages),
        cmocka_unit_test(an_error_without_messages_is_found_by_the_next_check),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
