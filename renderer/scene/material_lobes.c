/* SPDX-License-Identifier: MIT */
/* Lobes by a table of their places in a material. */
#include "renderer/scene/material_lobes.h"

#include <math.h>
#include <stddef.h>

static const struct {
    size_t offset;
    double unit; /* of a request, in that of the material */
} places[LOBE_MEMBER_COUNT] = {
    [LOBE_SPECULAR] = {offsetof(struct scene_material, specular), 1},
    [LOBE_SPECULAR_COLOR] = {offsetof(struct scene_material, specular_color), 1},
    [LOBE_CLEARCOAT] = {offsetof(struct scene_material, clearcoat), 1},
    [LOBE_CLEARCOAT_ROUGHNESS] = {offsetof(struct scene_material, clearcoat_roughness), 1},
    [LOBE_SHEEN_COLOR] = {offsetof(struct scene_material, sheen_color), 1},
    [LOBE_SHEEN_ROUGHNESS] = {offsetof(struct scene_material, sheen_roughness), 1},
    [LOBE_IRIDESCENCE] = {offsetof(struct scene_material, iridescence), 1},
    [LOBE_IRIDESCENCE_IOR] = {offsetof(struct scene_material, film_ior), 1},
    [LOBE_IRIDESCENCE_THICKNESS] = {offsetof(struct scene_material, film_nm[1]), 1},
    [LOBE_ANISOTROPY] = {offsetof(struct scene_material, anisotropy), 1},
    [LOBE_ANISOTROPY_ROTATION] = {offsetof(struct scene_material, anisotropy_rad), M_PI / 180},
    [LOBE_DIFFUSE_TRANSMISSION] = {offsetof(struct scene_material, diffuse_transmission), 1},
    [LOBE_DIFFUSE_TRANSMISSION_COLOR] = {offsetof(struct scene_material,
                                                  diffuse_transmission_color),
                                         1},
    [LOBE_DISPERSION] = {offsetof(struct scene_material, dispersion), 1},
};

/* The members of each lobe, the one without which there is no lobe first. */
static const uint32_t lobes_of_members[] = {
    1u << LOBE_CLEARCOAT | 1u << LOBE_CLEARCOAT_ROUGHNESS,
    1u << LOBE_SHEEN_COLOR | 1u << LOBE_SHEEN_ROUGHNESS,
    1u << LOBE_IRIDESCENCE | 1u << LOBE_IRIDESCENCE_IOR | 1u << LOBE_IRIDESCENCE_THICKNESS,
    1u << LOBE_ANISOTROPY | 1u << LOBE_ANISOTROPY_ROTATION,
    1u << LOBE_DIFFUSE_TRANSMISSION | 1u << LOBE_DIFFUSE_TRANSMISSION_COLOR,
    1u << LOBE_DISPERSION,
};
static const uint32_t specular_members = 1u << LOBE_SPECULAR | 1u << LOBE_SPECULAR_COLOR;

static float *place_of(struct scene_material *material, int member)
{
    return (float *)(void *)((char *)material + places[member].offset);
}

void material_lobes_set(struct scene_material *material, const struct lobe_members *lobes)
{
    if (lobes->said & specular_members && !(material->flags & SCENE_MATERIAL_SPECULAR)) {
        material->flags |= SCENE_MATERIAL_SPECULAR;
        material->specular = 1;
        for (int k = 0; k < 3; k++)
            material->specular_color[k] = 1;
    }
    for (int i = 0; i < LOBE_MEMBER_COUNT; i++)
        for (int k = 0; lobes->said & 1u << i && k < lobe_member_kind(i)->count; k++)
            place_of(material, i)[k] = (float)(lobes->values[i][k] * places[i].unit);
}

struct lobe_members material_lobes_get(const struct scene_material *material)
{
    struct scene_material copy = *material;
    struct lobe_members lobes = {.said = 0};
    for (int i = 0; i < LOBE_MEMBER_COUNT; i++)
        for (int k = 0; k < lobe_member_kind(i)->count; k++)
            lobes.values[i][k] = (double)place_of(&copy, i)[k] / places[i].unit;
    lobes.values[LOBE_ANISOTROPY_ROTATION][0] =
        fmod(lobes.values[LOBE_ANISOTROPY_ROTATION][0], 360); /* files may turn further */
    if (material->flags & SCENE_MATERIAL_SPECULAR)
        lobes.said |= specular_members;
    for (size_t i = 0; i < sizeof lobes_of_members / sizeof *lobes_of_members; i++) {
        int first = __builtin_ctz(lobes_of_members[i]);
        for (int k = 0; k < lobe_member_kind(first)->count; k++)
            if (lobes.values[first][k] > 0)
                lobes.said |= lobes_of_members[i];
    }
    for (int i = 0; i < LOBE_MEMBER_COUNT; i++)
        for (int k = 0; !(lobes.said & 1u << i) && k < LOBE_NUMBERS_MAX; k++)
            lobes.values[i][k] = 0;
    return lobes;
}
