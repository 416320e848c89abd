/* SPDX-License-Identifier: MIT */
/* Fuzz target: any bytes as an upload. A scene comes out that opens, or an error that is not ours.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/import/import.h"
#include "renderer/scene/scene.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    /* "other.bin" is there to be named by a URI; the upload itself is its content */
    const struct scene_file files[] = {{"scene.gltf", data, size}, {"other.bin", data, size}};
    const struct scene_import_desc desc = {
        .files = files, .file_count = 2, .max_blob_bytes = 16 << 20, .max_image_pixels = 1 << 16};
    struct error err = {0};
    struct scene scene;
    void *blob;
    size_t blob_bytes;
    bool is_imported = scene_import(&desc, &blob, &blob_bytes, &err);
    if (is_imported ? !scene_open(&scene, blob, blob_bytes, &err)
                    : err.code == ERROR_NONE || err.code == ERROR_INTERNAL)
        abort();
    free(blob);
    return 0;
}
