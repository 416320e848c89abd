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
#define FOV_MAX 3.14159f /* below pi, which has no picture */
#define CAMERA_LEAST 1e-30f
#define CAMERA_MOST 1e30f

#define OF_MATERIAL(path, member, numbers, lowest, highest)                                   \
    {                                                                                         \
        .owner = ANIMATED_MATERIAL, .pointer = (path), .count = (numbers), .least = (lowest), \
        .most = (highest), .offset = (uint32_t)offsetof(struct scene_material, member)        \
    }
#define OF_LIGHT(path, member, numbers, highest)                                           \
    {                                                                                      \
        .owner = ANIMATED_LIGHT, .pointer = (path), .count = (numbers), .most = (highest), \
        .offset = (uint32_t)offsetof(struct scene_light, member)                           \
    }
#define OF_CAMERA(path, member, lowest, highest)                                     \
    {                                                                                \
        .owner = ANIMATED_CAMERA, .pointer = (path), .count = 1, .least = (lowest),  \
        .most = (highest), .offset = (uint32_t)offsetof(struct scene_camera, member) \
    }
#define OF_TRANSFORM(path, slot, name, numbers, member, apart, dependent)                      \
    {                                                                                          \
        .owner = ANIMATED_MATERIAL, .pointer = path "/extensions/KHR_texture_transform/" name, \
        .count = (numbers), .least = -FACTOR_MAX, .most = FACTOR_MAX,                          \
        .offset = (uint32_t)offsetof(struct scene_material, textures[slot].member),            \
        .stride = (apart), .turned = (dependent)                                               \
    }
#define TURNED(slot) (uint32_t) offsetof(struct scene_material, textures[slot])
/* The offset is the third column of the 2 x 3 matrix. */
#define TRANSFORM_OF(path, slot)                                                  \
    OF_TRANSFORM(path, slot, "offset", 2, uv_transform[2], 3 * sizeof(float), 0), \
        OF_TRANSFORM(path, slot, "scale", 2, uv_scale, 0, TURNED(slot)),          \
        OF_TRANSFORM(path, slot, "rotation", 1, uv_rotation_rad, 0, TURNED(slot))
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
    TRANSFORM_OF("/pbrMetallicRoughness/baseColorTexture", SCENE_TEXTURE_BASE_COLOR),
    TRANSFORM_OF("/pbrMetallicRoughness/metallicRoughnessTexture",
                 SCENE_TEXTURE_METALLIC_ROUGHNESS),
    TRANSFORM_OF("/normalTexture", SCENE_TEXTURE_NORMAL),
    TRANSFORM_OF("/occlusionTexture", SCENE_TEXTURE_OCCLUSION),
    TRANSFORM_OF("/emissiveTexture", SCENE_TEXTURE_EMISSIVE),
    TRANSFORM_OF(EXTENSION "transmission/transmissionTexture", SCENE_TEXTURE_TRANSMISSION),
    TRANSFORM_OF(EXTENSION "volume/thicknessTexture", SCENE_TEXTURE_THICKNESS),
    TRANSFORM_OF(EXTENSION "specular/specularTexture", SCENE_TEXTURE_SPECULAR),
    TRANSFORM_OF(EXTENSION "specular/specularColorTexture", SCENE_TEXTURE_SPECULAR_COLOR),
    TRANSFORM_OF(EXTENSION "clearcoat/clearcoatTexture", SCENE_TEXTURE_CLEARCOAT),
    TRANSFORM_OF(EXTENSION "clearcoat/clearcoatRoughnessTexture",
                 SCENE_TEXTURE_CLEARCOAT_ROUGHNESS),
    TRANSFORM_OF(EXTENSION "clearcoat/clearcoatNormalTexture", SCENE_TEXTURE_CLEARCOAT_NORMAL),
    TRANSFORM_OF(EXTENSION "sheen/sheenColorTexture", SCENE_TEXTURE_SHEEN_COLOR),
    TRANSFORM_OF(EXTENSION "sheen/sheenRoughnessTexture", SCENE_TEXTURE_SHEEN_ROUGHNESS),
    TRANSFORM_OF(EXTENSION "iridescence/iridescenceTexture", SCENE_TEXTURE_IRIDESCENCE),
    TRANSFORM_OF(EXTENSION "iridescence/iridescenceThicknessTexture",
                 SCENE_TEXTURE_IRIDESCENCE_THICKNESS),
    TRANSFORM_OF(EXTENSION "anisotropy/anisotropyTexture", SCENE_TEXTURE_ANISOTROPY),
    TRANSFORM_OF(EXTENSION "diffuse_transmission/diffuseTransmissionTexture",
                 SCENE_TEXTURE_DIFFUSE_TRANSMISSION),
    TRANSFORM_OF(EXTENSION "diffuse_transmission/diffuseTransmissionColorTexture",
                 SCENE_TEXTURE_DIFFUSE_TRANSMISSION_COLOR),
    OF_LIGHT("/color", color, 3, FACTOR_MAX),
    OF_LIGHT("/intensity", intensity, 1, FACTOR_MAX),
    OF_LIGHT("/range", range, 1, FACTOR_MAX),
    OF_LIGHT("/spot/innerConeAngle", inner_cone_rad, 1, ANGLE_MAX),
    OF_LIGHT("/spot/outerConeAngle", outer_cone_rad, 1, ANGLE_MAX),
    OF_CAMERA("/perspective/yfov", y_fov_rad, CAMERA_LEAST, FOV_MAX),
    OF_CAMERA("/perspective/aspectRatio", aspect, CAMERA_LEAST, CAMERA_MOST),
    OF_CAMERA("/perspective/znear", z_near, CAMERA_LEAST, CAMERA_MOST),
    OF_CAMERA("/perspective/zfar", z_far, CAMERA_LEAST, CAMERA_MOST),
    OF_CAMERA("/orthographic/xmag", x_mag, CAMERA_LEAST, CAMERA_MOST),
    OF_CAMERA("/orthographic/ymag", y_mag, CAMERA_LEAST, CAMERA_MOST),
    OF_CAMERA("/orthographic/znear", z_near, 0, CAMERA_MOST),
    OF_CAMERA("/orthographic/zfar", z_far, CAMERA_LEAST, CAMERA_MOST),
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
    if (!member->turned)
        return;
    struct scene_texture_ref *ref = (void *)((char *)record + member->turned);
    scene_texture_ref_turn(ref, (double)ref->uv_rotation_rad);
}

void scene_texture_ref_turn(struct scene_texture_ref *ref, double rotation_rad)
{
    double c = cos(rotation_rad), s = sin(rotation_rad);
    double sx = (double)ref->uv_scale[0], sy = (double)ref->uv_scale[1];
    ref->uv_transform[0] = (float)(c * sx);
    ref->uv_transform[1] = (float)(s * sy);
    ref->uv_transform[3] = (float)(0 - s * sx); /* not -0 */
    ref->uv_transform[4] = (float)(c * sy);
}
