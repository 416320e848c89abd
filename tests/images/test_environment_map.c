/* SPDX-License-Identifier: MIT */
/* An environment as views name it: what they may ask, and how it is seen behind a scene (section 7
 * of docs/explanation/shading.md). */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "tests/support/image_checks.h"

enum { SIZE = 64, MAP_WIDTH = 32, MAP_HEIGHT = 16 };

static const double pi = 3.14159265358979323846, pane_color[3] = {0.9, 0.5, 0.25};

/* Smooth, and other in each direction. */
static struct environment *make_map(void)
{
    float pixels[3 * MAP_WIDTH * MAP_HEIGHT];
    struct error err = {0};
    for (int i = 0; i < MAP_WIDTH * MAP_HEIGHT; i++) {
        int x = i % MAP_WIDTH, y = i / MAP_WIDTH;
        double u = (x + 0.5) / MAP_WIDTH, v = (y + 0.5) / MAP_HEIGHT;
        pixels[3 * i] = (float)(1 + 0.5 * cos(2 * pi * u));
        pixels[3 * i + 1] = (float)(1 + 0.5 * sin(2 * pi * u));
        pixels[3 * i + 2] = (float)(1 + 0.5 * cos(pi * v));
    }
    struct environment *map =
        environment_create(&(struct environment_desc){pixels, MAP_WIDTH, MAP_HEIGHT}, &err);
    assert_non_null(map);
    return map;
}

static void count_release(void *context)
{
    ++*(int *)context;
}

static void attach(struct renderer *renderer, const char *key, const struct environment *map,
                   int *released)
{
    struct error err = {0};
    const struct renderer_environment_desc desc = {
        .key = key, .environment = map, .release = count_release, .context = released};
    if (!renderer_attach_environment(renderer, &desc, &err))
        fail_msg("%s", err.message);
}

/* A pane that reflects nothing, left of the middle. */
static void open_pane(struct rig_scene *rig, struct renderer *renderer)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Pane", &err);
    struct shape shape = {0};
    const double *p = pane_color;
    void *glb;
    size_t size_bytes;
    assert_non_null(builder);
    shape_add_quad(&shape, (double[]){-0.803, -0.303, 0}, (double[]){0.606, 0, 0},
                   (double[]){0, 0.606, 0});
    int material = glb_builder_add_material(
        builder, &(struct glb_material_desc){.name = "Pane",
                                             .base_color = {p[0], p[1], p[2], 1},
                                             .is_double_sided = true,
                                             .transmission = 1,
                                             .has_ior = true,
                                             .ior = 1});
    int mesh = shape_give_mesh(&shape, builder, "Pane", material);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Pane", .mesh = mesh});
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, "pane", glb, size_bytes);
    free(glb);
}

static struct view look(void)
{
    return (struct view){
        .width_px = SIZE,
        .height_px = SIZE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 3}, .fov_y_deg = 60},
        .environment_key = "map",
        .environment_rotation_deg = 40,
        .environment_intensity = 2,
        .environment_is_background = true,
        .background = {9, 9, 9, 1},
        .quality = {.shadows = SHADOWS_RAYTRACED, .samples = 1},
    };
}

/* What the middle of the pixel sees. */
static void expected_at(const struct view *view, const struct environment *map, int x, int y,
                        double radiance[3])
{
    double half = tan(30 * pi / 180);
    double way[3] = {(2 * (x + 0.5) / SIZE - 1) * half, (1 - 2 * (y + 0.5) / SIZE) * half, -1};
    double length = sqrt(way[0] * way[0] + way[1] * way[1] + 1);
    for (int k = 0; k < 3; k++)
        way[k] /= length;
    const struct environment_light light =
        environment_light_make(map, view->environment_rotation_deg, view->environment_intensity);
    environment_light_radiance(&light, way, radiance);
}

