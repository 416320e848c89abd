/* SPDX-License-Identifier: MIT */
/* The scene blob: one flat, position-independent, little-endian block that the decoder writes and
 * workers map.
 *
 * Layout: header, then the sections in any order, each 16-byte aligned; the writer puts the pixels
 * last, so that all else, the head, can be had without them. A section is an array of `count`
 * records of `stride` bytes. Indices between records are int32 with -1 for "none", or
 * uint32 where none is impossible. Text is a byte offset into the NUL-separated SCENE_STRINGS
 * section; offset 0 is the empty string. Everything is checked twice: by the decoder that writes
 * it, and by scene_open in the worker that trusts no one. */
#ifndef VITRAIL_RENDERER_SCENE_SCENE_BLOB_H
#define VITRAIL_RENDERER_SCENE_SCENE_BLOB_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SCENE_BLOB_MAGIC "VITRAIL" /* 8 bytes with the NUL */
enum { SCENE_BLOB_VERSION = 16 };  /* any change of a record or of its meaning raises it */

enum scene_section {
    SCENE_STRINGS,    /* char */
    SCENE_NODES,      /* struct scene_node, parents before children */
    SCENE_MESHES,     /* struct scene_mesh */
    SCENE_PRIMITIVES, /* struct scene_primitive; those of one mesh are contiguous */
    SCENE_MATERIALS,  /* struct scene_material; the last one is the glTF default material */
    SCENE_TEXTURES,   /* struct scene_texture: an image with its sampler */
    SCENE_IMAGES,     /* struct scene_image */
    SCENE_PIXELS,     /* bytes of all images and their levels, RGBA8, first row on top (v = 0) */
    SCENE_LIGHTS,     /* struct scene_light */
    SCENE_CAMERAS,    /* struct scene_camera */
    SCENE_INDICES,    /* u32, relative to the primitive's first_vertex */
    SCENE_POSITIONS,  /* 3 f32 per vertex, model space */
    SCENE_NORMALS,    /* 3 f32 per vertex, unit; zero vector for lines and points without normals */
    SCENE_TANGENTS,   /* 4 f32 per vertex, or absent (count 0) when no primitive brings tangents */
    SCENE_TEXCOORDS_0, /* 2 f32 per vertex, or absent */
    SCENE_TEXCOORDS_1, /* 2 f32 per vertex, or absent */
    SCENE_COLORS,      /* 4 f32 per vertex linear RGBA, or absent; 1 where a primitive has none */
    SCENE_EXTENSIONS_USED,    /* u32 string offsets */
    SCENE_EXTENSIONS_IGNORED, /* u32 string offsets: used but not evaluated here */
    SCENE_WARNINGS,           /* u32 string offsets: sentences for the user */
    SCENE_POSES,              /* struct scene_pose, nodes ascending: those that animations move */
    SCENE_ANIMATIONS,         /* struct scene_animation; their channels follow each other */
    SCENE_CHANNELS,           /* struct scene_channel */
    SCENE_KEYS,               /* f32 */
    /* Absent where nothing deforms (renderer/scene/deform.h): */
    SCENE_SKINS,        /* struct scene_skin; their joints follow each other */
    SCENE_JOINTS,       /* struct scene_joint */
    SCENE_DEFORMATIONS, /* struct scene_deformation, primitives ascending; their influences and
                           targets follow each other */
    SCENE_INFLUENCES,   /* struct scene_influence */
    SCENE_TARGETS,      /* struct scene_target; their deltas follow each other */
    SCENE_DELTAS,       /* struct scene_delta */
    /* struct scene_deformed_node, nodes ascending; their weights follow each other. */
    SCENE_DEFORMED_NODES,
    SCENE_TARGET_WEIGHTS,    /* f32 */
    SCENE_VARIANTS,          /* u32 string offsets: names of KHR_materials_variants, or absent */
    SCENE_VARIANT_MATERIALS, /* struct scene_variant_material, primitives not descending */
    /* u32, ascending: nodes that are not shown at rest, nor what is under them. */
    SCENE_HIDDEN_NODES,
    /* Absent where there is no smoke (renderer/scene/density_grid.h): */
    SCENE_GRIDS,       /* struct scene_grid */
    SCENE_GRID_BRICKS, /* struct scene_grid_brick; those of one grid follow each other */
    SCENE_GRID_VALUES, /* SCENE_BRICK_VALUES f32: one brick, x fastest, then y, then z */
    SCENE_SECTION_COUNT
};

struct scene_section_range {
    uint64_t offset; /* bytes from the start of the blob, multiple of 16 */
    uint64_t count;  /* records */
    uint32_t stride; /* bytes per record; must equal the size of the record type */
    uint32_t pad;
};

