/* SPDX-License-Identifier: MIT */
/* The two forms of the ray tracer against each other, against all triangles one by one, and
 * against the rasteriser's sample positions; the kept scene; too many surfaces on a ray. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/raytrace/rt_scene.h"
#include "renderer/scene/camera.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/image_checks.h"
#include "tests/support/raytrace_probe.h"

enum { SIDE_PX = 160 };

static struct frame frame_of(struct renderer *renderer, const struct rig_scene *rig,
                             const struct view *view)
{
    struct frame frame;
    struct error err = {0};
    if (!renderer_render(renderer, rig->key, view, &frame, &err))
        fail_msg("%s", err.message);
    return frame;
}

static void open_scene(struct rig_scene *rig, struct renderer *renderer,
                       struct closed_form_scene *scene)
{
    struct error err = {0};
    if (!rig_scene_from_glb(rig, renderer, "forms", scene->glb, scene->size_bytes, &err))
        fail_msg("%s", err.message);
}

static struct view make_view(const char *camera, int samples)
{
    return (struct view){.width_px = SIDE_PX,
                         .height_px = SIDE_PX,
                         .camera = {.kind = VIEW_CAMERA_NODE, .node = camera},
                         .quality = {.shadows = SHADOWS_RAYTRACED, .samples = samples}};
}

/* At pixel centres both forms shade the same points. What differs are rays that f32 sends past the
 * other side of an edge. */
static void compare_forms(struct renderer *renderer, struct closed_form_scene *scene,
                          const char *camera, const char *name)
{
    struct rig_scene rig;
    open_scene(&rig, renderer, scene);
    struct view view = make_view(camera, 1);
    struct frame production = frame_of(renderer, &rig, &view);
    view.quality.reference = true;
    struct frame reference = frame_of(renderer, &rig, &view);
    double share = image_share_differing(&production.outputs[VIEW_OUTPUT_COLOR],
                                         &reference.outputs[VIEW_OUTPUT_COLOR], 1e-4, 1);
    printf("%s: %.3f %% of pixels differ by more than 1e-4\n", name, 100 * share);
    save_picture(&production.outputs[VIEW_OUTPUT_COLOR], "forms_production");
    assert_true(share <= 1e-3);
    frame_finish(&production);
    frame_finish(&reference);
    rig_scene_finish(&rig, renderer);
}

static void production_equals_the_reference(void **state)
{
    for (uint64_t seed = 1; seed <= 6; seed++) {
        struct closed_form_scene scene;
        random_panes_scene_build(
            &(struct random_panes_scene_desc){
                .pane_count = 12, .seed = seed, .light = (enum glb_light_type)(seed % 3)},
            &scene);
        compare_forms(*state, &scene, "Floor", "panes");
        closed_form_scene_finish(&scene);
    }
    struct closed_form_scene room;
    room_scene_build(&(struct room_scene_desc){.light_count = 60, .seed = 7, .glass_spheres = 15},
                     &room);
    compare_forms(*state, &room, "Room", "room of 60 lights");
    closed_form_scene_finish(&room);
}

/* Four and eight samples of production and of the rasteriser lie at the same places, so that the
 * edges of opaque and transparent surfaces have the same coverage: a mirrored pattern would show
 * along all of them. */
static void compare_samples(struct renderer *renderer, int samples)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct error err = {0};
    room_scene_build(&(struct room_scene_desc){.light_count = 20, .seed = 3, .glass_spheres = 15},
                     &scene);
    open_scene(&rig, renderer, &scene);
    struct view view = make_view("Room", samples);
    view.quality.shadows = SHADOWS_NONE;
    struct frame raster = frame_of(renderer, &rig, &view);
    struct scene_state scene_state;
    struct camera camera;
    struct image traced;
    assert_true(scene_state_init(&scene_state, &rig.imported.scene, &view, &err));
    assert_true(camera_resolve(&camera, &view, &scene_state, &err));
    struct raytrace_desc desc = {
        .view = &view, .state = &scene_state, .camera = &camera, .samples = samples};
    assert_true(raytrace_render(&desc, &traced, NULL, &err));
    double share = image_share_differing(&raster.outputs[VIEW_OUTPUT_COLOR], &traced, 5e-3, 1);
    printf("room at %d samples: %.2f %% of pixels differ by more than 5e-3\n", samples,
           100 * share);
    save_picture(&traced, "forms_samples_traced");
    save_picture(&raster.outputs[VIEW_OUTPUT_COLOR], "forms_samples_raster");
    assert_true(share < 0.01);
    image_finish(&traced);
    scene_state_finish(&scene_state);
    frame_finish(&raster);
    rig_scene_finish(&rig, renderer);
    closed_form_scene_finish(&scene);
}

