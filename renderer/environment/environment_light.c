/* SPDX-License-Identifier: MIT */
/* An environment as a view has it: turned, scaled, looked at and sampled. */
#include <math.h>
#include <stdlib.h>

#include "renderer/environment/environment_internal.h"

static const double pi = 3.14159265358979323846;

struct environment_light environment_light_make(const struct environment *environment,
                                                double rotation_deg, double intensity)
{
    double angle = rotation_deg * pi / 180;
    return (struct environment_light){.environment = environment,
                                      .cosine = cos(angle),
                                      .sine = sin(angle),
                                      .intensity = intensity};
}

static void to_map(const struct environment_light *light, const double world[3], double map[3])
{
    map[0] = light->cosine * world[0] - light->sine * world[2];
    map[1] = world[1];
    map[2] = light->sine * world[0] + light->cosine * world[2];
}

static void to_world(const struct environment_light *light, const double map[3], double world[3])
{
    world[0] = light->cosine * map[0] + light->sine * map[2];
    world[1] = map[1];
    world[2] = light->cosine * map[2] - light->sine * map[0];
}

void environment_light_radiance(const struct environment_light *light, const double direction[3],
                                double radiance[3])
{
    double turned[3], u, v;
    to_map(light, direction, turned);
    environment_coordinates(turned, &u, &v);
    environment_texels_look(&light->environment->radiance, u, v, radiance);
    for (int k = 0; k < 3; k++)
        radiance[k] *= light->intensity;
}

void environment_light_mean(const struct environment_light *light, double mean[3])
{
    for (int k = 0; k < 3; k++)
        mean[k] = light->environment->mean[k] * light->intensity;
}

/* Luminance of Rec.709; a channel alone must not be missed, so that no weight is below a tenth. */
static double weight_of(const float texel[3])
{
    return 0.2126 * (double)texel[0] + 0.7152 * (double)texel[1] + 0.1 * (double)texel[2];
}

/* The integral of what is linear between the middles of texels, over one of them: 1/8, 3/4, 1/8
 * along each side. So no direction with light has no chance. */
static double blurred_weight(const struct environment_texels *map, int x, int y)
{
    static const double shares[3] = {0.125, 0.75, 0.125};
    double sum = 0;
    for (int j = -1; j <= 1; j++) {
        int row = y + j < 0 ? 0 : y + j >= map->height ? map->height - 1 : y + j;
        for (int i = -1; i <= 1; i++) {
            int column = (x + i + map->width) % map->width;
            size_t at = (size_t)row * (size_t)map->width + (size_t)column;
            sum += shares[j + 1] * shares[i + 1] * weight_of(map->pixels + 3 * at);
        }
    }
    return sum;
}

/* From 0 to 1; without any weight all are alike. */
static void end_sums(double *sums, const double *weights, int count)
{
    double total = 0, sum = 0;
    for (int i = 0; i < count; i++)
        total += weights[i];
    for (int i = 0; i < count; i++) {
        sums[i] = total > 0 ? fmin(sum / total, 1) : (double)i / count;
        sum += weights[i];
    }
    sums[count] = 1;
}

/* Solid angle of a texel of the row [sr]. */
static double row_texel_sr(const struct environment_texels *map, int row)
{
    double top = cos(pi * row / map->height), bottom = cos(pi * (row + 1) / map->height);
    return 2 * pi / map->width * (top - bottom);
}

bool environment_make_tables(struct environment *environment, struct error *err)
{
    const struct environment_texels *map = &environment->radiance;
    size_t height = (size_t)map->height, width = (size_t)map->width;
    environment->rows = calloc(height + 1, sizeof *environment->rows);
    environment->columns = calloc(height * (width + 1), sizeof *environment->columns);
    double *weights = calloc(width, sizeof *weights), *sums = calloc(height, sizeof *sums);
    bool ok = environment->rows && environment->columns && weights && sums;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "tables of an environment");
    double total = 0;
    for (int y = 0; ok && y < map->height; y++) {
        double area = row_texel_sr(map, y);
        for (int x = 0; x < map->width; x++)
            sums[y] += weights[x] = area * blurred_weight(map, x, y);
        total += sums[y];
        end_sums(environment->columns + (size_t)y * (width + 1), weights, map->width);
    }
    for (int y = 0; ok && total <= 0 && y < map->height; y++)
        sums[y] = row_texel_sr(map, y);
    if (ok)
        end_sums(environment->rows, sums, map->height);
    free(weights);
    free(sums);
    return ok && environment_make_guides(environment, err);
}

