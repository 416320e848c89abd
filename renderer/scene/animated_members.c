/* SPDX-License-Identifier: MIT */
/* The table of animated members. */
#include "renderer/scene/animated_members.h"

#include <math.h>
#include <string.h>

#include "renderer/scene/scene_blob.h"

#define FACTOR_MAX 1e12f /* as the importer has it */
#define IOR_MAX 100.f
#define FILM_NM_MAX 1e6f
#define ANGLE_MAX 1.57079632679f

#define OF_MATERIAL(pointer, member, count, least, most)         \
    {                                                            \
        ANIMATED_MATERIAL, pointer, count, least, most,          \
            (uint32_t)offsetof(struct scene_material, member), 0 \
    }
#define OF_LIGHT(pointer, member, count, most)                                                     \
    {                                                                                              \
        ANIMATED_LIGHT, pointer, count, 0, most, (uint32_t)offsetof(struct scene_light, member), 0 \
    }
/* The third column of its 2 x 3 matrix. */
#define OFFSET_OF(pointer, slot)                                                                   \
    {                                                                                              \
        ANIMATED_MATERIAL, pointer "/extensions/KHR_texture_transform/offset", 2, -FACTOR_MAX,     \
            FACTOR_MAX, (uint32_t)offsetof(struct scene_material, textures[slot].uv_transform[2]), \
            3 * sizeof(float)                                                                      \
    }
#define EXTENSION "/extensions/KHR_materials_"

static const struct animated_member members[] = {
    OF_MATERIAL("/pbrMetallicRoughness/baseColorFactor", base_color, 4, 0, 1),
    OF_MATERIAL("/pbrMetallicRoughness/metallicFactor", metallic, 1, 0, 1),
    OF_MATERIAL("/pbrMetallicRoughness/roughnessFactor", roughness, 1, 0, 1),
    OF_MATERIAL("/emissiveFactor", emissive, 3, 0, FACTOR_MAX),
    OF_MATERIAL("/alphaCutoff", alpha_cutoff, 1, 0, FACTOR_MAX),
    OF_MATERIAL("/normalTexture/scale", normal_scale, 1, -FACTOR_MAX, FACTOR_MAX),
    OF_MATERIAL("/occlusionTexture/strength", occlusion_strength, 1, 0, 1),
    OF_MATERIAL(EXTENSION "transmission/transmissionFactor", transmission, 1, 0, 1),
    OF_MATERIAL(EXTENSION "ior/ior", ior, 1, 1, IOR_MAX),
    OF_MATERIAL(EXTENSION "volume/thicknessFactor", thickness, 1, 0, FACTOR_MAX),
    OF_MATERIAL(EXTENSION "volume/attenuationDistance", attenuation_distance, 1, 1e-30f,
                FACTOR_MAX),
    OF_MATERIAL(EXTENSION "volume/attenuationColor", attenuation_color, 3, 0, 1),
    OF_MATERIAL(EXTENSION "specular/specularFactor", specular, 1, 0, 1),
    OF_MATERIAL(EXTENSION "specular/specularColorFactor", specular_color, 3, 0, FACTOR_MAX),
    OF_MATERIAL(EXTENSION "clearcoat/clearcoatFactor", clearcoat, 1, 0, 1),
    OF_MATERIAL(EXTENSION "clearcoat/clearcoatRoughnessFactor", clearcoat_roughness, 1, 0, 1),
    OF_MATERIAL(EXTENSION "clearcoat/clearcoatNormalTexture/scale", clearcoat_normal_scale, 1,
                -FACTOR_MAX, FACTOR_MAX),
    OF_MATERIAL(EXTENSION "sheen/sheenColorFactor", sheen_color, 3, 0, 1),
    OF_MATERIAL(EXTENSION "sheen/sheenRoughnessFactor", sheen_roughness, 1, 0, 1),
    OF_MATERIAL(EXTENSION "iridescence/iridescenceFactor", iridescence, 1, 0, 1),
    OF_MATERIAL(EXTENSION "iridescence/iridescenceIor", film_ior, 1, 1, IOR_MAX),
    OF_MATERIAL(EXTENSION "iridescence/iridescenceThicknessMinimum", film_nm[0], 1, 0, FILM_NM_MAX),
    OF_MATERIAL(EXTENSION "iridescence/iridescenceThicknessMaximum", film_nm[1], 1, 0, FILM_NM_MAX),
    OFFSET_OF("/pbrMetallicRoughness/baseColorTexture", SCENE_TEXTURE_BASE_COLOR),
    OFFSET_OF("/pbrMetallicRoughness/metallicRoughnessTexture", SCENE_TEXTURE_METALLIC_ROUGHNESS),
    OFFSET_OF("/normalTexture", SCENE_TEXTURE_NORMAL),
    OFFSET_OF("/occlusionTexture", SCENE_TEXTURE_OCCLUSION),
    OFFSET_OF("/emissiveTexture", SCENE_TEXTURE_EMISSIVE),
    OFFSET_OF(EXTENSION "transmission/transmissionTexture", SCENE_TEXTURE_TRANSMISSION),
    OFFSET_OF(EXTENSION "volume/thicknessTexture", SCENE_TEXTURE_THICKNESS),
    OFFSET_OF(EXTENSION "clearcoat/clearcoatTexture", SCENE_TEXTURE_CLEARCOAT),
    OFFSET_OF(EXTENSION "iridescence/iridescenceThicknessTexture",
              SCENE_TEXTURE_IRIDESCENCE_THICKNESS),
    OF_LIGHT("/color", color, 3, FACTOR_MAX),
    OF_LIGHT("/intensity", intensity, 1, FACTOR_MAX),
    OF_LIGHT("/range", range, 1, FACTOR_MAX),
    OF_LIGHT("/spot/innerConeAngle", inner_cone_rad, 1, ANGLE_MAX),
    OF_LIGHT("/spot/outerConeAngle", outer_cone_rad, 1, ANGLE_MAX),
};

enum { MEMBER_COUNT = sizeof members / sizeof *members };

const struct animated_member *animated_member(uint32_t index)
{
    return index < MEMBER_COUNT ? &members[index] : NULL;
}

int32_t animated_member_find(enum animated_owner owner, const char *pointer)
{
    for (int32_t i = 0; i < MEMBER_COUNT; i++)
        if (members[i].owner == owner && strcmp(members[i].pointer, pointer) == 0)
            return i;
    return -1;
}

void animated_member_set(const struct animated_member *member, const double *values, void *record)
{
    size_t stride = member->stride ? member->stride : sizeof(float);
    for (uint32_t i = 0; i < member->count; i++) {
        float value = (float)fmin(fmax(values[i], (double)member->least), (double)member->most);
        memcpy((char *)record + member->offset + i * stride, &value, sizeof value);
    }
}
