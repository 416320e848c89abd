/* SPDX-License-Identifier: MIT */
/* Media of the ray tracer against closed forms: slabs, wedges, spheres, overlapping boxes with
 * light, receiver and camera inside (A2 to A5 of docs/reference/accuracy.md). */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/scene/camera.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/import_support.h"
#include "tests/support/render_support.h"
#include "tests/support/raytrace_probe.h"

enum { BOXES = 4, PROBES = 64 };

struct box {
    double low[3], high[3];
    double left[3]; /* of white light after a metre */
};

static int add_medium(struct glb_builder *builder, const double left[3])
{
    struct glb_material_desc desc = {.name = "Medium",
                                     .base_color = {1, 1, 1, 1},
                                     .transmission = 1,
                                     .has_ior = true,
                                     .ior = 1,
                                     .thickness = 1,
                                     .attenuation_distance = 1};
    memcpy(desc.attenuation_color, left, sizeof desc.attenuation_color);
    return glb_builder_add_material(builder, &desc);
}

static void add_mesh(struct glb_builder *builder, int material, const float *positions,
                     size_t vertices, const uint32_t *indices, size_t count)
{
    struct glb_primitive_desc primitive = {.material = material,
                                           .vertex_count = vertices,
                                           .positions = positions,
                                           .indices = indices,
                                           .index_count = count};
    int mesh = glb_builder_add_mesh(builder, "Medium", &primitive, 1);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Medium", .mesh = mesh});
}

/* Corner i is high in axis k where bit k is set; faces counter-clockwise seen from outside. */
static void add_box(struct glb_builder *builder, const struct box *box)
{
    static const uint32_t indices[] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                       2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    float positions[8][3];
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            positions[i][k] = (float)(i >> k & 1 ? box->high[k] : box->low[k]);
    add_mesh(builder, add_medium(builder, box->left), &positions[0][0], 8, indices, 36);
}

/* Length of the part of a segment that lies in the box as f32 stores it. */
static double clipped_length(const struct box *box, const double a[3], const double b[3])
{
    double from = 0, to = 1, way[3];
    vec3_sub(b, a, way);
    for (int k = 0; k < 3; k++) {
        double low = (double)(float)box->low[k], high = (double)(float)box->high[k];
        if (way[k] == 0 && (a[k] < low || a[k] > high))
            return 0;
        if (way[k] == 0)
            continue;
        double s = (low - a[k]) / way[k], t = (high - a[k]) / way[k];
        from = fmax(from, fmin(s, t));
        to = fmin(to, fmax(s, t));
    }
    return to > from ? (to - from) * vec3_length(way) : 0;
}

static void expect_boxes(const struct box *boxes, int count, const double a[3], const double b[3],
                         double t[3])
{
    t[0] = t[1] = t[2] = 1;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            t[k] *= pow((double)(float)boxes[i].left[k], clipped_length(&boxes[i], a, b));
}

static void import_scene(struct closed_form_scene *scene, struct glb_builder *builder,
                         struct imported_scene *imported)
{
    struct error err = {0};
    closed_form_end(scene, builder);
    struct scene_file file = {.name = "", .bytes = scene->glb, .size_bytes = scene->size_bytes};
    if (!imported_scene_init(imported, &file, 1, &err))
        fail_msg("%s", err.message);
}

static void probe(const struct imported_scene *imported, const struct view_light *light,
                  const double (*points)[3], size_t count, double (*t)[3])
{
    struct view view = {.width_px = 1, .height_px = 1, .lights = light, .light_count = 1};
    struct scene_state state;
    struct error err = {0};
    assert_true(scene_state_init(&state, &imported->scene, &view, &err));
    assert_true(state.medium_count > 0);
    struct raytrace_probe_desc desc = {
        .view = &view, .state = &state, .points = points, .point_count = count};
    if (!raytrace_probe(&desc, t, &err))
        fail_msg("%s", err.message);
    scene_state_finish(&state);
}

static void make_boxes(struct box *boxes, uint64_t seed)
{
    for (int i = 0; i < BOXES; i++)
        for (int k = 0; k < 3; k++) {
            double center = closed_form_random(&seed, -0.6, 0.6);
            double half = closed_form_random(&seed, 0.3, 1.2);
            boxes[i].low[k] = center - half;
            boxes[i].high[k] = center + half;
            boxes[i].left[k] = closed_form_random(&seed, 0.05, 1);
        }
}

