/* SPDX-License-Identifier: MIT */
/* FLIP in tiles: each is converted with a border as wide as the filters, filtered along rows, then
 * along columns, and compared. Filters are separable, so a pixel costs a few hundred products. */
#include "renderer/accuracy/flip.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/accuracy/flip_color.h"
#include "renderer/accuracy/flip_kernels.h"
#include "renderer/accuracy/percentile.h"
#include "renderer/accuracy/sum.h"

enum {
    TILE_WIDTH_PX = 256, /* so that a tile's planes stay in the second-level cache */
    TILE_HEIGHT_PX = 64,
    OPPONENT_PLANES = 3,
    ROW_PLANES = FLIP_KERNEL_COUNT, /* one per kernel */
    /* after columns: three filtered opponent channels, then the features along x and y */
    FILTERED_X_EDGE = 3,
    FILTERED_Y_EDGE,
    FILTERED_X_POINT,
    FILTERED_Y_POINT,
    FILTERED_PLANES
};

/* Which opponent channel each kernel reads in the pass along rows. */
static const int row_source[FLIP_KERNEL_COUNT] = {
    [FLIP_ACHROMATIC] = 0, [FLIP_RED_GREEN] = 1, [FLIP_BLUE_YELLOW_1] = 2, [FLIP_BLUE_YELLOW_2] = 2,
    [FLIP_SMOOTH] = 0,     [FLIP_EDGE] = 0,      [FLIP_POINT] = 0,
};

/* The pass along columns: plane of the first pass, kernel, plane it is added to. */
static const struct column_step {
    enum flip_kernel rows, columns;
    int target;
} column_steps[] = {
    {FLIP_ACHROMATIC, FLIP_ACHROMATIC, 0},       {FLIP_RED_GREEN, FLIP_RED_GREEN, 1},
    {FLIP_BLUE_YELLOW_1, FLIP_BLUE_YELLOW_1, 2}, {FLIP_BLUE_YELLOW_2, FLIP_BLUE_YELLOW_2, 2},
    {FLIP_EDGE, FLIP_SMOOTH, FILTERED_X_EDGE},   {FLIP_SMOOTH, FLIP_EDGE, FILTERED_Y_EDGE},
    {FLIP_POINT, FLIP_SMOOTH, FILTERED_X_POINT}, {FLIP_SMOOTH, FLIP_POINT, FILTERED_Y_POINT},
};

/* One image's planes of the tile at hand, rows of `stride` floats. */
struct side {
    const struct image *image;
    float *opponent[OPPONENT_PLANES]; /* tile and border on all sides */
    float *rows[ROW_PLANES];          /* tile and border above and below */
    float *filtered[FILTERED_PLANES]; /* tile */
};

struct work {
    const struct flip_desc *desc;
    struct flip *flip;
    struct flip_color color;
    struct flip_kernels kernels;
    struct side sides[2]; /* image, reference */
    float *memory;        /* owned; of all planes */
    float *map;           /* borrowed or owned by the caller; [height][width] */
    int border;
    size_t stride;
    int x, y, width, height; /* of the tile */
    double gain;             /* of this exposure */
};

/* ---- colours ---- */

/* False where a value is not finite; rgb is black then. */
static bool read_pixel(const struct image *image, int x, int y, float rgb[3])
{
    size_t pixel = (size_t)y * (size_t)image->width_px + (size_t)x;
    const float *in = (const float *)image->pixels + pixel * (size_t)image->channels;
    bool is_grey = image->channels < 3;
    for (int i = 0; i < 3; i++)
        rgb[i] = in[is_grey ? 0 : i];
    if (isfinite(rgb[0]) && isfinite(rgb[1]) && isfinite(rgb[2]))
        return true;
    rgb[0] = rgb[1] = rgb[2] = 0;
    return false;
}

static int clamp_index(int index, int count)
{
    return index < 0 ? 0 : index < count ? index : count - 1;
}

