/* SPDX-License-Identifier: MIT */
/* Builds a GLB in memory, for the demo scene, tests and benchmarks. Thread: one per builder.
 *
 * Every add function returns the id of what it added: 1 for the first of its kind, 0 when it
 * failed. In a desc the id 0 means "none", so that zero is the default. A builder keeps its first
 * error and does nothing more after it; glb_builder_finish reports it: callers check once, at the
 * end. */
#ifndef VITRAIL_GLB_BUILDER_H
#define VITRAIL_GLB_BUILDER_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

struct glb_builder;

/* scene_name: borrowed; may be NULL. NULL when memory is short. */
struct glb_builder *glb_builder_create(const char *scene_name, struct error *err);
void glb_builder_destroy(struct glb_builder *builder);

/* Records an error of the caller as if an add had failed. Always returns 0, the id of nothing. */
int glb_builder_fail(struct glb_builder *builder, const struct error *cause);

/* Writes the file: *glb is malloc'ed, the caller frees it. The same calls give the same bytes. */
MUST_CHECK bool glb_builder_finish(struct glb_builder *builder, void **glb, size_t *size_bytes,
                                   struct error *err);

/* -- Images and textures -- */

/* rgba: width * height * 4 bytes, first row on top (v = 0); stored as PNG. */
int glb_builder_add_image(struct glb_builder *builder, const char *name, const uint8_t *rgba,
                          int width_px, int height_px);

enum glb_filter { GLB_FILTER_TRILINEAR, GLB_FILTER_LINEAR, GLB_FILTER_NEAREST };
enum glb_wrap { GLB_WRAP_REPEAT, GLB_WRAP_CLAMP, GLB_WRAP_MIRROR };

struct glb_texture_desc {
    const char *name;
    int image;              /* required */
    enum glb_filter filter; /* of magnification and minification */
    enum glb_wrap wrap_s, wrap_t;
};
int glb_builder_add_texture(struct glb_builder *builder, const struct glb_texture_desc *desc);

/* -- Materials -- */

struct glb_texture_ref {
    int texture;        /* 0 = none */
    int texcoord;       /* set 0 or 1 */
    bool has_transform; /* KHR_texture_transform */
    double offset[2], rotation_rad;
    double scale[2]; /* both zero means 1 1 */
};

enum glb_alpha_mode { GLB_OPAQUE, GLB_MASK, GLB_BLEND };
enum glb_pass_through { GLB_PASS_CONSTANT, GLB_PASS_SLAB, GLB_PASS_EDGE };

/* Factors are written as they stand unless the comment gives zero another meaning. */
struct glb_material_desc {
    const char *name;
    double base_color[4];       /* linear, [0,1]; all four zero means opaque white */
    double metallic, roughness; /* zero: smooth, dielectric; glTF's default is 1, 1 */
    double emissive[3];         /* linear, [0,1] */
    double emissive_strength;   /* 0 means 1 */
    enum glb_alpha_mode alpha_mode;
    double alpha_cutoff; /* 0 means 0.5 */
    bool is_double_sided, is_unlit;
    double transmission;         /* above 0 writes KHR_materials_transmission */
    bool has_ior;                /* false: nothing is written, glTF's default is 1.5 */
    double ior;                  /* 0, or at least 1 */
    double dispersion;           /* above 0 writes KHR_materials_dispersion */
    double thickness;            /* m; 0 = thin wall */
    double attenuation_distance; /* m; 0 = infinite */
    double attenuation_color[3]; /* written when attenuation_distance > 0 */
    bool has_specular;           /* writes KHR_materials_specular: */
    double specular, specular_color[3];
    double clearcoat, clearcoat_roughness;  /* above 0 writes KHR_materials_clearcoat */
    double sheen_color[3], sheen_roughness; /* not black writes KHR_materials_sheen */
    double diffuse_transmission;            /* above 0 writes KHR_materials_diffuse_transmission */
    double diffuse_transmission_color[3];
    double anisotropy, anisotropy_rad;   /* above 0 writes KHR_materials_anisotropy */
    double iridescence, iridescence_ior; /* above 0 writes KHR_materials_iridescence; ior 0 ... */
    double film_least_nm, film_most_nm;  /* ... and thickness 0 are not written */
    double normal_scale, occlusion_strength; /* 0 means 1 */
    struct glb_texture_ref base_color_texture, metallic_roughness_texture, normal_texture,
        occlusion_texture, emissive_texture, transmission_texture, thickness_texture,
        specular_texture, specular_color_texture, clearcoat_texture, clearcoat_roughness_texture,
        clearcoat_normal_texture, sheen_color_texture, sheen_roughness_texture, iridescence_texture,
        iridescence_thickness_texture, anisotropy_texture, diffuse_transmission_texture,
        diffuse_transmission_color_texture;
    enum glb_pass_through pass_through;  /* extras.vitrail.pass_through.model */
    double edge_color[3], edge_exponent; /* GLB_PASS_EDGE */
};
int glb_builder_add_material(struct glb_builder *builder, const struct glb_material_desc *desc);

