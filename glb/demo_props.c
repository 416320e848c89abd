/* SPDX-License-Identifier: MIT */
/* The furniture of the demo scene: benches, the altar, candles and the ring lamp. */
#include <math.h>

#include "glb/demo_internal.h"

#define ALTAR_Z (-8.6)
#define ALTAR_TOP 1.42
#define POST_X 4.2
#define POST_Z (-2.0)
#define POST_TOP 1.1
#define RING_Y 6.15
#define RING_Z (-4.0)
#define RING_RADIUS 0.85

static const double pi = 3.14159265358979323846;

/* Seat, back and two ends; x along the bench, the back towards +z. */
static int add_bench_mesh(struct demo *demo)
{
    struct shape shape = {0};
    shape_add_box(&shape, (double[]){-0.80, 0.42, -0.20}, (double[]){0.80, 0.47, 0.20});
    shape_add_box(&shape, (double[]){-0.80, 0.52, 0.20}, (double[]){0.80, 0.90, 0.24});
    shape_add_box(&shape, (double[]){-0.80, 0.34, 0.10}, (double[]){0.80, 0.42, 0.13});
    for (int side = -1; side <= 1; side += 2) {
        double a = side * 0.80, b = side * 0.86, low = a < b ? a : b, high = a < b ? b : a;
        shape_add_box(&shape, (double[]){low, 0, -0.22}, (double[]){high, 0.62, 0.14});
        shape_add_box(&shape, (double[]){low, 0, 0.14}, (double[]){high, 0.98, 0.28});
    }
    return shape_give_mesh(&shape, demo->builder, "Bench", demo->dark_wood);
}

static void add_benches(struct demo *demo, int parent)
{
    static const double places[][2] = {
        {1.75, -2.6}, {1.75, -3.9}, {1.75, -5.2}, {-1.75, -3.9}, {-1.75, -5.2}};
    int mesh = add_bench_mesh(demo);
    for (size_t i = 0; i < sizeof places / sizeof *places; i++)
        demo_add(demo, &(struct demo_place){.name = "Bench",
                                            .parent = parent,
                                            .mesh = mesh,
                                            .at = {places[i][0], 0, places[i][1]}});
}

static void add_altar(struct demo *demo, int parent)
{
    struct shape steps = {0}, cloth = {0};
    double end = -NAVE_HALF_LENGTH;
    shape_add_box(&steps, (double[]){-2.7, 0, end}, (double[]){2.7, 0.18, -6.9});
    shape_add_box(&steps, (double[]){-2.3, 0.18, end}, (double[]){2.3, 0.36, -7.4});
    shape_add_box(&steps, (double[]){-1.05, 0.36, ALTAR_Z - 0.40},
                  (double[]){1.05, 1.28, ALTAR_Z + 0.40});
    shape_add_box(&steps, (double[]){-1.2, 1.28, ALTAR_Z - 0.5},
                  (double[]){1.2, ALTAR_TOP - 0.02, ALTAR_Z + 0.5});
    int mesh = shape_give_mesh(&steps, demo->builder, "Altar", demo->trim);
    demo_add(demo, &(struct demo_place){.name = "Altar", .parent = parent, .mesh = mesh});

    int linen = glb_builder_add_material(
        demo->builder, &(struct glb_material_desc){.name = "Linen",
                                                   .base_color = {0.80, 0.77, 0.70, 1},
                                                   .roughness = 0.95,
                                                   .is_double_sided = true});
    shape_add_box(&cloth, (double[]){-0.7, ALTAR_TOP - 0.02, ALTAR_Z - 0.5},
                  (double[]){0.7, ALTAR_TOP, ALTAR_Z + 0.51});
    shape_add_box(&cloth, (double[]){-0.7, 0.80, ALTAR_Z + 0.5},
                  (double[]){0.7, ALTAR_TOP - 0.02, ALTAR_Z + 0.51});
    mesh = shape_give_mesh(&cloth, demo->builder, "Altar cloth", linen);
    demo_add(demo, &(struct demo_place){.name = "Altar cloth", .parent = parent, .mesh = mesh});

    shape_add_box(&cloth, (double[]){-0.045, 0, -0.03}, (double[]){0.045, 0.95, 0.03});
    shape_add_box(&cloth, (double[]){-0.27, 0.58, -0.03}, (double[]){0.27, 0.67, 0.03});
    shape_add_box(&cloth, (double[]){-0.16, -0.08, -0.12}, (double[]){0.16, 0, 0.12});
    mesh = shape_give_mesh(&cloth, demo->builder, "Cross", demo->gold);
    demo_add(demo, &(struct demo_place){.name = "Cross",
                                        .parent = parent,
                                        .mesh = mesh,
                                        .at = {0, ALTAR_TOP + 0.08, ALTAR_Z - 0.1}});
}

