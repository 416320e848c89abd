/* SPDX-License-Identifier: MIT */
/* Random scenes: the deep shadow map against its definition in f64 at the same texel centres, the
 * linked form against the default one, the scan by shader against the scan in C. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/shadow_rig.h"

enum { SEEDS = 1000, LIGHTS = 3, POINTS = 24 };

static struct shadow_rig rig;

static double symmetric(uint64_t *seed)
{
    return 2 * rig_random(seed) - 1;
}

static void random_unit(uint64_t *seed, double out[3])
{
    do
        for (int k = 0; k < 3; k++)
            out[k] = symmetric(seed);
    while (!(vec3_length(out) > 0.1));
    vec3_normalize(out);
}

static void random_frame(uint64_t *seed, double axes[3][3])
{
    double helper[3];
    random_unit(seed, axes[2]);
    random_unit(seed, helper);
    vec3_cross(axes[2], helper, axes[0]);
    vec3_normalize(axes[0]);
    vec3_cross(axes[2], axes[0], axes[1]);
}

/* From total absorption over nearly nothing to nearly all; clear and black now and then. */
static float random_filter(uint64_t *seed)
{
    double kind = rig_random(seed), t = rig_random(seed);
    if (kind < 0.05)
        return 0;
    if (kind < 0.1)
        return 1;
    if (kind < 0.2)
        return (float)pow(10, -6 * t);
    return (float)(kind < 0.3 ? 1 - pow(10, -1 - 6 * t) : t);
}

static void add_pane(struct pane_scene *panes, const double center[3], double axes[3][3],
                     const double half[2], const struct pane *like)
{
    struct pane pane = *like;
    for (int k = 0; k < 3; k++) {
        pane.center[k] = center[k];
        pane.u[k] = half[0] * axes[0][k];
        pane.v[k] = half[1] * axes[1][k];
    }
    pane_scene_add(panes, &pane);
}

static void add_box(struct pane_scene *panes, const double center[3], double axes[3][3],
                    const double half[3], const struct pane *like)
{
    for (int side = 0; side < 6; side++) {
        int n = side / 2, u = (n + 1) % 3, v = (n + 2) % 3;
        double face[3][3], middle[3], extents[2] = {half[u], half[v]};
        for (int k = 0; k < 3; k++) {
            middle[k] = center[k] + (side % 2 ? -half[n] : half[n]) * axes[n][k];
            face[0][k] = axes[u][k];
            face[1][k] = axes[v][k];
            face[2][k] = axes[n][k];
        }
        add_pane(panes, middle, face, extents, like);
    }
}

static void make_scene(struct pane_scene *panes, uint64_t *seed)
{
    int count = 2 + (int)(10 * rig_random(seed));
    for (int i = 0; i < count; i++) {
        double center[3], axes[3][3], half[3];
        struct pane like = {.is_opaque = rig_random(seed) < 0.15};
        for (int k = 0; k < 3; k++) {
            center[k] = 2 * symmetric(seed) + (k == 1 ? 3 : 0);
            half[k] = 0.1 + (like.is_opaque ? 0.5 : 1.4) * rig_random(seed);
            like.color[k] = random_filter(seed);
        }
        if (rig_random(seed) < 0.2)
            like.pass_through = SCENE_PASS_SLAB;
        random_frame(seed, axes);
        if (rig_random(seed) < 0.3)
            add_box(panes, center, axes, half, &like);
        else
            add_pane(panes, center, axes, half, &like);
    }
}

static void make_lights(struct view_light lights[LIGHTS], uint64_t *seed)
{
    static const enum scene_light_type types[LIGHTS] = {SCENE_LIGHT_DIRECTIONAL, SCENE_LIGHT_POINT,
                                                        SCENE_LIGHT_SPOT};
    for (int i = 0; i < LIGHTS; i++) {
        lights[i] = (struct view_light){.type = types[i], .color = {1, 1, 1}, .intensity = 1};
        for (int k = 0; k < 3; k++) {
            lights[i].position[k] = symmetric(seed) + (k == 1 ? 8 : 0);
            lights[i].direction[k] = 0.4 * symmetric(seed) - (k == 1);
        }
        if (types[i] == SCENE_LIGHT_SPOT)
            lights[i].outer_cone_deg = (float)(20 + 60 * rig_random(seed)); /* one face, or six */
    }
}

static void prepare(const struct pane_scene *panes, const struct view_light *lights,
                    const struct view_quality *quality)
{
    struct error err = {0};
    static const double eye[3] = {0.5, 2, 5};
    shadow_system_forget(rig.shadows, "panes");
    if (!shadow_rig_prepare(&rig, panes, lights, LIGHTS, eye, quality, &err))
        fail_msg("%s", err.message);
}

struct probes {
    double points[POINTS][3], normal[3], model[POINTS][3];
    bool is_clear[POINTS];
    float t[POINTS][4];
};

