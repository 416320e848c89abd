/* SPDX-License-Identifier: MIT */
/* Suite `traced`: wholly ray traced pictures on one core against the bare ray tracer of
 * bare_tracer.h, on scenes that the forecasts were not fitted to and on the demo scene, whose
 * textures the bare one does not read; another camera for each picture.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "glb/demo_scene.h"
#include "glb/shapes.h"
#include "renderer/raytrace/raytrace.h"
#include "tests/bench/bare_tracer.h"
#include "tests/bench/bench.h"
#include "tests/bench/full_tracer.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/generated_scene.h"
#include "tests/support/import_support.h"
#include "tests/support/light_scene.h"
#include "tests/support/render_support.h"

static const double HALF_M = 10; /* of the floor */

enum { ONE_SAMPLE, FOUR_SAMPLES, BARE, BARE_FOUR, FULL, VARIANTS };

struct traced_case {
    const char *scene, *name;
    int panes, spheres, quads; /* blended; opaque; blended, at random */
    size_t spots;              /* 0: the demo scene in its own lights, from where live views look */
    bool has_boxes, has_columns;
    double one_over_bare; /* goal */
};

static const struct traced_case cases[] = {
    {"panes", "five panes, 1 spot", 5, 0, 0, 1, false, false, 1.3},
    {"boxes", "3000 boxes, 50 spots", 0, 0, 0, 50, true, false, 1.3},
    {"boxes", "3000 boxes, 100 spots", 0, 0, 0, 100, true, false, 0.4},
    {"boxes", "3000 boxes, 250 spots", 0, 0, 0, 250, true, false, 0.4},
    {"spheres", "1000 spheres, 1 spot", 0, 1000, 0, 1, false, false, 1.3},
    {"quads", "1000 spheres, 500 quads, 1 spot", 0, 1000, 500, 1, false, false, 1.3},
    {"quads", "1000 spheres, 2000 quads, 1 spot", 0, 1000, 2000, 1, false, false, 1.3},
    {"colonnade", "colonnade, 5 spots", 0, 0, 0, 5, false, true, 1.3},
    {"colonnade", "colonnade, 15 spots", 0, 0, 0, 15, false, true, 1.3},
    {"colonnade", "colonnade, 25 spots", 0, 0, 0, 25, false, true, 1.3},
    {"demo", "demo scene, 12 lights", 0, 0, 0, 0, false, false, 1.3},
};

static int add_material(struct glb_builder *builder, uint64_t *state, double alpha)
{
    struct glb_material_desc material = {.roughness = 0.7,
                                         .alpha_mode = alpha < 1 ? GLB_BLEND : GLB_OPAQUE,
                                         .is_double_sided = alpha < 1};
    for (int c = 0; c < 3; c++)
        material.base_color[c] = random_uniform(state, 0.25, 0.95);
    material.base_color[3] = alpha;
    return glb_builder_add_material(builder, &material);
}

static void add_part(struct glb_builder *builder, struct shape *shape, int material)
{
    int mesh = shape_give_mesh(shape, builder, "Part", material);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Part", .mesh = mesh});
}

static void add_panes(struct glb_builder *builder, uint64_t *state, int count)
{
    for (int i = 0; i < count; i++) {
        struct shape shape = {0};
        shape_add_quad(&shape, (double[]){-4 + 0.4 * i, 0.1, -3 + 1.5 * i}, (double[]){6, 0, 0},
                       (double[]){0, 4, 0});
        add_part(builder, &shape, add_material(builder, state, 0.4));
    }
}

static void add_spheres(struct glb_builder *builder, uint64_t *state, int count)
{
    struct shape shape = {0};
    for (int i = 0; i < count; i++) {
        double center[3] = {random_uniform(state, -HALF_M, HALF_M), random_uniform(state, 0.2, 4),
                            random_uniform(state, -HALF_M, HALF_M)};
        shape_add_sphere(&shape, center, random_uniform(state, 0.05, 0.25), 16, 10);
    }
    add_part(builder, &shape, add_material(builder, state, 1));
}

static void add_quads(struct glb_builder *builder, uint64_t *state, int count)
{
    struct shape shape = {0};
    for (int i = 0; i < count; i++) {
        double around = random_uniform(state, 0, 6.28), side = random_uniform(state, 0.3, 1);
        shape_add_quad(
            &shape,
            (double[]){random_uniform(state, -HALF_M, HALF_M), random_uniform(state, 0.2, 4),
                       random_uniform(state, -HALF_M, HALF_M)},
            (double[]){side * cos(around), 0, side * sin(around)}, (double[]){0, side, 0});
    }
    add_part(builder, &shape, add_material(builder, state, 0.4));
}

