/* SPDX-License-Identifier: MIT */
/* The building of the demo scene: floor, walls with openings, arcades, columns and vault. */
#include "glb/demo_internal.h"

static const double zenith[3] = {0, 1, 0}, east[3] = {1, 0, 0}, west[3] = {-1, 0, 0};
static const double north[3] = {0, 0, -1};

static void add_floor(struct demo *demo, int parent)
{
    struct shape shape = {0};
    double x = NAVE_HALF_WIDTH + WALL_THICKNESS, z = NAVE_HALF_LENGTH + WALL_THICKNESS;
    shape_add_quad(&shape, (double[]){-x, 0, z}, (double[]){2 * x, 0, 0}, (double[]){0, 0, -2 * z});
    for (size_t i = 0; i < shape.vertex_count; i++) { /* metres, for the tiles */
        shape.texcoords[2 * i] = shape.positions[3 * i];
        shape.texcoords[2 * i + 1] = shape.positions[3 * i + 2];
    }
    int mesh = shape_give_mesh(&shape, demo->builder, "Floor", demo->floor);
    demo_add(demo, &(struct demo_place){.name = "Floor", .parent = parent, .mesh = mesh});
}

/* The wall with the rose, the plain wall opposite, and the plain side wall. */
static void add_plain_walls(struct demo *demo, int parent)
{
    double x = NAVE_HALF_WIDTH + WALL_THICKNESS, top = VAULT_SPRING + ARCADE_X + 0.4;
    double z = NAVE_HALF_LENGTH, depth = WALL_THICKNESS;
    struct shape_outline rose;
    struct shape shape = {0};
    shape_outline_circle(&rose, 0, ROSE_Y, ROSE_RADIUS, 96);
    shape_set_place(&shape, (double[]){0, 0, -z - depth}, NULL, NULL);
    shape_add_pierced_slab(&shape, (double[]){-x, 0}, (double[]){x, top}, &rose, depth);
    shape_set_place(&shape, NULL, NULL, NULL);
    shape_add_box(&shape, (double[]){-x, 0, z}, (double[]){x, top, z + depth});
    shape_add_box(&shape, (double[]){-x, 0, -z}, (double[]){-x + depth, AISLE_HEIGHT, z});
    int mesh = shape_give_mesh(&shape, demo->builder, "Walls", demo->stone);
    demo_add(demo, &(struct demo_place){.name = "Walls", .parent = parent, .mesh = mesh});
}

/* One bay of the side wall with its lancet opening, repeated along the nave. */
static void add_lancet_wall(struct demo *demo, int parent)
{
    struct shape_outline opening;
    struct shape shape = {0};
    shape_outline_arch(&opening, LANCET_WIDTH, LANCET_BOTTOM, LANCET_SPRING, LANCET_POINTEDNESS,
                       32);
    shape_set_place(&shape, (double[]){WALL_THICKNESS, 0, 0}, (double[]){0, 0, 1}, zenith);
    /* Local +Z is world -X here: the slab grows inward from the outer face. */
    shape_add_pierced_slab(&shape, (double[]){-BAY / 2, 0}, (double[]){BAY / 2, AISLE_HEIGHT},
                           &opening, WALL_THICKNESS);
    int mesh = shape_give_mesh(&shape, demo->builder, "Lancet wall", demo->stone);
    for (int bay = 0; bay < BAY_COUNT; bay++)
        demo_add(demo, &(struct demo_place){.name = "Lancet wall",
                                            .parent = parent,
                                            .mesh = mesh,
                                            .at = {NAVE_HALF_WIDTH, 0, demo_bay_z(bay)}});
}

