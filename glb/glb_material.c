/* SPDX-License-Identifier: MIT */
/* Images, textures and materials of the GLB builder. */
#include "glb/glb_internal.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "glb/png_encode.h"

int glb_builder_add_image(struct glb_builder *builder, const char *name, const uint8_t *rgba,
                          int width_px, int height_px)
{
    if (builder->failure.code != ERROR_NONE)
        return 0;
    void *png;
    size_t png_bytes;
    if (!png_encode(rgba, width_px, height_px, &png, &png_bytes, &builder->failure))
        return error_wrap(&builder->failure, "image '%s'", name ? name : "");
    int view = glb_add_view(builder, png, png_bytes, 0);
    free(png);
    json_t *image = glb_object(builder);
    glb_put_name(builder, image, name);
    glb_put(builder, image, "bufferView", json_integer(view - 1));
    glb_put(builder, image, "mimeType", json_string("image/png"));
    return glb_append(builder, GLB_KIND_IMAGE, image);
}

int glb_builder_add_texture(struct glb_builder *builder, const struct glb_texture_desc *desc)
{
    static const int mag_filters[] = {9729, 9729, 9728}; /* LINEAR, LINEAR, NEAREST */
    static const int min_filters[] = {9987, 9729, 9728}; /* LINEAR_MIPMAP_LINEAR, LINEAR, NEAREST */
    static const int wraps[] = {10497, 33071, 33648}; /* REPEAT, CLAMP_TO_EDGE, MIRRORED_REPEAT */
    if (builder->failure.code != ERROR_NONE)
        return 0;
    if (!glb_check_id(builder, GLB_KIND_IMAGE, desc->image, "texture.image"))
        return 0;
    if (desc->image == 0)
        return error_set(&builder->failure, ERROR_INVALID_REQUEST, "texture.image is required");
    json_t *sampler = glb_object(builder);
    glb_put(builder, sampler, "magFilter", json_integer(mag_filters[desc->filter]));
    glb_put(builder, sampler, "minFilter", json_integer(min_filters[desc->filter]));
    glb_put(builder, sampler, "wrapS", json_integer(wraps[desc->wrap_s]));
    glb_put(builder, sampler, "wrapT", json_integer(wraps[desc->wrap_t]));
    int sampler_id = glb_append(builder, GLB_KIND_SAMPLER, sampler);

    json_t *texture = glb_object(builder);
    glb_put_name(builder, texture, desc->name);
    glb_put(builder, texture, "sampler", json_integer(sampler_id - 1));
    glb_put(builder, texture, "source", json_integer(desc->image - 1));
    return glb_append(builder, GLB_KIND_TEXTURE, texture);
}

/* Puts a textureInfo under key, or nothing when ref names no texture. Returns it, borrowed. */
static json_t *put_texture(struct glb_builder *builder, json_t *object, const char *key,
                           const struct glb_texture_ref *ref)
{
    if (ref->texture == 0 || !glb_check_id(builder, GLB_KIND_TEXTURE, ref->texture, key) ||
        !glb_check_range(builder, ref->texcoord, 0, 1, key))
        return NULL;
    json_t *info = glb_object(builder);
    glb_put(builder, info, "index", json_integer(ref->texture - 1));
    if (ref->texcoord)
        glb_put(builder, info, "texCoord", json_integer(ref->texcoord));
    if (ref->has_transform) {
        static const double unit[2] = {1, 1};
        const double *scale = ref->scale[0] == 0 && ref->scale[1] == 0 ? unit : ref->scale;
        json_t *transform = glb_object(builder), *extensions = glb_object(builder);
        glb_put(builder, transform, "offset", glb_numbers(builder, ref->offset, 2, key));
        glb_put(builder, transform, "rotation", glb_number(builder, ref->rotation_rad, key));
        glb_put(builder, transform, "scale", glb_numbers(builder, scale, 2, key));
        glb_put(builder, extensions, "KHR_texture_transform", transform);
        glb_put(builder, info, "extensions", extensions);
        glb_use_extension(builder, "KHR_texture_transform");
    }
    glb_put(builder, object, key, info);
    return info;
}

static void put_extension(struct glb_builder *builder, json_t *extensions, const char *name,
                          json_t *body)
{
    glb_put(builder, extensions, name, body);
    glb_use_extension(builder, name);
}