/* Bare, and through the pane; the rest is dark. */
static void expect_background(const struct view *view, const struct environment *map,
                              const struct image *image, double tolerance)
{
    static const int bare[][2] = {{40, 10}, {60, 32}, {33, 60}, {3, 3}}, pane[] = {20, 32};
    double radiance[3];
    for (int i = 0; i < 5; i++) {
        const int *at = i < 4 ? bare[i] : pane;
        const float *pixel = image_pixel_f32(image, at[0], at[1]);
        expected_at(view, map, at[0], at[1], radiance);
        for (int k = 0; k < 3; k++) {
            double expected = radiance[k] * (i < 4 ? 1 : pane_color[k]);
            if (!(fabs((double)pixel[k] - expected) <= tolerance * expected))
                fail_msg("pixel %d,%d channel %d is %.8g, expected %.8g", at[0], at[1], k,
                         (double)pixel[k], expected);
        }
        assert_true(fabs((double)pixel[3] - 1) <= 1e-6);
    }
}

static void it_is_seen_behind_the_scene_turned_and_scaled(void **state)
{
    static const struct {
        enum shadow_technique shadows;
        bool is_reference;
        int samples;
        double tolerance; /* devices interpolate with 8 bits; 4 samples see a bit of the slope */
    } forms[] = {{SHADOWS_RAYTRACED, true, 1, 1e-6},
                 {SHADOWS_RAYTRACED, false, 1, 1e-6},
                 {SHADOWS_RAYTRACED, false, 4, 1e-3},
                 {SHADOWS_DEEP, false, 1, 1e-3},
                 {SHADOWS_RAYTRACED_SHADOWS, false, 4, 1e-3}};
    struct renderer *renderer = *state;
    struct environment *map = make_map();
    struct rig_scene rig;
    int released = 0;
    open_pane(&rig, renderer);
    attach(renderer, "map", map, &released);
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
        struct view view = look();
        view.quality.shadows = forms[i].shadows;
        view.quality.reference = forms[i].is_reference;
        view.quality.samples = forms[i].samples;
        struct image image = shoot_color(renderer, &rig, &view);
        expect_background(&view, map, &image, forms[i].tolerance);
        image_finish(&image);
        view.environment_is_background = false;
        image = shoot_color(renderer, &rig, &view);
        assert_true(image_pixel_f32(&image, 40, 10)[0] == 9);
        image_finish(&image);
    }
    renderer_detach_environment(renderer, "map");
    assert_int_equal(released, 1);
    rig_scene_finish(&rig, renderer);
    environment_destroy(map);
}

static void refuse(struct renderer *renderer, const struct view *view, enum error_code code,
                   const char *word)
{
    struct frame frame;
    struct error err = {0};
    assert_false(renderer_render(renderer, "pane", view, &frame, &err));
    assert_int_equal(err.code, code);
    if (!strstr(err.message, word))
        fail_msg("'%s' does not say '%s'", err.message, word);
}

static void what_views_ask_of_it_is_checked(void **state)
{
    struct renderer *renderer = *state;
    struct environment *map = make_map();
    struct rig_scene rig;
    int released = 0;
    open_pane(&rig, renderer);
    struct view view = look();
    refuse(renderer, &view, ERROR_NOT_FOUND, "environment 'map'");
    attach(renderer, "map", map, &released);
    view.environment_rotation_deg = 361;
    refuse(renderer, &view, ERROR_INVALID_REQUEST, "361");
    view = look();
    view.environment_intensity = NAN;
    refuse(renderer, &view, ERROR_INVALID_REQUEST, "intensity");
    view = look();
    view.screen.has_backdrop = true;
    refuse(renderer, &view, ERROR_INVALID_REQUEST, "background");
    view = look();
    view.quality.environment_samples = 4097;
    refuse(renderer, &view, ERROR_INVALID_REQUEST, "4097");
    renderer_detach_environment(renderer, "map");
    rig_scene_finish(&rig, renderer);
    environment_destroy(map);
}

