/* SPDX-License-Identifier: MIT */
/* Lists are counted in one pass and written in a second one. Where a driver has the second find
 * more fragments than the first, none is written beyond the list of its own pixel or texel. Here
 * the second pass draws in one half what it has drawn before. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"

enum { PANES = 12, SIZE = 64 /* pixels, and texels */, COMMAND_BYTES = 20 };

/* ---- a driver whose second pass finds more ---- */

static PFNGLMULTIDRAWELEMENTSINDIRECTPROC draw_below;
static PFNGLPUSHDEBUGGROUPPROC push_below;
static const char *doubled; /* the pass; NULL: none */
static char pass[64];
static int draws;

static void GLAPIENTRY push(GLenum source, GLuint id, GLsizei length, const GLchar *message)
{
    snprintf(pass, sizeof pass, "%s", message);
    push_below(source, id, length, message);
}

static void GLAPIENTRY draw(GLenum mode, GLenum type, const void *indirect, GLsizei count,
                            GLsizei stride)
{
    draw_below(mode, type, indirect, count, stride);
    if (!doubled || strcmp(pass, doubled) != 0)
        return;
    GLboolean was_cut = glIsEnabled(GL_SCISSOR_TEST);
    GLint box[4];
    glGetIntegerv(GL_SCISSOR_BOX, box);
    glEnable(GL_SCISSOR_TEST);
    glScissor(0, 0, SIZE / 2, SIZE);
    const unsigned char *last = (const unsigned char *)indirect + (count - 1) * COMMAND_BYTES;
    draw_below(mode, type, last, 1, stride); /* else each list would get what it has, in order */
    draws++;
    glScissor(box[0], box[1], box[2], box[3]);
    if (!was_cut)
        glDisable(GL_SCISSOR_TEST);
}

static void hook(void)
{
    if (draw_below)
        return;
    draw_below = epoxy_glMultiDrawElementsIndirect;
    epoxy_glMultiDrawElementsIndirect = draw;
    push_below = epoxy_glPushDebugGroup;
    epoxy_glPushDebugGroup = push;
}

/* ---- pictures ---- */

static void open_panes(struct renderer *renderer, struct rig_scene *panes)
{
    double colors[PANES][4];
    struct closed_form_scene scene;
    for (int i = 0; i < PANES; i++)
        for (int c = 0; c < 4; c++)
            colors[i][c] = c < 3 ? 0.9 - 0.3 * ((i * 7 + 3 * c) % 11) / 11 : 1;
    panes_scene_build(
        &(struct panes_scene_desc){.pane_count = PANES, .colors = (const double(*)[4])colors},
        &scene);
    rig_scene_open(panes, renderer, "panes", scene.glb, scene.size_bytes);
    closed_form_scene_finish(&scene);
}

static struct image take(bool is_hardware, const char *doubled_pass,
                         const struct view_quality *quality)
{
    struct rig_scene panes;
    struct view view = {
        .width_px = SIZE,
        .height_px = SIZE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {2.5, 0.9, 0.1},
                   /* below the panes: what they leave of the light */ .target = {0, 0, 0}},
        .quality = *quality};
    view.quality.shadow_resolution = SIZE;
    view.quality.shadow_taps = view.quality.samples = 1;
    struct renderer *renderer =
        render_rig_create_as(&(struct renderer_desc){.hooks.poses_as_hardware = is_hardware});
    hook();
    open_panes(renderer, &panes);
    doubled = doubled_pass;
    draws = 0;
    struct image image = shoot_color(renderer, &panes, &view);
    doubled = NULL;
    assert_true(!doubled_pass == !draws);
    rig_scene_finish(&panes, renderer);
    renderer_destroy(renderer);
    return image;
}

/* All lists are full when the second copies come, which find no place then. */
static void expect_same(const char *doubled_pass, const struct view_quality *quality)
{
    for (int is_hardware = 0; is_hardware < 2; is_hardware++) {
        struct image plain = take(is_hardware, NULL, quality);
        struct image twice = take(is_hardware, doubled_pass, quality);
        assert_same_bits(&plain, &twice);
        image_finish(&plain);
        image_finish(&twice);
    }
}

static void fragments_beyond_the_count_stay_out_of_other_pixels_lists(void **state)
{
    (void)state;
    expect_same("transparency.scatter", &(struct view_quality){.shadows = SHADOWS_NONE});
}

static void events_beyond_the_count_stay_out_of_other_texels_lists(void **state)
{
    (void)state;
    expect_same("shadow.deep.scatter", &(struct view_quality){.shadows = SHADOWS_DEEP});
}

static void events_of_compressed_maps_stay_in_their_texels_lists(void **state)
{
    (void)state;
    expect_same("shadow.deep.scatter",
                &(struct view_quality){.shadows = SHADOWS_DEEP, .shadow_compression = 0.01});
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fragments_beyond_the_count_stay_out_of_other_pixels_lists),
        cmocka_unit_test(events_beyond_the_count_stay_out_of_other_texels_lists),
        cmocka_unit_test(events_of_compressed_maps_stay_in_their_texels_lists),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