struct scene_header {
    char magic[8];
    uint32_t version;
    uint32_t section_count; /* SCENE_SECTION_COUNT */
    uint64_t size_bytes;    /* of the whole blob */
    /* World space, all visible primitives; min > max when there is no geometry. */
    double bounds_min[3];
    double bounds_max[3];
    uint64_t triangle_count;     /* over all nodes, instances counted each time */
    int32_t default_camera_node; /* first node with a camera, or -1 */
    uint32_t pad;
    struct scene_section_range sections[SCENE_SECTION_COUNT];
};

struct scene_node {
    double local_matrix[16]; /* column-major, parent_from_node */
    double world_matrix[16]; /* column-major, world_from_node, composed in f64 */
    int32_t parent, mesh, camera, light;
    uint32_t name;
    uint32_t source_index; /* index of the node in the glTF */
    int32_t grid;
    uint32_t pad;
};

/* The pose of a node that nothing moves: its local matrix is translation * rotation * scale. */
struct scene_pose {
    uint32_t node;
    uint32_t pad;
    double translation[3];
    double rotation[4]; /* unit quaternion x, y, z, w */
    double scale[3];
};

struct scene_animation {
    uint32_t name;
    uint32_t first_channel, channel_count;
    float duration_s; /* time of the last key of any channel; 0 without channels */
};

enum scene_path {
    SCENE_TRANSLATION,
    SCENE_ROTATION,
    SCENE_SCALE,
    SCENE_WEIGHTS,
    SCENE_VISIBILITY, /* a number; the node is shown where it is not 0 */
    SCENE_MEMBER,     /* of a material or light: renderer/scene/animated_members.h */
    SCENE_PATH_COUNT
};
enum scene_interpolation { SCENE_STEP, SCENE_LINEAR, SCENE_CUBIC };

/* Keys of what moves. SCENE_KEYS holds from first_key on: key_count times [s], not descending, from
 * 0 on; then a value of 3 numbers per key, 4 for rotations, 1 for visibility, as many as the node
 * has weights or the member has numbers for those; for SCENE_CUBIC three such values: in-tangent,
 * value, out-tangent. */
struct scene_channel {
    uint32_t target;        /* the pose; for SCENE_WEIGHTS of SCENE_DEFORMED_NODES, for
                               SCENE_VISIBILITY the node, for SCENE_MEMBER the material or light */
    uint32_t path;          /* enum scene_path */
    uint32_t interpolation; /* enum scene_interpolation */
    uint32_t key_count;     /* at least 1 */
    uint32_t first_key;
    uint32_t member; /* for SCENE_MEMBER; else 0 */
};

struct scene_skin {
    uint32_t first_joint, joint_count; /* at least 1 */
};

struct scene_joint {
    uint32_t node;
    float inverse_bind[12]; /* joint_from_mesh at rest, affine: four columns of three */
};

enum { SCENE_INFLUENCE_SETS_MAX = 2, SCENE_TARGETS_MAX = 1024 }; /* of a primitive */

enum scene_deformation_flags {
    SCENE_DEFORMATION_IS_FLAT = 1 /* vertices 3i to 3i + 2 are triangle i, which gives the normal */
};

/* How the vertices of a primitive may be deformed. */
struct scene_deformation {
    uint32_t primitive;
    uint32_t influence_sets;  /* 0: it follows no joints */
    uint32_t first_influence; /* of all vertices for the first set, then for the second */
    uint32_t joint_count;     /* no influence names a joint beyond */
    uint32_t first_target, target_count;
    uint32_t flags; /* enum scene_deformation_flags */
    uint32_t pad;
};

struct scene_influence {
    uint16_t joints[4]; /* of the skin */
    float weights[4];   /* not negative; over all sets of a vertex their sum is 1 */
};

struct scene_target {
    uint32_t first_delta, delta_count;
};

/* What a weight of 1 adds to a vertex. */
struct scene_delta {
    uint32_t vertex; /* of the primitive; ascending within a target */
    float position[3], normal[3], tangent[3];
};

/* A node whose mesh has targets, or that has a skin. */
struct scene_deformed_node {
    uint32_t node;
    int32_t skin;
    uint32_t first_weight, weight_count; /* as many as the mesh has targets */
};

struct scene_mesh {
    uint32_t first_primitive, primitive_count;
    uint32_t name;
    uint32_t pad;
};

enum scene_topology {
    SCENE_POINTS,
    SCENE_LINES,
    SCENE_TRIANGLES
}; /* strips, loops and fans are unrolled */