static json_t *metallic_roughness(struct glb_builder *builder, const struct glb_material_desc *desc)
{
    static const double white[4] = {1, 1, 1, 1};
    const double *c = desc->base_color;
    bool is_unset = c[0] == 0 && c[1] == 0 && c[2] == 0 && c[3] == 0;
    json_t *pbr = glb_object(builder);
    glb_put(builder, pbr, "baseColorFactor",
            glb_numbers(builder, is_unset ? white : c, 4, "base_color"));
    glb_put(builder, pbr, "metallicFactor", glb_number(builder, desc->metallic, "metallic"));
    glb_put(builder, pbr, "roughnessFactor", glb_number(builder, desc->roughness, "roughness"));
    put_texture(builder, pbr, "baseColorTexture", &desc->base_color_texture);
    put_texture(builder, pbr, "metallicRoughnessTexture", &desc->metallic_roughness_texture);
    return pbr;
}

static void put_glass(struct glb_builder *builder, json_t *extensions,
                      const struct glb_material_desc *desc)
{
    if (desc->transmission > 0) {
        json_t *body = glb_object(builder);
        glb_put(builder, body, "transmissionFactor",
                glb_number(builder, desc->transmission, "transmission"));
        put_texture(builder, body, "transmissionTexture", &desc->transmission_texture);
        put_extension(builder, extensions, "KHR_materials_transmission", body);
    }
    if (desc->has_ior) {
        json_t *body = glb_object(builder);
        glb_put(builder, body, "ior", glb_number(builder, desc->ior, "ior"));
        put_extension(builder, extensions, "KHR_materials_ior", body);
    }
    if (desc->dispersion > 0) {
        json_t *body = glb_object(builder);
        glb_put(builder, body, "dispersion", glb_number(builder, desc->dispersion, "dispersion"));
        put_extension(builder, extensions, "KHR_materials_dispersion", body);
    }
    if (desc->thickness > 0) {
        json_t *body = glb_object(builder);
        glb_put(builder, body, "thicknessFactor",
                glb_number(builder, desc->thickness, "thickness"));
        put_texture(builder, body, "thicknessTexture", &desc->thickness_texture);
        if (desc->attenuation_distance > 0) {
            glb_put(builder, body, "attenuationDistance",
                    glb_number(builder, desc->attenuation_distance, "attenuation_distance"));
            glb_put(builder, body, "attenuationColor",
                    glb_numbers(builder, desc->attenuation_color, 3, "attenuation_color"));
        }
        put_extension(builder, extensions, "KHR_materials_volume", body);
    }
}

static void put_lobes(struct glb_builder *builder, json_t *extensions,
                      const struct glb_material_desc *desc)
{
    const double *sheen = desc->sheen_color;
    if (desc->has_specular) {
        json_t *body = glb_object(builder);
        glb_put(builder, body, "specularFactor", glb_number(builder, desc->specular, "specular"));
        glb_put(builder, body, "specularColorFactor",
                glb_numbers(builder, desc->specular_color, 3, "specular_color"));
        put_texture(builder, body, "specularTexture", &desc->specular_texture);
        put_texture(builder, body, "specularColorTexture", &desc->specular_color_texture);
        put_extension(builder, extensions, "KHR_materials_specular", body);
    }
    if (desc->clearcoat > 0) {
        json_t *body = glb_object(builder);
        glb_put(builder, body, "clearcoatFactor",
                glb_number(builder, desc->clearcoat, "clearcoat"));
        glb_put(builder, body, "clearcoatRoughnessFactor",
                glb_number(builder, desc->clearcoat_roughness, "clearcoat_roughness"));
        put_texture(builder, body, "clearcoatTexture", &desc->clearcoat_texture);
        put_texture(builder, body, "clearcoatRoughnessTexture", &desc->clearcoat_roughness_texture);
        put_texture(builder, body, "clearcoatNormalTexture", &desc->clearcoat_normal_texture);
        put_extension(builder, extensions, "KHR_materials_clearcoat", body);
    }
    if (sheen[0] > 0 || sheen[1] > 0 || sheen[2] > 0) {
        json_t *body = glb_object(builder);
        glb_put(builder, body, "sheenColorFactor", glb_numbers(builder, sheen, 3, "sheen_color"));
        glb_put(builder, body, "sheenRoughnessFactor",
                glb_number(builder, desc->sheen_roughness, "sheen_roughness"));
        put_texture(builder, body, "sheenColorTexture", &desc->sheen_color_texture);
        put_texture(builder, body, "sheenRoughnessTexture", &desc->sheen_roughness_texture);
        put_extension(builder, extensions, "KHR_materials_sheen", body);
    }
}