/* A5: any light, any receiver, inside or outside of up to four boxes that overlap and nest. */
static void overlapping_boxes_add_up(void **unused)
{
    (void)unused;
    int inside = 0;
    for (uint64_t seed = 1; seed <= 20; seed++) {
        struct box boxes[BOXES];
        struct closed_form_scene scene;
        struct imported_scene imported = {0};
        struct glb_builder *builder = closed_form_begin(&scene, "Boxes", 0);
        make_boxes(boxes, seed);
        for (int i = 0; i < BOXES; i++)
            add_box(builder, &boxes[i]);
        import_scene(&scene, builder, &imported);
        uint64_t random = seed + 1000;
        double points[PROBES][3], t[PROBES][3];
        struct view_light light = {.type = SCENE_LIGHT_POINT, .color = {1, 1, 1}, .intensity = 1};
        for (int k = 0; k < 3; k++)
            light.position[k] = closed_form_random(&random, -1.5, 1.5);
        for (int i = 0; i < PROBES; i++)
            for (int k = 0; k < 3; k++)
                points[i][k] = closed_form_random(&random, -2, 2);
        probe(&imported, &light, (const double(*)[3])points, PROBES, t);
        for (int i = 0; i < PROBES; i++) {
            double expected[3];
            expect_boxes(boxes, BOXES, points[i], light.position, expected);
            inside += expected[0] < 1;
            for (int k = 0; k < 3; k++)
                if (!(fabs(t[i][k] / expected[k] - 1) <= 1e-5))
                    fail_msg("seed %d, probe %d: %.9g, closed form %.9g", (int)seed, i, t[i][k],
                             expected[k]);
        }
        imported_scene_finish(&imported);
        closed_form_scene_finish(&scene);
    }
    assert_true(inside > 10 * PROBES);
}

/* A2: exp(-sigma d / cos a), up to grazing incidence. */
static void slabs_attenuate_by_the_slanted_way(void **unused)
{
    (void)unused;
    const struct box slab = {{-900, 1, -5}, {900, 1.5, 5}, {0.9, 0.99, 0.999}};
    struct closed_form_scene scene;
    struct imported_scene imported = {0};
    struct glb_builder *builder = closed_form_begin(&scene, "Slab", 0);
    add_box(builder, &slab);
    import_scene(&scene, builder, &imported);
    static const double angles_deg[] = {0, 10, 30, 45, 60, 75, 85, 89, 89.8};
    for (size_t i = 0; i < sizeof angles_deg / sizeof *angles_deg; i++) {
        double slope = tan(angles_deg[i] * M_PI / 180), points[1][3] = {{0}}, t[1][3];
        struct view_light light = {.type = SCENE_LIGHT_POINT,
                                   .position = {2 * slope, 2, 0.1},
                                   .color = {1, 1, 1},
                                   .intensity = 1};
        points[0][2] = 0.1;
        probe(&imported, &light, (const double(*)[3])points, 1, t);
        for (int k = 0; k < 3; k++) {
            double expected = pow((double)(float)slab.left[k], 0.5 * sqrt(1 + slope * slope));
            if (!(fabs(t[0][k] / expected - 1) <= 1e-5))
                fail_msg("%g degrees: %.9g, closed form %.9g", angles_deg[i], t[0][k], expected);
        }
    }
    imported_scene_finish(&imported);
    closed_form_scene_finish(&scene);
}

/* A3: under a wedge log T falls linearly. */
static void wedges_attenuate_linearly(void **unused)
{
    (void)unused;
    static const float positions[6][3] = {{0, 1, -2}, {2, 1, -2}, {2, 1.5f, -2},
                                          {0, 1, 2},  {2, 1, 2},  {2, 1.5f, 2}};
    static const uint32_t indices[] = {0, 2, 1, 3, 4, 5, 0, 1, 4, 0, 4, 3,
                                       1, 2, 5, 1, 5, 4, 0, 3, 5, 0, 5, 2};
    static const double left[3] = {0.2, 0.5, 0.8};
    struct closed_form_scene scene;
    struct imported_scene imported = {0};
    struct glb_builder *builder = closed_form_begin(&scene, "Wedge", 0);
    add_mesh(builder, add_medium(builder, left), &positions[0][0], 6, indices, 24);
    import_scene(&scene, builder, &imported);
    const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                   .direction = {0, -1, 0},
                                   .color = {1, 1, 1},
                                   .intensity = 1};
    double points[PROBES][3] = {{0}}, t[PROBES][3];
    for (int i = 0; i < PROBES; i++) {
        points[i][0] = 0.01 + 0.03 * i;
        points[i][2] = 0.07;
    }
    probe(&imported, &sun, (const double(*)[3])points, PROBES, t);
    for (int i = 0; i < PROBES; i++)
        for (int k = 0; k < 3; k++) {
            double expected = pow((double)(float)left[k], points[i][0] / 4);
            if (!(fabs(t[i][k] / expected - 1) <= 1e-5))
                fail_msg("x = %g: %.9g, closed form %.9g", points[i][0], t[i][k], expected);
        }
    imported_scene_finish(&imported);
    closed_form_scene_finish(&scene);
}

