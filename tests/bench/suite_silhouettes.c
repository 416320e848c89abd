/* SPDX-License-Identifier: MIT */
/* Suite `silhouettes`: time of a frame whose light moves, by shadow volumes, maps and rays, against
 * the triangles of the grid of 10 x 10 spheres of Lexolights (Peciva). Maps alone are made anew for
 * that: edges of casters, and the ray tracer's structure, stand. Silhouettes by all stages that
 * draw them.
 *
 * Its tables of larger scenes: --triangles N and --objects N make one grid of so many spheres, each
 * an object, that have about so many triangles together; --scene sponza takes that building without
 * textures. Both are under a spot, whose map has one face. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "glb/shapes.h"
#include "tests/bench/frames.h"
#include "tests/bench/scenes.h"
#include "tests/support/light_scene.h"

/* Volumes of single triangles, the last two, take too long for more than the first count. */
enum { WAYS = 10, WAYS_OF_MANY = 6, DEFAULT_WAY = 2, COUNTS = 5, RESOLUTION = 2048 };
enum { WAYS_OF_LARGE = 4, TRIANGLES_OF_LARGE = 1000000 };

#define SPONZA_PATH "SponzaDracoNoTextures/sponza_no_textures.optimized.glb"

/* Of a sphere; it has twice as many slices, and 4 n (n - 1) triangles. */
static const int stack_counts[COUNTS] = {4, 9, 13, 16, 30}, quick_counts[] = {3, 4};

static const struct way {
    const char *name;
    enum shadow_technique technique;
    enum view_silhouette_form form;
} ways[WAYS] = {
    {"map", SHADOWS_MAP, VIEW_SILHOUETTE_COMPUTE},
    {"volume", SHADOWS_VOLUME, VIEW_SILHOUETTE_COMPUTE},
    [DEFAULT_WAY] = {"silhouette", SHADOWS_SILHOUETTE, VIEW_SILHOUETTE_COMPUTE},
    {"raytraced-shadows", SHADOWS_RAYTRACED_SHADOWS, VIEW_SILHOUETTE_COMPUTE},
    {"silhouette, geometry", SHADOWS_SILHOUETTE, VIEW_SILHOUETTE_GEOMETRY},
    {"silhouette, tessellation", SHADOWS_SILHOUETTE, VIEW_SILHOUETTE_TESSELLATION},
    {"silhouette, triangles-two-pass", SHADOWS_SILHOUETTE, VIEW_SILHOUETTE_TRIANGLES_TWO_PASS},
    {"silhouette, triangles-one-pass", SHADOWS_SILHOUETTE, VIEW_SILHOUETTE_TRIANGLES_ONE_PASS},
    {"silhouette, triangles-geometry", SHADOWS_SILHOUETTE, VIEW_SILHOUETTE_TRIANGLES_GEOMETRY},
    {"silhouette, stencil", SHADOWS_SILHOUETTE, VIEW_SILHOUETTE_STENCIL},
};

static const struct view_light lamp = {
    .type = SCENE_LIGHT_POINT, .position = {3, 9, 2}, .color = {1, 1, 1}, .intensity = 300};

static struct view view_of(const struct bench *bench, const struct way *way, const int size[2])
{
    int texels = bench->options.texels;
    return (struct view){.width_px = size[0],
                         .height_px = size[1],
                         .outputs = 1u << VIEW_OUTPUT_COLOR,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {9, 8, 10},
                                    .target = {0, 0, 0},
                                    .fov_y_deg = 50},
                         .lights = &lamp,
                         .light_count = 1,
                         .quality = {.shadows = way->technique,
                                     .silhouette_form = way->form,
                                     .shadow_resolution = texels ? texels : RESOLUTION,
                                     .samples = 1}};
}

static void tell(struct bench *bench, const char *scene, const char *subject, const int size[2],
                 const struct frame_variant *variant)
{
    const struct measurement *m = &variant->measurement;
    bench_result(bench, &(struct result){.scene = scene,
                                         .subject = subject,
                                         .variant = variant->name,
                                         .width = size[0],
                                         .height = size[1],
                                         .stage = PART_SHADOW,
                                         .measurement = m});
    char name[64];
    snprintf(name, sizeof name, "%s: total, cpu ms", variant->name);
    bench_check(bench, &(struct check){.scene = scene,
                                       .subject = subject,
                                       .name = name,
                                       .value = samples_summary(&m->cpu_ms).median,
                                       .p = NAN});
}

