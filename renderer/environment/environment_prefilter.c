/* SPDX-License-Identifier: MIT */
/* The maps that light without samples. Sums over a cosine run over the texels of a smaller map.
 * Over lobes of GGX: drawn directions, each a mean over its share of the sphere (Krivanek and
 * Colbert 2008, "Real-time Shading with Filtered Importance Sampling"). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/environment/environment_internal.h"

static const double pi = 3.14159265358979323846;

enum {
    SOURCE_WIDTH = 128, /* of the map whose texels the diffuse sums run over */
    SOURCE_HEIGHT = SOURCE_WIDTH / 2,
    /* Of a texel of the first level that has a lobe; wider ones have twice as many from level to
     * level, and few texels. The levels of a studio with soft boxes are then 0.4 to 2 % off. */
    LOBE_SAMPLES_FIRST = 64,
    LOBE_SAMPLES_MOST = LOBE_SAMPLES_FIRST << (ENVIRONMENT_LEVELS - 2),
};

/* Means over the texels of a map of another size, by solid angle. */
static void resample(const struct environment_texels *from, struct environment_texels *to)
{
    int across = (from->width + to->width - 1) / to->width;
    int down = (from->height + to->height - 1) / to->height;
    for (int y = 0; y < to->height; y++)
        for (int x = 0; x < to->width; x++) {
            double sum[3] = {0}, weights = 0, texel[3];
            for (int i = 0; i < across * down; i++) {
                int column = i % across, row = i / across;
                double u = (x + (column + 0.5) / across) / to->width;
                double v = (y + (row + 0.5) / down) / to->height, weight = sin(pi * v);
                environment_texels_look(from, u, v, texel);
                weights += weight;
                for (int k = 0; k < 3; k++)
                    sum[k] += weight * texel[k];
            }
            float *out = to->pixels + 3 * ((size_t)y * (size_t)to->width + (size_t)x);
            for (int k = 0; k < 3; k++)
                out[k] = (float)(sum[k] / weights);
        }
}

struct source { /* a small map as directions and weights */
    float (*directions)[3];
    float (*light)[3]; /* times the texel's solid angle */
    float *areas;      /* that [sr] */
    int count;
};

static void source_finish(struct source *source)
{
    free(source->directions);
    free(source->light);
    free(source->areas);
}

static bool source_init(struct source *source, const struct environment_texels *from,
                        struct error *err)
{
    struct environment_texels small;
    if (!environment_texels_init(&small, SOURCE_WIDTH, SOURCE_WIDTH / 2, err))
        return false;
    resample(from, &small);
    source->count = SOURCE_WIDTH * SOURCE_WIDTH / 2;
    source->directions = calloc((size_t)source->count, sizeof *source->directions);
    source->light = calloc((size_t)source->count, sizeof *source->light);
    source->areas = calloc((size_t)source->count, sizeof *source->areas);
    bool ok = source->directions && source->light && source->areas;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "irradiance of an environment");
    for (int i = 0; ok && i < source->count; i++) {
        int x = i % SOURCE_WIDTH, y = i / SOURCE_WIDTH;
        double direction[3], u = (x + 0.5) / SOURCE_WIDTH, v = (y + 0.5) / SOURCE_HEIGHT;
        double step = pi / SOURCE_HEIGHT;
        double area = 2 * pi / SOURCE_WIDTH * (cos(y * step) - cos((y + 1) * step));
        environment_direction(u, v, direction);
        source->areas[i] = (float)area;
        for (int k = 0; k < 3; k++) {
            source->directions[i][k] = (float)direction[k];
            source->light[i][k] = (float)area * small.pixels[3 * (size_t)i + (size_t)k];
        }
    }
    free(small.pixels);
    return ok;
}

/* Divided by the same sum over a white sky, so that a constant map comes out exactly. */
static void mean_by_cosine(const struct source *source, const float normal[3], float out[3])
{
    float sum[3] = {0};
    float weights = 0;
    for (int i = 0; i < source->count; i++) {
        const float *d = source->directions[i], *light = source->light[i];
        float cosine = normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2];
        cosine = cosine > 0 ? cosine : 0;
        weights += cosine * source->areas[i];
        for (int k = 0; k < 3; k++)
            sum[k] += cosine * light[k];
    }
    for (int k = 0; k < 3; k++)
        out[k] = sum[k] / weights;
}

static bool make_diffuse(struct environment *environment, struct error *err)
{
    struct environment_texels *to = &environment->diffuse;
    const int width = ENVIRONMENT_IRRADIANCE_WIDTH, height = width / 2;
    struct source source = {0};
    bool ok = environment_texels_init(to, width, height, err) &&
              source_init(&source, &environment->radiance, err);
    for (int i = 0; ok && i < width * height; i++) {
        double normal[3];
        int x = i % width, y = i / width;
        environment_direction((x + 0.5) / width, (y + 0.5) / height, normal);
        mean_by_cosine(&source,
                       (const float[3]){(float)normal[0], (float)normal[1], (float)normal[2]},
                       to->pixels + 3 * (size_t)i);
    }
    source_finish(&source);
    return ok;
}