enum { RINGS = 256, SEGMENTS = 512 };

static void add_sphere(struct glb_builder *builder, int material)
{
    static float positions[(RINGS - 1) * SEGMENTS + 2][3];
    static uint32_t indices[6 * SEGMENTS * (RINGS - 1)];
    const uint32_t top = (RINGS - 1) * SEGMENTS, bottom = top + 1;
    size_t n = 0;
    positions[top][1] = 1;
    positions[bottom][1] = -1;
    for (uint32_t r = 0; r < RINGS - 1; r++)
        for (uint32_t s = 0; s < SEGMENTS; s++) {
            double polar = M_PI * (r + 1) / RINGS, around = 2 * M_PI * s / SEGMENTS;
            positions[r * SEGMENTS + s][0] = (float)(sin(polar) * cos(around));
            positions[r * SEGMENTS + s][1] = (float)cos(polar);
            positions[r * SEGMENTS + s][2] = (float)(-sin(polar) * sin(around));
        }
    for (uint32_t r = 0; r < RINGS; r++)
        for (uint32_t s = 0; s < SEGMENTS; s++) {
            uint32_t next = (s + 1) % SEGMENTS;
            uint32_t a = r ? (r - 1) * SEGMENTS + s : top, b = r ? (r - 1) * SEGMENTS + next : top;
            uint32_t c = r < RINGS - 1 ? r * SEGMENTS + s : bottom;
            uint32_t d = r < RINGS - 1 ? r * SEGMENTS + next : bottom;
            const uint32_t quad[6] = {a, c, d, a, d, b};
            size_t first = r < RINGS - 1 ? 0 : 3, count = r && r < RINGS - 1 ? 6 : 3;
            memcpy(indices + n, quad + first, count * sizeof *quad);
            n += count;
        }
    add_mesh(builder, material, &positions[0][0], top + 2, indices, n);
}

/* A4: exp(-2 sigma sqrt(R^2 - b^2)). The mesh lies within R (pi / 512)^2 = 3.8e-5 of the
 * sphere, which at the rim, where the way ends at a slant, is as much over sqrt(1 - b^2). */
static void spheres_attenuate_by_the_chord(void **unused)
{
    (void)unused;
    static const double left[3] = {0.7, 0.8, 0.9};
    struct closed_form_scene scene;
    struct imported_scene imported = {0};
    struct glb_builder *builder = closed_form_begin(&scene, "Sphere", 0);
    add_sphere(builder, add_medium(builder, left));
    import_scene(&scene, builder, &imported);
    const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                   .direction = {0, -1, 0},
                                   .color = {1, 1, 1},
                                   .intensity = 1};
    double points[PROBES][3], t[PROBES][3];
    for (int i = 0; i < PROBES; i++) {
        double b = 1.2 * i / PROBES;
        points[i][0] = b * cos(1.7 * i);
        points[i][1] = -2;
        points[i][2] = b * sin(1.7 * i);
    }
    probe(&imported, &sun, (const double(*)[3])points, PROBES, t);
    for (int i = 0; i < PROBES; i++) {
        double b = 1.2 * i / PROBES, half = sqrt(fmax(1 - b * b, 0));
        if (fabs(b - 1) < 0.01)
            continue;
        for (int k = 0; k < 3; k++) {
            double sigma = -log((double)(float)left[k]);
            double tolerance = 1e-5 + 2 * sigma * 3.8e-5 / fmax(half, 0.1);
            double expected = exp(-2 * sigma * half);
            if (!(fabs(t[i][k] / expected - 1) <= tolerance))
                fail_msg("b = %g: %.9g, closed form %.9g", b, t[i][k], expected);
        }
    }
    imported_scene_finish(&imported);
    closed_form_scene_finish(&scene);
}