static void set_camera(struct view *view, const struct traced_case *one, double around)
{
    if (!one->spots) {
        view->camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                            .eye = {6 * sin(around), 2.4, 6 * cos(around)},
                                            .target = {0, 1.8, 0}};
        return;
    }
    view->camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                        .eye = {12 * cos(around), 5, 12 * sin(around)},
                                        .target = {0, 1, 0},
                                        .fov_y_deg = 50};
}

static bool make_own(struct generated_scene *scene, const struct traced_case *one,
                     struct error *err)
{
    uint64_t state = 77;
    struct glb_builder *builder = glb_builder_create("Traced", err);
    struct shape floor = {0};
    if (!builder)
        return false;
    shape_add_grid(&floor, (double[]){-HALF_M, 0, HALF_M}, (double[]){2 * HALF_M, 0, 0},
                   (double[]){0, 0, -2 * HALF_M}, 16, 16);
    add_part(builder, &floor, add_material(builder, &state, 1));
    add_panes(builder, &state, one->panes);
    if (one->spheres)
        add_spheres(builder, &state, one->spheres);
    if (one->quads)
        add_quads(builder, &state, one->quads);
    bool ok = glb_builder_finish(builder, &scene->glb, &scene->glb_bytes, err);
    glb_builder_destroy(builder);
    scene->lights[0] = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                           .position = {2, 12, 9},
                                           .direction = {-0.15f, -1, -0.7f},
                                           .color = {1, 1, 1},
                                           .intensity = 3000,
                                           .inner_cone_deg = 35,
                                           .outer_cone_deg = 45};
    scene->view = (struct view){.outputs = 1u << VIEW_OUTPUT_COLOR,
                                .lights = scene->lights,
                                .light_count = one->spots,
                                .ignore_scene_lights = true};
    return ok;
}

static bool make_demo(struct generated_scene *scene, struct error *err)
{
    scene->view = (struct view){.outputs = 1u << VIEW_OUTPUT_COLOR};
    return demo_scene_build(&(struct demo_scene_desc){0}, &scene->glb, &scene->glb_bytes, err);
}

/* Zeroed before. */
struct subject {
    struct generated_scene scene;
    struct imported_scene imported;
    struct raytrace_cache *cache;
    struct bare_tracer *bare;
    struct full_tracer *full;
    double surfaces[VARIANTS], shadow_rays[VARIANTS]; /* sums; ours alone */
    double full_error; /* of the full yardstick's last picture against our 1 sample, over the mean
                        */
};

static bool subject_init(struct subject *subject, const struct traced_case *one, const int size[2],
                         struct error *err)
{
    bool ok = one->has_boxes     ? generated_scene_make_boxes(&subject->scene, one->spots, 1, err)
              : one->has_columns ? generated_scene_make_colonnade(&subject->scene, err)
              : !one->spots      ? make_demo(&subject->scene, err)
                                 : make_own(&subject->scene, one, err);
    struct view *view = &subject->scene.view;
    view->light_count = one->spots;
    view->width_px = size[0];
    view->height_px = size[1];
    view->quality.shadows = SHADOWS_RAYTRACED;
    subject->cache = ok ? raytrace_cache_create(err) : NULL;
    const struct scene_file file = {"scene.glb", subject->scene.glb, subject->scene.glb_bytes};
    return subject->cache && imported_scene_init(&subject->imported, &file, 1, err);
}

static void subject_finish(struct subject *subject)
{
    raytrace_cache_destroy(subject->cache);
    full_tracer_destroy(subject->full);
    bare_tracer_destroy(subject->bare);
    imported_scene_finish(&subject->imported);
    generated_scene_finish(&subject->scene);
}

/* The bare and the full one, when they are first asked for. */
static bool make_yardsticks(struct subject *subject, const struct scene_state *state,
                            struct error *err)
{
    if (subject->full)
        return true;
    subject->bare = bare_tracer_create(state, err);
    subject->full = subject->bare ? full_tracer_create(subject->bare, state, err) : NULL;
    return subject->full;
}

static bool measure(const struct subject *subject, const struct camera *camera,
                    const struct scene_state *state, int variant, struct image *image,
                    struct error *err)
{
    uint64_t rays;
    if (variant == FULL)
        return full_tracer_render(subject->full, camera, state, image, err);
    return bare_tracer_render(subject->bare, camera, state, variant == BARE_FOUR ? 4 : 1, image,
                              &rays, err);
}

