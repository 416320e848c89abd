/* SPDX-License-Identifier: MIT */
/* Loads the module of a format, has it convert, and puts the result in front of the upload. */
#include "renderer/import/converter.h"

#include <dlfcn.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { GLB_HEADER_BYTES = 12, CHUNK_HEADER_BYTES = 8, CHUNK_ALIGNMENT = 4 };
#define GLB_MAGIC 0x46546C67u
#define GLB_VERSION 2u
#define CHUNK_JSON 0x4E4F534Au
#define CHUNK_BIN 0x004E4942u

/* By the library that it stands for. The one state of its kind: a loaded library is a property of
 * the process, and stays. */
static struct module {
    const char *converter;
    pthread_once_t once;
    void (*load)(void);
    const struct converter_functions *functions;
    char problem[160];
} modules[3];

static void load(struct module *module)
{
    char path[PATH_MAX + 64], name[64];
    int name_length = snprintf(name, sizeof name, "vitrail-%s.so", module->converter);
    ssize_t length = readlink("/proc/self/exe", path, PATH_MAX);
    char *slash = length > 0 ? memrchr(path, '/', (size_t)length) : NULL;
    if (!slash) {
        snprintf(module->problem, sizeof module->problem, "the program has no path");
        return;
    }
    memcpy(slash + 1, name, (size_t)name_length + 1);
    if (access(path, F_OK) != 0) {
        snprintf(module->problem, sizeof module->problem, "%s is not installed", name);
        return;
    }
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    const struct converter_functions *(*get)(void) = NULL;
    if (library)
        *(void **)&get = dlsym(library, "converter_get_functions");
    if (!get) {
        snprintf(module->problem, sizeof module->problem, "%s", dlerror());
        return;
    }
    module->functions = get();
    module->functions->warm_up();
}

static void load_assimp(void)
{
    load(&modules[0]);
}

static void load_opencascade(void)
{
    load(&modules[1]);
}

static void load_openvdb(void)
{
    load(&modules[2]);
}

static struct module modules[3] = {
    {.converter = "assimp", .once = PTHREAD_ONCE_INIT, .load = load_assimp},
    {.converter = "opencascade", .once = PTHREAD_ONCE_INIT, .load = load_opencascade},
    {.converter = "openvdb", .once = PTHREAD_ONCE_INIT, .load = load_openvdb},
};

static const struct converter_functions *find_module(enum scene_format format, struct error *err)
{
    const struct scene_format_info *info = scene_format_describe(format);
    struct module *module = modules;
    while (strcmp(module->converter, info->converter) != 0)
        module++;
    pthread_once(&module->once, module->load);
    if (!module->functions)
        error_set(err, ERROR_UNSUPPORTED, "this server reads no %s, which it needs %s for: %s",
                  info->title, info->converter, module->problem);
    return module->functions;
}

bool scene_import_prepare(enum scene_format format, struct error *err)
{
    return format == SCENE_FORMAT_GLTF || find_module(format, err);
}

/* The file of the format; a single file may have any name. */
static const struct scene_file *find_root(const struct scene_import_desc *desc, struct error *err)
{
    const struct scene_file *root = desc->file_count == 1 ? desc->files : NULL;
    for (size_t i = 0; desc->file_count > 1 && i < desc->file_count; i++) {
        enum scene_format format;
        const struct scene_file *file = &desc->files[i];
        if (!scene_format_of_file(file->name, &format) || format != desc->format)
            continue;
        if (root) {
            error_set(err, ERROR_INVALID_SCENE, "both '%s' and '%s' are scenes, one is expected",
                      root->name, file->name);
            return NULL;
        }
        root = file;
    }
    if (!root)
        error_set(err, ERROR_INVALID_SCENE, "no file ends in %s among the %zu uploaded",
                  scene_format_describe(desc->format)->suffixes, desc->file_count);
    return root;
}

