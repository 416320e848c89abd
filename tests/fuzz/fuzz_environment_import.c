/* SPDX-License-Identifier: MIT */
/* Fuzz target: any bytes as an environment map. A map comes out that the renderer takes, or an
 * error that is not ours. */
#include <stdint.h>
#include <stdlib.h>

#include "renderer/environment/environment.h"
#include "renderer/environment/environment_import.h"
#include "renderer/image/image_header.h"

enum { PIXELS_MAX = 1 << 12 /* larger ones take long, and show no more */ };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const struct environment_import *import)
{
    struct error err = {0};
    struct environment *environment = environment_create(
        &(struct environment_desc){
            .pixels = import->pixels, .width = import->width, .height = import->height},
        &err);
    if (!environment && err.code != ERROR_NO_MEMORY)
        abort();
    environment_destroy(environment);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct image_header header;
    struct environment_import import;
    struct error err = {0};
    if (image_header_read(&header, data, size, NULL) && header.width_px <= 8192 &&
        header.height_px <= 4096 && header.width_px * header.height_px > PIXELS_MAX)
        return 0;
    if (environment_import(data, size, &import, &err))
        check(&import);
    else if (err.code == ERROR_NONE || err.code == ERROR_INTERNAL || import.pixels)
        abort();
    environment_import_finish(&import);
    return 0;
}
