/* SPDX-License-Identifier: MIT */
/* The materials of primitives under a variant. */
#include "renderer/scene/variants.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Puts the materials of one file's variant over those of its primitives. */
static bool apply(const struct scene *scene, const char *name, uint32_t first_primitive,
                  uint32_t first_material, uint32_t *materials)
{
    int32_t variant = scene_find_variant(scene, name);
    for (uint32_t i = 0; variant >= 0 && i < scene->variant_material_count; i++) {
        const struct scene_variant_material *v = &scene->variant_materials[i];
        if (v->variant == (uint32_t)variant)
            materials[first_primitive + v->primitive] = first_material + v->material;
    }
    return variant >= 0;
}

static bool refuse(const struct scene *scene, const char *name, struct error *err)
{
    char names[160] = "";
    size_t length = 0;
    for (uint32_t i = 0; i < scene->variant_count && length < sizeof names; i++)
        length += (size_t)snprintf(names + length, sizeof names - length, "%s'%s'", i ? ", " : "",
                                   scene->strings + scene->variants[i]);
    return error_set_at(err, ERROR_NOT_FOUND, "/variant", "the scene has no variant '%.60s'%s%s",
                        name, scene->variant_count ? ", but " : ": it has none", names);
}

bool variant_materials_create(const struct scene *scene, const char *name, uint32_t **materials,
                              struct error *err)
{
    *materials = NULL;
    if (!name)
        return true;
    uint32_t *list = calloc((size_t)scene->primitive_count + 1, sizeof *list);
    if (!list)
        return error_set(err, ERROR_NO_MEMORY, "materials of %u primitives",
                         scene->primitive_count);
    for (uint32_t i = 0; i < scene->primitive_count; i++)
        list[i] = scene->primitives[i].material;
    const struct scene *base = scene->part_count ? scene->parts[0].scene : scene;
    bool is_known = apply(base, name, 0, 0, list);
    for (uint32_t i = 1; i < scene->part_count && name[0] != '#'; i++) {
        const struct scene_part *part = &scene->parts[i];
        is_known =
            apply(part->scene, name, part->first_primitive, part->first_material, list) || is_known;
    }
    if (is_known) {
        *materials = list;
        return true;
    }
    free(list);
    return refuse(base, name, err);
}