static uint8_t *put_u32(uint8_t *at, uint32_t value)
{
    memcpy(at, &value, sizeof value);
    return at + sizeof value;
}

static uint8_t *put_chunk(uint8_t *at, uint32_t kind, const void *bytes, size_t size_bytes,
                          size_t padded_bytes, char padding)
{
    at = put_u32(put_u32(at, (uint32_t)padded_bytes), kind);
    if (size_bytes > 0)
        memcpy(at, bytes, size_bytes);
    memset(at + size_bytes, padding, padded_bytes - size_bytes);
    return at + padded_bytes;
}

static size_t padded(size_t size_bytes)
{
    return (size_bytes + CHUNK_ALIGNMENT - 1) / CHUNK_ALIGNMENT * CHUNK_ALIGNMENT;
}

/* The GLB of what the module wrote, which is freed on the way (glTF 2.0 specification, section 4).
 */
static bool write_glb(struct conversion *conversion, size_t *size_bytes, struct error *err)
{
    struct converter_output *output = &conversion->output;
    size_t json = padded(output->json_bytes), buffer = padded(output->buffer_bytes);
    size_t total = GLB_HEADER_BYTES + 2 * (size_t)CHUNK_HEADER_BYTES;
    if (json > UINT32_MAX - total || buffer > UINT32_MAX - total - json)
        return error_set(err, ERROR_TOO_LARGE, "what it holds takes more than 4 GiB");
    total += json + buffer;
    uint8_t *at = malloc(total);
    conversion->glb = at;
    if (!at)
        return error_set(err, ERROR_NO_MEMORY, "%zu bytes of glTF", total);
    at = put_u32(put_u32(put_u32(at, GLB_MAGIC), GLB_VERSION), (uint32_t)total);
    at = put_chunk(at, CHUNK_JSON, output->json, output->json_bytes, json, ' ');
    put_chunk(at, CHUNK_BIN, output->buffer, output->buffer_bytes, buffer, '\0');
    free(output->json);
    free(output->buffer);
    output->json = NULL;
    output->buffer = NULL;
    *size_bytes = total;
    return true;
}

/* Other glTF files of the upload stay out, so that the new one is the scene. */
static bool list_files(struct conversion *conversion, const struct scene_import_desc *desc,
                       size_t glb_bytes, struct error *err)
{
    conversion->files = calloc(desc->file_count + 1, sizeof *conversion->files);
    if (!conversion->files)
        return error_set(err, ERROR_NO_MEMORY, "table of files");
    conversion->files[conversion->file_count++] =
        (struct scene_file){"converted.glb", conversion->glb, glb_bytes};
    for (size_t i = 0; i < desc->file_count; i++) {
        enum scene_format format;
        if (!scene_format_of_file(desc->files[i].name, &format) || format != SCENE_FORMAT_GLTF)
            conversion->files[conversion->file_count++] = desc->files[i];
    }
    return true;
}

void conversion_finish(struct conversion *conversion)
{
    free(conversion->output.json);
    free(conversion->output.buffer);
    free(conversion->output.warnings);
    free(conversion->files);
    free(conversion->glb);
    *conversion = (struct conversion){0};
}

bool conversion_init(struct conversion *conversion, const struct scene_import_desc *desc,
                     struct error *err)
{
    size_t glb_bytes = 0;
    *conversion = (struct conversion){0};
    const struct scene_file *root = find_root(desc, err);
    const struct converter_functions *functions = root ? find_module(desc->format, err) : NULL;
    return functions &&
           functions->convert(&(struct converter_input){.files = desc->files,
                                                        .file_count = desc->file_count,
                                                        .root = root,
                                                        .format = desc->format,
                                                        .unit_m = desc->unit_m,
                                                        .up = desc->up,
                                                        .deflection = desc->deflection,
                                                        .scene = desc->scene},
                              &conversion->output, err) &&
           write_glb(conversion, &glb_bytes, err) && list_files(conversion, desc, glb_bytes, err);
}
