/* SPDX-License-Identifier: MIT */
/* Counts what density grids have rays do, by crossing them on a few ways. */
#include "renderer/base/matrix.h"
#include "renderer/cost/workload.h"
#include "renderer/scene/atmosphere_grid.h"
#include "renderer/scene/smoke_lattice.h"
#include "renderer/scene/smoke_nodes.h"

enum {
    SKIP = 2, /* every second column and row of the cells of the picture is looked along */
    LOOKS = SCENE_COLUMNS / SKIP * (SCENE_ROWS / SKIP),
    STRIDE = 61, /* without a factor that LOOKS has: where the first ways are all, they lie about */
    PIECES_MAX = 20000, /* crossed on all ways together: two milliseconds */
    LIGHTS_SAMPLED = 16,
    LOOK_CELLS = 6, /* a look at kept depths takes as long as these */
};

struct counter {
    const struct workload_desc *desc;
    size_t light_step; /* of the lights that are looked at */
    int pieces;        /* so far */
    struct smoke_nodes nodes;
};

struct way {
    double from[3], direction[3]; /* world */
    double begin, end;            /* in units of the direction */
};

/* What a way meets of a grid. */
struct crossing {
    double cells;       /* with smoke */
    double first, last; /* of these; in units of the direction */
};

static bool cross(struct counter *counter, const struct state_grid *grid, const struct way *way,
                  struct crossing *crossing)
{
    double from[3], step[3], deep = 0, unit_m = vec3_length(way->direction);
    double dark = state_grid_dark_m(grid);
    struct density_walk walk;
    struct density_piece piece;
    *crossing = (struct crossing){.first = INFINITY};
    mat4_transform_point(grid->voxel_from_world, way->from, from);
    mat4_transform_direction(grid->voxel_from_world, way->direction, step);
    if (!density_walk_begin(&walk, &grid->values, from, step, way->begin, way->end))
        return false;
    while (deep < dark && counter->pieces < PIECES_MAX && density_walk_next(&walk, &piece)) {
        counter->pieces++;
        if (!(piece.bound > 0))
            continue;
        deep += unit_m * density_walk_integrate(&walk, piece.from, piece.to);
        crossing->cells++;
        crossing->first = fmin(crossing->first, piece.from);
        crossing->last = piece.to;
    }
    return deep > 0;
}

/* Cells on the way from a point to a light. */
static double cells_to(struct counter *counter, const double point[3],
                       const struct state_light *light)
{
    const struct scene_state *state = counter->desc->state;
    struct way way = {.end = light->type == SCENE_LIGHT_DIRECTIONAL ? INFINITY : 1};
    double cells = 0;
    memcpy(way.from, point, sizeof way.from);
    for (int k = 0; k < 3; k++)
        way.direction[k] = light->type == SCENE_LIGHT_DIRECTIONAL ? -light->direction[k]
                                                                  : light->position[k] - point[k];
    for (size_t i = 0; i < state->grid_count; i++) {
        struct crossing crossing;
        if (cross(counter, &state->grids[i], &way, &crossing))
            cells += crossing.cells;
    }
    return cells;
}

static bool is_in_range(const struct state_light *light, const double point[3])
{
    double off[3];
    vec3_sub(light->position, point, off);
    return light->type == SCENE_LIGHT_DIRECTIONAL || !(light->range > 0) ||
           vec3_length(off) < (double)light->range;
}

/* The lights of a point in a grid. */
static void add_lights(struct counter *counter, const double point[3], struct workload *sum)
{
    const struct scene_state *state = counter->desc->state;
    for (size_t i = 0; i < state->light_count; i += counter->light_step) {
        const struct state_light *light = &state->lights[i];
        double weight = (double)counter->light_step;
        if (!is_in_range(light, point))
            continue;
        sum->grid_lights += weight;
        if (workload_shines_into(light, point))
            sum->grid_lit_cells += weight * cells_to(counter, point, light);
    }
}

/* Through the middle of a cell of the picture, to what is opaque there. */
static struct way way_through(const struct camera *camera, const struct scene_sampling *sampling,
                              int column, int row)
{
    struct way way = {.begin = camera->is_orthographic ? 0 : camera->z_near};
    double x = (2 * (column + 0.5) / SCENE_COLUMNS - 1) * camera->half_width;
    double y = (2 * (row + 0.5) / SCENE_ROWS - 1) * camera->half_height;
    for (int k = 0; k < 3; k++) {
        double aside = camera->right[k] * x + camera->up[k] * y;
        way.from[k] = camera->eye[k] + (camera->is_orthographic ? aside : 0);
        way.direction[k] = (camera->is_orthographic ? 0 : aside) - camera->back[k];
    }
    way.end = (double)sampling->depths[row * SCENE_COLUMNS + column];
    return way;
}

