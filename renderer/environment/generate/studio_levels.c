/* SPDX-License-Identifier: MIT */
/* Writes the table of renderer/environment/studio_levels.h to standard output. Runs when the
 * program is built. */
#include <stdio.h>
#include <stdlib.h>

#include "renderer/environment/studio_levels.h"

static void print(struct environment_map map)
{
    for (size_t i = 0; i < (size_t)map.width * (size_t)map.height; i++)
        printf("%a,\n", (double)map.pixels[3 * i]);
}

int main(void)
{
    struct environment_texels radiance;
    struct error err = {0};
    if (!studio_radiance_init(&radiance, &err))
        goto fail;
    const struct environment_desc desc = {radiance.pixels, radiance.width, radiance.height};
    struct environment *studio = environment_create(&desc, &err);
    free(radiance.pixels);
    if (!studio)
        goto fail;
    printf("/* Generated; do not edit. */\n#include \"renderer/environment/studio_levels.h\"\n"
           "const float studio_levels[] = {\n");
    print(environment_diffuse_map(studio));
    for (int i = 1; i < ENVIRONMENT_LEVELS; i++)
        print(environment_specular_map(studio, i));
    printf("};\n");
    environment_destroy(studio);
    return fflush(stdout) == 0 && !ferror(stdout) ? EXIT_SUCCESS : EXIT_FAILURE;

fail:
    fprintf(stderr, "studio_levels: %s\n", err.message);
    return EXIT_FAILURE;
}