enum scene_primitive_flags {
    SCENE_PRIMITIVE_HAS_TANGENTS = 1,
    SCENE_PRIMITIVE_HAS_TEXCOORDS_0 = 2,
    SCENE_PRIMITIVE_HAS_TEXCOORDS_1 = 4,
    SCENE_PRIMITIVE_HAS_COLORS = 8,
    /* Always set for triangles: flat normals are made where the file has none. */
    SCENE_PRIMITIVE_HAS_NORMALS = 16,
    SCENE_PRIMITIVE_IS_CLOSED = 32, /* its triangles bound a volume: renderer/scene/edge_table.h */
    SCENE_PRIMITIVE_IS_SMOOTH = 64, /* of triangles: the vertices of one have different normals */
};

struct scene_primitive {
    uint32_t material;
    uint32_t topology; /* enum scene_topology */
    uint32_t first_index, index_count;
    uint32_t first_vertex, vertex_count;
    uint32_t flags;                     /* enum scene_primitive_flags */
    uint32_t part;                      /* 0; renderer/scene/compose.h has others */
    float bounds_min[3], bounds_max[3]; /* model space */
};

/* The material that a primitive has under a variant, where that is another one. */
struct scene_variant_material {
    uint32_t variant, primitive, material;
};

enum scene_alpha_mode { SCENE_OPAQUE, SCENE_MASK, SCENE_BLEND };

enum scene_material_flags {
    SCENE_MATERIAL_DOUBLE_SIDED = 1,
    SCENE_MATERIAL_UNLIT = 2,
    SCENE_MATERIAL_SPECULAR = 4, /* its specular members count; else they are 1 */
};

enum scene_texture_slot {
    SCENE_TEXTURE_BASE_COLOR,            /* sRGB, alpha linear */
    SCENE_TEXTURE_METALLIC_ROUGHNESS,    /* linear; G roughness, B metallic */
    SCENE_TEXTURE_NORMAL,                /* linear */
    SCENE_TEXTURE_OCCLUSION,             /* linear; R */
    SCENE_TEXTURE_EMISSIVE,              /* sRGB */
    SCENE_TEXTURE_TRANSMISSION,          /* linear; R */
    SCENE_TEXTURE_THICKNESS,             /* linear; G */
    SCENE_TEXTURE_SPECULAR,              /* linear; A */
    SCENE_TEXTURE_SPECULAR_COLOR,        /* sRGB */
    SCENE_TEXTURE_CLEARCOAT,             /* linear; R */
    SCENE_TEXTURE_CLEARCOAT_ROUGHNESS,   /* linear; G */
    SCENE_TEXTURE_CLEARCOAT_NORMAL,      /* linear */
    SCENE_TEXTURE_SHEEN_COLOR,           /* sRGB */
    SCENE_TEXTURE_SHEEN_ROUGHNESS,       /* linear; A */
    SCENE_TEXTURE_IRIDESCENCE,           /* linear; R */
    SCENE_TEXTURE_IRIDESCENCE_THICKNESS, /* linear; G */
    SCENE_TEXTURE_ANISOTROPY,            /* linear; RG direction in the tangent frame, B strength */
    SCENE_TEXTURE_DIFFUSE_TRANSMISSION,  /* linear; A */
    SCENE_TEXTURE_DIFFUSE_TRANSMISSION_COLOR, /* sRGB */
    SCENE_TEXTURE_SLOT_COUNT
};

struct scene_texture_ref {
    int32_t texture;       /* index of SCENE_TEXTURES, or -1 */
    uint32_t texcoord;     /* 0 or 1 */
    float uv_transform[6]; /* KHR_texture_transform, 2 x 3 by rows: u' = [0]u + [1]v + [2] */
    /* What the matrix is made of but for its offset, for animations of one of the two. */
    float uv_scale[2], uv_rotation_rad;
};

/* Sets the matrix from the scale and a rotation, and leaves its third column: translation *
 * rotation * scale, rotation clockwise in image space (KHR_texture_transform). */
void scene_texture_ref_turn(struct scene_texture_ref *ref, double rotation_rad);

/* How light passes through the surface as the angle changes; glTF extras `vitrail.pass_through`
 * (docs/explanation/shading.md). */
enum scene_pass_through {
    SCENE_PASS_CONSTANT, /* T */
    SCENE_PASS_SLAB,     /* T^(1/|n.l|): a slab of constant thickness */
    SCENE_PASS_EDGE,     /* mix(edge_color * T, T, |n.l|^edge_exponent): artistic rim */
};

