/* SPDX-License-Identifier: MIT */
/* Memory below need: at every budget a frame has the bits that it has with ample memory, or is
 * refused with the budget and what it needs; pools of one element grow; a device that reads small
 * tables only is filled and no further. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/extreme_checks.h"
#include "tests/support/extreme_scene.h"
#include "tests/support/image_checks.h"
#include "tests/support/shadow_rig.h"

/* One renderer at a time: each owns the thread's GL context. */
static struct renderer *create_renderer(uint64_t budget_bytes)
{
    struct error err = {0};
    struct renderer *renderer = renderer_create(
        &(struct renderer_desc){.gpu_budget_bytes = budget_bytes, .is_strict = true}, &err);
    if (!renderer && err.code == ERROR_NO_DEVICE)
        skip();
    assert_non_null(renderer);
    return renderer;
}

/* False when refused. */
static bool shoot_within(uint64_t budget_bytes, enum shadow_technique shadows,
                         struct image *picture)
{
    struct renderer *renderer = create_renderer(budget_bytes);
    struct extreme_scene scene;
    struct frame frame;
    struct error err = {0};
    extreme_scene_open(&scene, renderer, "budget", &(struct extreme_desc){0});
    scene.view.quality.shadows = shadows;
    bool is_made = renderer_render(renderer, scene.rig.key, &scene.view, &frame, &err);
    if (is_made) {
        *picture = frame.outputs[VIEW_OUTPUT_COLOR];
        frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
        frame_finish(&frame);
    } else {
        print_message("%llu MiB: %s\n", (unsigned long long)budget_bytes >> 20, err.message);
        assert_int_equal(err.code, ERROR_OVER_BUDGET);
        assert_non_null(strstr(err.message, "budget"));
        scene.view.quality.shadow_resolution = 8; /* what fits is served after a refusal */
        shoot(renderer, &scene.rig, &scene.view, &frame);
        frame_finish(&frame);
    }
    extreme_scene_finish(&scene, renderer);
    renderer_destroy(renderer);
    return is_made;
}

static void every_budget_gives_the_same_bits_or_a_refusal(void **state)
{
    (void)state;
    static const uint64_t budgets_mib[] = {8, 24, 56, 64, 88, 160, 320, 512};
    static const enum shadow_technique techniques[] = {SHADOWS_DEEP, SHADOWS_DEEP_LINKED};
    for (int t = 0; t < 2; t++) {
        struct image ample = {0};
        int made = 0, differing = 0, count = sizeof budgets_mib / sizeof *budgets_mib;
        assert_true(shoot_within(0, techniques[t], &ample));
        for (int i = 0; i < count; i++) {
            struct image tight = {0};
            if (!shoot_within(budgets_mib[i] << 20, techniques[t], &tight)) {
                assert_int_equal(made, 0); /* more is never worse */
                continue;
            }
            made++;
            differing += memcmp(tight.pixels, ample.pixels, image_size_bytes(&ample)) != 0;
            image_finish(&tight);
        }
        image_finish(&ample);
        assert_int_in_range(made, 1, count - 1); /* some budgets are below need, some above */
        extreme_expect(&(struct extreme_row){"budgets of 8 to 512 MiB", t ? "deep-linked" : "deep",
                                             "pictures of other bits", 0},
                       differing);
    }
}

static const struct view_light lamps[] = {
    {.type = SCENE_LIGHT_POINT, .position = {0.1, 5, 0.2}, .color = {1, 1, 1}, .intensity = 1},
    {.type = SCENE_LIGHT_POINT, .position = {0.7, 5, 0.1}, .color = {1, 1, 1}, .intensity = 1},
    {.type = SCENE_LIGHT_POINT, .position = {0.3, 5, 0.9}, .color = {1, 1, 1}, .intensity = 1},
    {.type = SCENE_LIGHT_POINT, .position = {0.2, 5, 0.4}, .color = {1, 1, 1}, .intensity = 1},
    {.type = SCENE_LIGHT_POINT, .position = {0.6, 5, 0.5}, .color = {1, 1, 1}, .intensity = 1},
    {.type = SCENE_LIGHT_POINT, .position = {0.8, 5, 0.6}, .color = {1, 1, 1}, .intensity = 1},
};

static struct pane_scene make_panes(void)
{
    struct pane_scene panes = {0};
    for (int i = 0; i < 12; i++) {
        struct pane pane = {.center = {0, 2 + 0.1 * i, 0},
                            .u = {3, 0, 0},
                            .v = {0, 0, -3},
                            .color = {0.9f, 0.8f, 0.95f}};
        pane_scene_add(&panes, &pane);
    }
    return panes;
}