static void production_samples_where_the_rasteriser_does(void **state)
{
    compare_samples(*state, 4);
    compare_samples(*state, 8);
}

/* -- all triangles, one by one -- */

enum { SOUP_TRIANGLES = 600, SOUP_RAYS = 2000 };

static void build_soup(struct closed_form_scene *scene, uint64_t seed)
{
    static float positions[SOUP_TRIANGLES * 3][3];
    struct glb_builder *builder = closed_form_begin(scene, "Soup", 0);
    for (int part = 0; part < 2; part++) { /* glass, and an opaque half as many */
        int count = part ? SOUP_TRIANGLES / 20 : SOUP_TRIANGLES;
        for (int i = 0; i < count; i++) {
            double center[3];
            for (int k = 0; k < 3; k++)
                center[k] = closed_form_random(&seed, -2, 2);
            for (int v = 0; v < 3; v++)
                for (int k = 0; k < 3; k++)
                    positions[3 * i + v][k] =
                        (float)(center[k] + closed_form_random(&seed, -0.8, 0.8));
        }
        int material = glb_builder_add_material(
            builder, &(struct glb_material_desc){.name = part ? "Stone" : "Glass",
                                                 .base_color = {0.5, 0.7, 0.9, 1},
                                                 .transmission = part ? 0 : 1,
                                                 .is_double_sided = true});
        struct glb_primitive_desc primitive = {
            .material = material, .vertex_count = (size_t)count * 3, .positions = &positions[0][0]};
        int mesh = glb_builder_add_mesh(builder, "Soup", &primitive, 1);
        glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Soup", .mesh = mesh});
    }
    closed_form_end(scene, builder);
}

/* Moeller and Trumbore 1997 in f64. border: least barycentric weight. */
static bool meet(const double (*v)[3], const struct rt_ray *ray, double *t, double *border)
{
    double e1[3], e2[3], p[3], s[3], q[3];
    vec3_sub(v[1], v[0], e1);
    vec3_sub(v[2], v[0], e2);
    vec3_cross(ray->direction, e2, p);
    double det = vec3_dot(e1, p);
    vec3_sub(ray->origin, v[0], s);
    double u = vec3_dot(s, p) / det;
    vec3_cross(s, e1, q);
    double w = vec3_dot(ray->direction, q) / det;
    *t = vec3_dot(e2, q) / det;
    *border = fmin(fmin(u, w), 1 - u - w);
    return *border >= 0 && *t > ray->t_min && *t < ray->t_max;
}

/* Sorted distances by testing every triangle, cut at the first opaque one; false for a ray so near
 * to a border that f32 may decide otherwise. */
static bool collect_brute(const struct rt_scene *scene, const struct rt_ray *ray, double *ts,
                          size_t *count)
{
    double opaque = INFINITY;
    *count = 0;
    for (uint32_t pass = 0; pass < 2; pass++) {
        for (uint32_t m = 0; m < scene->mesh_count; m++) {
            bool is_opaque = scene->meshes[m].item->class_ == STATE_OPAQUE;
            uint32_t triangles =
                scene->state->scene->primitives[scene->meshes[m].item->primitive].index_count / 3;
            for (uint32_t i = 0; is_opaque == !pass && i < triangles; i++) {
                double t, border;
                const double(*v)[3] = (const double(*)[3])scene->meshes[m].positions + 3 * i;
                bool is_met = meet(v, ray, &t, &border);
                if (fabs(border) < 1e-4)
                    return false;
                if (is_met && is_opaque)
                    opaque = fmin(opaque, t);
                else if (is_met && t < opaque)
                    ts[(*count)++] = t;
            }
        }
    }
    if (opaque < INFINITY)
        ts[(*count)++] = opaque;
    for (size_t i = 1; i < *count; i++)
        for (size_t k = i; k && ts[k - 1] > ts[k]; k--) {
            double swapped = ts[k];
            ts[k] = ts[k - 1];
            ts[k - 1] = swapped;
        }
    return true;
}