/* Twelve small candles on a ring that hangs from the vault on three rods. */
static void add_ring_lamp(struct demo *demo, int parent)
{
    struct shape iron = {0}, wax = {0}, flame = {0};
    double inner = ARCADE_X - ARCADE_THICKNESS / 2, top = VAULT_SPRING + inner - RING_Y;
    shape_add_torus(&iron, (double[]){0, 0, 0}, RING_RADIUS, 0.035, demo_sides(demo, 64),
                    demo_sides(demo, 12));
    shape_add_torus(&iron, (double[]){0, 0.09, 0}, RING_RADIUS, 0.018, demo_sides(demo, 64),
                    demo_sides(demo, 8));
    shape_add_sphere(&iron, (double[]){0, 1.5, 0}, 0.06, demo_sides(demo, 16),
                     demo_sides(demo, 10));
    shape_add_cylinder(&iron, (double[]){0, 1.5, 0}, 0.012, top - 1.5, demo_sides(demo, 8));
    for (int i = 0; i < 12; i++) {
        double x = RING_RADIUS * cos(2 * pi * i / 12), z = RING_RADIUS * sin(2 * pi * i / 12);
        shape_add_cylinder(&wax, (double[]){x, 0.03, z}, 0.025, 0.20, demo_sides(demo, 12));
        shape_add_cone(&flame, (double[]){x, 0.24, z}, 0.014, 0, 0.06, demo_sides(demo, 8));
        if (i % 4 != 0)
            continue;
        double y_axis[3] = {-x, 1.5, -z}, length = hypot(RING_RADIUS, 1.5);
        double x_axis[3] = {1.5 * x / RING_RADIUS, RING_RADIUS, 1.5 * z / RING_RADIUS};
        for (int k = 0; k < 3; k++) {
            y_axis[k] /= length;
            x_axis[k] /= length;
        }
        shape_set_place(&iron, (double[]){x, 0, z}, x_axis, y_axis);
        shape_add_cylinder(&iron, (double[]){0, 0, 0}, 0.009, length, demo_sides(demo, 8));
        shape_set_place(&iron, NULL, NULL, NULL);
    }
    int group = demo_add(
        demo,
        &(struct demo_place){.name = "Ring lamp", .parent = parent, .at = {0, RING_Y, RING_Z}});
    const struct demo_place parts[] = {
        {"Ring", group, shape_give_mesh(&iron, demo->builder, "Ring", demo->iron), {0}, 0},
        {"Ring candles",
         group,
         shape_give_mesh(&wax, demo->builder, "Ring candles", demo->wax),
         {0},
         0},
        {"Ring flames",
         group,
         shape_give_mesh(&flame, demo->builder, "Ring flames", demo->flame),
         {0},
         0},
    };
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        demo_add(demo, &parts[i]);
    demo_add_light(demo, group,
                   &(struct demo_light){.name = "Ring light",
                                        .type = GLB_LIGHT_POINT,
                                        .eye = {0, 0.42, 0},
                                        .color = {1, 0.72, 0.42},
                                        .intensity = 34,
                                        .range = 14});
}

