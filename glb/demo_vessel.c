/* SPDX-License-Identifier: MIT */
/* The glass vessel of the demo scene on its plinth: tinted, its rim darker where it is seen edge
 * on. */
#include "glb/demo_internal.h"

#define VESSEL_X 1.65
#define VESSEL_Z 2.2
#define PLINTH_TOP 0.92

static void add_plinth(struct demo *demo, int parent)
{
    struct shape shape = {0};
    shape_add_box(&shape, (double[]){-0.38, 0, -0.38}, (double[]){0.38, 0.12, 0.38});
    shape_add_box(&shape, (double[]){-0.29, 0.12, -0.29}, (double[]){0.29, 0.80, 0.29});
    shape_add_box(&shape, (double[]){-0.36, 0.80, -0.36}, (double[]){0.36, PLINTH_TOP, 0.36});
    int mesh = shape_give_mesh(&shape, demo->builder, "Plinth", demo->trim);
    demo_add(demo,
             &(struct demo_place){
                 .name = "Plinth", .parent = parent, .mesh = mesh, .at = {VESSEL_X, 0, VESSEL_Z}});
}

/* One sheet of glass, as blown: a ray crosses it twice. */
static int add_vessel_mesh(struct demo *demo)
{
    static const double profile[][2] = {
        {0, 0.015},    {0.13, 0.012},  {0.142, 0.02}, {0.12, 0.034},  {0.05, 0.05},  {0.035, 0.075},
        {0.04, 0.10},  {0.075, 0.13},  {0.13, 0.175}, {0.18, 0.235},  {0.212, 0.31}, {0.222, 0.39},
        {0.21, 0.47},  {0.175, 0.545}, {0.13, 0.605}, {0.095, 0.655}, {0.08, 0.70},  {0.082, 0.745},
        {0.10, 0.785}, {0.128, 0.815}, {0.145, 0.825}};
    struct shape shape = {0};
    shape_add_lathe(&shape, &(struct shape_lathe_desc){.profile = profile,
                                                       .count = sizeof profile / sizeof *profile,
                                                       .slices = demo_sides(demo, 96)});
    int glass = glb_builder_add_material(
        demo->builder, &(struct glb_material_desc){.name = "Vessel glass",
                                                   .base_color = {0.99, 0.76, 0.40, 1},
                                                   .transmission = 1,
                                                   .roughness = 0.06,
                                                   .has_ior = true,
                                                   .ior = 1.45,
                                                   .is_double_sided = true,
                                                   .pass_through = GLB_PASS_SLAB});
    return shape_give_mesh(&shape, demo->builder, "Vessel", glass);
}

/* A ball of blue glass beside it. */
static int add_ball_mesh(struct demo *demo)
{
    struct shape shape = {0};
    shape_add_sphere(&shape, (double[]){0, 0.10, 0}, 0.10, demo_sides(demo, 48),
                     demo_sides(demo, 32));
    int glass = glb_builder_add_material(
        demo->builder, &(struct glb_material_desc){.name = "Ball glass",
                                                   .base_color = {0.40, 0.70, 0.99, 1},
                                                   .transmission = 1,
                                                   .roughness = 0.05,
                                                   .has_ior = true,
                                                   .ior = 1.45,
                                                   .pass_through = GLB_PASS_SLAB,
                                                   .is_double_sided = true});
    return shape_give_mesh(&shape, demo->builder, "Ball", glass);
}

void demo_add_vessel(struct demo *demo)
{
    int parent = demo_add_group(demo, "Vessel and plinth");
    add_plinth(demo, parent);
    demo_add(demo, &(struct demo_place){.name = "Vessel",
                                        .parent = parent,
                                        .mesh = add_vessel_mesh(demo),
                                        .at = {VESSEL_X, PLINTH_TOP, VESSEL_Z}});
    demo_add(demo, &(struct demo_place){.name = "Ball",
                                        .parent = parent,
                                        .mesh = add_ball_mesh(demo),
                                        .at = {VESSEL_X - 0.20, PLINTH_TOP, VESSEL_Z + 0.22}});
}