static float shown_value(const struct work *work, float value)
{
    if (!(value > 0))
        return 0;
    if (!work->desc->is_hdr)
        return fminf(value, 1);
    return (float)flip_tone_curve((double)value * work->gain);
}

/* The tile and its border in opponent space; outside the image its nearest pixel is repeated. */
static void load_tile(const struct work *work, const struct side *side)
{
    int border = work->border;
    for (int row = 0; row < work->height + 2 * border; row++) {
        int y = clamp_index(work->y + row - border, side->image->height_px);
        size_t start = (size_t)row * work->stride;
        for (int column = 0; column < work->width + 2 * border; column++) {
            int x = clamp_index(work->x + column - border, side->image->width_px);
            float rgb[3], opponent[3];
            read_pixel(side->image, x, y, rgb);
            for (int i = 0; i < 3; i++)
                rgb[i] = shown_value(work, rgb[i]);
            flip_opponent_from_linear(rgb, opponent);
            for (int i = 0; i < 3; i++)
                side->opponent[i][start + (size_t)column] = opponent[i];
        }
    }
}

/* ---- filters ---- */

static void add_scaled(float *restrict to, const float *restrict from, float weight, int count)
{
    for (int i = 0; i < count; i++)
        to[i] += weight * from[i];
}

static void filter_rows(const struct work *work, const struct side *side)
{
    for (int k = 0; k < FLIP_KERNEL_COUNT; k++) {
        int radius = work->kernels.radius[k];
        for (int row = 0; row < work->height + 2 * work->border; row++) {
            float *to = side->rows[k] + (size_t)row * work->stride;
            const float *from = side->opponent[row_source[k]] + (size_t)row * work->stride;
            memset(to, 0, (size_t)work->width * sizeof *to);
            for (int i = -radius; i <= radius; i++)
                add_scaled(to, from + work->border + i, work->kernels.weights[k][i + radius],
                           work->width);
        }
    }
}

static void filter_columns(const struct work *work, const struct side *side)
{
    size_t plane = (size_t)work->height * work->stride;
    for (int i = 0; i < FILTERED_PLANES; i++)
        memset(side->filtered[i], 0, plane * sizeof(float));
    for (size_t s = 0; s < sizeof column_steps / sizeof *column_steps; s++) {
        const struct column_step *step = &column_steps[s];
        int radius = work->kernels.radius[step->columns];
        const float *weights = work->kernels.weights[step->columns];
        for (int row = 0; row < work->height; row++)
            for (int i = -radius; i <= radius; i++)
                add_scaled(side->filtered[step->target] + (size_t)row * work->stride,
                           side->rows[step->rows] + (size_t)(row + work->border + i) * work->stride,
                           weights[i + radius], work->width);
    }
}

/* ---- differences ---- */

/* Of the lengths of both gradients, edges or points: Andersson 2020, equation 9 and before. */
static float feature_distance(const struct side *sides, int x_plane, int y_plane, size_t at)
{
    float length[2];
    for (int i = 0; i < 2; i++) {
        float dx = sides[i].filtered[x_plane][at], dy = sides[i].filtered[y_plane][at];
        length[i] = sqrtf(dx * dx + dy * dy) / 116; /* luminance in [0, 1] */
    }
    return fabsf(length[0] - length[1]);
}

/* Equation 10: features raise what the colours alone would say. */
static float pixel_difference(const struct work *work, size_t at)
{
    const struct side *sides = work->sides;
    float opponent[2][3];
    for (int i = 0; i < 2; i++)
        for (int c = 0; c < 3; c++)
            opponent[i][c] = sides[i].filtered[c][at];
    float color = flip_color_distance(&work->color, opponent[0], opponent[1]);
    if (!(color > 0))
        return 0;
    float edge = feature_distance(sides, FILTERED_X_EDGE, FILTERED_Y_EDGE, at);
    float point = feature_distance(sides, FILTERED_X_POINT, FILTERED_Y_POINT, at);
    float feature = sqrtf((float)M_SQRT1_2 * fmaxf(edge, point));
    return powf(color, 1 - fminf(feature, 1));
}