/* Of random points; with one random normal, or a level one. */
static void make_probes(struct probes *probes, uint32_t light, uint64_t *seed, bool is_level)
{
    random_unit(seed, probes->normal);
    for (int k = 0; k < 3 && is_level; k++)
        probes->normal[k] = k == 1;
    for (int i = 0; i < POINTS; i++) {
        for (int k = 0; k < 3; k++)
            probes->points[i][k] = 2.5 * symmetric(seed) + (k == 1 ? 2 : 0);
        probes->is_clear[i] =
            shadow_rig_model(&rig, light, probes->points[i], probes->normal, probes->model[i]);
    }
    shadow_rig_query(&rig, light, (const double(*)[3])probes->points, probes->normal, POINTS,
                     UINT32_MAX, probes->t);
}

struct outcome {
    long compared, mismatches;
    double worst;
};

static void compare(const struct probes *probes, double tolerance, struct outcome *outcome,
                    uint64_t scene, uint32_t light)
{
    for (int i = 0; i < POINTS; i++) {
        for (int k = 0; k < 3 && probes->is_clear[i]; k++) {
            double error = fabs((double)probes->t[i][k] - probes->model[i][k]);
            outcome->compared++;
            outcome->worst = fmax(outcome->worst, error);
            if (error <= tolerance)
                continue;
            outcome->mismatches++;
            print_message("scene %d, light %u at %g %g %g, channel %d: %.9g, not %.9g\n",
                          (int)scene, light, probes->points[i][0], probes->points[i][1],
                          probes->points[i][2], k, (double)probes->t[i][k], probes->model[i][k]);
        }
    }
}

static void a_thousand_random_scenes_agree_with_the_definition_in_f64(void **state)
{
    (void)state;
    static const int taps[] = {1, 4, 9, 16};
    struct outcome nearest = {0}, filtered = {0};
    for (uint64_t scene = 0; scene < SEEDS; scene++) {
        uint64_t seed = 1000003 * scene + 17;
        struct pane_scene panes = {0};
        struct view_light lights[LIGHTS];
        struct view_quality quality = {.shadow_resolution = 32 + (int)(scene % 5) * 17,
                                       .shadow_taps = taps[scene % 4]};
        make_scene(&panes, &seed);
        make_lights(lights, &seed);
        prepare(&panes, lights, &quality);
        for (uint32_t light = 0; light < LIGHTS; light++) {
            static struct probes probes;
            make_probes(&probes, light, &seed, false);
            if (quality.shadow_taps == 1)
                compare(&probes, 2e-6, &nearest, scene, light);
            else /* weights between texels carry the rounding of f32 map coordinates */
                compare(&probes, 4e-5, &filtered, scene, light);
        }
        pane_scene_finish(&panes);
    }
    print_message("%ld and %ld values compared\n", nearest.compared, filtered.compared);
    assert_true(nearest.compared > 10000 && filtered.compared > 30000);
    extreme_expect(&(struct extreme_row){"1000 random scenes, nearest texel", "deep",
                                         "error of T against the same texels in f64", 2e-6},
                   nearest.worst);
    extreme_expect(&(struct extreme_row){"1000 random scenes, 4 to 16 texels", "deep",
                                         "error of T against the same texels in f64", 4e-5},
                   filtered.worst);
    assert_int_equal(nearest.mismatches + filtered.mismatches, 0);
}

/* Heads and events of the light; NULL where it has no lists. */
static uint32_t *read_lists(uint32_t light, size_t *words)
{
    const struct shadow_map *map = shadow_system_map(rig.shadows, light);
    const struct shadow_store *store = shadow_system_store(rig.shadows);
    *words = 0;
    if (!map || !map->heads.count)
        return NULL;
    *words = map->heads.count + 4 * map->events.count;
    uint32_t *lists = malloc(*words * sizeof *lists);
    assert_non_null(lists);
    gl_buffer_read(&store->pools[SHADOW_POOL_HEADS].streams[0], map->heads.first * 4,
                   map->heads.count * 4, lists);
    gl_buffer_read(&store->pools[SHADOW_POOL_EVENTS].streams[SHADOW_STREAM_EVENT],
                   map->events.first * 16, map->events.count * 16, lists + map->heads.count);
    return lists;
}

static void the_scan_by_shader_gives_the_lists_of_the_scan_in_c(void **state)
{
    (void)state;
    long differing = 0, compared = 0;
    for (uint64_t scene = 0; scene < 100; scene++) {
        uint64_t seed = 7919 * scene + 5;
        struct pane_scene panes = {0};
        struct view_light lights[LIGHTS];
        struct view_quality quality = {.shadow_resolution = 16 + (int)scene};
        uint32_t *lists[2][LIGHTS];
        size_t words[2][LIGHTS];
        make_scene(&panes, &seed);
        make_lights(lights, &seed);
        for (int system = 0; system < 2; system++) {
            rig.shadows = rig.systems[system];
            prepare(&panes, lights, &quality);
            for (uint32_t light = 0; light < LIGHTS; light++)
                lists[system][light] = read_lists(light, &words[system][light]);
        }
        for (int light = 0; light < LIGHTS; light++) {
            compared += lists[0][light] != NULL;
            differing +=
                words[0][light] != words[1][light] ||
                (lists[0][light] && memcmp(lists[0][light], lists[1][light],
                                           words[0][light] * sizeof *lists[0][light]) != 0);
            free(lists[0][light]);
            free(lists[1][light]);
        }
        pane_scene_finish(&panes);
    }
    rig.shadows = rig.systems[0];
    assert_true(compared > 200);
    extreme_expect(&(struct extreme_row){"100 random scenes, scanned by shader and in C", "deep",
                                         "maps of other bits", 0},
                   differing);
}

