/* SPDX-License-Identifier: MIT */
/* Coloured cloth between the columns of the demo scene. */
#include "glb/demo_internal.h"

#define ROD_Y 3.25

struct curtain {
    const char *name;
    double color[4]; /* linear; alpha is how much of the light the cloth stops */
    double x, z, width, gather, phase_rad;
    bool is_mirrored; /* hangs from z towards -z */
};

static int add_cloth(struct demo *demo, const struct curtain *curtain)
{
    struct glb_material_desc cloth = {
        .name = curtain->name, .roughness = 0.95, .alpha_mode = GLB_BLEND, .is_double_sided = true};
    for (int i = 0; i < 4; i++)
        cloth.base_color[i] = curtain->color[i];
    struct shape shape = {0};
    shape_set_place(&shape, NULL, (double[]){0, 0, curtain->is_mirrored ? -1 : 1},
                    (double[]){0, 1, 0});
    shape_add_curtain(&shape, &(struct shape_curtain_desc){
                                  .width = curtain->width,
                                  .height = 3.12,
                                  .fold_depth = 0.10,
                                  .folds = curtain->width * 3.6,
                                  .gather = curtain->gather,
                                  .phase_rad = curtain->phase_rad,
                                  .columns = demo_sides(demo, (int)(curtain->width * 72)),
                                  .rows = demo_sides(demo, 24)});
    int material = glb_builder_add_material(demo->builder, &cloth);
    return shape_give_mesh(&shape, demo->builder, curtain->name, material);
}

/* A rod across a bay, from capital to capital. */
static void add_rods(struct demo *demo, int parent, const double (*places)[2], size_t count)
{
    struct shape shape = {0};
    shape_set_place(&shape, (double[]){0, 0, -BAY / 2}, (double[]){1, 0, 0}, (double[]){0, 0, 1});
    shape_add_cylinder(&shape, (double[]){0, 0, 0}, 0.022, BAY, demo_sides(demo, 12));
    int mesh = shape_give_mesh(&shape, demo->builder, "Curtain rod", demo->iron);
    for (size_t i = 0; i < count; i++)
        demo_add(demo, &(struct demo_place){.name = "Curtain rod",
                                            .parent = parent,
                                            .mesh = mesh,
                                            .at = {places[i][0], ROD_Y, places[i][1]}});
}

void demo_add_curtains(struct demo *demo)
{
    static const struct curtain curtains[] = {
        {.name = "Crimson curtain",
         .color = {0.80, 0.04, 0.07, 0.62},
         .x = -ARCADE_X,
         .z = -5.65,
         .width = 2.9,
         .gather = 0.10,
         .phase_rad = 0.4},
        {.name = "Saffron curtain",
         .color = {1.0, 0.38, 0.02, 0.64},
         .x = -ARCADE_X,
         .z = 1.65,
         .width = 2.9,
         .gather = 0.14,
         .phase_rad = 1.9,
         .is_mirrored = true},
        {.name = "Teal curtain",
         .color = {0.03, 0.42, 0.50, 0.60},
         .x = -ARCADE_X,
         .z = 2.35,
         .width = 2.4,
         .gather = 0.08,
         .phase_rad = 3.1},
        {.name = "Violet curtain",
         .color = {0.34, 0.08, 0.62, 0.52},
         .x = ARCADE_X,
         .z = -5.65,
         .width = 1.35,
         .gather = 0.30,
         .phase_rad = 0.9},
    };
    static const double rods[][2] = {
        {-ARCADE_X, -BAY}, {-ARCADE_X, 0}, {-ARCADE_X, BAY}, {ARCADE_X, -BAY}};
    int parent = demo_add_group(demo, "Curtains");
    for (size_t i = 0; i < sizeof curtains / sizeof *curtains; i++)
        demo_add(demo, &(struct demo_place){.name = curtains[i].name,
                                            .parent = parent,
                                            .mesh = add_cloth(demo, &curtains[i]),
                                            .at = {curtains[i].x, ROD_Y, curtains[i].z}});
    add_rods(demo, parent, rods, sizeof rods / sizeof *rods);
}
