/* SPDX-License-Identifier: MIT */
/* Invariants of pictures: sums and multiples of light, techniques against each other. */
#include "tests/support/asset_checks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"

struct view asset_view(const double eye[3], const double target[3], double fov_y_deg)
{
    return (struct view){
        .width_px = 480,
        .height_px = 270,
        .outputs = (1u << VIEW_OUTPUT_COUNT) - 1,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {eye[0], eye[1], eye[2]},
                   .target = {target[0], target[1], target[2]},
                   .fov_y_deg = fov_y_deg},
        .background = {0.2f, 0.2f, 0.2f, 1},
    };
}

static double bounds_of(const struct rig_scene *scene, double centre[3])
{
    const struct scene_header *header = scene->imported.scene.header;
    double radius = 0;
    for (int i = 0; i < 3; i++) {
        centre[i] = 0.5 * (header->bounds_min[i] + header->bounds_max[i]);
        radius += pow(0.5 * (header->bounds_max[i] - header->bounds_min[i]), 2);
    }
    return sqrt(radius);
}

struct view asset_view_from(const struct rig_scene *scene, const double direction[3],
                            double fov_y_deg)
{
    double centre[3], eye[3], way[3] = {direction[0], direction[1], direction[2]};
    double radius = bounds_of(scene, centre);
    assert_true(vec3_normalize(way));
    for (int i = 0; i < 3; i++)
        eye[i] = centre[i] + way[i] * radius / sin(fov_y_deg * 3.14159265358979 / 360);
    return asset_view(eye, centre, fov_y_deg);
}

void asset_shoot(struct renderer *renderer, const struct rig_scene *scene, const struct view *view,
                 const char *picture, struct frame *frame)
{
    shoot(renderer, scene, view, frame);
    assert_image_is_sound(&frame->outputs[VIEW_OUTPUT_COLOR], 1e7);
    save_picture(&frame->outputs[VIEW_OUTPUT_COLOR], picture);
}

/* -- Invariants -- */

struct lamps {
    struct renderer *renderer;
    const struct rig_scene *scene;
    struct view view;
    struct view_light lights[2];
};

static void place_lamps(struct lamps *lamps)
{
    double centre[3];
    double radius = bounds_of(lamps->scene, centre);
    float intensity = (float)(4 * radius * radius);
    lamps->lights[0] = (struct view_light){
        .type = SCENE_LIGHT_POINT, .color = {1, 0.9f, 0.7f}, .intensity = intensity};
    lamps->lights[1] = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                           .color = {0.6f, 0.8f, 1},
                                           .intensity = 2 * intensity,
                                           .inner_cone_deg = 20,
                                           .outer_cone_deg = 40};
    static const double places[2][3] = {{0.3, 0.6, 0.5}, {-0.7, 0.9, 0.8}};
    for (int l = 0; l < 2; l++)
        for (int i = 0; i < 3; i++) {
            lamps->lights[l].position[i] = centre[i] + places[l][i] * radius;
            lamps->lights[l].direction[i] = -places[l][i];
        }
    struct view *view = &lamps->view;
    view->outputs = 1u << VIEW_OUTPUT_COLOR;
    view->width_px /= 2;
    view->height_px /= 2;
    view->ignore_scene_lights = true;
    view->has_environment = true; /* black, and thereby no default lighting */
    view->quality.shadow_resolution = 256;
}

static struct image shoot_lamps(struct lamps *lamps, int first, int count, float factor)
{
    struct view_light lights[2] = {lamps->lights[first], lamps->lights[count > 1]};
    lights[0].intensity *= factor;
    lamps->view.lights = lights;
    lamps->view.light_count = (size_t)count;
    struct image color = shoot_color(lamps->renderer, lamps->scene, &lamps->view);
    lamps->view.lights = NULL;
    return color;
}