static void measure_tile(const struct work *work)
{
    for (int i = 0; i < 2; i++) {
        load_tile(work, &work->sides[i]);
        filter_rows(work, &work->sides[i]);
        filter_columns(work, &work->sides[i]);
    }
    size_t width_px = (size_t)work->desc->image->width_px;
    for (int row = 0; row < work->height; row++) {
        float *map = work->map + (size_t)(work->y + row) * width_px + (size_t)work->x;
        for (int column = 0; column < work->width; column++) {
            size_t at = (size_t)row * work->stride + (size_t)column;
            map[column] = fmaxf(map[column], pixel_difference(work, at));
        }
    }
}

static int min_int(int a, int b)
{
    return a < b ? a : b;
}

static void measure_tiles(struct work *work)
{
    const struct image *image = work->desc->image;
    const struct flip *flip = work->flip;
    int count = flip->exposures ? flip->exposures : 1;
    double step = count > 1 ? (flip->last_exposure_ev - flip->first_exposure_ev) / (count - 1) : 0;
    for (work->y = 0; work->y < image->height_px; work->y += TILE_HEIGHT_PX)
        for (work->x = 0; work->x < image->width_px; work->x += TILE_WIDTH_PX) {
            work->width = min_int(TILE_WIDTH_PX, image->width_px - work->x);
            work->height = min_int(TILE_HEIGHT_PX, image->height_px - work->y);
            for (int i = 0; i < count; i++) {
                work->gain = exp2(flip->first_exposure_ev + step * i);
                measure_tile(work);
            }
        }
}

/* ---- exposures ---- */

static void luminances_of(const struct image *image, float *luminances)
{
    for (int y = 0; y < image->height_px; y++)
        for (int x = 0; x < image->width_px; x++) {
            float rgb[3];
            read_pixel(image, x, y, rgb);
            for (int i = 0; i < 3; i++)
                rgb[i] = fmaxf(rgb[i], 0);
            *luminances++ = flip_luminance(rgb);
        }
}

/* Largest and median luminance; the median is that of lit pixels when most are black. False when
 * there is no light at all. luminances: scratch of one float per pixel. */
static bool find_range(const struct image *image, float *luminances, uint64_t *counts,
                       double *largest, double *median)
{
    size_t count = (size_t)image->width_px * (size_t)image->height_px, dark = 0;
    luminances_of(image, luminances);
    *largest = 0;
    for (size_t i = 0; i < count; i++) {
        dark += !(luminances[i] > 0);
        *largest = fmax(*largest, (double)luminances[i]);
    }
    if (dark == count)
        return false;
    uint64_t rank = dark > count / 2 ? dark + (count - dark) / 2 : count / 2;
    *median = percentile_select(luminances, count, rank < count ? rank + 1 : count, counts);
    return *median > 0;
}

/* Andersson 2021, section 3.1. */
static void find_exposures(struct work *work, uint64_t *counts)
{
    double largest, median;
    struct flip *flip = work->flip;
    flip->exposures = 2;
    if (!find_range(work->desc->reference, work->map, counts, &largest, &median) &&
        !find_range(work->desc->image, work->map, counts, &largest, &median))
        return; /* both are black: any exposure will do */
    double knee = flip_tone_curve_knee();
    flip->first_exposure_ev = log2(knee / largest);
    flip->last_exposure_ev = log2(knee / median);
    double stops = ceil(flip->last_exposure_ev - flip->first_exposure_ev);
    flip->exposures = (int)fmin(fmax(stops, 2), FLIP_EXPOSURES_MAX);
}

/* ---- the whole ---- */