static bool draw(struct subject *subject, const struct traced_case *one, int variant, double around,
                 double *cpu_ms, struct image *image, struct error *err)
{
    struct scene_state state = {0};
    struct camera camera;
    struct raytrace_stats stats = {0};
    struct view view = subject->scene.view;
    set_camera(&view, one, around);
    bool ok = scene_state_init(&state, &subject->imported.scene, &view, err) &&
              camera_resolve(&camera, &view, &state, err);
    const struct raytrace_desc desc = {.view = &view,
                                       .state = &state,
                                       .camera = &camera,
                                       .samples = variant == FOUR_SAMPLES ? 4 : 1,
                                       .cache = subject->cache,
                                       .threads = 1};
    const bool is_ours = variant == ONE_SAMPLE || variant == FOUR_SAMPLES;
    if (ok && !is_ours)
        ok = make_yardsticks(subject, &state, err) &&
             image_init(image, view.width_px, view.height_px, 4, IMAGE_F32, err);
    double begin = cpu_now_ms();
    if (ok)
        ok = is_ours ? raytrace_render(&desc, image, &stats, err)
                     : measure(subject, &camera, &state, variant, image, err);
    *cpu_ms = cpu_now_ms() - begin;
    subject->surfaces[variant] += (double)stats.surfaces;
    subject->shadow_rays[variant] += (double)stats.shadow_rays;
    scene_state_finish(&state);
    return ok;
}

static void tell(struct bench *bench, const struct traced_case *one,
                 const struct samples ms[VARIANTS])
{
    static const char *const names[VARIANTS] = {"cpu ms, 1 sample", "cpu ms, 4 samples",
                                                "cpu ms, bare", "cpu ms, bare, 4 camera rays",
                                                "cpu ms, bare rays and full shading"};
    double median[VARIANTS];
    for (int i = 0; i < VARIANTS; i++) {
        median[i] = samples_summary(&ms[i]).median;
        bench_check(bench, &(struct check){.scene = one->scene,
                                           .subject = one->name,
                                           .name = names[i],
                                           .value = median[i],
                                           .p = NAN});
    }
    bench_check(bench, &(struct check){.scene = one->scene,
                                       .subject = one->name,
                                       .name = "cpu 1 sample / bare",
                                       .value = median[ONE_SAMPLE] / median[BARE],
                                       .relation = "<=",
                                       .bound = one->one_over_bare,
                                       .p = samples_difference_p(&ms[ONE_SAMPLE], &ms[BARE])});
    bench_check(bench, &(struct check){.scene = one->scene,
                                       .subject = one->name,
                                       .name = "cpu full shading / bare",
                                       .value = median[FULL] / median[BARE],
                                       .p = samples_difference_p(&ms[FULL], &ms[BARE])});
    bench_check(bench, &(struct check){.scene = one->scene,
                                       .subject = one->name,
                                       .name = "cpu 1 sample / full shading",
                                       .value = median[ONE_SAMPLE] / median[FULL],
                                       .p = samples_difference_p(&ms[ONE_SAMPLE], &ms[FULL])});
    bench_check(bench,
                &(struct check){.scene = one->scene,
                                .subject = one->name,
                                .name = "cpu 4 samples / 1 sample",
                                .value = median[FOUR_SAMPLES] / median[ONE_SAMPLE],
                                .relation = "<=",
                                .bound = 1.5,
                                .p = samples_difference_p(&ms[FOUR_SAMPLES], &ms[ONE_SAMPLE])});
    const double further = median[BARE_FOUR] - median[BARE];
    bench_check(bench, &(struct check){.scene = one->scene,
                                       .subject = one->name,
                                       .name = "1 sample and 3 bare camera rays / 1 sample",
                                       .value = 1 + further / median[ONE_SAMPLE],
                                       .p = samples_difference_p(&ms[BARE_FOUR], &ms[BARE])});
}

