/* SPDX-License-Identifier: MIT */
/* Computes the cache keys of a window. */
#include "renderer/frame/window_cache_keys.h"

#include <string.h>

#include "renderer/plan/view_key.h"

/* The members of a material that matter to an opaque surface. */
static struct scene_material surface_part(const struct scene_material *material)
{
    struct scene_material part = *material;
    part.transmission = part.ior = part.thickness = part.attenuation_distance = 0;
    part.edge_exponent = 0;
    part.pass_through = 0;
    memset(part.attenuation_color, 0, sizeof part.attenuation_color);
    memset(part.edge_color, 0, sizeof part.edge_color);
    return part;
}

static void add_materials(struct window_cache_keys *keys, const struct scene_state *state)
{
    for (uint32_t i = 0; i < state->scene->material_count; i++) {
        const struct scene_material *material = &state->materials[i].base;
        struct scene_material part = surface_part(material);
        /* whether it is opaque, and whether its inside attenuates, sort it into the passes */
        uint32_t sorts =
            (uint32_t)material_class(material) | (uint32_t)scene_material_attenuates(material) << 8;
        content_key_add(&keys->surfaces, &part, sizeof part);
        content_key_add(&keys->surfaces, &sorts, sizeof sorts);
        content_key_add(&keys->layers, material, sizeof *material);
    }
}

static void add_doubles(struct content_key *key, const double *values, size_t count)
{
    content_key_add(key, values, count * sizeof *values);
}

static void add_camera(struct content_key *key, const struct camera *camera)
{
    add_doubles(key, camera->eye, 3);
    add_doubles(key, camera->right, 3);
    add_doubles(key, camera->up, 3);
    add_doubles(key, camera->back, 3);
    add_doubles(key,
                (const double[]){camera->half_width, camera->half_height, camera->z_near,
                                 camera->z_far, camera->is_orthographic},
                5);
}

struct window_cache_keys window_cache_keys_of(const struct window_cache_desc *desc)
{
    struct window_cache_keys keys = {.surfaces = desc->placement};
    add_camera(&keys.surfaces, desc->camera);
    content_key_add(&keys.surfaces, desc->window, sizeof *desc->window);
    content_key_add(&keys.surfaces, &desc->samples, sizeof desc->samples);
    struct content_key cut = view_cut_key(desc->view);
    content_key_add(&keys.surfaces, &cut, sizeof cut);
    keys.layers = keys.surfaces;
    add_materials(&keys, desc->state);
    content_key_add(&keys.layers, &keys.surfaces, sizeof keys.surfaces); /* they end at surfaces */
    return keys;
}
