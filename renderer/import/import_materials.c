/* SPDX-License-Identifier: MIT */
/* Materials: glTF 2.0 specification 3.9, the KHR_materials_* extensions, and extras
 * `vitrail.pass_through`. */
#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/import/importer.h"

#define FACTOR_MAX 1e12 /* nt, m and such: keeps every product inside f32 */
#define IOR_MAX 100
#define FILM_NM_MAX 1e6 /* thicker ones show no colours */

static const struct scene_material default_material = {
    .base_color = {1, 1, 1, 1},
    .metallic = 1,
    .roughness = 1,
    .normal_scale = 1,
    .occlusion_strength = 1,
    .alpha_cutoff = 0.5f,
    .ior = 1.5f,
    .film_ior = 1.3f,
    .attenuation_color = {1, 1, 1},
    .edge_color = {1, 1, 1},
    .edge_exponent = 1,
};

static const char *const slot_names[SCENE_TEXTURE_SLOT_COUNT] = {
    [GLTF_TEXTURE_BASE_COLOR] = "baseColorTexture",
    [GLTF_TEXTURE_METALLIC_ROUGHNESS] = "metallicRoughnessTexture",
    [GLTF_TEXTURE_NORMAL] = "normalTexture",
    [GLTF_TEXTURE_OCCLUSION] = "occlusionTexture",
    [GLTF_TEXTURE_EMISSIVE] = "emissiveTexture",
    [GLTF_TEXTURE_TRANSMISSION] = "transmissionTexture",
    [GLTF_TEXTURE_THICKNESS] = "thicknessTexture",
    [GLTF_TEXTURE_SPECULAR] = "specularTexture",
    [GLTF_TEXTURE_SPECULAR_COLOR] = "specularColorTexture",
    [GLTF_TEXTURE_CLEARCOAT] = "clearcoatTexture",
    [GLTF_TEXTURE_CLEARCOAT_ROUGHNESS] = "clearcoatRoughnessTexture",
    [GLTF_TEXTURE_CLEARCOAT_NORMAL] = "clearcoatNormalTexture",
    [GLTF_TEXTURE_SHEEN_COLOR] = "sheenColorTexture",
    [GLTF_TEXTURE_SHEEN_ROUGHNESS] = "sheenRoughnessTexture",
    [GLTF_TEXTURE_IRIDESCENCE] = "iridescenceTexture",
    [GLTF_TEXTURE_IRIDESCENCE_THICKNESS] = "iridescenceThicknessTexture",
    [GLTF_TEXTURE_ANISOTROPY] = "anisotropyTexture",
    [GLTF_TEXTURE_DIFFUSE_TRANSMISSION] = "diffuseTransmissionTexture",
    [GLTF_TEXTURE_DIFFUSE_TRANSMISSION_COLOR] = "diffuseTransmissionColorTexture",
};

static void reset_refs(struct scene_material *m)
{
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        m->textures[slot] = (struct scene_texture_ref){
            .texture = -1, .uv_transform = {1, 0, 0, 0, 1, 0}, .uv_scale = {1, 1}};
}

static bool import_transform(const struct gltf_texture_ref *from, struct scene_texture_ref *to,
                             struct error *err)
{
    float offset[2] = {0, 0};
    if (!import_numbers(from->offset, 2, -FACTOR_MAX, FACTOR_MAX, offset,
                        "texture transform offset", err) ||
        !import_numbers(from->scale, 2, -FACTOR_MAX, FACTOR_MAX, to->uv_scale,
                        "texture transform scale", err) ||
        !import_number(from->rotation_rad, -FACTOR_MAX, FACTOR_MAX, &to->uv_rotation_rad,
                       "texture transform rotation", err))
        return false;
    scene_texture_ref_turn(to, from->rotation_rad);
    to->uv_transform[2] = offset[0];
    to->uv_transform[5] = offset[1];
    return true;
}

