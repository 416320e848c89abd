/* SPDX-License-Identifier: MIT */
/* An independent reader of GLB files for the tests of the builder. */
#include "tests/support/glb_reader.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WHY_BYTES = 160 };

static size_t read_u32(const unsigned char *at)
{
    return at[0] | (size_t)at[1] << 8 | (size_t)at[2] << 16 | (size_t)at[3] << 24;
}

bool glb_file_init(struct glb_file *file, const void *bytes, size_t size_bytes, char *why)
{
    const unsigned char *at = bytes;
    *file = (struct glb_file){0};
    snprintf(why, WHY_BYTES, "header");
    if (size_bytes < 20 || memcmp(at, "glTF", 4) != 0 || read_u32(at + 4) != 2 ||
        read_u32(at + 8) != size_bytes || memcmp(at + 16, "JSON", 4) != 0)
        return false;
    size_t json_bytes = read_u32(at + 12), bin = 20 + json_bytes;
    snprintf(why, WHY_BYTES, "chunk sizes");
    if (json_bytes % 4 != 0 || bin > size_bytes)
        return false;
    if (bin < size_bytes) {
        if (bin + 8 > size_bytes || memcmp(at + bin + 4, "BIN", 4) != 0)
            return false;
        file->binary = at + bin + 8;
        file->binary_bytes = read_u32(at + bin);
        if (file->binary_bytes % 4 != 0 || bin + 8 + file->binary_bytes != size_bytes)
            return false;
    }
    json_error_t error;
    const char *text = (const char *)at + 20;
    file->root = json_loadb(text, json_bytes, JSON_REJECT_DUPLICATES, &error);
    if (!file->root)
        snprintf(why, WHY_BYTES, "JSON: %.150s", error.text);
    return file->root != NULL;
}

void glb_file_finish(struct glb_file *file)
{
    json_decref(file->root);
    *file = (struct glb_file){0};
}

json_t *glb_member(const json_t *object, const char *path)
{
    char key[64];
    json_t *value = NULL;
    while (object && *path) {
        size_t length = strcspn(path, ".");
        snprintf(key, sizeof key, "%.*s", (int)length, path);
        value = json_is_array(object) ? json_array_get(object, strtoul(key, NULL, 10))
                                      : json_object_get(object, key);
        object = value;
        path += length + (path[length] == '.');
    }
    return value;
}

static json_t *array_of(const struct glb_file *file, const char *array)
{
    if (strcmp(array, "lights") == 0)
        return glb_member(file->root, "extensions.KHR_lights_punctual.lights");
    return json_object_get(file->root, array);
}

size_t glb_file_count(const struct glb_file *file, const char *array)
{
    return json_array_size(array_of(file, array));
}

json_t *glb_file_element(const struct glb_file *file, const char *array, size_t i)
{
    return json_array_get(array_of(file, array), i);
}

/* Absent, or a whole number below the number of elements. */
static bool refers(const struct glb_file *file, const json_t *object, const char *path,
                   const char *array, char *why)
{
    const json_t *value = glb_member(object, path);
    if (!value || (json_is_integer(value) && json_integer_value(value) >= 0 &&
                   (size_t)json_integer_value(value) < glb_file_count(file, array)))
        return true;
    snprintf(why, WHY_BYTES, "%s points outside %s", path, array);
    return false;
}

static size_t size_of(const json_t *object, const char *key)
{
    return (size_t)json_integer_value(json_object_get(object, key));
}

static size_t component_bytes(const json_t *accessor)
{
    size_t type = size_of(accessor, "componentType");
    return type == 5123 ? 2 : type == 5125 || type == 5126 ? 4 : 0;
}