static void ask_all(struct shadow_rig *rig, const struct pane_scene *panes, size_t lights,
                    enum shadow_technique shadows, float (*t)[4])
{
    static const double eye[3] = {0, 0, 0}, up[3] = {0, 1, 0};
    struct error err = {0};
    if (!shadow_rig_prepare(rig, panes, lamps, lights, eye,
                            &(struct view_quality){.shadow_resolution = 24, .shadows = shadows},
                            &err))
        fail_msg("%s", err.message);
    for (uint32_t i = 0; i < lights; i++)
        shadow_rig_query(rig, i, &(const double[3]){0.1, 1, 0.2}, up, 1, UINT32_MAX, &t[i]);
}

static void pools_of_one_element_grow_to_the_same_bits(void **state)
{
    (void)state;
    struct pane_scene panes = make_panes();
    union {
        float t[3][4];
        uint32_t bits[12];
    } answers[2];
    for (int is_small = 0; is_small < 2; is_small++) {
        struct shadow_rig rig;
        if (!shadow_rig_open(&rig, 0, is_small ? 1 : 0))
            skip();
        ask_all(&rig, &panes, 3, SHADOWS_DEEP_LINKED, answers[is_small].t);
        shadow_rig_close(&rig);
    }
    extreme_expect(
        &(struct extreme_row){"pools of one element", "deep-linked", "answers of other bits", 0},
        memcmp(answers[0].bits, answers[1].bits, sizeof answers[0].bits) != 0);
    pane_scene_finish(&panes);
}

/* Five cubes fill what the device reads in one table; the sixth is refused before it is built. */
static void tables_are_filled_to_what_the_device_reads(void **state)
{
    (void)state;
    struct pane_scene panes = make_panes();
    struct shadow_rig rig;
    struct error err = {0};
    float t[2][6][4];
    if (!shadow_rig_open(&rig, 0, 0))
        skip();
    struct gl_limits small = *gl_context_limits(rig.context);
    small.max_texture_buffer_texels = 5 * (6 * 24 * 24 + 1);
    struct shadow_system_desc desc = {
        .programs = rig.programs, .timeline = rig.timeline, .limits = &small};
    ask_all(&rig, &panes, 5, SHADOWS_MAP, t[0]);
    struct shadow_system *shipped = rig.shadows;
    rig.shadows = shadow_system_create(&desc, &err);
    assert_non_null(rig.shadows);
    ask_all(&rig, &panes, 5, SHADOWS_MAP, t[1]);
    assert_memory_equal(t[0], t[1], 5 * sizeof *t[0]);
    static const double eye[3] = {0, 0, 0};
    assert_false(shadow_rig_prepare(
        &rig, &panes, lamps, 6, eye,
        &(struct view_quality){.shadow_resolution = 24, .shadows = SHADOWS_DEEP}, &err));
    print_message("refused: %s\n", err.message);
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err.message, "17285"));
    assert_non_null(strstr(err.message, "shadow_resolution"));
    shadow_system_destroy(rig.shadows);
    rig.shadows = shipped;
    shadow_rig_close(&rig);
    pane_scene_finish(&panes);
}

/* 300 objects, each without shadow on itself and all on each other: ids beyond 8 bits. */
static void three_hundred_objects_leave_out_themselves_alone(void **state)
{
    (void)state;
    enum { OBJECTS = 300 };
    struct pane_scene panes = {0};
    struct shadow_rig rig;
    struct error err = {0};
    static const double eye[3] = {0, 0, 0}, up[3] = {0, 1, 0};
    if (!shadow_rig_open(&rig, 0, 0))
        skip();
    for (int i = 0; i < OBJECTS; i++) {
        struct pane pane = {.center = {0, 4 - 0.01 * i, 0},
                            .u = {3, 0, 0},
                            .v = {0, 0, -3},
                            .color = {0.99f, 0.995f, 0.98f},
                            .no_self_shadow = true};
        pane_scene_add(&panes, &pane);
    }
    if (!shadow_rig_prepare(&rig, &panes, lamps, 1, eye,
                            &(struct view_quality){.shadow_resolution = 24}, &err))
        fail_msg("%s", err.message);
    double worst = 0;
    for (uint32_t object = 0; object < OBJECTS; object += 7) {
        float t[1][4];
        shadow_rig_query(&rig, 0, &(const double[3]){0.1, 0.5, 0.2}, up, 1, object, t);
        for (int k = 0; k < 3; k++) {
            double filter = (double)panes.panes[object].color[k], expected = 1;
            for (int i = 0; i < OBJECTS - 1; i++)
                expected *= filter;
            double error = (double)t[0][k] / expected - 1;
            worst = error > worst ? error : -error > worst ? -error : worst;
        }
    }
    extreme_expect(&(struct extreme_row){"300 objects without shadow on themselves", "deep",
                                         "relative error of T", 1e-5},
                   worst);
    shadow_rig_close(&rig);
    pane_scene_finish(&panes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_budget_gives_the_same_bits_or_a_refusal),
        cmocka_unit_test(pools_of_one_element_grow_to_the_same_bits),
        cmocka_unit_test(tables_are_filled_to_what_the_device_reads),
        cmocka_unit_test(three_hundred_objects_leave_out_themselves_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
