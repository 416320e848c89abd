/* SPDX-License-Identifier: MIT */
/* The glTF document as plain C, parsed by tinygltf. The only home of tinygltf is gltf_shim.cpp.
 *
 * tinygltf gets nothing but JSON: buffers, images, skins and animations were taken out by
 * gltf_json.h, so that it never copies, decodes or opens anything. What it accepts is not yet
 * checked: every index, count and number of a document is whatever the file says, and the
 * import_*.c files check each where they use it. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_GLTF_SHIM_H
#define VITRAIL_RENDERER_IMPORT_GLTF_SHIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Indices are -1 where the file has none. Text is never NULL. All of it lives as long as the
 * document. */

struct gltf_numbers { /* a JSON array of numbers; count 0 when absent */
    const double *values;
    size_t count;
};

struct gltf_indices {
    const int *values;
    size_t count;
};

/* EXT_meshopt_compression or KHR_meshopt_compression, which have the same members. */
struct gltf_meshopt {
    const char *extension; /* its name; NULL: the view is not compressed */
    int buffer, byte_offset, byte_length, byte_stride, count;
    const char *mode, *filter;
};

struct gltf_buffer_view {
    int buffer;
    uint64_t byte_offset, byte_length, byte_stride; /* stride 0 = tightly packed */
    struct gltf_meshopt meshopt;
};

/* The numbers of glTF, which are those of OpenGL. */
enum gltf_component {
    GLTF_BYTE = 5120,
    GLTF_UNSIGNED_BYTE = 5121,
    GLTF_SHORT = 5122,
    GLTF_UNSIGNED_SHORT = 5123,
    GLTF_UNSIGNED_INT = 5125,
    GLTF_FLOAT = 5126,
};

struct gltf_accessor {
    int buffer_view;
    uint64_t byte_offset, count;
    int component;  /* enum gltf_component, or an invalid number */
    int components; /* 1 to 4; 0 for matrices */
    bool is_matrix_4x4, is_normalized, is_sparse;
    int sparse_count;
    int sparse_index_view, sparse_index_offset, sparse_index_component;
    int sparse_value_view, sparse_value_offset;
};

enum gltf_attribute {
    GLTF_POSITION,
    GLTF_NORMAL,
    GLTF_TANGENT,
    GLTF_TEXCOORD_0,
    GLTF_TEXCOORD_1,
    GLTF_COLOR_0,
    GLTF_JOINTS_0,
    GLTF_WEIGHTS_0,
    GLTF_JOINTS_1,
    GLTF_WEIGHTS_1,
    GLTF_ATTRIBUTE_COUNT
};

struct gltf_target { /* of morphing: accessors of differences */
    int position, normal, tangent;
};

/* Of KHR_materials_variants: the material that a primitive has under some variants. */
struct gltf_variant_mapping {
    int material;
    struct gltf_indices variants; /* -1 for what is no index */
};

/* Of a primitive. */
enum gltf_mode {
    GLTF_POINTS,
    GLTF_LINES,
    GLTF_LINE_LOOP,
    GLTF_LINE_STRIP,
    GLTF_TRIANGLES,
    GLTF_TRIANGLE_STRIP,
    GLTF_TRIANGLE_FAN
};

struct gltf_primitive {
    int attributes[GLTF_ATTRIBUTE_COUNT]; /* accessors */
    int indices, material, mode;
    const struct gltf_target *targets;
    size_t target_count;
    const struct gltf_variant_mapping *mappings;
    size_t mapping_count;
    bool has_more_joints;                       /* JOINTS_2 */
    bool is_draco;                              /* carries KHR_draco_mesh_compression */
    int draco_view;                             /* buffer view of its stream */
    int draco_attributes[GLTF_ATTRIBUTE_COUNT]; /* ids in the stream; -1: not there */
};

struct gltf_mesh {
    const char *name;
    const struct gltf_primitive *primitives;
    size_t primitive_count;
    struct gltf_numbers weights; /* of morph targets */
};

/* Of EXT_mesh_gpu_instancing. */
enum gltf_instance_attribute {
    GLTF_INSTANCE_TRANSLATION,
    GLTF_INSTANCE_ROTATION,
    GLTF_INSTANCE_SCALE,
    GLTF_INSTANCE_ATTRIBUTE_COUNT
};

struct gltf_node {
    const char *name;
    int mesh, camera, light, skin;
    int grid;                                               /* VITRAIL_density_grids */
    bool is_visible;                                        /* KHR_node_visibility */
    bool is_instanced;                                      /* carries EXT_mesh_gpu_instancing */
    int instance_attributes[GLTF_INSTANCE_ATTRIBUTE_COUNT]; /* accessors */
    struct gltf_indices children;
    struct gltf_numbers matrix, translation, rotation, scale;
    struct gltf_numbers weights; /* of morph targets; those of the mesh when absent */
};

struct gltf_scene {
    const char *name;
    struct gltf_indices nodes;
};

struct gltf_texture_ref {
    int texture, texcoord;
    bool has_transform; /* KHR_texture_transform; its texCoord is already in texcoord */
    struct gltf_numbers offset, scale;
    double rotation_rad;
};