/* To the form that is the default. */
static void tell_ratio(struct bench *bench, const char *subject, const char *way, double ratio)
{
    char name[64];
    snprintf(name, sizeof name, "%s: over compute", way);
    bench_check(
        bench, &(struct check){
                   .scene = "spheres", .subject = subject, .name = name, .value = ratio, .p = NAN});
}

static bool run_count(struct bench *bench, int at, int stacks, double (*totals)[COUNTS],
                      struct error *err)
{
    struct frame_variant variants[WAYS] = {{0}};
    struct rig_scene rig = {0};
    int size[2], count = at ? WAYS_OF_MANY : WAYS;
    char subject[32];
    bench_size(bench, 320, 240, size);
    snprintf(subject, sizeof subject, "%d triangles",
             SPHERES_SIDE * SPHERES_SIDE * 4 * stacks * (stacks - 1) + 2);
    for (int i = 0; i < count; i++)
        variants[i] = (struct frame_variant){.name = ways[i].name,
                                             .view = view_of(bench, &ways[i], size),
                                             .rebuilds_shadows = ways[i].technique == SHADOWS_MAP};
    bool ok = bench_spheres_open(&rig, bench_renderer(bench), stacks, err) &&
              frames_run(bench, &rig, variants, count, err);
    for (int i = 0; ok && i < count; i++) {
        tell(bench, "spheres", subject, size, &variants[i]);
        totals[i][at] = samples_summary(&variants[i].measurement.cpu_ms).median;
    }
    for (int i = DEFAULT_WAY + 1; ok && i < count; i++)
        if (ways[i].form != VIEW_SILHOUETTE_COMPUTE)
            tell_ratio(bench, subject, ways[i].name, totals[i][at] / totals[DEFAULT_WAY][at]);
    frames_finish(variants, count);
    rig_scene_finish(&rig, bench_renderer(bench));
    return ok;
}

/* ---- larger scenes ---- */

/* Nodes of one mesh, in a square of the grid's size. */
static bool open_objects(struct bench *bench, struct rig_scene *rig, int objects, int stacks,
                         struct error *err)
{
    struct shape ball = {0}, floor = {0};
    int side = (int)ceil(sqrt(objects));
    double cell = (double)SPHERES_SIDE / side;
    struct glb_builder *builder = glb_builder_create("Spheres", err);
    if (!builder)
        return false;
    int gray = glb_builder_add_material(
        builder, &(struct glb_material_desc){.base_color = {0.5, 0.5, 0.5, 1}, .roughness = 1});
    shape_add_sphere(&ball, (double[]){0, 0, 0}, 0.35 * cell, 2 * stacks, stacks);
    shape_add_quad(&floor, (double[]){-9, 0, -9}, (double[]){0, 0, 18}, (double[]){18, 0, 0});
    int mesh = shape_give_mesh(&ball, builder, "Sphere", gray);
    int ground = shape_give_mesh(&floor, builder, "Floor", gray);
    for (int i = 0; i < objects; i++)
        glb_builder_add_node(
            builder,
            &(struct glb_node_desc){
                .mesh = mesh,
                .translation = {cell * (i % side + 0.5) - SPHERES_SIDE / 2.0, 0.6 + 0.1 * (i % 7),
                                cell * (i / side + 0.5) - SPHERES_SIDE / 2.0},
            });
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Floor", .mesh = ground});
    return rig_scene_from_builder(rig, bench_renderer(bench), "objects", builder, err);
}

/* Maps, volumes and rays; what a technique refuses is told, and the others go on. */
static bool run_large(struct bench *bench, const char *scene, const char *subject,
                      const struct rig_scene *rig, const struct view *view, struct error *err)
{
    struct frame_variant variants[WAYS_OF_LARGE] = {{0}};
    int size[2] = {view->width_px, view->height_px}, count = 0;
    for (int i = 0; i < WAYS_OF_LARGE; i++) {
        struct frame_variant variant = {.name = ways[i].name,
                                        .view = *view,
                                        .rebuilds_shadows = ways[i].technique == SHADOWS_MAP};
        struct frame_times times;
        struct error refused = {0};
        variant.view.quality.shadows = ways[i].technique;
        if (frame_measure(bench_renderer(bench), rig, &variant.view, false, &times, NULL, &refused))
            variants[count++] = variant;
        else
            fprintf(stderr, "%s, %s, %s: %s\n", scene, subject, ways[i].name, refused.message);
    }
    bool ok = frames_run(bench, rig, variants, (size_t)count, err);
    for (int i = 0; ok && i < count; i++)
        tell(bench, scene, subject, size, &variants[i]);
    frames_finish(variants, (size_t)count);
    return ok;
}

