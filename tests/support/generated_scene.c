/* SPDX-License-Identifier: MIT */
/* Solids of glb/shapes, thrown about by Xorshift. */
#include "tests/support/generated_scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "glb/shapes.h"
#include "renderer/scene/scene.h"
#include "tests/support/light_scene.h"

static const double HALF = 10; /* m, of the floor */

/* What a scene is made by. */
struct recipe {
    enum generated_kind kind;
    int count; /* of its solids */
    size_t lights;
    bool has_points, has_ranges; /* all lights are */
    int width, height, samples;
    uint64_t seed;
    bool has_smoke;
};

static int add_material(struct glb_builder *builder, uint64_t *state, bool is_glass)
{
    struct glb_material_desc material = {.name = "Paint", .roughness = 0.7, .metallic = 0};
    for (int c = 0; c < 3; c++)
        material.base_color[c] = random_uniform(state, 0.25, 0.95);
    material.base_color[3] = 1;
    if (is_glass) {
        material.transmission = 1;
        material.has_ior = true;
        material.ior = 1;
        material.is_double_sided = true;
    }
    return glb_builder_add_material(builder, &material);
}

static void add_part(struct glb_builder *builder, struct shape *shape, const char *name,
                     int material)
{
    glb_builder_add_node(
        builder, &(struct glb_node_desc){.name = name,
                                         .mesh = shape_give_mesh(shape, builder, name, material)});
}

static void add_floor(struct glb_builder *builder, uint64_t *state)
{
    struct shape shape = {0};
    shape_add_grid(&shape, (double[]){-HALF, 0, HALF}, (double[]){2 * HALF, 0, 0},
                   (double[]){0, 0, -2 * HALF}, 16, 16);
    add_part(builder, &shape, "Floor", add_material(builder, state, false));
}

/* Sixteen meshes, each of one material. */
static void add_boxes(struct glb_builder *builder, uint64_t *state, int count)
{
    enum { MESHES = 16 };
    for (int m = 0; m < MESHES && m < count; m++) {
        struct shape shape = {0};
        for (int i = m; i < count; i += MESHES) {
            double x = random_uniform(state, -HALF, HALF), z = random_uniform(state, -HALF, HALF);
            double half = random_uniform(state, 0.05, 0.25), top = random_uniform(state, 0.1, 1.2);
            shape_add_box(&shape, (double[]){x - half, 0, z - half},
                          (double[]){x + half, top, z + half});
        }
        add_part(builder, &shape, "Boxes", add_material(builder, state, false));
    }
}

static void add_spheres(struct glb_builder *builder, uint64_t *state, int count)
{
    for (int i = 0; i < count; i++) {
        struct shape shape = {0};
        double radius = random_uniform(state, 0.3, 1);
        double center[3] = {random_uniform(state, -HALF, HALF), radius,
                            random_uniform(state, -HALF, HALF)};
        shape_add_sphere(&shape, center, radius, 24, 16);
        add_part(builder, &shape, "Sphere", add_material(builder, state, i % 4 == 0));
    }
}

static void add_panes(struct glb_builder *builder, uint64_t *state, int count)
{
    for (int i = 0; i < count; i++) {
        struct shape shape = {0};
        double x = random_uniform(state, -6, 4), z = random_uniform(state, -6, 4);
        double width = random_uniform(state, 1, 4), height = random_uniform(state, 1, 3);
        shape_add_quad(&shape, (double[]){x, 0.1, z}, (double[]){width, 0, 0},
                       (double[]){0, height, 0});
        add_part(builder, &shape, "Pane", add_material(builder, state, true));
    }
    add_boxes(builder, state, 4 * count);
}

static void add_columns(struct glb_builder *builder, uint64_t *state, int count)
{
    int side = (int)ceil(sqrt(count));
    for (int row = 0; row * side < count; row++) {
        struct shape shape = {0};
        for (int i = 0; i < side && row * side + i < count; i++) {
            double x = HALF * (2. * i / side - 0.9), z = HALF * (2. * row / side - 0.9);
            shape_add_cylinder(&shape, (double[]){x, 0, z}, 0.25, 3.5, 96);
            shape_add_sphere(&shape, (double[]){x, 3.7, z}, 0.4, 48, 20);
            shape_add_sphere(&shape, (double[]){x, 0.1, z}, 0.4, 32, 12);
        }
        add_part(builder, &shape, "Columns", add_material(builder, state, false));
    }
}