struct scene_material {
    float base_color[4]; /* linear */
    float metallic, roughness;
    float normal_scale, occlusion_strength;
    float emissive[3]; /* linear, times KHR_materials_emissive_strength [nt] */
    float alpha_cutoff;
    float transmission;         /* KHR_materials_transmission [0,1] */
    float ior;                  /* KHR_materials_ior, default 1.5; 0 means total reflection */
    float thickness;            /* KHR_materials_volume, model units [m]; 0 = thin wall */
    float attenuation_distance; /* [m]; 0 means infinite */
    float attenuation_color[3];
    float edge_exponent;
    float edge_color[3];
    float specular, specular_color[3]; /* KHR_materials_specular, with SCENE_MATERIAL_SPECULAR */
    /* KHR_materials_clearcoat [0,1]; 0 = none. */
    float clearcoat, clearcoat_roughness, clearcoat_normal_scale;
    float sheen_color[3], sheen_roughness; /* KHR_materials_sheen [0,1]; black = none */
    float iridescence, film_ior;           /* KHR_materials_iridescence [0,1]; 0 = none; [1, 100] */
    float film_nm[2];                      /* thickness of its film where its texture is 0, and 1 */
    float diffuse_transmission, diffuse_transmission_color[3]; /* KHR_materials_diffuse_transmission
                                                                  [0,1]; 0 = none */
    /* KHR_materials_anisotropy [0,1]; 0 = none; from the tangent, counter-clockwise. */
    float anisotropy, anisotropy_rad;
    uint32_t alpha_mode;   /* enum scene_alpha_mode */
    uint32_t flags;        /* enum scene_material_flags */
    uint32_t pass_through; /* enum scene_pass_through */
    uint32_t name;
    float dispersion; /* KHR_materials_dispersion: 20 over Abbe's number; 0 = none */
    struct scene_texture_ref textures[SCENE_TEXTURE_SLOT_COUNT];
};

/* Filters and wraps keep the numbers of glTF (they are those of OpenGL). */
struct scene_texture {
    int32_t image; /* -1: unusable image, sampled as white with a warning */
    uint32_t mag_filter, min_filter, wrap_s, wrap_t; /* never 0: defaults are filled in */
    uint32_t name;
};

struct scene_image {
    uint32_t width_px, height_px;
    uint64_t offset_bytes; /* into SCENE_PIXELS; width * height * 4 bytes */
    /* Into SCENE_PIXELS: level 1 and all that follow, one after the other, averaged as linear
     * values [0] or as sRGB [1]; 0 where no material samples the image so, or there is but one
     * level (renderer/scene/texture_levels.h). */
    uint64_t levels_offset_bytes[2];
    uint32_t name;
    uint32_t least_alpha; /* of all texels of level 0, [0, 255]: no filter samples less */
    uint32_t part;        /* as of primitives */
    uint32_t pad;
};

enum scene_light_type {
    SCENE_LIGHT_DIRECTIONAL,
    SCENE_LIGHT_POINT,
    SCENE_LIGHT_SPOT,
    SCENE_LIGHT_RECT, /* requests only: files have no area lights */
    SCENE_LIGHT_DISK,
};

struct scene_light { /* KHR_lights_punctual; emits along the node's -Z */
    uint32_t type;
    float color[3];
    float intensity;                      /* cd, or lx for directional */
    float range;                          /* m; 0 = unbounded */
    float inner_cone_rad, outer_cone_rad; /* half angles */
    uint32_t name;
    uint32_t pad;
};

enum {
    SCENE_BRICK_SIDE = 8, /* voxels */
    SCENE_BRICK_VALUES = SCENE_BRICK_SIDE * SCENE_BRICK_SIDE * SCENE_BRICK_SIDE,
    SCENE_GRID_SIDE_MAX = 8192,      /* voxels along an axis */
    SCENE_GRID_VOXELS_MAX = 1 << 29, /* empty ones too */
};
#define SCENE_GRID_VALUE_MAX 1e12f /* of a value, its factors and their product */

/* A medium whose density varies from place to place, in the space of its node: values at the
 * centres of voxels, trilinear between, constant in the outer half voxel and 0 outside the box. */
struct scene_grid {
    uint32_t size[3];                   /* voxels, at least 1 */
    uint32_t first_brick;               /* ceil(size / 8) bricks, x fastest */
    float bounds_min[3], bounds_max[3]; /* through the outer faces of voxels */
    float density;                      /* of a value of 1 [1/m]; >= 0 */
    float extinction[3];                /* of the channels, relative to that; >= 0 */
    float color[3];                     /* the share of the extinction that scatters [0,1] */
    float anisotropy;                   /* Henyey and Greenstein's g, in (-1, 1) */
    float largest;                      /* of all values */
    uint32_t name;
    uint32_t part; /* as of primitives */
};

struct scene_grid_brick {
    uint32_t values; /* 1 + index in SCENE_GRID_VALUES; 0: all are 0 */
    float largest;   /* of the values */
};

struct scene_camera {
    uint32_t is_orthographic;
    float y_fov_rad, aspect; /* perspective; aspect 0 = that of the image */
    float x_mag, y_mag;      /* orthographic half extents */
    float z_near, z_far;     /* z_far 0 = infinite */
    uint32_t name;
};

#ifdef __cplusplus
}
#endif
#endif