/* Nearest to so many triangles together. */
static int stacks_of(int triangles, int objects)
{
    int stacks = (int)round((1 + sqrt(1 + (double)triangles / objects)) / 2);
    return stacks < 3 ? 3 : stacks;
}

static bool run_objects(struct bench *bench, struct error *err)
{
    const struct bench_options *options = &bench->options;
    int objects = options->objects ? options->objects : SPHERES_SIDE * SPHERES_SIDE, size[2];
    int stacks = stacks_of(options->triangles ? options->triangles : TRIANGLES_OF_LARGE, objects);
    struct rig_scene rig = {0};
    struct view_light spot = lamp;
    char subject[64];
    spot.type = SCENE_LIGHT_SPOT;
    for (int k = 0; k < 3; k++)
        spot.direction[k] = -spot.position[k];
    spot.inner_cone_deg = 40;
    spot.outer_cone_deg = 45;
    bench_size(bench, 320, 240, size);
    struct view view = view_of(bench, &ways[0], size);
    view.lights = &spot;
    snprintf(subject, sizeof subject, "%d objects, %d triangles", objects,
             objects * 4 * stacks * (stacks - 1) + 2);
    bool ok = open_objects(bench, &rig, objects, stacks, err) &&
              run_large(bench, "spheres", subject, &rig, &view, err);
    rig_scene_finish(&rig, bench_renderer(bench));
    return ok;
}

static bool run_sponza(struct bench *bench, struct error *err)
{
    const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                   .direction = {0.2, -1, 0.15},
                                   .color = {1, 1, 1},
                                   .intensity = 3};
    struct rig_scene rig = {0};
    int size[2];
    bench_size(bench, 320, 240, size);
    if (access(VITRAIL_ASSET_DIR "/" SPONZA_PATH, R_OK) != 0) {
        fprintf(stderr, "%s: Sponza is not on this machine\n", bench->suite);
        return true;
    }
    struct view view = view_of(bench, &ways[0], size);
    view.lights = &sun;
    view.ignore_scene_lights = true;
    view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                       .eye = {8.5, 2.2, -0.6},
                                       .target = {-4, 2.2, 0.4},
                                       .fov_y_deg = 60};
    bool ok = rig_scene_from_asset(&rig, bench_renderer(bench), SPONZA_PATH, err) &&
              run_large(bench, "sponza", "a sun", &rig, &view, err);
    rig_scene_finish(&rig, bench_renderer(bench));
    return ok;
}

bool suite_silhouettes(struct bench *bench, struct error *err)
{
    const struct bench_options *options = &bench->options;
    if (options->scene && strcmp(options->scene, "sponza") == 0)
        return run_sponza(bench, err);
    if (options->objects || options->triangles)
        return run_objects(bench, err);
    double totals[WAYS][COUNTS] = {{0}}, triangles[COUNTS];
    bool is_quick = bench->options.is_quick;
    const int *counts = is_quick ? quick_counts : stack_counts;
    for (int i = 0; i < (is_quick ? 2 : COUNTS); i++) {
        triangles[i] = SPHERES_SIDE * SPHERES_SIDE * 4.0 * counts[i] * (counts[i] - 1);
        if (!run_count(bench, i, counts[i], totals, err))
            return false;
    }
    for (int i = 0; !is_quick && i < WAYS_OF_MANY; i++)
        bench_series(bench, &(struct series){.scene = "spheres",
                                             .subject = "triangles",
                                             .name = ways[i].name,
                                             .of = "triangles",
                                             .unit = "ms",
                                             .x = triangles,
                                             .y = totals[i],
                                             .count = COUNTS,
                                             .growth = GROWTH_ANY});
    return true;
}
