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

#include "glb/demo_scene.h"
#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "renderer/raytrace/raytrace.h"
#include "tests/support/generated_scene.h"
#include "tests/support/import_support.h"

enum { SPOTS = 24, WIDTH = 160, HEIGHT = 120 };

struct subject { /* zeroed before init */
    struct generated_scene scene;
    struct imported_scene imported;
    struct raytrace_cache *cache;
};

static void import_subject(struct subject *s)
{
    struct error err = {0};
    const struct scene_file file = {"scene.glb", s->scene.glb, s->scene.glb_bytes};
    s->cache = raytrace_cache_create(&err);
    if (!s->cache || !imported_scene_init(&s->imported, &file, 1, &err))
        fail_msg("%s", err.message);
    s->scene.view.width_px = WIDTH;
    s->scene.view.height_px = HEIGHT;
    s->scene.view.quality.shadows = SHADOWS_RAYTRACED;
}

static void init_subject(struct subject *s, bool has_columns)
{
    struct error err = {0};
    bool ok = has_columns ? generated_scene_make_colonnade(&s->scene, &err)
                          : generated_scene_make_boxes(&s->scene, SPOTS, 1, &err);
    if (!ok)
        fail_msg("%s", err.message);
    import_subject(s);
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
    int bare = 0;
    for (size_t i = 0; i < state->scene->material_count; i++) {
        struct scene_material *m = &state->materials[i].base;
        bare += m->transmission <= 0 && m->clearcoat <= 0 && !(m->flags & SCENE_MATERIAL_UNLIT);
        m->clearcoat = m->clearcoat > 0 ? m->clearcoat : 1e-42f;
    }
    assert_true(bare > 0);
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
    static const int samples[] = {1, 4, 8};
    for (int i = 0; i < 3; i++) {
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

/* Of noise, finer than the pixels of what is far away. */
static int add_texture(struct glb_builder *b, enum glb_filter filter)
{
    enum { SIDE = 64 };
    uint8_t pixels[4 * SIDE * SIDE];
    uint32_t seed = 7;
    for (size_t i = 0; i < sizeof pixels; i++) {
        seed = seed * 1664525 + 1013904223;
        pixels[i] = (uint8_t)(40 + (seed >> 24) * 4 / 5);
    }
    int image = glb_builder_add_image(b, "noise", pixels, SIDE, SIDE);
    return glb_builder_add_texture(b, &(struct glb_texture_desc){.image = image, .filter = filter});
}

/* A strip of rectangles in waves, with normals across them, 6 m wide and 8 m long, `up` m high. */
static void add_waves(struct glb_builder *b, int material, double up, bool is_colored)
{
    enum { ROWS = 24 };
    float positions[2 * ROWS][3], normals[2 * ROWS][3], texcoords[2 * ROWS][2], colors[2 * ROWS][4];
    uint32_t indices[6 * (ROWS - 1)];
    for (size_t i = 0; i < (size_t)2 * ROWS; i++) {
        double z = 8. * (double)(i / 2) / (ROWS - 1), slope = 0.3 * cos(2 * z);
        double length = sqrt(1 + slope * slope);
        const double at[3] = {i % 2 ? 3 : -3, up + 0.15 * sin(2 * z), -z};
        const double normal[3] = {0, 1 / length, slope / length};
        for (int k = 0; k < 3; k++) {
            positions[i][k] = (float)at[k];
            normals[i][k] = (float)normal[k];
            colors[i][k] = (float)(0.5 + 0.5 * sin((double)(i * 3) + k));
        }
        colors[i][3] = 1;
        texcoords[i][0] = (float)(at[0] * 2);
        texcoords[i][1] = (float)(z * 2);
    }
    for (uint32_t i = 0; i < ROWS - 1; i++)
        for (uint32_t k = 0; k < 6; k++)
            indices[6 * i + k] = 2 * i + (const uint32_t[]){0, 1, 3, 0, 3, 2}[k];
    const struct glb_primitive_desc primitive = {.material = material,
                                                 .vertex_count = (size_t)2 * ROWS,
                                                 .positions = positions[0],
                                                 .normals = normals[0],
                                                 .texcoords = is_colored ? NULL : texcoords[0],
                                                 .colors = is_colored ? colors[0] : NULL,
                                                 .indices = indices,
                                                 .index_count = sizeof indices / sizeof *indices};
    int mesh = glb_builder_add_mesh(b, "waves", &primitive, 1);
    glb_builder_add_node(b, &(struct glb_node_desc){.mesh = mesh});
}

/* Waves above each other: two with a texture in every place that a base has, with levels of detail
 * and without; between them one of glass that covers by a texture; and one of vertex colours. */
static void build_waves(void **glb, size_t *size)
{
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("waves", &err);
    assert_non_null(b);
    for (int i = 0; i < 4; i++) {
        const struct glb_texture_ref texture = {
            .texture = add_texture(b, i ? GLB_FILTER_NEAREST : GLB_FILTER_TRILINEAR)};
        struct glb_material_desc material = {.metallic = 0.5, .roughness = 1};
        material.is_double_sided = true;
        if (i < 3)
            material.base_color_texture = texture;
        if (i < 2) {
            material.metallic_roughness_texture = material.normal_texture = texture;
            material.occlusion_texture = material.emissive_texture = texture;
            material.emissive[1] = 0.1;
        }
        material.alpha_mode = i == 2 ? GLB_BLEND : GLB_OPAQUE;
        add_waves(b, glb_builder_add_material(b, &material), i < 2 ? 2. * i : i - 1.5, i == 3);
    }
    bool ok = glb_builder_finish(b, glb, size, &err);
    glb_builder_destroy(b);
    if (!ok)
        fail_msg("%s", err.message);
}

static void textured_and_coloured_meshes(void **state)
{
    (void)state;
    struct subject s = {.cache = NULL};
    build_waves(&s.scene.glb, &s.scene.glb_bytes);
    import_subject(&s);
    struct view *view = &s.scene.view;
    s.scene.lights[0] = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                            .position = {1, 6, 1},
                                            .direction = {-0.1, -1, -0.5},
                                            .color = {1, 0.9f, 0.8f},
                                            .intensity = 100,
                                            .outer_cone_deg = 50};
    s.scene.lights[1] = (struct view_light){.type = SCENE_LIGHT_POINT,
                                            .position = {-4, 1, -2},
                                            .color = {0.3f, 0.9f, 0.8f},
                                            .intensity = 20};
    s.scene.lights[2] = (struct view_light){.type = SCENE_LIGHT_DISK,
                                            .position = {3, 5, -6},
                                            .direction = {-0.3, -1, 0},
                                            .color = {1, 0.4f, 0.3f},
                                            .intensity = 20,
                                            .radius_m = 0.5};
    view->lights = s.scene.lights;
    view->light_count = 3;
    view->camera = (struct view_camera){
        .kind = VIEW_CAMERA_LOOK_AT, .eye = {5, 3, 4}, .target = {0, 0.8, -3}, .fov_y_deg = 50};
    compare(&s, view, "waves");
    view->has_environment = true;
    view->sky[2] = view->ground[0] = 0.25f;
    view->atmosphere.density_per_m = 0.05;
    compare(&s, view, "waves below a hemisphere in haze");
    finish_subject(&s);
}

static int add_plain(struct glb_builder *b, uint32_t number, double alpha, bool is_double_sided)
{
    struct glb_material_desc material = {.roughness = 0.2 + 0.1 * (number % 7),
                                         .metallic = number % 3 == 2 ? 0.7 : 0,
                                         .alpha_mode = alpha < 1 ? GLB_BLEND : GLB_OPAQUE,
                                         .is_double_sided = is_double_sided};
    for (uint32_t k = 0; k < 3; k++)
        material.base_color[k] = 0.2 + 0.1 * ((number + 1) * (k + 3) % 8);
    material.base_color[3] = alpha;
    material.emissive[1] = number % 4 == 3 ? 0.2 : 0;
    return glb_builder_add_material(b, &material);
}

static void add_node(struct glb_builder *b, struct shape *shape, int material, bool is_mirrored)
{
    const int mesh = shape_give_mesh(shape, b, "part", material);
    struct glb_node_desc node = {.mesh = mesh};
    if (is_mirrored) {
        node.scale[0] = -1;
        node.scale[1] = node.scale[2] = 1;
    }
    glb_builder_add_node(b, &node);
}

/* Panes, one of which is seen from one side alone and one mirrored, before a floor, a sphere, more
 * panes, and nothing; and a crowd of small ones, so that samples of a pixel see different ones. */
static void build_panes(void **glb, size_t *size)
{
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("panes", &err);
    assert_non_null(b);
    struct shape floor = {0}, sphere = {0}, crowd = {0};
    shape_add_grid(&floor, (double[]){-6, 0, 3}, (double[]){12, 0, 0}, (double[]){0, 0, -9}, 9, 7);
    add_node(b, &floor, add_plain(b, 0, 1, false), false);
    shape_add_sphere(&sphere, (double[]){1, 1, -2}, 0.9, 18, 12);
    add_node(b, &sphere, add_plain(b, 1, 1, false), false);
    for (uint32_t i = 0; i < 12; i++) {
        struct shape pane = {0};
        shape_add_quad(&pane, (double[]){-3 + 0.3 * i, 0.1, -4.2 + 0.5 * i}, (double[]){4, 0, 0.3},
                       (double[]){0.2, 2.5 - 0.1 * i, 0.1 * i});
        add_node(b, &pane, add_plain(b, i + 2, 0.05 + 0.08 * i, i != 5), i == 7);
    }
    for (int i = 0; i < 150; i++)
        shape_add_quad(&crowd, (double[]){i % 15 * 0.3 - 3, 0.3 + i / 15 * 0.25, -1 - i % 7 * 0.4},
                       (double[]){0.3, 0, 0.05 * (i % 5)}, (double[]){0, 0.2, 0});
    add_node(b, &crowd, add_plain(b, 20, 0.3, true), false);
    bool ok = glb_builder_finish(b, glb, size, &err);
    glb_builder_destroy(b);
    if (!ok)
        fail_msg("%s", err.message);
}

static void panes_of_plain_meshes(void **state)
{
    (void)state;
    struct subject s = {.cache = NULL};
    build_panes(&s.scene.glb, &s.scene.glb_bytes);
    import_subject(&s);
    struct view *view = &s.scene.view;
    s.scene.lights[0] = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                            .position = {2, 6, 5},
                                            .direction = {-0.2, -1, -1},
                                            .color = {1, 0.9f, 0.8f},
                                            .intensity = 300,
                                            .inner_cone_deg = 20,
                                            .outer_cone_deg = 45};
    s.scene.lights[1] = (struct view_light){.type = SCENE_LIGHT_POINT,
                                            .position = {-3, 2, 1},
                                            .color = {0.3f, 0.9f, 0.8f},
                                            .intensity = 30,
                                            .casts_no_shadow = true};
    view->lights = s.scene.lights;
    view->light_count = 2;
    view->ignore_scene_lights = true;
    view->background[0] = 0.25f;
    view->background[3] = 0.5f;
    const double eyes[][3] = {{1, 3, 7}, {-5, 1.5, -1}, {0.5, 2, -8}};
    for (int i = 0; i < 3; i++) {
        view->camera = (struct view_camera){
            .kind = VIEW_CAMERA_LOOK_AT, .target = {0, 1, -1}, .fov_y_deg = 50};
        memcpy(view->camera.eye, eyes[i], sizeof eyes[i]);
        compare(&s, view, "panes");
        view->has_environment = i == 0;
        view->sky[2] = view->ground[0] = 0.25f;
    }
    finish_subject(&s);
}

static void the_demo_scene(void **state)
{
    (void)state;
    struct subject s = {.cache = NULL};
    struct error err = {0};
    if (!demo_scene_build(&(struct demo_scene_desc){.texture_size_px = 128}, &s.scene.glb,
                          &s.scene.glb_bytes, &err))
        fail_msg("%s", err.message);
    import_subject(&s);
    s.scene.view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                               .eye = {1, 1.75, 6.6},
                                               .target = {-0.45, 2.95, -10},
                                               .fov_y_deg = 52};
    compare(&s, &s.scene.view, "demo");
    finish_subject(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lights_of_every_kind),  cmocka_unit_test(hemisphere_haze_and_ground),
        cmocka_unit_test(smooth_meshes),         cmocka_unit_test(textured_and_coloured_meshes),
        cmocka_unit_test(panes_of_plain_meshes), cmocka_unit_test(the_demo_scene),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
