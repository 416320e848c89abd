/* SPDX-License-Identifier: MIT */
/* Fuzz target: any bytes as a scene of another format than glTF; the first byte chooses which. A
 * scene comes out that opens, or an error that is not ours. */
#include <stdint.h>
#include <stdlib.h>

#include "renderer/import/import.h"
#include "renderer/scene/scene.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    enum scene_format format = SCENE_FORMAT_GLTF;
    static const struct {
        uint8_t letter;
        enum scene_format format;
    } formats[] = {{'o', SCENE_FORMAT_OBJ},
                   {'p', SCENE_FORMAT_PLY},
                   {'s', SCENE_FORMAT_STL},
                   {'i', SCENE_FORMAT_INVENTOR}};
    for (size_t i = 0; size > 0 && i < sizeof formats / sizeof *formats; i++)
        if (data[0] == formats[i].letter)
            format = formats[i].format;
    if (format == SCENE_FORMAT_GLTF || !scene_format_describe(format)->is_built)
        return 0;
    /* "m.mtl" is there to be named */
    const char *name = format == SCENE_FORMAT_OBJ   ? "scene.obj"
                       : format == SCENE_FORMAT_PLY ? "scene.ply"
                       : format == SCENE_FORMAT_STL ? "scene.stl"
                                                    : "scene.iv";
    const struct scene_file files[] = {{name, data + 1, size - 1}, {"m.mtl", data + 1, size - 1}};
    const struct scene_import_desc desc = {.files = files,
                                           .file_count = 2,
                                           .format = format,
                                           .max_blob_bytes = 16 << 20,
                                           .max_image_pixels = 1 << 16};
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