/* The largest of some balls whose edges are soft, 1 in their middles. */
static void fill_with_balls(float *values, const uint32_t size[3], uint64_t *state)
{
    enum { BALLS = 6 };
    double balls[BALLS][4];
    for (int i = 0; i < BALLS; i++)
        for (int k = 0; k < 4; k++)
            balls[i][k] = k < 3 ? random_uniform(state, 0.2, 0.8) : random_uniform(state, 0.1, 0.4);
    for (uint32_t z = 0; z < size[2]; z++)
        for (uint32_t y = 0; y < size[1]; y++)
            for (uint32_t x = 0; x < size[0]; x++) {
                const double at[3] = {(x + 0.5) / size[0], (y + 0.5) / size[1],
                                      (z + 0.5) / size[2]};
                double most = 0;
                for (int i = 0; i < BALLS; i++) {
                    double square = 0;
                    for (int k = 0; k < 3; k++)
                        square += (at[k] - balls[i][k]) * (at[k] - balls[i][k]);
                    most = fmax(most, 1 - square / (balls[i][3] * balls[i][3]));
                }
                values[x + size[0] * (y + (size_t)size[1] * z)] = (float)most;
            }
}

static bool add_smoke(struct glb_builder *builder, uint64_t seed, struct error *err)
{
    uint64_t state = 0xd1342543de82ef95u * (seed + 1);
    for (int grids = 1 + (int)(random_next(&state) % 2); grids > 0; grids--) {
        struct glb_grid_desc desc = {.name = grids == 1 ? "Smoke" : "More smoke",
                                     .density = random_log_uniform(&state, 0.3, 10),
                                     .anisotropy = random_uniform(&state, -0.3, 0.6)};
        for (int k = 0; k < 3; k++) {
            double half = random_uniform(&state, 1, 5);
            double middle = k == 1 ? half : random_uniform(&state, -4, 4);
            desc.low[k] = middle - half;
            desc.high[k] = middle + half;
            desc.size[k] = (uint32_t)random_log_uniform(&state, 12, 90);
        }
        size_t count = (size_t)desc.size[0] * desc.size[1] * desc.size[2];
        float *values = calloc(count, sizeof *values);
        if (!values)
            return error_set(err, ERROR_NO_MEMORY, "smoke");
        fill_with_balls(values, desc.size, &state);
        desc.values = values;
        int grid = glb_builder_add_grid(builder, &desc);
        glb_builder_add_node(builder, &(struct glb_node_desc){.name = desc.name, .grid = grid});
        free(values);
    }
    return true;
}

static void set_light(struct view_light *light, const struct recipe *recipe, uint64_t *state)
{
    bool is_spot = !recipe->has_points;
    *light = (struct view_light){
        .type = is_spot ? SCENE_LIGHT_SPOT : SCENE_LIGHT_POINT,
        .position = {random_uniform(state, -9, 9), random_uniform(state, 3, 5),
                     random_uniform(state, -9, 9)},
        .direction = {(float)random_uniform(state, -0.6, 0.6), -1,
                      (float)random_uniform(state, -0.6, 0.6)},
        .color = {1, (float)random_uniform(state, 0.6, 1), (float)random_uniform(state, 0.4, 1)},
        .intensity = (float)(300 / sqrt((double)recipe->lights)),
        .range = recipe->has_ranges ? (float)random_uniform(state, 5, 9) : 0,
        .inner_cone_deg = is_spot ? 20 : 0,
        .outer_cone_deg = is_spot ? 30 : 0,
    };
}

static bool make_glb(struct generated_scene *scene, const struct recipe *recipe, uint64_t *state,
                     struct error *err)
{
    static void (*const add[GENERATED_KINDS])(struct glb_builder *, uint64_t *, int) = {
        [GENERATED_BOXES] = add_boxes,
        [GENERATED_SPHERES] = add_spheres,
        [GENERATED_PANES] = add_panes,
        [GENERATED_COLONNADE] = add_columns,
    };
    struct glb_builder *builder = glb_builder_create("Generated", err);
    if (!builder)
        return false;
    add_floor(builder, state);
    add[recipe->kind](builder, state, recipe->count);
    bool ok = (!recipe->has_smoke || add_smoke(builder, recipe->seed, err)) &&
              glb_builder_finish(builder, &scene->glb, &scene->glb_bytes, err);
    glb_builder_destroy(builder);
    return ok;
}