/* Of what is not shared among the samples of a pixel. */
static void tell_shares(struct bench *bench, const struct traced_case *one,
                        const struct subject *subject)
{
    const struct {
        const char *name;
        const double *of;
    } rows[] = {{"surfaces, 4 samples / 1 sample", subject->surfaces},
                {"shadow rays, 4 samples / 1 sample", subject->shadow_rays}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        bench_check(bench,
                    &(struct check){.scene = one->scene,
                                    .subject = one->name,
                                    .name = rows[i].name,
                                    .value = rows[i].of[FOUR_SAMPLES] / rows[i].of[ONE_SAMPLE],
                                    .p = NAN});
}

/* What 4 samples take if three bare camera rays come to 1 sample, and the surfaces that it has not
 * are lit as fast as the quicker of ours and of the full loop lights those that it has. */
static void tell_least(struct bench *bench, const struct traced_case *one,
                       const struct samples ms[VARIANTS], const struct subject *subject)
{
    double median[VARIANTS];
    for (int i = 0; i < VARIANTS; i++)
        median[i] = samples_summary(&ms[i]).median;
    const double cameras = median[BARE_FOUR] - median[BARE];
    const double lit = fmin(median[ONE_SAMPLE], median[FULL]) - cameras / 3;
    const double surfaces = subject->surfaces[FOUR_SAMPLES] / subject->surfaces[ONE_SAMPLE] - 1;
    bench_check(bench, &(struct check){.scene = one->scene,
                                       .subject = one->name,
                                       .name = "the same, with further surfaces / 1 sample",
                                       .value = 1 + (cameras + surfaces * lit) / median[ONE_SAMPLE],
                                       .p = NAN});
}

/* Both see the same surfaces in the same light, or the full yardstick measures something else. */
static void tell_error(struct bench *bench, const struct traced_case *one,
                       const struct subject *subject)
{
    bench_check(bench, &(struct check){.scene = one->scene,
                                       .subject = one->name,
                                       .name = "RMSE / mean, full shading - 1 sample",
                                       .value = subject->full_error,
                                       .p = NAN});
}

/* What is kept from picture to picture, beside the decoded scene, which both read. */
static void tell_memory(struct bench *bench, const struct traced_case *one,
                        const struct subject *subject)
{
    double ours = (double)raytrace_cache_size_bytes(subject->cache);
    double bare = (double)bare_tracer_size_bytes(subject->bare);
    const struct {
        const char *name;
        double value;
    } rows[] = {
        {"MB kept", ours / 1e6}, {"MB kept, bare", bare / 1e6}, {"kept / bare", ours / bare}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        bench_check(bench, &(struct check){.scene = one->scene,
                                           .subject = one->name,
                                           .name = rows[i].name,
                                           .value = rows[i].value,
                                           .p = NAN});
}

static bool run_case(struct bench *bench, const struct traced_case *one, struct error *err)
{
    struct subject *subject = calloc(1, sizeof *subject);
    struct samples ms[VARIANTS] = {0};
    int size[2];
    if (!subject)
        return error_set(err, ERROR_NO_MEMORY, "suite traced");
    bench_size(bench, 1024, 768, size);
    bool ok = subject_init(subject, one, size, err);
    for (struct rounds rounds = rounds_begin(bench); ok && rounds_next(&rounds);) {
        struct image first = {0};
        for (int i = 0; ok && i < VARIANTS; i++) {
            struct image image = {0};
            double cpu_ms = 0;
            ok = draw(subject, one, i, 0.7 + 0.21 * rounds.done, &cpu_ms, &image, err);
            if (ok && !rounds.is_warming)
                samples_add(&ms[i], cpu_ms);
            if (ok && rounds.done == 0 && bench->options.saves_pictures) {
                char name[160];
                snprintf(name, sizeof name, "bench-traced-%td-%d", one - cases, i);
                save_picture(&image, name);
            }
            if (ok && i == FULL)
                subject->full_error = extreme_rmse(&image, &first);
            if (i == ONE_SAMPLE)
                first = image;
            else
                image_finish(&image);
        }
        image_finish(&first);
    }
    if (ok) {
        tell(bench, one, ms);
        tell_least(bench, one, ms, subject);
        tell_shares(bench, one, subject);
        if (one->spots) /* without textures the demo scene is another picture */
            tell_error(bench, one, subject);
        tell_memory(bench, one, subject);
    }
    for (int i = 0; i < VARIANTS; i++)
        samples_finish(&ms[i]);
    subject_finish(subject);
    free(subject);
    return ok;
}

bool suite_traced(struct bench *bench, struct error *err)
{
    const size_t count = sizeof cases / sizeof *cases;
    for (size_t i = 0; i < (bench->options.is_quick ? 1 : count); i++)
        if (bench_wants_scene(bench, cases[i].scene) && !run_case(bench, &cases[i], err))
            return false;
    return true;
}