static void put_iridescence(struct glb_builder *builder, json_t *extensions,
                            const struct glb_material_desc *desc)
{
    static const char *const names[] = {"iridescenceIor", "iridescenceThicknessMinimum",
                                        "iridescenceThicknessMaximum"};
    const double values[] = {desc->iridescence_ior, desc->film_least_nm, desc->film_most_nm};
    if (desc->iridescence <= 0)
        return;
    json_t *body = glb_object(builder);
    glb_put(builder, body, "iridescenceFactor",
            glb_number(builder, desc->iridescence, "iridescence"));
    for (int i = 0; i < 3; i++)
        if (values[i] > 0)
            glb_put(builder, body, names[i], glb_number(builder, values[i], names[i]));
    put_texture(builder, body, "iridescenceTexture", &desc->iridescence_texture);
    put_texture(builder, body, "iridescenceThicknessTexture", &desc->iridescence_thickness_texture);
    put_extension(builder, extensions, "KHR_materials_iridescence", body);
}

static void put_anisotropy(struct glb_builder *builder, json_t *extensions,
                           const struct glb_material_desc *desc)
{
    if (desc->anisotropy <= 0)
        return;
    json_t *body = glb_object(builder);
    glb_put(builder, body, "anisotropyStrength",
            glb_number(builder, desc->anisotropy, "anisotropy"));
    glb_put(builder, body, "anisotropyRotation",
            glb_number(builder, desc->anisotropy_rad, "anisotropy_rad"));
    put_texture(builder, body, "anisotropyTexture", &desc->anisotropy_texture);
    put_extension(builder, extensions, "KHR_materials_anisotropy", body);
}

static void put_diffuse_transmission(struct glb_builder *builder, json_t *extensions,
                                     const struct glb_material_desc *desc)
{
    if (desc->diffuse_transmission <= 0)
        return;
    json_t *body = glb_object(builder);
    glb_put(builder, body, "diffuseTransmissionFactor",
            glb_number(builder, desc->diffuse_transmission, "diffuse_transmission"));
    glb_put(
        builder, body, "diffuseTransmissionColorFactor",
        glb_numbers(builder, desc->diffuse_transmission_color, 3, "diffuse_transmission_color"));
    put_texture(builder, body, "diffuseTransmissionTexture", &desc->diffuse_transmission_texture);
    put_texture(builder, body, "diffuseTransmissionColorTexture",
                &desc->diffuse_transmission_color_texture);
    put_extension(builder, extensions, "KHR_materials_diffuse_transmission", body);
}

static void put_emissive(struct glb_builder *builder, json_t *material, json_t *extensions,
                         const struct glb_material_desc *desc)
{
    const double *e = desc->emissive;
    if (e[0] == 0 && e[1] == 0 && e[2] == 0)
        return;
    glb_put(builder, material, "emissiveFactor", glb_numbers(builder, e, 3, "emissive"));
    put_texture(builder, material, "emissiveTexture", &desc->emissive_texture);
    if (desc->emissive_strength != 0 && desc->emissive_strength != 1) {
        json_t *body = glb_object(builder);
        glb_put(builder, body, "emissiveStrength",
                glb_number(builder, desc->emissive_strength, "emissive_strength"));
        put_extension(builder, extensions, "KHR_materials_emissive_strength", body);
    }
}

static void put_alpha(struct glb_builder *builder, json_t *material,
                      const struct glb_material_desc *desc)
{
    if (desc->alpha_mode == GLB_BLEND)
        glb_put(builder, material, "alphaMode", json_string("BLEND"));
    if (desc->alpha_mode == GLB_MASK) {
        glb_put(builder, material, "alphaMode", json_string("MASK"));
        glb_put(builder, material, "alphaCutoff",
                glb_number(builder, desc->alpha_cutoff != 0 ? desc->alpha_cutoff : 0.5,
                           "alpha_cutoff"));
    }
    if (desc->is_double_sided)
        glb_put(builder, material, "doubleSided", json_true());
}

