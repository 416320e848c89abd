/* SPDX-License-Identifier: MIT */
/* What fits the budget of shadows, and what is compressed to fit it: decided by the budget, not by
 * how many structures the clock let be built at once, or by what stood before. */
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shadows/shadows_internal.h"
#include "tests/support/shadow_rig.h"

enum { LIGHTS = 9, PANES = 50, STEPS = 20 };

static struct shadow_rig rig;
static const double no_eye[3];

static void use_budget(uint64_t bytes)
{
    struct error err = {0};
    shadow_system_destroy(rig.shadows);
    rig.systems[0] = rig.shadows =
        shadow_system_create(&(struct shadow_system_desc){.programs = rig.programs,
                                                          .timeline = rig.timeline,
                                                          .limits = gl_context_limits(rig.context),
                                                          .budget_bytes = bytes},
                             &err);
    assert_non_null(rig.shadows);
}

/* Layers above each other, so that lists are sorted by way of other memory; the last lights see
 * more of them than the first. */
static void add_panes(struct pane_scene *panes)
{
    for (int i = 0; i < PANES; i++)
        pane_scene_add(panes, &(struct pane){.center = {0.1 * i, 1 + 0.1 * i, 0},
                                             .u = {3 + 0.05 * i, 0, 0},
                                             .v = {0, 0, -3},
                                             .color = {0.9f, 0.8f, 0.95f}});
}

static void add_lights(struct view_light lights[LIGHTS])
{
    for (int i = 0; i < LIGHTS; i++)
        lights[i] = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                        .position = {0.3 * i - 1, 12 + i, 0.2 * i},
                                        .direction = {0.02 * i, -1, 0.01},
                                        .color = {1, 1, 1},
                                        .intensity = 1,
                                        .outer_cone_deg = 30 - 2 * i};
}

struct outcome {
    bool is_refused;
    uint64_t events, compressed;
    char message[ERROR_MESSAGE_BYTES];
};

static bool never(void *context)
{
    (void)context;
    return false;
}

enum way { AT_ONCE, IN_PIECES, AFTER_OTHERS, WAYS };

static struct outcome prepare(const struct pane_scene *panes, uint64_t budget_bytes, enum way way,
                              double error_allowed)
{
    struct view_light lights[LIGHTS];
    struct error err = {0};
    const struct yield_point yield = {.should_yield = never};
    struct view_quality quality = {.shadow_resolution = 48};
    add_lights(lights);
    use_budget(budget_bytes);
    rig.yield = NULL;
    if (way == AFTER_OTHERS) { /* a picture of half the resolution stands */
        quality.shadow_resolution = 24;
        (void)!shadow_rig_prepare(&rig, panes, lights, LIGHTS, no_eye, &quality, &err);
        err = (struct error){0};
        quality.shadow_resolution = 48;
    }
    if (way == IN_PIECES)
        rig.yield = &yield;
    quality.shadow_error_allowed = error_allowed;
    bool ok = shadow_rig_prepare(&rig, panes, lights, LIGHTS, no_eye, &quality, &err);
    rig.yield = NULL;
    struct outcome outcome = {.is_refused = !ok,
                              .events = ok ? rig.report.counts.events : 0,
                              .compressed = rig.report.compression.maps};
    memcpy(outcome.message, err.message, sizeof outcome.message);
    if (!ok)
        assert_int_equal(err.code, ERROR_OVER_BUDGET);
    else
        assert_true(shadow_system_size_bytes(rig.shadows) <= budget_bytes);
    return outcome;
}

/* From where everything fits to where nothing does. */
static void only_the_budget_decides(void **state)
{
    struct pane_scene panes = {0};
    int refused[2] = {0}, compressed = 0;
    (void)state;
    add_panes(&panes);
    struct outcome whole = prepare(&panes, 1 << 30, AT_ONCE, 0);
    uint64_t most_bytes = whole.events * 18 * 3 / 2;
    assert_false(whole.is_refused);
    for (int step = 1; step <= STEPS; step++) {
        for (int may_err = 0; may_err < 2; may_err++) {
            uint64_t budget_bytes = most_bytes * (uint64_t)step / STEPS;
            struct outcome first = prepare(&panes, budget_bytes, AT_ONCE, may_err ? 0.02 : 0);
            refused[may_err] += first.is_refused;
            compressed += first.compressed > 0;
            for (enum way way = IN_PIECES; way < WAYS; way++) {
                struct outcome other = prepare(&panes, budget_bytes, way, may_err ? 0.02 : 0);
                if (other.is_refused != first.is_refused || other.events != first.events ||
                    other.compressed != first.compressed)
                    fail_msg("budget %d: %s %d, %s %d", (int)budget_bytes, first.message,
                             (int)first.events, other.message, (int)other.events);
            }
        }
    }
    assert_int_in_range(refused[0], 2, STEPS - 2);
    assert_int_in_range(compressed, 2, STEPS - 2);
    pane_scene_finish(&panes);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(only_the_budget_decides),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