static bool work_allocate(struct work *work, struct error *err)
{
    int border = work->border = work->kernels.largest_radius;
    size_t tall = (size_t)(TILE_HEIGHT_PX + 2 * border);
    work->stride = (size_t)(TILE_WIDTH_PX + 2 * border);
    size_t bordered = tall * work->stride, inner = TILE_HEIGHT_PX * work->stride;
    size_t side = (OPPONENT_PLANES + ROW_PLANES) * bordered + FILTERED_PLANES * inner;
    float *next = work->memory = calloc(2 * side, sizeof *next);
    if (!next)
        return error_set(err, ERROR_NO_MEMORY, "a tile of FLIP");
    for (int i = 0; i < 2; i++) {
        struct side *s = &work->sides[i];
        for (int k = 0; k < OPPONENT_PLANES; k++, next += bordered)
            s->opponent[k] = next;
        for (int k = 0; k < ROW_PLANES; k++, next += bordered)
            s->rows[k] = next;
        for (int k = 0; k < FILTERED_PLANES; k++, next += inner)
            s->filtered[k] = next;
    }
    return true;
}

/* Values over the pixels that are finite; the others become NaN for the percentile, then 1. */
static void summarise(struct work *work, uint64_t *counts)
{
    const struct image *image = work->desc->image, *reference = work->desc->reference;
    size_t width = (size_t)image->width_px, count = width * (size_t)image->height_px;
    struct flip *flip = work->flip;
    struct sum total = {0};
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % width), y = (int)(i / width);
        float rgb[3];
        if (!read_pixel(image, x, y, rgb) || !read_pixel(reference, x, y, rgb)) {
            flip->nonfinite_pixels++;
            work->map[i] = NAN;
            continue;
        }
        sum_add(&total, (double)work->map[i]);
        if ((double)work->map[i] > flip->max) {
            flip->max = (double)work->map[i];
            flip->max_x = x;
            flip->max_y = y;
        }
    }
    uint64_t finite = count - flip->nonfinite_pixels;
    flip->mean = finite ? sum_value(&total) / (double)finite : 0;
    flip->p99 = percentile_select(work->map, count, percentile_rank(finite, 100), counts);
    for (size_t i = 0; i < count; i++)
        if (isnan(work->map[i]))
            work->map[i] = 1;
}

static bool check_desc(const struct flip_desc *desc, double *pixels_per_degree, struct error *err)
{
    if (!image_pair_check(desc->image, desc->reference, err))
        return false;
    *pixels_per_degree = desc->pixels_per_degree;
    if (*pixels_per_degree == 0)
        *pixels_per_degree = FLIP_PIXELS_PER_DEGREE;
    if (!(*pixels_per_degree >= 1 && *pixels_per_degree <= 1000))
        return error_set(err, ERROR_INVALID_REQUEST, "%g pixels per degree, must be from 1 to 1000",
                         desc->pixels_per_degree);
    return true;
}

bool flip_measure(const struct flip_desc *desc, struct flip *flip, struct image *map,
                  struct error *err)
{
    struct work work = {.desc = desc, .flip = flip};
    struct image own_map = {0};
    uint64_t *counts = NULL;
    bool is_done = false;
    memset(flip, 0, sizeof *flip);
    if (map)
        memset(map, 0, sizeof *map);
    if (!check_desc(desc, &flip->pixels_per_degree, err) ||
        !image_init(&own_map, desc->image->width_px, desc->image->height_px, 1, IMAGE_F32, err) ||
        !flip_kernels_init(&work.kernels, flip->pixels_per_degree, err) ||
        !work_allocate(&work, err))
        goto done;
    counts = malloc(PERCENTILE_CODES * sizeof *counts);
    if (!counts) {
        error_set(err, ERROR_NO_MEMORY, "FLIP");
        goto done;
    }
    work.map = own_map.pixels;
    work.sides[0].image = desc->image;
    work.sides[1].image = desc->reference;
    flip_color_init(&work.color);
    if (desc->is_hdr) {
        find_exposures(&work, counts);
        memset(work.map, 0, image_size_bytes(&own_map)); /* it was the scratch */
    }
    measure_tiles(&work);
    summarise(&work, counts);
    is_done = true;
    if (map) {
        *map = own_map;
        own_map = (struct image){0};
    }
done:
    free(counts);
    free(work.memory);
    flip_kernels_finish(&work.kernels);
    image_finish(&own_map);
    return is_done;
}