/* One bay of an arcade: the wall over a round arch, and its moulding. */
static void add_arcades(struct demo *demo, int parent)
{
    double radius = BAY / 2 - 0.28, half = ARCADE_THICKNESS / 2;
    struct shape_outline arch, wall = {.count = 0};
    struct shape shape = {0};
    shape_outline_arch(&arch, 2 * radius, 0, ARCH_SPRING, 0.5, 48);
    static const double top[2] = {BAY / 2, VAULT_SPRING};
    double corners[4][2] = {
        {BAY / 2, ARCH_SPRING}, {top[0], top[1]}, {-top[0], top[1]}, {-BAY / 2, ARCH_SPRING}};
    for (int i = 0; i < 4; i++) {
        wall.points[wall.count][0] = corners[i][0];
        wall.points[wall.count++][1] = corners[i][1];
    }
    for (int i = arch.count - 1; i >= 2; i--) { /* from the left spring over the top */
        wall.points[wall.count][0] = arch.points[i][0];
        wall.points[wall.count++][1] = arch.points[i][1];
    }
    shape_set_place(&shape, (double[]){half, 0, 0}, (double[]){0, 0, 1}, zenith);
    shape_add_extrusion(&shape, &wall, ARCADE_THICKNESS);
    shape_set_place(&shape, (double[]){half + 0.06, ARCH_SPRING, 0}, (double[]){0, 0, 1}, zenith);
    shape_add_arch(&shape, radius - 0.001, radius + 0.20, ARCADE_THICKNESS + 0.12,
                   demo_sides(demo, 40));
    int mesh = shape_give_mesh(&shape, demo->builder, "Arcade", demo->stone);
    for (int side = -1; side <= 1; side += 2)
        for (int bay = 0; bay < BAY_COUNT; bay++)
            demo_add(demo, &(struct demo_place){.name = "Arcade",
                                                .parent = parent,
                                                .mesh = mesh,
                                                .at = {side * ARCADE_X, 0, demo_bay_z(bay)}});
}

/* A column: plinth, turned base, shaft with a slight swell, turned capital, abacus. */
static int add_column_mesh(struct demo *demo)
{
    static const double base[][2] = {
        {0, 0.22},    {0.36, 0.22},  {0.385, 0.245}, {0.39, 0.28},  {0.37, 0.315}, {0.325, 0.335},
        {0.31, 0.37}, {0.325, 0.40}, {0.34, 0.42},   {0.335, 0.45}, {0.30, 0.47},  {0.285, 0.50},
        {0.283, 1.2}, {0.275, 2.1},  {0.262, 2.85},  {0.262, 2.90}, {0.29, 2.92},  {0.30, 2.95},
        {0.29, 2.98}, {0.265, 3.0},  {0.27, 3.08},   {0.295, 3.18}, {0.34, 3.28},  {0.40, 3.36},
        {0.42, 3.40}, {0, 3.40}};
    struct shape shape = {0};
    shape_add_box(&shape, (double[]){-0.42, 0, -0.42}, (double[]){0.42, 0.22, 0.42});
    shape_add_lathe(&shape, &(struct shape_lathe_desc){.profile = base,
                                                       .count = sizeof base / sizeof *base,
                                                       .slices = demo_sides(demo, 48)});
    shape_add_box(&shape, (double[]){-0.40, 3.40, -0.40}, (double[]){0.40, 3.50, 0.40});
    shape_add_box(&shape, (double[]){-0.44, 3.50, -0.44}, (double[]){0.44, ARCH_SPRING, 0.44});
    return shape_give_mesh(&shape, demo->builder, "Column", demo->trim);
}

static void add_columns(struct demo *demo, int parent)
{
    int mesh = add_column_mesh(demo);
    for (int side = -1; side <= 1; side += 2)
        for (int row = 0; row <= BAY_COUNT; row++)
            demo_add(demo,
                     &(struct demo_place){.name = "Column",
                                          .parent = parent,
                                          .mesh = mesh,
                                          .at = {side * ARCADE_X, 0, demo_bay_z(row) - BAY / 2}});
}

