/* SPDX-License-Identifier: MIT */
/* The windows of the demo scene: panes of drawn glass in the openings, and the sky behind them. */
#include "glb/demo_internal.h"

static const double zenith[3] = {0, 1, 0};

static int add_glass_material(struct demo *demo, enum demo_window window, const char *name)
{
    int glass = 0, clear = 0;
    demo_draw_window(demo, window, &glass, &clear);
    return glb_builder_add_material(demo->builder, &(struct glb_material_desc){
                                                       .name = name,
                                                       .base_color_texture.texture = glass,
                                                       .transmission = 1,
                                                       .transmission_texture.texture = clear,
                                                       .has_ior = true,
                                                       .ior = 1.0,
                                                       .is_double_sided = true,
                                                   });
}

static void add_rose(struct demo *demo, int parent)
{
    struct shape_outline outline;
    struct shape shape = {0};
    int material = add_glass_material(demo, DEMO_ROSE, "Rose glass");
    shape_outline_circle(&outline, 0, 0, ROSE_RADIUS, 96);
    shape_add_face(&shape, &outline);
    int mesh = shape_give_mesh(&shape, demo->builder, "Rose", material);
    demo_add(demo, &(struct demo_place){.name = "Rose window",
                                        .parent = parent,
                                        .mesh = mesh,
                                        .at = {0, ROSE_Y, -NAVE_HALF_LENGTH - WALL_THICKNESS / 2}});
}

static void add_lancets(struct demo *demo, int parent)
{
    static const char *const names[] = {[DEMO_LANCET_MEDALLIONS] = "Medallion glass",
                                        [DEMO_LANCET_SCALES] = "Scale glass",
                                        [DEMO_LANCET_LILY] = "Lily glass"};
    static const enum demo_window order[BAY_COUNT] = {DEMO_LANCET_MEDALLIONS, DEMO_LANCET_LILY,
                                                      DEMO_LANCET_SCALES, DEMO_LANCET_MEDALLIONS,
                                                      DEMO_LANCET_LILY};
    int meshes[DEMO_WINDOW_COUNT] = {0};
    for (int window = DEMO_LANCET_MEDALLIONS; window < DEMO_WINDOW_COUNT; window++) {
        struct shape_outline outline;
        struct shape shape = {0};
        int material = add_glass_material(demo, (enum demo_window)window, names[window]);
        shape_outline_arch(&outline, LANCET_WIDTH, LANCET_BOTTOM, LANCET_SPRING, LANCET_POINTEDNESS,
                           32);
        shape_set_place(&shape, NULL, (double[]){0, 0, 1}, zenith); /* faces -X, into the nave */
        shape_add_face(&shape, &outline);
        meshes[window] = shape_give_mesh(&shape, demo->builder, "Lancet", material);
    }
    for (int bay = 0; bay < BAY_COUNT; bay++)
        demo_add(demo, &(struct demo_place){
                           .name = "Lancet window",
                           .parent = parent,
                           .mesh = meshes[order[bay]],
                           .at = {NAVE_HALF_WIDTH + WALL_THICKNESS / 2, 0, demo_bay_z(bay)}});
}

/* Bright sheets behind the lights that stand for the sky: the glass glows when it is looked at. */
static void add_sky(struct demo *demo, int parent)
{
    struct shape shape = {0};
    int material = glb_builder_add_material(
        demo->builder, &(struct glb_material_desc){.name = "Sky",
                                                   .base_color = {0, 0, 0, 1},
                                                   .roughness = 1,
                                                   .emissive = {0.80, 0.90, 1},
                                                   .emissive_strength = 2.2 * demo->light_factor,
                                                   .is_double_sided = true});
    shape_add_quad(&shape, (double[]){-45, -10, -46}, (double[]){90, 0, 0}, (double[]){0, 60, 0});
    shape_add_quad(&shape, (double[]){34, -10, -120}, (double[]){0, 0, 150}, (double[]){0, 60, 0});
    int mesh = shape_give_mesh(&shape, demo->builder, "Sky", material);
    demo_add(demo, &(struct demo_place){.name = "Sky", .parent = parent, .mesh = mesh});
}

void demo_add_windows(struct demo *demo)
{
    int parent = demo_add_group(demo, "Windows");
    add_rose(demo, parent);
    add_lancets(demo, parent);
    add_sky(demo, parent);
}