static bool import_ref(struct importer *importer, const struct gltf_texture_ref *from,
                       struct scene_texture_ref *to, struct error *err)
{
    if (from->texture == -1)
        return true;
    if (from->texture < 0 || (size_t)from->texture >= importer->document->texture_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no texture %d", from->texture);
    if (from->texcoord < 0)
        return error_set(err, ERROR_INVALID_SCENE, "texCoord is %d", from->texcoord);
    if (from->texcoord > 1) {
        importer->far_texcoords++;
        return true;
    }
    to->texture = from->texture;
    to->texcoord = (uint32_t)from->texcoord;
    importer->is_texture_used[from->texture] = true;
    return !from->has_transform || import_transform(from, to, err);
}

static bool import_alpha_mode(const char *mode, uint32_t *out, struct error *err)
{
    static const char *const names[] = {
        [SCENE_OPAQUE] = "OPAQUE", [SCENE_MASK] = "MASK", [SCENE_BLEND] = "BLEND"};
    for (uint32_t i = 0; i < 3; i++)
        if (strcmp(mode, names[i]) == 0) {
            *out = i;
            return true;
        }
    return error_set(err, ERROR_INVALID_SCENE, "alphaMode is '%s', not OPAQUE, MASK or BLEND",
                     mode);
}

static bool import_pass_through(const struct gltf_material *from, struct scene_material *to,
                                struct error *err)
{
    static const char *const names[] = {
        [SCENE_PASS_CONSTANT] = "constant", [SCENE_PASS_SLAB] = "slab", [SCENE_PASS_EDGE] = "edge"};
    if (!*from->pass_through)
        return true;
    for (uint32_t i = 0; i < 3; i++)
        if (strcmp(from->pass_through, names[i]) == 0) {
            to->pass_through = i;
            return import_numbers(from->edge_color, 3, 0, 1, to->edge_color,
                                  "extras vitrail edge_color", err) &&
                   import_number(from->edge_exponent, 0, 1000, &to->edge_exponent,
                                 "extras vitrail edge_exponent", err);
        }
    return error_set(err, ERROR_INVALID_SCENE,
                     "extras vitrail.pass_through.model is '%s', not constant, slab or edge",
                     from->pass_through);
}

static bool import_core(const struct gltf_material *from, struct scene_material *to,
                        struct error *err)
{
    return import_numbers(from->base_color, 4, 0, 1, to->base_color, "baseColorFactor", err) &&
           import_number(from->metallic, 0, 1, &to->metallic, "metallicFactor", err) &&
           import_number(from->roughness, 0, 1, &to->roughness, "roughnessFactor", err) &&
           import_number(from->normal_scale, -FACTOR_MAX, FACTOR_MAX, &to->normal_scale,
                         "normalTexture.scale", err) &&
           import_number(from->occlusion_strength, 0, 1, &to->occlusion_strength,
                         "occlusionTexture.strength", err) &&
           import_number(from->alpha_cutoff, 0, FACTOR_MAX, &to->alpha_cutoff, "alphaCutoff",
                         err) &&
           import_alpha_mode(from->alpha_mode, &to->alpha_mode, err);
}

static bool import_emissive(const struct gltf_material *from, struct scene_material *to,
                            struct error *err)
{
    float strength;
    if (!import_numbers(from->emissive, 3, 0, FACTOR_MAX, to->emissive, "emissiveFactor", err) ||
        !import_number(from->emissive_strength, 0, FACTOR_MAX, &strength, "emissiveStrength", err))
        return false;
    for (int i = 0; i < 3; i++) {
        double product = (double)to->emissive[i] * strength;
        if (!import_number(product, 0, FACTOR_MAX, &to->emissive[i],
                           "emissiveFactor times emissiveStrength", err))
            return false;
    }
    return true;
}

static bool import_glass(const struct gltf_material *from, struct scene_material *to,
                         struct error *err)
{
    if (!import_number(from->dispersion, 0, FACTOR_MAX, &to->dispersion, "dispersion", err) ||
        !import_number(from->transmission, 0, 1, &to->transmission, "transmissionFactor", err) ||
        !import_number(from->thickness, 0, FACTOR_MAX, &to->thickness, "thicknessFactor", err) ||
        !import_numbers(from->attenuation_color, 3, 0, 1, to->attenuation_color, "attenuationColor",
                        err))
        return false;
    to->ior = 0; /* KHR_materials_ior: 0 is the backward compatible "infinity" */
    if (from->ior != 0 && !import_number(from->ior, 1, IOR_MAX, &to->ior, "ior", err))
        return false;
    if (!from->has_attenuation_distance)
        return true;
    if (from->attenuation_distance <= 0)
        return error_set(err, ERROR_INVALID_SCENE, "attenuationDistance is %g, not positive",
                         from->attenuation_distance);
    /* Some write FLT_MAX for infinite. */
    float distance = (float)fmin(from->attenuation_distance, FACTOR_MAX);
    to->attenuation_distance = distance < 1e-30f                          ? 1e-30f
                               : from->attenuation_distance >= FACTOR_MAX ? 0
                                                                          : distance;
    return true;
}

static bool import_specular(const struct gltf_material *from, struct scene_material *to,
                            struct error *err)
{
    to->specular = 1;
    to->specular_color[0] = to->specular_color[1] = to->specular_color[2] = 1;
    if (!import_number(from->specular, 0, 1, &to->specular, "specularFactor", err) ||
        !import_numbers(from->specular_color, 3, 0, FACTOR_MAX, to->specular_color,
                        "specularColorFactor", err))
        return false;
    to->flags |= SCENE_MATERIAL_SPECULAR;
    return true;
}

/* KHR_materials_specular, _clearcoat and _sheen. What a material has nothing of stays zero. */
static bool import_lobes(const struct gltf_material *from, struct scene_material *to,
                         struct error *err)
{
    return (!from->has_specular || import_specular(from, to, err)) &&
           import_number(from->clearcoat, 0, 1, &to->clearcoat, "clearcoatFactor", err) &&
           import_number(from->clearcoat_roughness, 0, 1, &to->clearcoat_roughness,
                         "clearcoatRoughnessFactor", err) &&
           import_number(from->clearcoat_normal_scale, -FACTOR_MAX, FACTOR_MAX,
                         &to->clearcoat_normal_scale, "clearcoatNormalTexture.scale", err) &&
           import_numbers(from->sheen_color, 3, 0, 1, to->sheen_color, "sheenColorFactor", err) &&
           import_number(from->sheen_roughness, 0, 1, &to->sheen_roughness, "sheenRoughnessFactor",
                         err);
}

static bool import_iridescence(const struct gltf_material *from, struct scene_material *to,
                               struct error *err)
{
    return import_number(from->iridescence, 0, 1, &to->iridescence, "iridescenceFactor", err) &&
           import_number(from->iridescence_ior, 1, IOR_MAX, &to->film_ior, "iridescenceIor", err) &&
           import_number(from->iridescence_least_nm, 0, FILM_NM_MAX, &to->film_nm[0],
                         "iridescenceThicknessMinimum", err) &&
           import_number(from->iridescence_most_nm, 0, FILM_NM_MAX, &to->film_nm[1],
                         "iridescenceThicknessMaximum", err);
}

static bool import_anisotropy(const struct gltf_material *from, struct scene_material *to,
                              struct error *err)
{
    return import_number(from->anisotropy, 0, 1, &to->anisotropy, "anisotropyStrength", err) &&
           import_number(from->anisotropy_rad, -FACTOR_MAX, FACTOR_MAX, &to->anisotropy_rad,
                         "anisotropyRotation", err);
}

static bool import_diffuse_transmission(const struct gltf_material *from, struct scene_material *to,
                                        struct error *err)
{
    for (int k = 0; k < 3; k++)
        to->diffuse_transmission_color[k] = 1;
    return import_number(from->diffuse_transmission, 0, 1, &to->diffuse_transmission,
                         "diffuseTransmissionFactor", err) &&
           import_numbers(from->diffuse_transmission_color, 3, 0, 1, to->diffuse_transmission_color,
                          "diffuseTransmissionColorFactor", err);
}

static bool import_material(struct importer *importer, const struct gltf_material *from,
                            struct scene_material *to, struct error *err)
{
    *to = default_material;
    reset_refs(to);
    to->flags = (from->is_double_sided ? SCENE_MATERIAL_DOUBLE_SIDED : 0u) |
                (from->is_unlit ? SCENE_MATERIAL_UNLIT : 0u);
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        if (!import_ref(importer, &from->textures[slot], &to->textures[slot], err))
            return error_wrap(err, "%s", slot_names[slot]);
    return import_core(from, to, err) && import_emissive(from, to, err) &&
           import_glass(from, to, err) && import_lobes(from, to, err) &&
           import_iridescence(from, to, err) && import_anisotropy(from, to, err) &&
           import_diffuse_transmission(from, to, err) && import_pass_through(from, to, err);
}

static bool append_material(struct importer *importer, const struct scene_material *material,
                            const char *name, struct error *err)
{
    uint32_t offset;
    if (!blob_writer_add_text(&importer->writer, name, &offset, err))
        return false;
    struct scene_material *record = blob_writer_append(&importer->writer, SCENE_MATERIALS, 1, err);
    if (!record)
        return false;
    *record = *material;
    record->name = offset;
    return true;
}

bool import_materials(struct importer *importer, struct error *err)
{
    const struct gltf_document *document = importer->document;
    static_assert((int)SCENE_TEXTURE_SLOT_COUNT == (int)GLTF_TEXTURE_SLOT_COUNT,
                  "both list the same slots");
    importer->is_texture_used =
        calloc(document->texture_count + 1, sizeof *importer->is_texture_used);
    if (!importer->is_texture_used)
        return error_set(err, ERROR_NO_MEMORY, "%zu textures", document->texture_count);
    struct scene_material material;
    for (size_t i = 0; i < document->material_count; i++) {
        const char *name = document->materials[i].name;
        if (!import_material(importer, &document->materials[i], &material, err))
            return error_wrap(err, "material %zu '%s'", i, name);
        if (!append_material(importer, &material, name, err))
            return false;
    }
    material = default_material;
    reset_refs(&material);
    return append_material(importer, &material, "", err);
}