/* Same order as enum scene_texture_slot. */
enum gltf_texture_slot {
    GLTF_TEXTURE_BASE_COLOR,
    GLTF_TEXTURE_METALLIC_ROUGHNESS,
    GLTF_TEXTURE_NORMAL,
    GLTF_TEXTURE_OCCLUSION,
    GLTF_TEXTURE_EMISSIVE,
    GLTF_TEXTURE_TRANSMISSION,
    GLTF_TEXTURE_THICKNESS,
    GLTF_TEXTURE_SPECULAR,
    GLTF_TEXTURE_SPECULAR_COLOR,
    GLTF_TEXTURE_CLEARCOAT,
    GLTF_TEXTURE_CLEARCOAT_ROUGHNESS,
    GLTF_TEXTURE_CLEARCOAT_NORMAL,
    GLTF_TEXTURE_SHEEN_COLOR,
    GLTF_TEXTURE_SHEEN_ROUGHNESS,
    GLTF_TEXTURE_IRIDESCENCE,
    GLTF_TEXTURE_IRIDESCENCE_THICKNESS,
    GLTF_TEXTURE_ANISOTROPY,
    GLTF_TEXTURE_DIFFUSE_TRANSMISSION,
    GLTF_TEXTURE_DIFFUSE_TRANSMISSION_COLOR,
    GLTF_TEXTURE_SLOT_COUNT
};

struct gltf_material {
    const char *name;
    const char *alpha_mode;
    double alpha_cutoff;
    bool is_double_sided, is_unlit;
    struct gltf_numbers base_color, emissive;
    double metallic, roughness, normal_scale, occlusion_strength;
    double emissive_strength, transmission, ior, thickness, dispersion;
    bool has_attenuation_distance; /* false = infinite */
    double attenuation_distance;
    struct gltf_numbers attenuation_color;
    bool has_specular, has_clearcoat, has_sheen; /* KHR_materials_... */
    double specular, clearcoat, clearcoat_roughness, clearcoat_normal_scale, sheen_roughness;
    struct gltf_numbers specular_color, sheen_color;
    double anisotropy, anisotropy_rad, diffuse_transmission;
    struct gltf_numbers diffuse_transmission_color;
    double iridescence, iridescence_ior, iridescence_least_nm, iridescence_most_nm;
    const char *pass_through; /* extras vitrail.pass_through.model, or "" */
    struct gltf_numbers edge_color;
    double edge_exponent; /* 1 when absent */
    struct gltf_texture_ref textures[GLTF_TEXTURE_SLOT_COUNT];
};

struct gltf_texture {
    const char *name;
    int image, sampler; /* the image is that of EXT_texture_webp where there is one */
    bool is_basisu;     /* carries KHR_texture_basisu; image is its fallback */
};

struct gltf_sampler {
    int mag_filter, min_filter; /* -1 when absent */
    int wrap_s, wrap_t;
};

struct gltf_light {
    const char *name, *type;
    struct gltf_numbers color;
    double intensity, range, inner_cone_rad, outer_cone_rad;
};

struct gltf_camera {
    const char *name;
    bool is_orthographic;
    double y_fov_rad, aspect, x_mag, y_mag, z_near, z_far;
};

/* Of VITRAIL_density_grids. */
struct gltf_grid {
    const char *name;
    struct gltf_numbers size, min, max, extinction, color;
    double density, anisotropy;
    int values;            /* accessor, or -1 */
    const char *procedure; /* its type; NULL: none */
    double seed, detail;   /* of it */
};

struct gltf_document {
    const char *const *extensions_used;
    size_t extension_used_count;
    const char *const *extensions_required;
    size_t extension_required_count;
    const char *const *variants; /* names of KHR_materials_variants; "" without one */
    size_t variant_count;
    const struct gltf_buffer_view *views;
    size_t view_count;
    const struct gltf_accessor *accessors;
    size_t accessor_count;
    const struct gltf_mesh *meshes;
    size_t mesh_count;
    const struct gltf_node *nodes;
    size_t node_count;
    const struct gltf_scene *scenes;
    size_t scene_count;
    const struct gltf_material *materials;
    size_t material_count;
    const struct gltf_texture *textures;
    size_t texture_count;
    const struct gltf_sampler *samplers;
    size_t sampler_count;
    const struct gltf_light *lights;
    size_t light_count;
    const struct gltf_camera *cameras;
    size_t camera_count;
    const struct gltf_grid *grids;
    size_t grid_count;
    int default_scene; /* -1 when absent */
};

const char *gltf_attribute_name(int attribute); /* as in a file: "POSITION" */

/* `known` is a NULL-terminated list: any other required extension is ERROR_UNSUPPORTED by name,
 * whatever else is wrong with the file. json need not be NUL-terminated and is not kept. */
struct gltf_document *gltf_document_create(const char *json, size_t json_length,
                                           const char *const *known, struct error *err);

/* Gives the primitives, in the order of the document, the accessors of their indices
 * (gltf_indices.h). */
void gltf_document_put_indices(struct gltf_document *document, struct gltf_indices indices);

void gltf_document_destroy(struct gltf_document *document); /* accepts NULL */

#ifdef __cplusplus
}
#endif
#endif
