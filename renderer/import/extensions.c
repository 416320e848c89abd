/* SPDX-License-Identifier: MIT */
/* The names of the extensions. */
#include "renderer/import/extensions.h"

#include <stddef.h>

/* One to a line. */
/* clang-format off */
static const char *const known_extensions[] = {
    "KHR_texture_basisu", /* only passed; those that follow are evaluated */
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_transform",
    "VITRAIL_density_grids",
    NULL,
};
/* clang-format on */

const char *const *scene_import_extensions(void)
{
    return known_extensions + 1;
}

const char *const *scene_import_passed_extensions(void)
{
    return known_extensions;
}