/* -- Meshes -- */

enum glb_topology { GLB_TRIANGLES, GLB_LINES, GLB_POINTS };

struct glb_primitive_desc {
    enum glb_topology topology;
    int material;             /* 0 = glTF's default material */
    size_t vertex_count;      /* required */
    const float *positions;   /* required; 3 per vertex, m */
    const float *normals;     /* 3 per vertex, unit; NULL = none */
    const float *texcoords;   /* 2 per vertex; NULL = none */
    const float *texcoords_1; /* second set; NULL = none */
    const float *colors;      /* 4 per vertex, linear RGBA; NULL = none */
    const uint32_t *indices;  /* NULL = vertices in order */
    size_t index_count;
};
int glb_builder_add_mesh(struct glb_builder *builder, const char *name,
                         const struct glb_primitive_desc *primitives, size_t primitive_count);

/* -- Lights and cameras: both look along the -Z of their node -- */

enum glb_light_type { GLB_LIGHT_POINT, GLB_LIGHT_SPOT, GLB_LIGHT_DIRECTIONAL };

struct glb_light_desc {
    const char *name;
    enum glb_light_type type;
    double color[3];                       /* linear, [0,1]; all zero means white */
    double intensity;                      /* cd; lx for directional */
    double range;                          /* m; 0 = unbounded */
    double inner_cone_deg, outer_cone_deg; /* half angles of a spot; outer 0 means 45 */
};
int glb_builder_add_light(struct glb_builder *builder, const struct glb_light_desc *desc);

struct glb_camera_desc {
    const char *name;
    double fov_y_deg; /* perspective; 0 means 45 */
    double aspect;    /* perspective; 0 = that of the image */
    bool is_orthographic;
    double x_mag, y_mag; /* m, half extents; required when orthographic */
    double z_near;       /* m; 0 means 0.05 */
    double z_far;        /* m; 0 means infinite, or 1000 when orthographic */
};
int glb_builder_add_camera(struct glb_builder *builder, const struct glb_camera_desc *desc);

/* -- Density grids (VITRAIL_density_grids, docs/reference/scene-formats.md) -- */

struct glb_grid_desc {
    const char *name;
    uint32_t size[3];       /* required; voxels */
    const float *values;    /* required; x fastest, then y, then z */
    double low[3], high[3]; /* required; m, the box through the outer faces of voxels */
    double density;         /* of a value of 1 [1/m]; 0 means 1 */
    double color[3];        /* of what is scattered [0,1]; all zero means 1 1 1 */
    double extinction[3];   /* of the channels; all zero means 1 1 1 */
    double anisotropy;      /* Henyey and Greenstein's g */
    bool is_black;          /* color is 0 0 0 */
};
int glb_builder_add_grid(struct glb_builder *builder, const struct glb_grid_desc *desc);

/* -- Nodes -- */

struct glb_node_desc {
    const char *name;
    int parent; /* 0 = a root of the scene */
    int mesh, light, camera, grid;
    bool has_matrix;       /* matrix instead of translation, rotation and scale */
    double matrix[16];     /* column-major, parent_from_node */
    double translation[3]; /* m */
    double rotation[4];    /* unit quaternion x y z w; all zero means none */
    double scale[3];       /* all zero means 1 1 1 */
};
int glb_builder_add_node(struct glb_builder *builder, const struct glb_node_desc *desc);

/* Sets node's matrix: at eye, -Z towards target, its +Y as near to +Y as that allows. For lights
 * and cameras. eye and target must differ. */
void glb_node_look_at(struct glb_node_desc *node, const double eye[3], const double target[3]);

/* Sets node's rotation: angle_deg about the unit axis, counter-clockwise seen from its tip. */
void glb_node_rotate(struct glb_node_desc *node, const double axis[3], double angle_deg);

#endif