static bool make(struct generated_scene *scene, const struct recipe *recipe, struct error *err)
{
    static const char *const kinds[GENERATED_KINDS] = {"boxes", "spheres", "panes", "colonnade"};
    uint64_t state = 0x9e3779b97f4a7c15u * (recipe->seed + 1);
    *scene = (struct generated_scene){.kind = recipe->kind};
    if (!make_glb(scene, recipe, &state, err))
        return false;
    for (size_t i = 0; i < recipe->lights; i++)
        set_light(&scene->lights[i], recipe, &state);
    double around = random_uniform(&state, 0, 6.28), far = random_uniform(&state, 9, 14);
    scene->view = (struct view){
        .width_px = recipe->width,
        .height_px = recipe->height,
        .outputs = 1u << VIEW_OUTPUT_COLOR,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {far * cos(around), random_uniform(&state, 2, 8), far * sin(around)},
                   .target = {0, 0.5, 0},
                   .fov_y_deg = 50},
        .lights = scene->lights,
        .light_count = recipe->lights,
        .ignore_scene_lights = true,
        .quality = {.samples = recipe->samples, .shadow_taps = 4, .shadow_resolution = 1024},
    };
    snprintf(scene->name, sizeof scene->name, "%s %d, %zu %s%s, %dx%d, %d sample%s",
             kinds[recipe->kind], recipe->count, recipe->lights,
             recipe->has_points ? "points" : "spots", recipe->has_ranges ? "" : " unbounded",
             recipe->width, recipe->height, recipe->samples, recipe->samples == 1 ? "" : "s");
    return true;
}

static bool make_by_seed(struct generated_scene *scene, uint64_t seed, bool has_smoke,
                         struct error *err)
{
    static const size_t lights[] = {1, 2, 4, 8, 12, 25, 50, 100};
    static const int sizes[][2] = {{256, 192}, {384, 216}, {480, 360}, {640, 400}};
    uint64_t state = 0x2545f4914f6cdd1du * (seed + 7);
    for (int i = 0; i < 8; i++)
        random_next(&state);
    int size = (int)(random_next(&state) % 4);
    struct recipe recipe = {.kind = (enum generated_kind)(random_next(&state) % GENERATED_KINDS),
                            .lights = lights[random_next(&state) % 8],
                            .has_points = random_next(&state) % 4 == 0,
                            .has_ranges = random_next(&state) % 2,
                            .width = sizes[size][0],
                            .height = sizes[size][1],
                            .samples = random_next(&state) % 2 ? 4 : 1,
                            .seed = seed,
                            .has_smoke = has_smoke};
    recipe.count = (int)(recipe.kind == GENERATED_BOXES     ? random_log_uniform(&state, 100, 4000)
                         : recipe.kind == GENERATED_SPHERES ? random_log_uniform(&state, 8, 80)
                         : recipe.kind == GENERATED_PANES   ? random_log_uniform(&state, 2, 12)
                                                            : random_log_uniform(&state, 9, 64));
    if (recipe.has_points && recipe.lights > 12)
        recipe.lights = 12; /* six faces each */
    return make(scene, &recipe, err);
}

bool generated_scene_make(struct generated_scene *scene, uint64_t seed, struct error *err)
{
    return make_by_seed(scene, seed, false, err);
}

bool generated_scene_make_smoky(struct generated_scene *scene, uint64_t seed, struct error *err)
{
    return make_by_seed(scene, seed, true, err);
}

bool generated_scene_make_boxes(struct generated_scene *scene, size_t spots, int samples,
                                struct error *err)
{
    return make(scene,
                &(struct recipe){.kind = GENERATED_BOXES,
                                 .count = 3000,
                                 .lights = spots,
                                 .width = 512,
                                 .height = 384,
                                 .samples = samples,
                                 .seed = 13},
                err);
}

bool generated_scene_make_colonnade(struct generated_scene *scene, struct error *err)
{
    return make(scene,
                &(struct recipe){.kind = GENERATED_COLONNADE,
                                 .count = 81,
                                 .lights = 25,
                                 .has_ranges = true,
                                 .width = 512,
                                 .height = 384,
                                 .samples = 4,
                                 .seed = 14},
                err);
}

void generated_scene_finish(struct generated_scene *scene)
{
    free(scene->glb);
    *scene = (struct generated_scene){.glb = NULL};
}