/* One more than there is room for; and each is released once. */
static void the_least_recently_used_map_is_released(void **state)
{
    struct renderer *renderer = *state;
    struct environment *map = make_map();
    int released[RENDERER_ENVIRONMENTS_MAX + 1] = {0}, again = 0;
    char key[2] = "a";
    struct error err = {0};
    const struct renderer_environment_desc unnamed = {.key = "", .environment = map};
    assert_false(renderer_attach_environment(renderer, &unnamed, &err));
    for (int i = 0; i <= RENDERER_ENVIRONMENTS_MAX; i++) {
        key[0] = (char)('a' + i);
        attach(renderer, key, map, &released[i]);
        attach(renderer, "a", map, &again); /* is used all the time */
    }
    assert_int_equal(again, RENDERER_ENVIRONMENTS_MAX + 1);
    for (int i = 0; i <= RENDERER_ENVIRONMENTS_MAX; i++) {
        key[0] = (char)('a' + i);
        assert_int_equal(renderer_has_environment(renderer, key), i != 1);
        assert_int_equal(released[i], i == 1);
        renderer_detach_environment(renderer, key);
        assert_int_equal(released[i], 1);
    }
    environment_destroy(map);
}

/* Shows three maps, twice in turn, within the budget. bytes: what was taken after each picture. */
static void show_in_turn(uint64_t budget_bytes, struct image images[6], uint64_t bytes[6])
{
    struct renderer *renderer =
        render_rig_create_as(&(struct renderer_desc){.gpu_budget_bytes = budget_bytes});
    struct environment *maps[3] = {make_map(), make_map(), make_map()};
    struct rig_scene rig;
    int released = 0;
    open_pane(&rig, renderer);
    for (int i = 0; i < 6; i++) {
        const struct environment *map = maps[i % 3];
        struct view view = look();
        struct renderer_info info;
        const char key[] = {(char)('a' + i % 3), '\0'};
        view.environment_key = key;
        view.environment_rotation_deg = 40 * (i % 3);
        view.quality.shadows = SHADOWS_DEEP;
        attach(renderer, key, map, &released);
        images[i] = shoot_color(renderer, &rig, &view);
        expect_background(&view, map, &images[i], 1e-3);
        renderer_get_info(renderer, &info);
        bytes[i] = info.used_bytes;
    }
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
    for (int i = 0; i < 3; i++)
        environment_destroy(maps[i]);
}

/* A map takes 2.1 MB of the device: 512 x 256 texels of 12 bytes, and their smaller levels. */
static void maps_that_no_frame_shows_leave_a_device_that_is_full(void **state)
{
    (void)state;
    const uint64_t map_bytes = 2100000;
    struct image ample[6], tight[6];
    uint64_t bytes[6], budget;
    show_in_turn(0, ample, bytes);
    assert_true(bytes[1] >= bytes[0] + map_bytes && bytes[2] >= bytes[1] + map_bytes);
    assert_true(bytes[5] < bytes[2] + map_bytes);
    budget = bytes[0] + map_bytes / 2;
    show_in_turn(budget, tight, bytes);
    for (int i = 0; i < 6; i++) {
        assert_true(bytes[i] <= budget);
        assert_memory_equal(ample[i].pixels, tight[i].pixels, sizeof(float) * 4 * SIZE * SIZE);
        image_finish(&ample[i]);
        image_finish(&tight[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_is_seen_behind_the_scene_turned_and_scaled),
        cmocka_unit_test(what_views_ask_of_it_is_checked),
        cmocka_unit_test(the_least_recently_used_map_is_released),
    };
    const struct CMUnitTest own_renderers[] = {
        cmocka_unit_test(maps_that_no_frame_shows_leave_a_device_that_is_full),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown) +
           cmocka_run_group_tests(own_renderers, NULL, NULL);
}