/* The barrel vault with its ribs, and the flat ceilings of the aisles. */
static void add_ceiling(struct demo *demo, int parent)
{
    double inner = ARCADE_X - ARCADE_THICKNESS / 2, z = NAVE_HALF_LENGTH;
    double wall_x = NAVE_HALF_WIDTH + WALL_THICKNESS;
    struct shape shape = {0};
    shape_set_place(&shape, (double[]){0, VAULT_SPRING, -z}, NULL, NULL);
    shape_add_arch(&shape, inner, inner + 0.3, 2 * z, demo_sides(demo, 64));
    shape_set_place(&shape, NULL, NULL, NULL);
    for (int side = -1; side <= 1; side += 2) {
        double a = side * (ARCADE_X - 0.1), b = side * wall_x;
        shape_add_box(&shape, (double[]){a < b ? a : b, AISLE_HEIGHT, -z},
                      (double[]){a < b ? b : a, AISLE_HEIGHT + 0.3, z});
    }
    int mesh = shape_give_mesh(&shape, demo->builder, "Vault", demo->stone);
    demo_add(demo, &(struct demo_place){.name = "Vault", .parent = parent, .mesh = mesh});

    shape_set_place(&shape, (double[]){0, VAULT_SPRING, -0.16}, NULL, NULL);
    shape_add_arch(&shape, inner - 0.16, inner + 0.02, 0.32, demo_sides(demo, 48));
    shape_set_place(&shape, NULL, NULL, NULL);
    for (int side = -1; side <= 1; side += 2) { /* corbels under the feet of the ribs */
        double a = side * (inner - 0.18), b = side * (inner + 0.02);
        shape_add_box(&shape, (double[]){a < b ? a : b, VAULT_SPRING - 0.22, -0.2},
                      (double[]){a < b ? b : a, VAULT_SPRING, 0.2});
    }
    mesh = shape_give_mesh(&shape, demo->builder, "Rib", demo->trim);
    for (int row = 1; row < BAY_COUNT; row++)
        demo_add(demo, &(struct demo_place){.name = "Rib",
                                            .parent = parent,
                                            .mesh = mesh,
                                            .at = {0, 0, demo_bay_z(row) - BAY / 2}});
}

/* Round mouldings on the inside: around the rose, along the foot and the head of the arcade wall.
 */
static void add_mouldings(struct demo *demo, int parent)
{
    struct shape shape = {0};
    shape_set_place(&shape, (double[]){0, ROSE_Y, -NAVE_HALF_LENGTH}, east, north);
    shape_add_torus(&shape, (double[]){0, 0, 0}, ROSE_RADIUS + 0.12, 0.11, demo_sides(demo, 96),
                    demo_sides(demo, 12));
    shape_add_torus(&shape, (double[]){0, 0, 0}, ROSE_RADIUS + 0.34, 0.06, demo_sides(demo, 96),
                    demo_sides(demo, 10));
    shape_set_place(&shape, NULL, NULL, NULL);
    double inner = ARCADE_X - ARCADE_THICKNESS / 2;
    for (int side = -1; side <= 1; side += 2) {
        const double *along = side < 0 ? east : west;
        shape_set_place(&shape, (double[]){side * inner, 0, 0}, along, zenith);
        shape_add_box(&shape, (double[]){-0.02, VAULT_SPRING - 0.10, -NAVE_HALF_LENGTH},
                      (double[]){0.10, VAULT_SPRING + 0.02, NAVE_HALF_LENGTH});
    }
    int mesh = shape_give_mesh(&shape, demo->builder, "Mouldings", demo->trim);
    demo_add(demo, &(struct demo_place){.name = "Mouldings", .parent = parent, .mesh = mesh});
}

void demo_add_walls(struct demo *demo)
{
    int parent = demo_add_group(demo, "Building");
    add_floor(demo, parent);
    add_plain_walls(demo, parent);
    add_lancet_wall(demo, parent);
    add_arcades(demo, parent);
    add_columns(demo, parent);
    add_ceiling(demo, parent);
    add_mouldings(demo, parent);
}
