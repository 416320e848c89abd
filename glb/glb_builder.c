/* SPDX-License-Identifier: MIT */
/* The frame of the GLB builder: its arrays, the BIN chunk, numbers, and the finished file. */
#include "glb/glb_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const kind_keys[GLB_KIND_COUNT] = {
    [GLB_KIND_IMAGE] = "images",       [GLB_KIND_SAMPLER] = "samplers",
    [GLB_KIND_TEXTURE] = "textures",   [GLB_KIND_MATERIAL] = "materials",
    [GLB_KIND_ACCESSOR] = "accessors", [GLB_KIND_VIEW] = "bufferViews",
    [GLB_KIND_MESH] = "meshes",        [GLB_KIND_LIGHT] = "lights",
    [GLB_KIND_CAMERA] = "cameras",     [GLB_KIND_NODE] = "nodes",
    [GLB_KIND_GRID] = "grids",
};

struct glb_builder *glb_builder_create(const char *scene_name, struct error *err)
{
    struct glb_builder *builder = calloc(1, sizeof *builder);
    if (!builder)
        goto fail;
    bool is_complete = true;
    for (int kind = 0; kind < GLB_KIND_COUNT; kind++)
        is_complete &= (builder->arrays[kind] = json_array()) != NULL;
    is_complete &= (builder->roots = json_array()) != NULL;
    is_complete &= (builder->extensions = json_array()) != NULL;
    if (scene_name)
        is_complete &= (builder->scene_name = strdup(scene_name)) != NULL;
    if (is_complete)
        return builder;

fail:
    error_set(err, ERROR_NO_MEMORY, "GLB builder");
    glb_builder_destroy(builder);
    return NULL;
}

void glb_builder_destroy(struct glb_builder *builder)
{
    if (!builder)
        return;
    for (int kind = 0; kind < GLB_KIND_COUNT; kind++)
        json_decref(builder->arrays[kind]);
    json_decref(builder->roots);
    json_decref(builder->extensions);
    free(builder->scene_name);
    free(builder->binary);
    free(builder);
}

int glb_builder_fail(struct glb_builder *builder, const struct error *cause)
{
    if (builder->failure.code == ERROR_NONE)
        builder->failure = *cause;
    return 0;
}

int glb_fail_memory(struct glb_builder *builder)
{
    error_set(&builder->failure, ERROR_NO_MEMORY, "GLB builder");
    return 0;
}

json_t *glb_number(struct glb_builder *builder, double value, const char *field)
{
    if (!isfinite(value)) {
        error_set(&builder->failure, ERROR_INVALID_REQUEST, "%s is not a finite number", field);
        return NULL;
    }
    bool is_whole = value == floor(value) && fabs(value) < 1e15 && !(value == 0 && signbit(value));
    json_t *number = is_whole ? json_integer((json_int_t)value) : json_real(value);
    if (!number)
        glb_fail_memory(builder);
    return number;
}

json_t *glb_numbers(struct glb_builder *builder, const double *values, size_t count,
                    const char *field)
{
    json_t *array = json_array();
    for (size_t i = 0; array && i < count; i++) {
        json_t *number = glb_number(builder, values[i], field);
        if (!number || json_array_append_new(array, number) != 0) {
            json_decref(array);
            array = NULL;
        }
    }
    if (!array)
        glb_fail_memory(builder);
    return array;
}

json_t *glb_object(struct glb_builder *builder)
{
    json_t *object = json_object();
    if (!object)
        glb_fail_memory(builder);
    return object;
}

void glb_put(struct glb_builder *builder, json_t *object, const char *key, json_t *value)
{
    if (json_object_set_new(object, key, value) != 0)
        glb_fail_memory(builder);
}

void glb_put_name(struct glb_builder *builder, json_t *object, const char *name)
{
    if (!name || !*name)
        return;
    json_t *text = json_string(name);
    if (!text)
        error_set(&builder->failure, ERROR_INVALID_REQUEST, "a name is not valid UTF-8");
    glb_put(builder, object, "name", text);
}

bool glb_check_range(struct glb_builder *builder, double value, double low, double high,
                     const char *field)
{
    if (value >= low && value <= high)
        return true;
    return error_set(&builder->failure, ERROR_INVALID_REQUEST, "%s is %g, must be in [%g, %g]",
                     field, value, low, high);
}

bool glb_check_id(struct glb_builder *builder, enum glb_kind kind, int id, const char *field)
{
    size_t count = json_array_size(builder->arrays[kind]);
    if (id >= 0 && (size_t)id <= count)
        return true;
    return error_set(&builder->failure, ERROR_INVALID_REQUEST, "%s is %d, there are %zu %s", field,
                     id, count, kind_keys[kind]);
}

int glb_append(struct glb_builder *builder, enum glb_kind kind, json_t *element)
{
    if (builder->failure.code != ERROR_NONE) {
        json_decref(element);
        return 0;
    }
    if (json_array_append_new(builder->arrays[kind], element) != 0)
        return glb_fail_memory(builder);
    return (int)json_array_size(builder->arrays[kind]);
}

void glb_use_extension(struct glb_builder *builder, const char *name)
{
    size_t index;
    json_t *known;
    json_array_foreach(builder->extensions, index,
                       known) if (strcmp(json_string_value(known), name) == 0) return;
    if (json_array_append_new(builder->extensions, json_string(name)) != 0)
        glb_fail_memory(builder);
}