static void check_rays(const struct rt_scene *scene, uint64_t seed, int *compared, int *crossings)
{
    struct rt_hits hits;
    struct error err = {0};
    assert_true(rt_hits_init(&hits, &err));
    for (int r = 0; r < SOUP_RAYS; r++) {
        struct rt_ray ray = {
            .t_max = INFINITY, .skip_mesh = UINT32_MAX, .skip_triangle = UINT32_MAX};
        double ts[SOUP_TRIANGLES + 1];
        size_t count;
        for (int k = 0; k < 3; k++) {
            ray.origin[k] = closed_form_random(&seed, -3, 3);
            ray.direction[k] = closed_form_random(&seed, -1, 1);
        }
        rt_scene_collect(scene, &ray, &hits);
        if (!collect_brute(scene, &ray, ts, &count))
            continue;
        ++*compared;
        assert_int_equal(hits.count, count);
        for (size_t i = 0; i < count; i++)
            assert_true(fabs(hits.hits[i].t - ts[i]) <= 1e-9 * (1 + fabs(ts[i])));
        *crossings += (int)count;
    }
    rt_hits_finish(&hits);
}

static void hits_are_those_of_all_triangles(void **unused)
{
    (void)unused;
    int compared = 0, crossings = 0;
    for (uint64_t seed = 1; seed <= 5; seed++) {
        struct closed_form_scene scene;
        struct imported_scene imported = {0};
        struct error err = {0};
        struct view view = {.width_px = 1, .height_px = 1};
        struct scene_state state;
        struct rt_scene rt;
        build_soup(&scene, seed);
        struct scene_file file = {.name = "", .bytes = scene.glb, .size_bytes = scene.size_bytes};
        assert_true(imported_scene_init(&imported, &file, 1, &err));
        assert_true(scene_state_init(&state, &imported.scene, &view, &err));
        assert_true(rt_scene_init(&rt, &state, &view, &err));
        check_rays(&rt, seed + 100, &compared, &crossings);
        rt_scene_finish(&rt);
        scene_state_finish(&state);
        imported_scene_finish(&imported);
        closed_form_scene_finish(&scene);
    }
    printf("%d rays, %d crossings\n", compared, crossings);
    assert_true(compared > 5 * SOUP_RAYS / 2 && crossings > compared);
}

/* -- edges -- */

/* The diagonal of a pane lies on both of its triangles; light through it is filtered once. Two
 * panes in one place filter twice. */
static void a_shared_edge_is_crossed_once(void **unused)
{
    (void)unused;
    for (int panes = 1; panes <= 2; panes++) {
        struct closed_form_scene scene;
        struct imported_scene imported = {0};
        struct error err = {0};
        struct panes_scene_desc desc = {
            .pane_count = panes,
            .colors = (const double[][4]){{0.5, 0.5, 0.5, 1}, {0.5, 0.5, 0.5, 1}},
            .spacing = 1e-9,
            .light = GLB_LIGHT_DIRECTIONAL};
        panes_scene_build(&desc, &scene);
        struct scene_file file = {.name = "", .bytes = scene.glb, .size_bytes = scene.size_bytes};
        assert_true(imported_scene_init(&imported, &file, 1, &err));
        struct view view = {.width_px = 1, .height_px = 1};
        struct scene_state state;
        assert_true(scene_state_init(&state, &imported.scene, &view, &err));
        double points[41][3], t[41][3];
        for (int i = 0; i < 41; i++) {
            points[i][0] = 0.03125 * (i - 20);
            points[i][1] = 0;
            points[i][2] = i % 2 ? points[i][0] : -points[i][0];
        }
        struct raytrace_probe_desc probe = {.view = &view,
                                            .state = &state,
                                            .points = (const double(*)[3])points,
                                            .point_count = 41};
        assert_true(raytrace_probe(&probe, t, &err));
        for (int i = 0; i < 41; i++)
            if (fabs(t[i][0] - pow(0.5, panes)) > 1e-6)
                fail_msg("%d panes, x = %g: %g", panes, points[i][0], t[i][0]);
        scene_state_finish(&state);
        imported_scene_finish(&imported);
        closed_form_scene_finish(&scene);
    }
}

/* -- the kept scene -- */

static bool has_reused(const struct frame *frame)
{
    for (int i = 0; i < frame->report.reused_count; i++)
        if (!strcmp(frame->report.reused[i], "raytrace.build"))
            return true;
    return false;
}