/* a += factor * b */
static void image_add(struct image *a, const struct image *b, float factor)
{
    float *p = a->pixels;
    const float *q = b->pixels;
    for (size_t i = 0; i < image_size_bytes(a) / sizeof *p; i++)
        p[i] += factor * q[i];
}

/* With one sample: where more are lit apart depends on all light together. */
static void check_sums(struct lamps *lamps)
{
    int samples = lamps->view.quality.samples;
    lamps->view.quality.samples = 1;
    struct image both = shoot_lamps(lamps, 0, 2, 1);
    struct image none = shoot_lamps(lamps, 0, 0, 1), point = shoot_lamps(lamps, 0, 1, 1);
    struct image spot = shoot_lamps(lamps, 1, 1, 1), twice = shoot_lamps(lamps, 0, 1, 2);
    double dark = 1e-2;
    assert_true(image_compare(&point, &none, dark).relative > 0.5); /* both lamps do shine */
    assert_true(image_compare(&spot, &none, dark).relative > 0.5);
    image_add(&spot, &point, 1);
    image_add(&spot, &none, -1); /* emission and background are in both */
    assert_images_close(&spot, &both, dark, 1e-5);
    image_add(&twice, &none, 1);
    image_add(&twice, &point, -1);
    assert_images_close(&twice, &point, dark, 1e-5);
    image_finish(&both);
    image_finish(&none);
    image_finish(&point);
    image_finish(&spot);
    image_finish(&twice);
    lamps->view.quality.samples = samples;
}

static bool is_transparent(const struct scene *scene)
{
    for (uint32_t i = 0; i < scene->material_count; i++)
        if (scene->materials[i].alpha_mode == SCENE_BLEND || scene->materials[i].transmission > 0)
            return true;
    return false;
}

/* Linked lists know no media (docs/explanation/architecture.md). */
static bool has_media(const struct scene *scene)
{
    for (uint32_t i = 0; i < scene->primitive_count; i++)
        if ((scene->primitives[i].flags & SCENE_PRIMITIVE_IS_CLOSED) &&
            scene_material_attenuates(&scene->materials[scene->primitives[i].material]))
            return true;
    return false;
}

static void check_techniques(struct lamps *lamps, const struct image *both)
{
    struct view_quality quality = lamps->view.quality;
    lamps->view.quality.shadows = SHADOWS_DEEP;
    struct image deep = shoot_lamps(lamps, 0, 2, 1);
    assert_same_bits(both, &deep); /* what "auto" takes */
    if (!is_transparent(&lamps->scene->imported.scene)) {
        lamps->view.quality.shadows = SHADOWS_MAP;
        struct image map = shoot_lamps(lamps, 0, 2, 1);
        assert_same_bits(&deep, &map);
        image_finish(&map);
    }
    lamps->view.quality.shadows = SHADOWS_DEEP_LINKED;
    struct image linked = shoot_lamps(lamps, 0, 2, 1);
    /* Half a step of 16 bits per filter and lookup, relative to light that passes at all. */
    if (!has_media(&lamps->scene->imported.scene))
        assert_images_close(&deep, &linked, 0.05, 1e-3);
    lamps->view.quality = quality;
    lamps->view.quality.light_lists = VIEW_LIGHT_LISTS_LINKED;
    struct image listed = shoot_lamps(lamps, 0, 2, 1);
    assert_images_close(&deep, &listed, 1e-3, 1e-6);
    lamps->view.quality = quality;
    image_finish(&deep);
    image_finish(&linked);
    image_finish(&listed);
}

void asset_check_invariants(struct renderer *renderer, const struct rig_scene *scene,
                            const struct view *view)
{
    struct lamps lamps = {.renderer = renderer, .scene = scene, .view = *view};
    place_lamps(&lamps);
    struct image both = shoot_lamps(&lamps, 0, 2, 1);
    assert_image_is_sound(&both, 1e7);
    check_sums(&lamps);
    check_techniques(&lamps, &both);
    image_finish(&both);
}
