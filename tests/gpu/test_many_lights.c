/* SPDX-License-Identifier: MIT */
/* No light is lost, however many reach one point: their lists are walked in as many dispatches as
 * the loop budget of the device needs. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/support/closed_form_scenes.h"
#include "tests/support/render_support.h"

enum { SIDE_PX = 8 };

struct fixture {
    struct renderer *renderer;
    struct closed_form_scene source;
    struct rig_scene scene;
};

/* The floor below two panes, lit by `count` equal lights at one place that together give 100 cd. */
static float render_middle(const struct fixture *fixture, size_t count, float range_m,
                           bool casts_shadow, enum view_light_lists lists, struct error *err)
{
    struct view_light *lights = calloc(count, sizeof *lights);
    for (size_t i = 0; i < count; i++)
        lights[i] = (struct view_light){.type = SCENE_LIGHT_POINT,
                                        .position = {0.3, 3, 0.2},
                                        .color = {1, 1, 1},
                                        .intensity = 100.0f / (float)count,
                                        .range = range_m,
                                        .casts_no_shadow = !casts_shadow};
    struct view view = {
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .camera = {.kind = VIEW_CAMERA_NODE, .node = "Floor"},
        .lights = lights,
        .light_count = count,
        .ignore_scene_lights = true,
        .quality = {.samples = 1, .light_lists = lists, .shadow_resolution = 64},
    };
    struct frame frame;
    float value = -1;
    if (renderer_render(fixture->renderer, fixture->scene.key, &view, &frame, err)) {
        value = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], SIDE_PX / 2, SIDE_PX / 2)[0];
        frame_finish(&frame);
    }
    free(lights);
    return value;
}

static void equal_lights_add_up(void **state)
{
    static const size_t counts[] = {2, 1000, 4096, 20000, 65536};
    for (int bounded = 0; bounded < 2; bounded++) {
        float range_m = bounded ? 20.0f : 0;
        struct error err = {0};
        float one = render_middle(*state, 1, range_m, false, VIEW_LIGHT_LISTS_CLUSTERED, &err);
        assert_true(one > 0.1f);
        for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
            float many =
                render_middle(*state, counts[i], range_m, false, VIEW_LIGHT_LISTS_CLUSTERED, &err);
            if (!(fabsf(many - one) <= 1e-4f * one + 2e-8f * (float)counts[i] * one))
                fail_msg("%zu lights give %.7g, one gives %.7g (%s)", counts[i], (double)many,
                         (double)one, err.message);
        }
    }
}

static void shadowed_lights_add_up(void **state)
{
    struct error err = {0};
    float one = render_middle(*state, 1, 0, true, VIEW_LIGHT_LISTS_CLUSTERED, &err);
    float open = render_middle(*state, 1, 0, false, VIEW_LIGHT_LISTS_CLUSTERED, &err);
    assert_true(one > 0.01f && one < 0.6f * open); /* two panes are between */
    float many = render_middle(*state, 150, 0, true, VIEW_LIGHT_LISTS_CLUSTERED, &err);
    if (!(fabsf(many - one) <= 1e-4f * one))
        fail_msg("150 shadowed lights give %.7g, one gives %.7g (%s)", (double)many, (double)one,
                 err.message);
}

/* The linked form cannot skip into a list; what it cannot walk it refuses. */
static void linked_lists_refuse_what_they_would_lose(void **state)
{
    struct error err = {0};
    float value = render_middle(*state, 30000, 0, false, VIEW_LIGHT_LISTS_LINKED, &err);
    if (value < 0) {
        assert_int_equal(err.code, ERROR_OVER_BUDGET);
        return;
    }
    /* a device whose loops have no end walks them all */
    float expected = render_middle(*state, 30000, 0, false, VIEW_LIGHT_LISTS_CLUSTERED, &err);
    assert_true(expected > 0 && fabsf(value - expected) <= 1e-4f * expected);
}

static int setup(void **state)
{
    static struct fixture fixture;
    static const double colors[2][4] = {{0.5, 0.5, 0.5, 1}, {0.5, 0.5, 0.5, 1}};
    struct error err = {0};
    fixture.renderer = render_rig_create();
    panes_scene_build(&(struct panes_scene_desc){.pane_count = 2, .colors = colors},
                      &fixture.source);
    *state = &fixture;
    return rig_scene_from_glb(&fixture.scene, fixture.renderer, "floor", fixture.source.glb,
                              fixture.source.size_bytes, &err)
               ? 0
               : -1;
}

static int teardown(void **state)
{
    struct fixture *fixture = *state;
    rig_scene_finish(&fixture->scene, fixture->renderer);
    closed_form_scene_finish(&fixture->source);
    renderer_destroy(fixture->renderer);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equal_lights_add_up),
        cmocka_unit_test(shadowed_lights_add_up),
        cmocka_unit_test(linked_lists_refuse_what_they_would_lose),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