/* Radiance in a chain of maps, each half as large as the one before, between two of them. */
static void look_at_level(const struct environment_texels *chain, double lod,
                          const double direction[3], double out[3])
{
    double u, v, finer[3], coarser[3], last = ENVIRONMENT_LEVELS - 1;
    lod = fmin(fmax(lod, 0), last);
    int level = lod < last ? (int)lod : ENVIRONMENT_LEVELS - 2;
    environment_coordinates(direction, &u, &v);
    environment_texels_look(&chain[level], u, v, finer);
    environment_texels_look(&chain[level + 1], u, v, coarser);
    for (int k = 0; k < 3; k++)
        out[k] = finer[k] + (coarser[k] - finer[k]) * (lod - level);
}

/* Two directions across n: Duff et al. 2017, "Building an Orthonormal Basis, Revisited". */
static void find_frame(const double n[3], double s[3], double t[3])
{
    double sign = n[2] < 0 ? -1 : 1, a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
    s[0] = 1 + sign * n[0] * n[0] * a, s[1] = sign * b, s[2] = -sign * n[0];
    t[0] = b, t[1] = sign + n[1] * n[1] * a, t[2] = -n[1];
}

static double radical_inverse(uint32_t bits)
{
    bits = (bits << 16) | (bits >> 16);
    bits = ((bits & 0x55555555u) << 1) | ((bits & 0xAAAAAAAAu) >> 1);
    bits = ((bits & 0x33333333u) << 2) | ((bits & 0xCCCCCCCCu) >> 2);
    bits = ((bits & 0x0F0F0F0Fu) << 4) | ((bits & 0xF0F0F0F0u) >> 4);
    bits = ((bits & 0x00FF00FFu) << 8) | ((bits & 0xFF00FF00u) >> 8);
    return (double)bits / 4294967296.0;
}

/* A direction of the lobe around +Z with the viewer there: n.h by the distribution, mirrored. */
struct lobe_sample {
    double l[3], lod;
};

static int draw_lobe(double alpha, uint32_t draws, struct lobe_sample samples[LOBE_SAMPLES_MOST])
{
    /* the largest texel's, at the horizon */
    double step = 2 * pi / ENVIRONMENT_LEVEL_WIDTH, texel_sr = step * step;
    int count = 0;
    for (uint32_t i = 0; i < draws; i++) {
        double u = (i + 0.5) / draws, phi = 2 * pi * radical_inverse(i), a2 = alpha * alpha;
        double square = (1 - u) / (1 + (a2 - 1) * u), cosine = sqrt(square); /* n.h */
        double f = square * (a2 - 1) + 1, density = a2 / (pi * f * f) / 4;   /* D n.h / (4 v.h) */
        double sine = 2 * cosine * sqrt(1 - square);
        struct lobe_sample sample = {.l = {sine * cos(phi), sine * sin(phi), 2 * square - 1}};
        if (sample.l[2] <= 0)
            continue;
        sample.lod = 0.5 * log2(1 / (draws * density * texel_sr));
        samples[count++] = sample;
    }
    return count;
}

static void filter_texel(const struct environment_texels *chain, const double n[3],
                         const struct lobe_sample *samples, int count, float out[3])
{
    double s[3], t[3], sum[3] = {0}, weights = 0, radiance[3];
    find_frame(n, s, t);
    for (int i = 0; i < count; i++) {
        const double *l = samples[i].l;
        double direction[3];
        for (int k = 0; k < 3; k++)
            direction[k] = l[0] * s[k] + l[1] * t[k] + l[2] * n[k];
        look_at_level(chain, samples[i].lod, direction, radiance);
        weights += l[2];
        for (int k = 0; k < 3; k++)
            sum[k] += l[2] * radiance[k];
    }
    for (int k = 0; k < 3; k++)
        out[k] = (float)(sum[k] / weights);
}

static void filter_level(const struct environment_texels *chain, int level,
                         struct environment_texels *to)
{
    struct lobe_sample samples[LOBE_SAMPLES_MOST];
    double roughness = (double)level / (ENVIRONMENT_LEVELS - 1);
    int count = draw_lobe(roughness * roughness, LOBE_SAMPLES_FIRST << (level - 1), samples);
    for (int i = 0; i < to->width * to->height; i++) {
        double n[3];
        int x = i % to->width, y = i / to->width;
        environment_direction((x + 0.5) / to->width, (y + 0.5) / to->height, n);
        filter_texel(chain, n, samples, count, to->pixels + 3 * (size_t)i);
    }
}

static bool make_specular(struct environment *environment, struct error *err)
{
    struct environment_texels chain[ENVIRONMENT_LEVELS] = {0};
    struct environment_texels *levels = environment->specular;
    bool ok = true;
    for (int i = 0; ok && i < ENVIRONMENT_LEVELS; i++) {
        int width = ENVIRONMENT_LEVEL_WIDTH >> i;
        ok = environment_texels_init(&chain[i], width, width / 2, err) &&
             environment_texels_init(&levels[i], width, width / 2, err);
        if (ok)
            resample(i ? &chain[i - 1] : &environment->radiance, &chain[i]);
    }
    if (ok)
        memcpy(levels[0].pixels, chain[0].pixels,
               3 * sizeof *chain[0].pixels * (size_t)chain[0].width * (size_t)chain[0].height);
    for (int i = 1; ok && i < ENVIRONMENT_LEVELS; i++)
        filter_level(chain, i, &levels[i]);
    for (int i = 0; i < ENVIRONMENT_LEVELS; i++)
        free(chain[i].pixels);
    return ok;
}

bool environment_prefilter(struct environment *environment, struct error *err)
{
    return make_diffuse(environment, err) && make_specular(environment, err);
}
