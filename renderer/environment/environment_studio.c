/* SPDX-License-Identifier: MIT */
/* The studio with the levels that were summed up when the program was built: their sums take twenty
 * times as long as all else. */
#include <stdlib.h>
#include <string.h>

#include "renderer/environment/studio_levels.h"

static bool spread(struct environment_texels *to, int width, const float **numbers,
                   struct error *err)
{
    if (!environment_texels_init(to, width, width / 2, err))
        return false;
    size_t count = (size_t)to->width * (size_t)to->height;
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < 3; k++)
            to->pixels[3 * i + k] = (*numbers)[i];
    *numbers += count;
    return true;
}

struct environment *environment_create_studio(struct error *err)
{
    struct environment *studio = calloc(1, sizeof *studio);
    const float *numbers = studio_levels;
    if (!studio) {
        error_set(err, ERROR_NO_MEMORY, "studio");
        return NULL;
    }
    struct environment_texels *first = &studio->specular[0];
    bool ok =
        studio_radiance_init(&studio->radiance, err) && environment_make_tables(studio, err) &&
        environment_texels_init(first, ENVIRONMENT_LEVEL_WIDTH, ENVIRONMENT_LEVEL_WIDTH / 2, err) &&
        spread(&studio->diffuse, ENVIRONMENT_IRRADIANCE_WIDTH, &numbers, err);
    for (int i = 1; ok && i < ENVIRONMENT_LEVELS; i++)
        ok = spread(&studio->specular[i], ENVIRONMENT_LEVEL_WIDTH >> i, &numbers, err);
    if (!ok) {
        environment_destroy(studio);
        return NULL;
    }
    memcpy(first->pixels, studio->radiance.pixels,
           3 * sizeof *first->pixels * (size_t)first->width * (size_t)first->height);
    return studio;
}