/* -- the camera -- */

/* A white unlit floor seen through boxes from inside and outside of them: each pixel's centre is
 * the clipped lengths' transmittance; 1e-5 in the reference, f32 positions leave 1e-4 in
 * production. */
static void check_camera(struct renderer *renderer, const struct rig_scene *rig,
                         const struct box *boxes, const struct view *view)
{
    struct frame frame;
    struct error err = {0};
    if (!renderer_render(renderer, rig->key, view, &frame, &err))
        fail_msg("%s", err.message);
    double tolerance = view->quality.reference ? 1e-5 : 1e-4;
    double half = view->camera.ortho_height > 0 ? view->camera.ortho_height / 2
                                                : tan(view->camera.fov_y_deg * M_PI / 360);
    for (int y = 0; y < view->height_px; y++)
        for (int x = 0; x < view->width_px; x++) {
            /* looking down with -z up: right is +x, the picture's y is +z */
            double px = ((x + 0.5) / view->width_px * 2 - 1) * half;
            double pz = ((y + 0.5) / view->height_px * 2 - 1) * half;
            const double *eye = view->camera.eye;
            double start[3] = {eye[0], eye[1], eye[2]};
            double end[3] = {eye[0] + px, -3, eye[2] + pz}, expected[3];
            if (view->camera.ortho_height > 0)
                start[0] = end[0], start[2] = end[2];
            else
                end[0] = eye[0] + px * (eye[1] + 3), end[2] = eye[2] + pz * (eye[1] + 3);
            expect_boxes(boxes, BOXES, start, end, expected);
            const float *pixel = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], x, y);
            for (int k = 0; k < 3; k++)
                if (!(fabs((double)pixel[k] / expected[k] - 1) <= tolerance))
                    fail_msg("eye y %g, pixel %d %d: %.9g, closed form %.9g", eye[1], x, y,
                             (double)pixel[k], expected[k]);
        }
    frame_finish(&frame);
}

static void the_view_is_attenuated_from_the_eye_on(void **unused)
{
    (void)unused;
    struct renderer *renderer = render_rig_create();
    for (uint64_t seed = 1; seed <= 3; seed++) {
        struct box boxes[BOXES];
        struct closed_form_scene scene;
        struct rig_scene rig;
        struct error err = {0};
        struct glb_builder *builder = closed_form_begin(&scene, "Boxes", 0);
        make_boxes(boxes, seed);
        for (int i = 0; i < BOXES; i++)
            add_box(builder, &boxes[i]);
        int white = glb_builder_add_material(
            builder, &(struct glb_material_desc){
                         .name = "White", .base_color = {1, 1, 1, 1}, .is_unlit = true});
        closed_form_quad(builder, "Floor", white, (double[]){-20, -3, 20}, (double[]){40, 0, 0},
                         (double[]){0, 0, -40});
        closed_form_end(&scene, builder);
        assert_true(rig_scene_from_glb(&rig, renderer, "boxes", scene.glb, scene.size_bytes, &err));
        for (int i = 0; i < 12; i++) {
            struct view view = {
                .width_px = 24,
                .height_px = 24,
                .ignore_scene_lights = true,
                .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                           .eye = {0.013, 2.5 - 0.4 * (i / 4), 0.017},
                           .target = {0.013, -3, 0.017},
                           .up = {0, 0, -1},
                           .fov_y_deg = 60,
                           .ortho_height = i / 2 % 2 ? 3 : 0},
                .quality = {.shadows = SHADOWS_RAYTRACED, .samples = 1, .reference = i % 2}};
            if (i / 4 == 2)
                view.camera.eye[1] = 0.1;
            check_camera(renderer, &rig, boxes, &view);
        }
        rig_scene_finish(&rig, renderer);
        closed_form_scene_finish(&scene);
    }
    renderer_destroy(renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(overlapping_boxes_add_up),
        cmocka_unit_test(slabs_attenuate_by_the_slanted_way),
        cmocka_unit_test(wedges_attenuate_linearly),
        cmocka_unit_test(spheres_attenuate_by_the_chord),
        cmocka_unit_test(the_view_is_attenuated_from_the_eye_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