static void add_candle_meshes(struct demo *demo, int *stick, int *wax, int *flame)
{
    static const double profile[][2] = {{0, 0},        {0.13, 0},     {0.13, 0.02},  {0.06, 0.05},
                                        {0.022, 0.09}, {0.018, 0.30}, {0.035, 0.33}, {0.018, 0.36},
                                        {0.018, 0.52}, {0.06, 0.55},  {0.065, 0.57}, {0, 0.57}};
    static const double drop[][2] = {{0, 0},         {0.010, 0.006}, {0.016, 0.02},
                                     {0.014, 0.035}, {0.006, 0.06},  {0, 0.075}};
    struct shape shape = {0};
    shape_add_lathe(&shape, &(struct shape_lathe_desc){.profile = profile,
                                                       .count = sizeof profile / sizeof *profile,
                                                       .slices = demo_sides(demo, 24)});
    *stick = shape_give_mesh(&shape, demo->builder, "Candlestick", demo->gold);
    shape_add_cylinder(&shape, (double[]){0, 0, 0}, 0.03, 0.30, demo_sides(demo, 16));
    *wax = shape_give_mesh(&shape, demo->builder, "Candle", demo->wax);
    shape_add_lathe(&shape, &(struct shape_lathe_desc){.profile = drop,
                                                       .count = sizeof drop / sizeof *drop,
                                                       .slices = demo_sides(demo, 12)});
    *flame = shape_give_mesh(&shape, demo->builder, "Flame", demo->flame);
}

/* A stone post in each aisle for a candle to stand on. */
static void add_posts(struct demo *demo, int parent)
{
    struct shape shape = {0};
    for (int side = -1; side <= 1; side += 2) {
        double x = side * POST_X;
        shape_add_box(&shape, (double[]){x - 0.22, 0, POST_Z - 0.22},
                      (double[]){x + 0.22, 0.1, POST_Z + 0.22});
        shape_add_cylinder(&shape, (double[]){x, 0.1, POST_Z}, 0.13, POST_TOP - 0.18,
                           demo_sides(demo, 32));
        shape_add_box(&shape, (double[]){x - 0.2, POST_TOP - 0.08, POST_Z - 0.2},
                      (double[]){x + 0.2, POST_TOP, POST_Z + 0.2});
    }
    int mesh = shape_give_mesh(&shape, demo->builder, "Posts", demo->trim);
    demo_add(demo, &(struct demo_place){.name = "Posts", .parent = parent, .mesh = mesh});
}

void demo_add_candles(struct demo *demo)
{
    static const struct {
        double at[3], intensity;
    } candles[] = {{{-0.92, ALTAR_TOP - 0.02, ALTAR_Z}, 3.2},
                   {{0.92, ALTAR_TOP - 0.02, ALTAR_Z}, 3.2},
                   {{-POST_X, POST_TOP, POST_Z}, 8},
                   {{POST_X, POST_TOP, POST_Z}, 8}};
    int stick, wax, flame, parent = demo_add_group(demo, "Candles");
    add_posts(demo, parent);
    add_candle_meshes(demo, &stick, &wax, &flame);
    for (size_t i = 0; i < sizeof candles / sizeof *candles; i++) {
        const double *at = candles[i].at;
        int group = demo_add(demo, &(struct demo_place){.name = "Candle stand",
                                                        .parent = parent,
                                                        .mesh = stick,
                                                        .at = {at[0], at[1], at[2]}});
        demo_add(demo, &(struct demo_place){
                           .name = "Candle", .parent = group, .mesh = wax, .at = {0, 0.57, 0}});
        demo_add(demo, &(struct demo_place){
                           .name = "Flame", .parent = group, .mesh = flame, .at = {0, 0.88, 0}});
        /* Above the flame: inside it the flame itself would be the shadow. */
        demo_add_light(demo, group,
                       &(struct demo_light){.name = "Candle light",
                                            .type = GLB_LIGHT_POINT,
                                            .eye = {0, 1.02, 0},
                                            .color = {1, 0.66, 0.34},
                                            .intensity = candles[i].intensity,
                                            .range = 7});
    }
}

void demo_add_props(struct demo *demo)
{
    int parent = demo_add_group(demo, "Furniture");
    add_benches(demo, parent);
    add_altar(demo, parent);
    add_ring_lamp(demo, parent);
}
