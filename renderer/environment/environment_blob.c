/* SPDX-License-Identifier: MIT */
/* The header: eight letters, the version, columns and rows, and zeros. */
#include "renderer/environment/environment_blob.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/environment/environment_internal.h"

static const char letters[8] = {'V', 'I', 'T', 'R', 'E', 'N', 'V', 'M'};

/* Means of a map, summed up in f32, may exceed its texels by their rounding. */
#define MEAN_MAX (1.01f * ENVIRONMENT_RADIANCE_MAX)

struct header {
    char letters[8];
    uint32_t version, width, height, zeros[3];
};
_Static_assert(sizeof(struct header) == ENVIRONMENT_BLOB_HEADER_BYTES, "the header has no gaps");

/* ---- writing ---- */

static struct environment_blob_part part_of(const struct environment_texels *map)
{
    return (struct environment_blob_part){
        map->pixels, 3 * sizeof *map->pixels * (size_t)map->width * (size_t)map->height};
}

void environment_blob_parts(const struct environment *environment,
                            uint8_t bytes[ENVIRONMENT_BLOB_HEADER_BYTES],
                            struct environment_blob_part parts[ENVIRONMENT_BLOB_ARRAYS])
{
    size_t width = (size_t)environment->radiance.width;
    size_t height = (size_t)environment->radiance.height;
    struct header header = {
        .version = ENVIRONMENT_BLOB_VERSION, .width = (uint32_t)width, .height = (uint32_t)height};
    memcpy(header.letters, letters, sizeof letters);
    memcpy(bytes, &header, sizeof header);
    parts[0] =
        (struct environment_blob_part){environment->rows, (height + 1) * sizeof *environment->rows};
    parts[1] = (struct environment_blob_part){environment->columns,
                                              height * (width + 1) * sizeof *environment->columns};
    parts[2] = part_of(&environment->radiance);
    parts[3] = part_of(&environment->diffuse);
    for (int i = 0; i < ENVIRONMENT_LEVELS; i++)
        parts[4 + i] = part_of(&environment->specular[i]);
}

/* ---- reading ---- */

static bool read_header(struct header *header, const void *bytes, size_t size_bytes,
                        struct error *err)
{
    if (size_bytes < sizeof *header)
        return error_set(err, ERROR_INVALID_ENVIRONMENT, "a blob of %zu bytes has no header",
                         size_bytes);
    memcpy(header, bytes, sizeof *header);
    if (memcmp(header->letters, letters, sizeof letters) != 0 ||
        header->version != ENVIRONMENT_BLOB_VERSION)
        return error_set(err, ERROR_INVALID_ENVIRONMENT, "no blob of version %d",
                         ENVIRONMENT_BLOB_VERSION);
    return (header->width >= 2 && header->width <= ENVIRONMENT_WIDTH_MAX && header->height >= 1 &&
            header->height <= ENVIRONMENT_HEIGHT_MAX) ||
           error_set(err, ERROR_INVALID_ENVIRONMENT, "a blob of %u x %u texels", header->width,
                     header->height);
}

static float *take_map(struct environment_texels *map, int width, int height, float *at)
{
    *map = (struct environment_texels){.pixels = at, .width = width, .height = height};
    return at + 3 * (size_t)width * (size_t)height;
}

/* Points the arrays into the blob. */
static void take_arrays(struct environment *environment, const struct header *header, void *bytes)
{
    size_t width = header->width, height = header->height;
    environment->rows = (double *)bytes + sizeof *header / sizeof(double);
    environment->columns = environment->rows + height + 1;
    float *at = (float *)(environment->columns + height * (width + 1));
    at = take_map(&environment->radiance, (int)width, (int)height, at);
    at = take_map(&environment->diffuse, ENVIRONMENT_IRRADIANCE_WIDTH,
                  ENVIRONMENT_IRRADIANCE_WIDTH / 2, at);
    for (int i = 0; i < ENVIRONMENT_LEVELS; i++)
        at = take_map(&environment->specular[i], ENVIRONMENT_LEVEL_WIDTH >> i,
                      ENVIRONMENT_LEVEL_WIDTH / 2 >> i, at);
}

/* Whether they rise from 0 or more to 1, as samples are looked up in them. */
static bool are_sums(const double *sums, size_t count)
{
    bool is_good = sums[0] >= 0 && sums[count] == 1;
    for (size_t i = 0; i < count; i++)
        is_good &= sums[i] <= sums[i + 1];
    return is_good;
}

static bool is_map(const struct environment_texels *map, float most)
{
    size_t count = 3 * (size_t)map->width * (size_t)map->height;
    bool is_good = true;
    for (size_t i = 0; i < count; i++)
        is_good &= map->pixels[i] >= 0 && map->pixels[i] <= most;
    return is_good;
}

static bool is_sound(const struct environment *environment)
{
    size_t width = (size_t)environment->radiance.width;
    size_t height = (size_t)environment->radiance.height;
    bool is_good = are_sums(environment->rows, height) &&
                   is_map(&environment->radiance, ENVIRONMENT_RADIANCE_MAX) &&
                   is_map(&environment->diffuse, MEAN_MAX);
    for (size_t y = 0; is_good && y < height; y++)
        is_good = are_sums(environment->columns + y * (width + 1), width);
    for (int i = 0; is_good && i < ENVIRONMENT_LEVELS; i++)
        is_good = is_map(&environment->specular[i], MEAN_MAX);
    return is_good;
}

static size_t size_of(const struct header *header)
{
    size_t texels = (size_t)header->width * header->height, maps = 3 * texels;
    size_t sums = header->height + 1 + texels + header->height;
    maps += 3 * (size_t)ENVIRONMENT_IRRADIANCE_WIDTH * ENVIRONMENT_IRRADIANCE_WIDTH / 2;
    for (int i = 0; i < ENVIRONMENT_LEVELS; i++)
        maps +=
            3 * ((size_t)ENVIRONMENT_LEVEL_WIDTH >> i) * ((size_t)ENVIRONMENT_LEVEL_WIDTH / 2 >> i);
    return sizeof *header + sums * sizeof(double) + maps * sizeof(float);
}

struct environment *environment_blob_open(void *bytes, size_t size_bytes, struct error *err)
{
    struct header header;
    if (!read_header(&header, bytes, size_bytes, err))
        return NULL;
    if (size_bytes != size_of(&header)) {
        error_set(err, ERROR_INVALID_ENVIRONMENT,
                  "a blob of %zu bytes does not hold %u x %u texels", size_bytes, header.width,
                  header.height);
        return NULL;
    }
    struct environment *environment = calloc(1, sizeof *environment);
    if (!environment) {
        error_set(err, ERROR_NO_MEMORY, "environment");
        return NULL;
    }
    environment->is_borrowed = true;
    take_arrays(environment, &header, bytes);
    if (!is_sound(environment)) {
        error_set(err, ERROR_INVALID_ENVIRONMENT, "a blob with numbers that no map has");
    } else if (environment_make_guides(environment, err)) {
        environment_find_mean(environment);
        return environment;
    }
    environment_destroy(environment);
    return NULL;
}