/* Room for size_bytes more, counting in 4-byte steps; the fresh bytes are zero. */
static bool reserve(struct glb_builder *builder, size_t size_bytes)
{
    size_t needed = builder->binary_bytes + size_bytes;
    if (size_bytes > UINT32_MAX / 2 || needed > UINT32_MAX / 2)
        return error_set(&builder->failure, ERROR_TOO_LARGE, "GLB of more than 2 GiB");
    if (needed <= builder->binary_capacity)
        return true;
    size_t capacity = builder->binary_capacity ? builder->binary_capacity : 65536;
    while (capacity < needed)
        capacity *= 2;
    unsigned char *grown = realloc(builder->binary, capacity);
    if (!grown)
        return glb_fail_memory(builder);
    memset(grown + builder->binary_capacity, 0, capacity - builder->binary_capacity);
    builder->binary = grown;
    builder->binary_capacity = capacity;
    return true;
}

int glb_add_view(struct glb_builder *builder, const void *bytes, size_t size_bytes, int target)
{
    size_t padded = (size_bytes + 3) / 4 * 4;
    if (builder->failure.code != ERROR_NONE || padded < size_bytes || !reserve(builder, padded))
        return 0;
    memcpy(builder->binary + builder->binary_bytes, bytes, size_bytes);
    json_t *view = glb_object(builder);
    glb_put(builder, view, "buffer", json_integer(0));
    glb_put(builder, view, "byteOffset", json_integer((json_int_t)builder->binary_bytes));
    glb_put(builder, view, "byteLength", json_integer((json_int_t)size_bytes));
    if (target)
        glb_put(builder, view, "target", json_integer(target));
    builder->binary_bytes += padded;
    return glb_append(builder, GLB_KIND_VIEW, view);
}

/* Lights and grids stand in extensions. */
static bool is_top_level(int kind)
{
    return kind != GLB_KIND_LIGHT && kind != GLB_KIND_GRID;
}

static json_t *document_extensions(struct glb_builder *builder)
{
    json_t *extensions = glb_object(builder);
    if (json_array_size(builder->arrays[GLB_KIND_LIGHT]) > 0)
        glb_put(builder, extensions, "KHR_lights_punctual",
                json_pack("{sO}", "lights", builder->arrays[GLB_KIND_LIGHT]));
    if (json_array_size(builder->arrays[GLB_KIND_GRID]) > 0)
        glb_put(builder, extensions, "VITRAIL_density_grids",
                json_pack("{sO}", "grids", builder->arrays[GLB_KIND_GRID]));
    return extensions;
}

/* Everything around the arrays. */
static json_t *gltf_document(struct glb_builder *builder)
{
    json_t *root = glb_object(builder), *scene = glb_object(builder);
    glb_put(builder, root, "asset", json_pack("{ssss}", "version", "2.0", "generator", "vitrail"));
    glb_put(builder, root, "scene", json_integer(0));
    glb_put_name(builder, scene, builder->scene_name);
    if (json_array_size(builder->roots) > 0)
        glb_put(builder, scene, "nodes", json_incref(builder->roots));
    glb_put(builder, root, "scenes", json_pack("[o]", scene));
    for (int kind = 0; kind < GLB_KIND_COUNT; kind++)
        if (is_top_level(kind) && json_array_size(builder->arrays[kind]) > 0)
            glb_put(builder, root, kind_keys[kind], json_incref(builder->arrays[kind]));
    json_t *extensions = document_extensions(builder);
    if (json_object_size(extensions) > 0)
        glb_put(builder, root, "extensions", json_incref(extensions));
    json_decref(extensions);
    if (json_array_size(builder->extensions) > 0)
        glb_put(builder, root, "extensionsUsed", json_incref(builder->extensions));
    if (builder->binary_bytes > 0)
        glb_put(builder, root, "buffers",
                json_pack("[{sI}]", "byteLength", (json_int_t)builder->binary_bytes));
    return root;
}

static unsigned char *write_u32(unsigned char *at, size_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (unsigned char)(value >> (8 * i));
    return at + 4;
}

/* glTF 2.0, 4.4 "Binary glTF layout": header, JSON chunk padded with spaces, BIN chunk. */
static bool write_container(struct glb_builder *builder, const char *text, void **glb,
                            size_t *size_bytes)
{
    size_t text_bytes = strlen(text), json_bytes = (text_bytes + 3) / 4 * 4;
    size_t bin_bytes = builder->binary_bytes;
    size_t total = 12 + 8 + json_bytes + (bin_bytes ? 8 + bin_bytes : 0);
    if (total > UINT32_MAX)
        return error_set(&builder->failure, ERROR_TOO_LARGE, "GLB of %zu bytes", total);
    unsigned char *bytes = malloc(total);
    if (!bytes)
        return glb_fail_memory(builder);
    unsigned char *at = write_u32(bytes, 0x46546C67); /* "glTF" */
    at = write_u32(at, 2);
    at = write_u32(at, total);
    at = write_u32(at, json_bytes);
    at = write_u32(at, 0x4E4F534A); /* "JSON" */
    memset(at, ' ', json_bytes);
    memcpy(at, text, text_bytes);
    at += json_bytes;
    if (bin_bytes) {
        at = write_u32(at, bin_bytes);
        at = write_u32(at, 0x004E4942); /* "BIN" */
        memcpy(at, builder->binary, bin_bytes);
    }
    *glb = bytes;
    *size_bytes = total;
    return true;
}

bool glb_builder_finish(struct glb_builder *builder, void **glb, size_t *size_bytes,
                        struct error *err)
{
    *glb = NULL;
    *size_bytes = 0;
    bool is_written = false;
    if (builder->failure.code == ERROR_NONE) {
        json_t *document = gltf_document(builder);
        char *text = document ? json_dumps(document, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
        if (!text)
            glb_fail_memory(builder);
        else if (builder->failure.code == ERROR_NONE)
            is_written = write_container(builder, text, glb, size_bytes);
        free(text);
        json_decref(document);
    }
    if (!is_written && err && err->code == ERROR_NONE)
        *err = builder->failure;
    return is_written;
}
