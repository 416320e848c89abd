/* SPDX-License-Identifier: MIT */
/* KHR_draco_mesh_compression: its counts against those of the accessors. */
#include "renderer/import/import_draco.h"

#include <stdlib.h>

#include "renderer/import/draco_shim.h"

static const struct gltf_accessor *accessor_of(const struct importer *importer, int index)
{
    const struct gltf_document *document = importer->document;
    bool is_there = index >= 0 && (size_t)index < document->accessor_count;
    return is_there ? &document->accessors[index] : NULL;
}

static bool check_mode(const struct gltf_primitive *from, struct error *err)
{
    return from->mode == GLTF_TRIANGLES || from->mode == GLTF_TRIANGLE_STRIP ||
           error_set(err, ERROR_INVALID_SCENE,
                     "its mode is %d; geometry compressed by Draco is triangles or strips of them",
                     from->mode);
}

/* Fills what the accessors say of the stream. It holds single triangles also where the primitive is
 * a strip, which its encoder has cut up: how long that was says nothing of their number. */
static bool describe(struct importer *importer, const struct gltf_primitive *from,
                     struct draco_desc *desc, struct error *err)
{
    const struct gltf_accessor *position = accessor_of(importer, from->attributes[GLTF_POSITION]);
    const struct gltf_accessor *indices = accessor_of(importer, from->indices);
    uint64_t size;
    if (!position || position->count < 1 || position->count > UINT32_MAX)
        return error_set(err, ERROR_INVALID_SCENE,
                         "KHR_draco_mesh_compression without an accessor of POSITION");
    bool is_strip = from->mode == GLTF_TRIANGLE_STRIP;
    if (from->indices != -1 &&
        (!indices || indices->count < 3 || (!is_strip && indices->count % 3 != 0)))
        return error_set(err, ERROR_INVALID_SCENE,
                         "the accessor %d of its indices does not count triangles", from->indices);
    if (!accessor_view_bytes(&importer->source, from->draco_view, "KHR_draco_mesh_compression",
                             &desc->bytes, &size, err))
        return false;
    desc->size_bytes = size;
    desc->points = (uint32_t)position->count;
    desc->triangles = indices && !is_strip ? indices->count / 3 : 0;
    desc->max_bytes = importer->decodable_bytes;
    return true;
}

static bool read_attribute(struct draco_geometry *geometry, const struct importer *importer,
                           const struct gltf_primitive *from, int attribute,
                           const struct draco_mesh *mesh, struct error *err)
{
    const struct gltf_accessor *position = accessor_of(importer, from->attributes[GLTF_POSITION]);
    const struct gltf_accessor *a = accessor_of(importer, from->attributes[attribute]);
    if (!a || a->components < 1)
        return error_set(err, ERROR_INVALID_SCENE, "there is no vector in accessor %d",
                         from->attributes[attribute]);
    if (a->count != position->count)
        return error_set(err, ERROR_INVALID_SCENE,
                         "accessor %d has %llu elements, POSITION has %llu",
                         from->attributes[attribute], (unsigned long long)a->count,
                         (unsigned long long)position->count);
    size_t numbers = (size_t)a->count * (size_t)a->components;
    void *values = geometry->attributes[attribute] = calloc(numbers, sizeof(float));
    if (!values)
        return error_set(err, ERROR_NO_MEMORY, "%zu numbers", numbers);
    return draco_mesh_attribute(mesh, from->draco_attributes[attribute], a->component,
                                a->components, values, err);
}

static bool read_indices(struct draco_geometry *geometry, const struct draco_mesh *mesh,
                         struct error *err)
{
    geometry->index_count = 3 * draco_mesh_triangles(mesh);
    geometry->indices = calloc(geometry->index_count + 1, sizeof *geometry->indices);
    if (!geometry->indices)
        return error_set(err, ERROR_NO_MEMORY, "%llu indices",
                         (unsigned long long)geometry->index_count);
    draco_mesh_indices(mesh, geometry->indices);
    return true;
}

bool draco_geometry_init(struct draco_geometry *geometry, struct importer *importer,
                         const struct gltf_primitive *from, struct error *err)
{
    *geometry = (struct draco_geometry){.indices = NULL};
    struct draco_desc desc = {.bytes = NULL};
    if (!from->is_draco)
        return true;
    if (!check_mode(from, err) || !describe(importer, from, &desc, err))
        return false;
    struct draco_mesh *mesh = draco_mesh_create(&desc, err);
    bool is_done = mesh && read_indices(geometry, mesh, err);
    for (int i = 0; is_done && i < GLTF_ATTRIBUTE_COUNT; i++)
        if (from->attributes[i] != -1 && from->draco_attributes[i] != -1)
            is_done = read_attribute(geometry, importer, from, i, mesh, err) ||
                      error_wrap(err, "%s", gltf_attribute_name(i));
    draco_mesh_destroy(mesh);
    return is_done;
}

void draco_geometry_finish(struct draco_geometry *geometry)
{
    for (int i = 0; i < GLTF_ATTRIBUTE_COUNT; i++)
        free(geometry->attributes[i]);
    free(geometry->indices);
    *geometry = (struct draco_geometry){.indices = NULL};
}