static void put_pass_through(struct glb_builder *builder, json_t *material,
                             const struct glb_material_desc *desc)
{
    if (desc->pass_through == GLB_PASS_CONSTANT)
        return;
    json_t *body = glb_object(builder), *extras = glb_object(builder);
    bool is_slab = desc->pass_through == GLB_PASS_SLAB;
    glb_put(builder, body, "model", json_string(is_slab ? "slab" : "edge"));
    if (!is_slab) {
        glb_put(builder, body, "edge_color",
                glb_numbers(builder, desc->edge_color, 3, "edge_color"));
        glb_put(builder, body, "edge_exponent",
                glb_number(builder, desc->edge_exponent, "edge_exponent"));
    }
    glb_put(builder, extras, "vitrail", json_pack("{so}", "pass_through", body));
    glb_put(builder, material, "extras", extras);
}

static void put_surface_textures(struct glb_builder *builder, json_t *material,
                                 const struct glb_material_desc *desc)
{
    json_t *normal = put_texture(builder, material, "normalTexture", &desc->normal_texture);
    if (normal && desc->normal_scale != 0)
        glb_put(builder, normal, "scale", glb_number(builder, desc->normal_scale, "normal_scale"));
    json_t *occlusion =
        put_texture(builder, material, "occlusionTexture", &desc->occlusion_texture);
    if (occlusion && desc->occlusion_strength != 0)
        glb_put(builder, occlusion, "strength",
                glb_number(builder, desc->occlusion_strength, "occlusion_strength"));
}

static bool check_material(struct glb_builder *builder, const struct glb_material_desc *desc)
{
    bool is_good = true;
    for (int i = 0; i < 4; i++)
        is_good = is_good && glb_check_range(builder, desc->base_color[i], 0, 1, "base_color");
    for (int i = 0; i < 3; i++)
        is_good = is_good && glb_check_range(builder, desc->emissive[i], 0, 1, "emissive") &&
                  glb_check_range(builder, desc->attenuation_color[i], 0, 1, "attenuation_color") &&
                  glb_check_range(builder, desc->edge_color[i], 0, 1, "edge_color");
    return is_good && glb_check_range(builder, desc->metallic, 0, 1, "metallic") &&
           glb_check_range(builder, desc->roughness, 0, 1, "roughness") &&
           glb_check_range(builder, desc->emissive_strength, 0, FLT_MAX, "emissive_strength") &&
           glb_check_range(builder, desc->alpha_cutoff, 0, 1, "alpha_cutoff") &&
           glb_check_range(builder, desc->transmission, 0, 1, "transmission") &&
           (desc->ior == 0 || glb_check_range(builder, desc->ior, 1, FLT_MAX, "ior")) &&
           glb_check_range(builder, desc->dispersion, 0, FLT_MAX, "dispersion") &&
           glb_check_range(builder, desc->thickness, 0, FLT_MAX, "thickness") &&
           glb_check_range(builder, desc->attenuation_distance, 0, FLT_MAX,
                           "attenuation_distance") &&
           glb_check_range(builder, desc->occlusion_strength, 0, 1, "occlusion_strength") &&
           glb_check_range(builder, desc->edge_exponent, 0, FLT_MAX, "edge_exponent");
}

int glb_builder_add_material(struct glb_builder *builder, const struct glb_material_desc *desc)
{
    if (builder->failure.code != ERROR_NONE)
        return 0;
    if (!check_material(builder, desc))
        return error_wrap(&builder->failure, "material '%s'", desc->name ? desc->name : "");
    json_t *material = glb_object(builder), *extensions = glb_object(builder);
    glb_put_name(builder, material, desc->name);
    glb_put(builder, material, "pbrMetallicRoughness", metallic_roughness(builder, desc));
    put_alpha(builder, material, desc);
    put_surface_textures(builder, material, desc);
    put_emissive(builder, material, extensions, desc);
    put_glass(builder, extensions, desc);
    put_lobes(builder, extensions, desc);
    put_iridescence(builder, extensions, desc);
    put_anisotropy(builder, extensions, desc);
    put_diffuse_transmission(builder, extensions, desc);
    if (desc->is_unlit)
        put_extension(builder, extensions, "KHR_materials_unlit", glb_object(builder));
    if (json_object_size(extensions) > 0)
        glb_put(builder, material, "extensions", json_incref(extensions));
    json_decref(extensions);
    put_pass_through(builder, material, desc);
    return glb_append(builder, GLB_KIND_MATERIAL, material);
}