static bool renders_reusing(struct renderer *renderer, const struct rig_scene *rig,
                            const struct view *view)
{
    struct frame frame = frame_of(renderer, rig, view);
    bool reused = has_reused(&frame);
    frame_finish(&frame);
    return reused;
}

/* Camera, lights and colours move without a build; a node that moves needs one. */
static void an_unchanged_scene_is_kept(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 3, .seed = 5}, &scene);
    open_scene(&rig, *state, &scene);
    struct view view = make_view("Floor", 1);
    view.width_px = view.height_px = 16;
    assert_false(renders_reusing(*state, &rig, &view));
    view.camera = (struct view_camera){.kind = VIEW_CAMERA_FIT, .fit = VIEW_FIT_ISO};
    assert_true(renders_reusing(*state, &rig, &view));
    struct view_light lamp = {.type = SCENE_LIGHT_POINT, .color = {1, 1, 1}, .intensity = 3};
    view.lights = &lamp;
    view.light_count = 1;
    assert_true(renders_reusing(*state, &rig, &view));
    struct view_material_override red = {
        .material = "#0", .has_base_color = true, .base_color = {1, 0, 0, 0.5f}};
    view.materials = &red;
    view.material_override_count = 1;
    struct frame kept = frame_of(*state, &rig, &view);
    assert_true(has_reused(&kept));
    struct view_node_override gone = {.node = "Pane", .has_visible = true};
    view.nodes = &gone;
    view.node_override_count = 1;
    assert_false(renders_reusing(*state, &rig, &view));
    view.node_override_count = 0;
    struct frame rebuilt = frame_of(*state, &rig, &view);
    assert_false(has_reused(&rebuilt));
    assert_memory_equal(kept.outputs[VIEW_OUTPUT_COLOR].pixels,
                        rebuilt.outputs[VIEW_OUTPUT_COLOR].pixels, 16 * 16 * 4 * sizeof(float));
    frame_finish(&kept);
    frame_finish(&rebuilt);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

/* -- too much -- */

enum { STACK = RT_HITS_MAX + 100 };

static void build_stack(struct closed_form_scene *scene)
{
    static float positions[STACK][3][3];
    struct glb_builder *builder = closed_form_begin(scene, "Stack", 0);
    for (int i = 0; i < STACK; i++)
        for (int v = 0; v < 3; v++) {
            positions[i][v][0] = (float)(v == 1 ? 8 : -4);
            positions[i][v][1] = (float)(1 + i * 1e-4);
            positions[i][v][2] = (float)(v == 2 ? 8 : -4);
        }
    int glass = glb_builder_add_material(
        builder,
        &(struct glb_material_desc){.name = "Glass", .transmission = 1, .is_double_sided = true});
    struct glb_primitive_desc primitive = {
        .material = glass, .vertex_count = 3 * STACK, .positions = &positions[0][0][0]};
    int mesh = glb_builder_add_mesh(builder, "Stack", &primitive, 1);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Stack", .mesh = mesh});
    closed_form_floor(scene, builder, 1);
    closed_form_end(scene, builder);
}

static void more_surfaces_than_a_ray_holds_are_refused(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    build_stack(&scene);
    open_scene(&rig, *state, &scene);
    for (int form = 0; form < 2; form++) {
        struct view view = make_view("", 1);
        view.width_px = view.height_px = 2;
        view.camera = (struct view_camera){
            .kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0.5, 0}, .target = {0, 0, 0}, .up = {1, 0, 0}};
        view.quality.reference = form;
        struct frame frame;
        struct error err = {0};
        assert_false(renderer_render(*state, rig.key, &view, &frame, &err));
        assert_int_equal(err.code, ERROR_OVER_BUDGET);
        assert_non_null(strstr(err.message, "16384 surfaces"));
        assert_null(frame.outputs[VIEW_OUTPUT_COLOR].pixels);
    }
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(production_equals_the_reference),
        cmocka_unit_test(production_samples_where_the_rasteriser_does),
        cmocka_unit_test(hits_are_those_of_all_triangles),
        cmocka_unit_test(a_shared_edge_is_crossed_once),
        cmocka_unit_test(an_unchanged_scene_is_kept),
        cmocka_unit_test(more_surfaces_than_a_ray_holds_are_refused),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
