/* SPDX-License-Identifier: MIT */
/* A checked, read-only view of a scene blob. Thread: any; immutable after scene_open. */
#ifndef VITRAIL_RENDERER_SCENE_SCENE_H
#define VITRAIL_RENDERER_SCENE_SCENE_H

#include <stddef.h>

#include "protocol/error.h"
#include "renderer/scene/scene_blob.h"

struct scene;

/* One of the scenes that a composed one was made from (renderer/scene/compose.h). */
struct scene_part {
    const struct scene *scene; /* borrowed */
    const char *name;          /* NULL of the base, which is the first part */
    uint64_t identity;         /* of its content; 0 of the base */
    uint32_t source_index;     /* among the parts of the description */
    /* Indices of what is the first in its scene. The node before that is the part's own. */
    uint32_t first_node, first_primitive, first_material, first_texture, first_image, first_grid;
};

/* Pointers into the blob, with their counts. Borrowed: valid while the blob's memory is. */
struct scene {
    const struct scene_header *header;
    uint64_t serial; /* of this opening: no other has it */
    const char *strings;
    const struct scene_node *nodes;
    uint32_t node_count;
    const struct scene_mesh *meshes;
    uint32_t mesh_count;
    const struct scene_primitive *primitives;
    uint32_t primitive_count;
    const struct scene_material *materials;
    uint32_t material_count; /* at least 1 */
    const struct scene_texture *textures;
    uint32_t texture_count;
    const struct scene_image *images;
    uint32_t image_count;
    const uint8_t *pixels;
    uint64_t pixel_bytes;
    const struct scene_light *lights;
    uint32_t light_count;
    const struct scene_camera *cameras;
    uint32_t camera_count;
    const uint32_t *indices;
    uint32_t index_count;
    uint32_t vertex_count;
    const float *positions, *normals; /* never NULL when vertex_count > 0 */
    const float *tangents, *texcoords_0, *texcoords_1, *colors; /* NULL when absent */
    const uint32_t *extensions_used;
    uint32_t extension_used_count;
    const uint32_t *extensions_ignored;
    uint32_t extension_ignored_count;
    const uint32_t *warnings;
    uint32_t warning_count;
    const struct scene_pose *poses;
    uint32_t pose_count;
    const struct scene_animation *animations;
    uint32_t animation_count;
    const struct scene_channel *channels;
    uint32_t channel_count;
    const float *keys;
    uint32_t key_count;
    const struct scene_skin *skins; /* this and what follows: none where nothing deforms */
    uint32_t skin_count;
    const struct scene_joint *joints;
    uint32_t joint_count;
    const struct scene_deformation *deformations;
    uint32_t deformation_count;
    const struct scene_influence *influences;
    uint32_t influence_count;
    const struct scene_target *targets;
    uint32_t target_count;
    const struct scene_delta *deltas;
    uint32_t delta_count;
    const struct scene_deformed_node *deformed_nodes;
    uint32_t deformed_node_count;
    const float *target_weights;
    uint32_t target_weight_count;
    const struct scene_grid *grids; /* this and what follows: none without density grids */
    uint32_t grid_count;
    const struct scene_grid_brick *grid_bricks;
    uint32_t grid_brick_count;
    const float (*grid_values)[SCENE_BRICK_VALUES];
    uint32_t grid_value_count; /* bricks */
    const uint32_t *variants;  /* names */
    uint32_t variant_count;
    const struct scene_variant_material *variant_materials;
    uint32_t variant_material_count;
    /* Of a composed scene, else NULL and 0. Its vertices, indices, pixels, animations,
     * deformations and variants are those of its parts; the members of that name are those of the
     * base alone. */
    const uint32_t *hidden_nodes; /* of a scene without parts */
    uint32_t hidden_node_count;
    const struct scene_part *parts;
    uint32_t part_count;
};

/* Checks every offset, count, index, enum and number (finite) of the blob, in time linear in its
 * size. The blob must stay mapped and unchanged (a sealed memfd or a file nobody else writes) while
 * the scene is used. */
MUST_CHECK bool scene_open(struct scene *scene, const void *blob, size_t size_bytes,
                           struct error *err);

/* Opens a blob of which only the first head_bytes are in memory, which hold all sections but the
 * pixels. `pixels` is NULL, `pixel_bytes` is known. */
MUST_CHECK bool scene_open_head(struct scene *scene, const void *head, size_t head_bytes,
                                struct error *err);

/* Whether a slot's texels are sRGB: the second of an image's levels_offset_bytes. */
static inline bool scene_slot_is_srgb(int slot)
{
    return slot == SCENE_TEXTURE_BASE_COLOR || slot == SCENE_TEXTURE_EMISSIVE ||
           slot == SCENE_TEXTURE_SPECULAR_COLOR || slot == SCENE_TEXTURE_SHEEN_COLOR ||
           slot == SCENE_TEXTURE_DIFFUSE_TRANSMISSION_COLOR;
}

/* The scene that holds the vertices and indices which a primitive counts from. */
static inline const struct scene *scene_of_primitive(const struct scene *scene,
                                                     const struct scene_primitive *primitive)
{
    return scene->part_count ? scene->parts[primitive->part].scene : scene;
}

/* Likewise of the bricks that a grid counts from. */
static inline const struct scene *scene_of_grid(const struct scene *scene,
                                                const struct scene_grid *grid)
{
    return scene->part_count ? scene->parts[grid->part].scene : scene;
}

/* RGBA8, first row on top. */
static inline const uint8_t *scene_image_pixels(const struct scene *scene,
                                                const struct scene_image *image)
{
    const struct scene *from = scene->part_count ? scene->parts[image->part].scene : scene;
    return from->pixels + image->offset_bytes;
}

/* Node, material, animation or variant by exact name, first match in file order; -1 when
 * there is none. "#12" means index 12, "PART/#12" the one that has it in that part. Animations and
 * variants: of the scene itself, not of its parts. */
int32_t scene_find_node(const struct scene *scene, const char *name);
int32_t scene_find_material(const struct scene *scene, const char *name);
int32_t scene_find_grid(const struct scene *scene, const char *name);
int32_t scene_find_animation(const struct scene *scene, const char *name);
int32_t scene_find_variant(const struct scene *scene, const char *name);

/* Whether light loses something on its way through the inside: transmission, a thickness, and an
 * attenuation that is neither infinite nor white (KHR_materials_volume). */
bool scene_material_attenuates(const struct scene_material *material);

/* KHR_materials_sheen: black is none. */
static inline bool scene_material_has_sheen(const struct scene_material *material)
{
    const float *color = material->sheen_color;
    return color[0] > 0 || color[1] > 0 || color[2] > 0;
}

#endif
