/* SPDX-License-Identifier: MIT */
/* The self-test at the start takes this device, and refuses one on which views of buffers show a
 * storage of before. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "renderer/renderer.h"
#include "tests/support/gl_hooks.h"

/* Of views with one label those after the first show no more than the first one did, as if they
 * were still of its storage. */
static struct {
    PFNGLTEXTUREBUFFERPROC make_view;
    const char *label;
    GLint first_bytes;
    int stale;
} defect;

static void make_stale_view(GLuint texture, GLenum format, GLuint buffer)
{
    char label[64] = "";
    GLint bytes = 0;
    defect.make_view(texture, format, buffer);
    glGetObjectLabel(GL_TEXTURE, texture, sizeof label, NULL, label);
    if (!defect.label || strcmp(label, defect.label) != 0)
        return;
    glGetNamedBufferParameteriv(buffer, GL_BUFFER_SIZE, &bytes);
    if (!defect.first_bytes)
        defect.first_bytes = bytes;
    if (bytes <= defect.first_bytes)
        return;
    glTextureBufferRange(texture, format, buffer, 0, defect.first_bytes);
    defect.stale++;
}

static bool starts(const char *label, bool poses_as_hardware, struct error *err)
{
    const struct renderer_desc desc = {.is_strict = true, .poses_as_hardware = poses_as_hardware};
    *err = (struct error){0};
    defect.label = label;
    defect.first_bytes = defect.stale = 0;
    GL_SPY_BEGIN(TextureBuffer, defect.make_view, make_stale_view);
    struct renderer *renderer = renderer_create(&desc, err);
    GL_SPY_END(TextureBuffer, defect.make_view);
    renderer_destroy(renderer);
    return renderer != NULL;
}

static void this_device_passes(void **state)
{
    struct error err;
    (void)state;
    for (int poses = 0; poses < 2; poses++) /* with scans on processors, and on devices */
        if (!starts(NULL, poses, &err))
            fail_msg("%s", err.message);
}

static void a_device_with_stale_views_is_refused(void **state)
{
    static const char *const labels[] = {"shadow.records", "shadow.heads", "shadow.deep.events",
                                         "lights.clusters.items"};
    (void)state;
    for (size_t i = 0; i < sizeof labels / sizeof *labels; i++) {
        struct error err;
        bool ok = starts(labels[i], i % 2, &err);
        if (!defect.stale)
            fail_msg("no view of %s was made again", labels[i]);
        if (ok)
            fail_msg("stale views of %s are not noticed", labels[i]);
        assert_int_equal(err.code, ERROR_NO_DEVICE);
        if (!strstr(err.message, "150 lights"))
            fail_msg("%s: %s", labels[i], err.message);
    }
}

int main(void)
{
    struct error err = {0};
    struct renderer *renderer = renderer_create(&(struct renderer_desc){.is_strict = true}, &err);
    if (!renderer && strstr(err.message, "self-test") == NULL) {
        print_message("skipped: %s\n", err.message);
        return 77;
    }
    renderer_destroy(renderer);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(this_device_passes),
        cmocka_unit_test(a_device_with_stale_views_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
