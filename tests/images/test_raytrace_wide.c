/* SPDX-License-Identifier: MIT */
/* Whole ray traced pictures whose surfaces are lit sixteen at a time have the bits of those that
 * are lit one by one, whatever lights them, and whichever thread traces them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/raytrace/raytrace.h"
#include "tests/support/generated_scene.h"
#include "tests/support/import_support.h"

enum { SPOTS = 24, WIDTH = 160, HEIGHT = 120 };

struct subject { /* zeroed before init */
    struct generated_scene scene;
    struct imported_scene imported;
    struct raytrace_cache *cache;
};

static void init_subject(struct subject *s, bool has_columns)
{
    struct error err = {0};
    bool ok = has_columns ? generated_scene_make_colonnade(&s->scene, &err)
                          : generated_scene_make_boxes(&s->scene, SPOTS, 1, &err);
    const struct scene_file file = {"scene.glb", s->scene.glb, s->scene.glb_bytes};
    s->cache = ok ? raytrace_cache_create(&err) : NULL;
    if (!s->cache || !imported_scene_init(&s->imported, &file, 1, &err))
        fail_msg("%s", err.message);
    s->scene.view.width_px = WIDTH;
    s->scene.view.height_px = HEIGHT;
    s->scene.view.quality.shadows = SHADOWS_RAYTRACED;
}

static void finish_subject(struct subject *s)
{
    raytrace_cache_destroy(s->cache);
    imported_scene_finish(&s->imported);
    generated_scene_finish(&s->scene);
}

/* A coat too thin to change a bit keeps surfaces from being lit together. */
static void add_coats(struct scene_state *state)
{
    int plain = 0;
    for (size_t i = 0; i < state->scene->material_count; i++) {
        struct scene_material *m = &state->materials[i].base;
        plain += m->textures[SCENE_TEXTURE_BASE_COLOR].texture < 0 && m->transmission <= 0 &&
                 m->clearcoat <= 0 && !(m->flags & SCENE_MATERIAL_UNLIT);
        m->clearcoat = m->clearcoat > 0 ? m->clearcoat : 1e-42f;
    }
    assert_true(plain > 0);
}

struct way { /* of tracing */
    bool one_by_one;
    int samples, threads;
};

static void trace(const struct subject *s, const struct view *view, const struct way *way,
                  struct image *image)
{
    struct scene_state state = {0};
    struct camera camera;
    struct raytrace_stats stats;
    struct error err = {0};
    if (!scene_state_init(&state, &s->imported.scene, view, &err) ||
        !camera_resolve(&camera, view, &state, &err))
        fail_msg("%s", err.message);
    if (way->one_by_one)
        add_coats(&state);
    const struct raytrace_desc desc = {.view = view,
                                       .state = &state,
                                       .camera = &camera,
                                       .samples = way->samples,
                                       .cache = s->cache,
                                       .threads = way->threads};
    if (!raytrace_render(&desc, image, &stats, &err))
        fail_msg("%s", err.message);
    scene_state_finish(&state);
}

static void compare(const struct subject *s, const struct view *view, const char *what)
{
    static const int samples[] = {1, 4};
    for (int i = 0; i < 2; i++) {
        const struct way ways[] = {
            {true, samples[i], 1}, {false, samples[i], 1}, {false, samples[i], 3}};
        struct image images[3] = {{0}};
        for (int k = 0; k < 3; k++)
            trace(s, view, &ways[k], &images[k]);
        const float *expected = images[0].pixels;
        double sum = 0;
        for (size_t k = 0; k < (size_t)WIDTH * HEIGHT * 4; k++)
            sum += (double)expected[k];
        assert_true(sum > WIDTH * HEIGHT / 100.);
        for (int k = 1; k < 3; k++)
            for (size_t p = 0; p < (size_t)WIDTH * HEIGHT * 4; p++)
                if (((const float *)images[k].pixels)[p] != expected[p])
                    fail_msg(
                        "%s, %d samples, %d threads: channel %zu of pixel %zu is %.9g, not %.9g",
                        what, samples[i], ways[k].threads, p % 4, p / 4,
                        (double)((const float *)images[k].pixels)[p], (double)expected[p]);
        for (int k = 0; k < 3; k++)
            image_finish(&images[k]);
    }
}

static void lights_of_every_kind(void **state)
{
    (void)state;
    struct subject s = {.cache = NULL};
    init_subject(&s, false);
    struct view_light *lights = s.scene.lights;
    compare(&s, &s.scene.view, "spots");
    lights[3] = (struct view_light){.type = SCENE_LIGHT_DIRECTIONAL,
                                    .direction = {0.3, -1, 0.2},
                                    .color = {1, 0.9f, 0.8f},
                                    .intensity = 2};
    lights[4] = (struct view_light){.type = SCENE_LIGHT_POINT,
                                    .position = {0, 3, 0},
                                    .color = {0.2f, 0.9f, 0.8f},
                                    .intensity = 50,
                                    .range = 6,
                                    .casts_no_shadow = true};
    lights[5] = (struct view_light){.type = SCENE_LIGHT_DISK,
                                    .position = {1, 4, 1},
                                    .direction = {0, -1, 0},
                                    .color = {1, 0.2f, 0.2f},
                                    .intensity = 20,
                                    .radius_m = 0.5};
    compare(&s, &s.scene.view, "lights of every kind");
    finish_subject(&s);
}

static void hemisphere_haze_and_ground(void **state)
{
    (void)state;
    struct subject s = {.cache = NULL};
    init_subject(&s, false);
    struct view view = s.scene.view;
    view.light_count = 3;
    view.has_environment = true;
    view.sky[2] = 0.5f;
    view.ground[0] = 0.25f;
    compare(&s, &view, "a hemisphere");
    view.ground_plane.is_shown = true;
    compare(&s, &view, "a ground that catches shadows");
    view.ground_plane.is_shown = false;
    view.atmosphere.density_per_m = 0.05;
    view.atmosphere.color[1] = 0.5f;
    compare(&s, &view, "haze");
    finish_subject(&s);
}

static void smooth_meshes(void **state)
{
    (void)state;
    struct subject s = {.cache = NULL};
    init_subject(&s, true);
    compare(&s, &s.scene.view, "columns");
    finish_subject(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lights_of_every_kind),
        cmocka_unit_test(hemisphere_haze_and_ground),
        cmocka_unit_test(smooth_meshes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