static bool check_accessors(const struct glb_file *file, char *why)
{
    static const char *const types[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    for (size_t i = 0; i < glb_file_count(file, "bufferViews"); i++) {
        const json_t *view = glb_file_element(file, "bufferViews", i);
        snprintf(why, WHY_BYTES, "bufferView %zu", i);
        if (size_of(view, "byteOffset") % 4 != 0 ||
            size_of(view, "byteOffset") + size_of(view, "byteLength") > file->binary_bytes)
            return false;
    }
    for (size_t i = 0; i < glb_file_count(file, "accessors"); i++) {
        const json_t *accessor = glb_file_element(file, "accessors", i);
        const char *type = json_string_value(json_object_get(accessor, "type"));
        size_t width = 0;
        for (size_t k = 1; k < 5; k++)
            if (type && strcmp(type, types[k]) == 0)
                width = k;
        if (!refers(file, accessor, "bufferView", "bufferViews", why))
            return false;
        const json_t *view = glb_file_element(file, "bufferViews", size_of(accessor, "bufferView"));
        snprintf(why, WHY_BYTES, "accessor %zu", i);
        size_t bytes = component_bytes(accessor) * width * size_of(accessor, "count");
        if (bytes == 0 || bytes > size_of(view, "byteLength"))
            return false;
    }
    return true;
}

/* Vertex index i of an accessor whose bytes are in range. */
static size_t index_at(const struct glb_file *file, const json_t *accessor, size_t i)
{
    const json_t *view = glb_file_element(file, "bufferViews", size_of(accessor, "bufferView"));
    const unsigned char *bytes = file->binary + size_of(view, "byteOffset");
    if (component_bytes(accessor) == 2)
        return bytes[2 * i] | (size_t)bytes[2 * i + 1] << 8;
    return read_u32(bytes + 4 * i);
}

static bool check_primitive(const struct glb_file *file, const json_t *primitive, char *why)
{
    const char *semantic;
    json_t *value, *attributes = json_object_get(primitive, "attributes");
    size_t vertex_count = SIZE_MAX;
    if (!refers(file, primitive, "indices", "accessors", why) ||
        !refers(file, primitive, "material", "materials", why))
        return false;
    json_object_foreach(attributes, semantic, value)
    {
        if (!refers(file, attributes, semantic, "accessors", why))
            return false;
        const json_t *of = glb_file_element(file, "accessors", (size_t)json_integer_value(value));
        if (vertex_count != SIZE_MAX && size_of(of, "count") != vertex_count)
            return false;
        vertex_count = size_of(of, "count");
    }
    if (!json_object_get(primitive, "indices"))
        return true;
    const json_t *indices = glb_file_element(file, "accessors", size_of(primitive, "indices"));
    for (size_t i = 0; i < size_of(indices, "count"); i++)
        if (index_at(file, indices, i) >= vertex_count) {
            snprintf(why, WHY_BYTES, "vertex index %zu is out of range", i);
            return false;
        }
    return true;
}

static bool check_materials(const struct glb_file *file, char *why)
{
    static const char *const textures[] = {
        "pbrMetallicRoughness.baseColorTexture.index",
        "pbrMetallicRoughness.metallicRoughnessTexture.index",
        "normalTexture.index",
        "occlusionTexture.index",
        "emissiveTexture.index",
        "extensions.KHR_materials_transmission.transmissionTexture.index",
        "extensions.KHR_materials_volume.thicknessTexture.index",
    };
    for (size_t i = 0; i < glb_file_count(file, "materials"); i++)
        for (size_t k = 0; k < sizeof textures / sizeof *textures; k++)
            if (!refers(file, glb_file_element(file, "materials", i), textures[k], "textures", why))
                return false;
    for (size_t i = 0; i < glb_file_count(file, "textures"); i++)
        if (!refers(file, glb_file_element(file, "textures", i), "source", "images", why) ||
            !refers(file, glb_file_element(file, "textures", i), "sampler", "samplers", why))
            return false;
    for (size_t i = 0; i < glb_file_count(file, "images"); i++)
        if (!refers(file, glb_file_element(file, "images", i), "bufferView", "bufferViews", why))
            return false;
    return true;
}

static bool check_nodes(const struct glb_file *file, char *why)
{
    size_t i;
    json_t *child;
    for (size_t n = 0; n < glb_file_count(file, "nodes"); n++) {
        const json_t *node = glb_file_element(file, "nodes", n);
        if (!refers(file, node, "mesh", "meshes", why) ||
            !refers(file, node, "camera", "cameras", why) ||
            !refers(file, node, "extensions.KHR_lights_punctual.light", "lights", why))
            return false;
        json_array_foreach(
            json_object_get(node, "children"), i,
            child) if (json_integer_value(child) <= (json_int_t)n ||
                       (size_t)json_integer_value(child) >=
                           glb_file_count(file, "nodes")) return snprintf(why, WHY_BYTES,
                                                                          "a child of node %zu",
                                                                          n) < 0;
    }
    json_array_foreach(
        glb_member(file->root, "scenes.0.nodes"), i,
        child) if ((size_t)json_integer_value(child) >=
                   glb_file_count(file, "nodes")) return snprintf(why, WHY_BYTES,
                                                                  "a root of the scene") < 0;
    return true;
}

bool glb_file_references_hold(const struct glb_file *file, char *why)
{
    if (!check_accessors(file, why) || !check_materials(file, why) || !check_nodes(file, why))
        return false;
    for (size_t m = 0; m < glb_file_count(file, "meshes"); m++) {
        size_t i;
        json_t *primitive;
        json_array_foreach(glb_member(glb_file_element(file, "meshes", m), "primitives"), i,
                           primitive) if (!check_primitive(file, primitive, why)) return false;
    }
    return true;
}