/* About four steps for each, which are told apart by two comparisons. */
static int cells_for(int count)
{
    int cells = 1;
    while (4 * cells < count)
        cells *= 2;
    return cells;
}

static uint16_t *guide_steps(const double *sums, int count, int cells, uint16_t *guides)
{
    int step = 0;
    for (int cell = 0; cell < cells; cell++) {
        while (step + 1 < count && sums[step + 1] <= (double)cell / cells)
            step++;
        *guides++ = (uint16_t)step;
    }
    *guides++ = (uint16_t)(count - 1);
    return guides;
}

bool environment_make_guides(struct environment *environment, struct error *err)
{
    const struct environment_texels *map = &environment->radiance;
    const size_t height = (size_t)map->height, width = (size_t)map->width;
    environment->row_cells = cells_for(map->height);
    environment->column_cells = cells_for(map->width);
    size_t count = (size_t)environment->row_cells + 1;
    count += height * ((size_t)environment->column_cells + 1);
    uint16_t *at = environment->guides = malloc(count * sizeof *at);
    if (!at)
        return error_set(err, ERROR_NO_MEMORY, "guides of an environment");
    at = guide_steps(environment->rows, map->height, environment->row_cells, at);
    for (size_t y = 0; y < height; y++)
        at = guide_steps(environment->columns + y * (width + 1), map->width,
                         environment->column_cells, at);
    return true;
}

/* The last step that begins at or before u, and has a chance; *within: where u lies in it. guides:
 * of the sums' cells. */
static int find_step(const double *sums, const uint16_t *guides, int cells, double u,
                     double *within)
{
    const int cell = u < 1 ? (int)(u * cells) : cells - 1; /* exact, as the begins of cells */
    int low = guides[cell], high = guides[cell + 1] + 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (sums[middle] <= u)
            low = middle;
        else
            high = middle;
    }
    double begin = sums[low], end = sums[low + 1];
    *within = end > begin ? fmin(fmax((u - begin) / (end - begin), 0), 1) : 0.5;
    return low;
}

static double density_of(const struct environment *environment, int x, int y)
{
    const struct environment_texels *map = &environment->radiance;
    const double *columns = environment->columns + (size_t)y * ((size_t)map->width + 1);
    double row = environment->rows[y + 1] - environment->rows[y];
    double column = columns[x + 1] - columns[x];
    return row * column / row_texel_sr(map, y);
}

double environment_light_sample(const struct environment_light *light, const double u[2],
                                double direction[3])
{
    const struct environment *environment = light->environment;
    const struct environment_texels *map = &environment->radiance;
    double down, right, turned[3];
    const int row_cells = environment->row_cells, column_cells = environment->column_cells;
    int y = find_step(environment->rows, environment->guides, row_cells, u[1], &down);
    const uint16_t *guides =
        environment->guides + (row_cells + 1) + (size_t)y * (size_t)(column_cells + 1);
    int x = find_step(environment->columns + (size_t)y * ((size_t)map->width + 1), guides,
                      column_cells, u[0], &right);
    double top = cos(pi * y / map->height), bottom = cos(pi * (y + 1) / map->height);
    double cosine = top + (bottom - top) * down, sine = sqrt(fmax(1 - cosine * cosine, 0));
    double phi = 2 * pi * ((x + right) / map->width - 0.5);
    turned[0] = sine * sin(phi);
    turned[1] = cosine;
    turned[2] = -sine * cos(phi);
    to_world(light, turned, direction);
    return density_of(environment, x, y);
}

double environment_light_density(const struct environment_light *light, const double direction[3])
{
    const struct environment_texels *map = &light->environment->radiance;
    double turned[3], u, v;
    to_map(light, direction, turned);
    environment_coordinates(turned, &u, &v);
    int x = (int)(u * map->width), y = (int)(v * map->height);
    return density_of(light->environment, x < map->width ? x : map->width - 1,
                      y < map->height ? y : map->height - 1);
}