static void look_along(struct counter *counter, const struct way *way, struct workload *sum)
{
    const struct scene_state *state = counter->desc->state;
    for (size_t i = 0; i < state->grid_count; i++) {
        struct crossing crossing;
        double middle[3];
        if (!cross(counter, &state->grids[i], way, &crossing))
            continue;
        sum->grid_cells += crossing.cells;
        for (int k = 0; k < 3; k++)
            middle[k] = way->from[k] + 0.5 * (crossing.first + crossing.last) * way->direction[k];
        struct workload lights = {.pixels = 0};
        add_lights(counter, middle, &lights);
        sum->grid_lights += lights.grid_lights;
        sum->grid_lit_cells += lights.grid_lit_cells;
        /* along the direction a step is a metre of depth; one node beyond either end is lit, too */
        double nodes = 2 + smoke_node_at(&counter->nodes, crossing.last) -
                       smoke_node_at(&counter->nodes, crossing.first);
        sum->grid_nodes += nodes;
        sum->grid_node_lights += nodes * lights.grid_lights;
        sum->grid_node_cells += nodes * lights.grid_lit_cells;
    }
}

/* Sums over the ways that were looked along. */
static void count_nodes(const struct workload_desc *desc, const struct workload *sum, int looks,
                        struct workload *workload)
{
    const struct view *view = desc->view;
    const struct camera_window whole = camera_window_whole(view->width_px, view->height_px);
    const struct atmosphere_grid grid = atmosphere_grid_of(view, &whole);
    double columns = (double)atmosphere_columns(&grid) / looks;
    workload->grid_nodes = columns * sum->grid_nodes;
    workload->grid_node_lights = columns * sum->grid_node_lights;
    workload->grid_node_cells = columns * sum->grid_node_cells;
    if (workload->grid_nodes > 0 &&
        smoke_lattice_serves(view, desc->state, desc->camera, desc->depths_bytes)) {
        double points = (double)smoke_lattice_of(desc->state).points;
        workload->grid_point_cells = points * workload->grid_node_cells / workload->grid_nodes;
        workload->grid_node_cells = LOOK_CELLS * workload->grid_node_lights;
    }
}

static void count_shadows(struct counter *counter, const struct scene_sampling *sampling,
                          struct workload *workload)
{
    const struct scene_state *state = counter->desc->state;
    double points = 0, cells = 0;
    for (int p = 0; p < sampling->point_count && counter->pieces < PIECES_MAX; p++) {
        const struct scene_sample *sample = &sampling->points[p];
        points += sample->weight;
        for (size_t i = 0; i < state->light_count; i += counter->light_step)
            if (workload_shines_on(&state->lights[i], sample))
                cells += sample->weight * (double)counter->light_step *
                         cells_to(counter, sample->position, &state->lights[i]);
    }
    workload->grid_shadow_cells = points > 0 ? cells / points : 0;
}

void workload_measure_grids(struct workload *workload, const struct workload_desc *desc,
                            const struct scene_sampling *sampling)
{
    struct counter counter = {.desc = desc,
                              .light_step = desc->state->light_count / LIGHTS_SAMPLED + 1,
                              .nodes = smoke_nodes_of(desc->view, desc->state, desc->camera)};
    struct workload sum = {.pixels = 0};
    int looks = 0;
    if (!desc->state->grid_count)
        return;
    for (; looks < LOOKS && counter.pieces < PIECES_MAX; looks++) {
        int cell = looks * STRIDE % LOOKS, columns = SCENE_COLUMNS / SKIP;
        const struct way way =
            way_through(desc->camera, sampling, cell % columns * SKIP, cell / columns * SKIP);
        look_along(&counter, &way, &sum);
    }
    workload->grid_samples = desc->view->quality.atmosphere_samples;
    workload->grid_cells = sum.grid_cells / looks;
    workload->grid_lights = sum.grid_lights / looks;
    workload->grid_lit_cells = sum.grid_lit_cells / looks;
    count_nodes(desc, &sum, looks, workload);
    counter.pieces = 0;
    count_shadows(&counter, sampling, workload);
}