/* The corrected linked lists keep 16 bits of each filter: half a step per layer. */
static void linked_lists_agree_with_contiguous_ones(void **state)
{
    (void)state;
    double worst = 0; /* in half steps per layer */
    for (uint64_t scene = 0; scene < 200; scene++) {
        uint64_t seed = 104729 * scene + 11;
        struct pane_scene panes = {0};
        struct view_light lights[LIGHTS];
        static struct probes deep, linked;
        struct view_quality quality = {.shadow_resolution = 48, .shadow_taps = 4};
        make_scene(&panes, &seed);
        make_lights(lights, &seed);
        for (uint32_t light = 0; light < LIGHTS; light++) {
            uint64_t same = seed;
            quality.shadows = SHADOWS_DEEP;
            prepare(&panes, lights, &quality);
            make_probes(&deep, light, &same, false);
            same = seed;
            quality.shadows = SHADOWS_DEEP_LINKED;
            prepare(&panes, lights, &quality);
            make_probes(&linked, light, &same, false);
            double layers = fmax(1, (double)rig.report.counts.longest_list);
            for (int i = 0; i < POINTS; i++)
                for (int k = 0; k < 3; k++)
                    worst = fmax(worst, fabs((double)deep.t[i][k] - (double)linked.t[i][k]) * 2 *
                                            65535 / layers);
        }
        pane_scene_finish(&panes);
    }
    extreme_expect(&(struct extreme_row){"200 random scenes, linked against contiguous lists",
                                         "deep-linked", "difference of T in half steps per layer",
                                         1.05},
                   worst);
}

static double brightest_difference(const struct probes *a, const struct probes *b)
{
    double worst = 0;
    for (int i = 0; i < POINTS; i++)
        for (int k = 0; k < 3; k++)
            worst = fmax(worst, fabs((double)a->t[i][k] - (double)b->t[i][k]));
    return worst;
}

/* A stack of panes over a receiver: two filters change places, one becomes two of its root. */
static void filters_may_change_places_and_be_split(void **state)
{
    (void)state;
    enum { LAYERS = 24 };
    double swapped = 0, split = 0;
    for (uint64_t scene = 0; scene < 100; scene++) {
        uint64_t seed = 15485863 * scene + 3, probe_seed;
        struct pane_scene panes = {0};
        struct view_light lights[LIGHTS];
        static struct probes first[LIGHTS], second;
        struct view_quality quality = {.shadow_resolution = 40, .shadow_taps = 4};
        for (int i = 0; i < LAYERS; i++) {
            struct pane pane = {.center = {0, 7 - 0.1 * i, 0}, .u = {20, 0, 0}, .v = {0, 0, -20}};
            for (int k = 0; k < 3; k++)
                pane.color[k] = (float)(0.3 + 0.7 * rig_random(&seed));
            pane_scene_add(&panes, &pane);
        }
        make_lights(lights, &seed);
        probe_seed = seed;
        for (int change = 0; change < 3; change++) {
            struct pane a = panes.panes[3], b = panes.panes[17];
            if (change == 1) {
                memcpy(a.color, panes.panes[17].color, sizeof a.color);
                memcpy(b.color, panes.panes[3].color, sizeof b.color);
            }
            for (int k = 0; k < 3 && change == 2; k++)
                a.color[k] = sqrtf(a.color[k]);
            pane_scene_set(&panes, 3, &a);
            pane_scene_set(&panes, 17, &b);
            a.center[1] -= 0.04;
            if (change == 2)
                pane_scene_add(&panes, &a);
            prepare(&panes, lights, &quality);
            for (uint32_t light = 0; light < LIGHTS; light++) {
                uint64_t same = probe_seed;
                make_probes(change ? &second : &first[light], light, &same, true);
                if (change == 1)
                    swapped = fmax(swapped, brightest_difference(&first[light], &second));
                if (change == 2)
                    split = fmax(split, brightest_difference(&first[light], &second));
            }
        }
        pane_scene_finish(&panes);
    }
    extreme_expect(
        &(struct extreme_row){"two of 24 filters change places", "deep", "difference of T", 1e-6},
        swapped);
    extreme_expect(&(struct extreme_row){"one of 24 filters becomes two of its root", "deep",
                                         "difference of T", 1e-6},
                   split);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_thousand_random_scenes_agree_with_the_definition_in_f64),
        cmocka_unit_test(the_scan_by_shader_gives_the_lists_of_the_scan_in_c),
        cmocka_unit_test(linked_lists_agree_with_contiguous_ones),
        cmocka_unit_test(filters_may_change_places_and_be_split),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
