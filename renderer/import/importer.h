/* SPDX-License-Identifier: MIT */
/* What the import_*.c files share: one import under way. Private to scene_import. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_IMPORTER_H
#define VITRAIL_RENDERER_IMPORT_IMPORTER_H

#include "renderer/import/accessor.h"
#include "renderer/import/gltf_json.h"
#include "renderer/import/import.h"
#include "renderer/scene/blob_writer.h"
#include "renderer/scene/scene.h"

struct importer {
    const struct scene_import_desc *desc; /* borrowed */
    struct gltf_package package;
    struct gltf_json json;
    struct gltf_document *document; /* owned */
    struct gltf_bytes *buffers;     /* owned, json.buffer_count of them */
    struct gltf_bytes *decoded;     /* owned, by buffer view: accessor_source */
    uint64_t decodable_bytes;
    struct accessor_source source;
    struct blob_writer writer;
    struct scene_header header;
    uint64_t max_image_pixels;
    bool takes_old_images; /* BMP and TGA: not in glTF */

    int32_t *mesh_of;       /* owned: blob mesh of each glTF mesh, -1 when no shown node uses it */
    bool *is_mesh_skinned;  /* owned: by a shown node, per glTF mesh */
    bool *is_texture_used;  /* owned: by an evaluated slot of some material */
    uint32_t *image_source; /* owned: glTF image of each of the blob's */
    uint32_t *node_order;   /* owned: glTF nodes of the scene, parents first */
    uint32_t node_count;
    struct geometry_scratch *scratch; /* owned by import_geometry.c */
    struct pixel_job *pixels;         /* owned; NULL without images */

    /* Counted while importing; the warnings at the end state them. */
    uint64_t degenerate_triangles, repaired_normals, clamped_colors;
    uint64_t unbound_vertices, unjointed_primitives, left_out_influences;
    uint64_t missing_texcoords, far_texcoords, open_volumes;
    uint64_t skinned_instances;
    uint64_t undirected_primitives;
    uint64_t unmoved_channels; /* of animations, that move neither a node nor a morph target */
};

/* A primitive under way whose vertices were chosen: what its influences and targets are read from.
 */
struct deformed_shape {
    const struct gltf_primitive *from;
    const struct accessor *attributes; /* by enum gltf_attribute */
    const uint32_t *sources;           /* the accessors' vertex of each vertex */
    const struct scene_primitive *primitive;
    bool is_flat; /* each corner is a vertex of its own, normals come from the triangles */
    bool is_skinned;
};
static inline bool deformed_shape_deforms(const struct deformed_shape *shape)
{
    return shape->is_skinned || shape->from->target_count > 0;
}
/* The record of the primitive is the next to be appended. keeps_closed: no pose parts vertices that
 * are at one place at rest. */
MUST_CHECK bool import_deformation(struct importer *importer, const struct deformed_shape *shape,
                                   bool *keeps_closed, struct error *err);
/* The targets of all primitives, and the weights, of one mesh. */
MUST_CHECK bool import_check_targets(const struct gltf_mesh *mesh, struct error *err);
/* Whether they are within the reach of coordinates. */
MUST_CHECK bool import_check_bounds(const struct scene_header *header, struct error *err);
/* After the blob was opened: adds what deforms, at rest, to the bounds in its header. */
MUST_CHECK bool import_rest_bounds(struct scene_header *header, const struct scene *scene,
                                   struct error *err);

/* Each returns false with err set, and fills the sections of its name. In the order of the calls in
 * import.c: materials also is_texture_used; textures also images and image_source, and takes room
 * for their pixels; hierarchy node_order, mesh_of and is_mesh_skinned; meshes all vertex sections
 * and deformations; nodes also the bounds and counts of the header; skins also joints, deformed
 * nodes and their weights; animations also poses, channels and keys. */
MUST_CHECK bool import_materials(struct importer *importer, struct error *err);
MUST_CHECK bool import_variants(struct importer *importer, struct error *err);
MUST_CHECK bool import_textures(struct importer *importer, struct error *err);
MUST_CHECK bool import_lights(struct importer *importer, struct error *err);
MUST_CHECK bool import_cameras(struct importer *importer, struct error *err);
MUST_CHECK bool import_grids(struct importer *importer, struct error *err);
MUST_CHECK bool import_hierarchy(struct importer *importer, struct error *err);
MUST_CHECK bool import_meshes(struct importer *importer, struct error *err);
MUST_CHECK bool import_nodes(struct importer *importer, struct error *err);
MUST_CHECK bool import_skins(struct importer *importer, struct error *err);
MUST_CHECK bool import_animations(struct importer *importer, struct error *err);

/* The materials that the variants give to the primitive appended last. */
MUST_CHECK bool import_variant_materials(struct importer *importer,
                                         const struct gltf_primitive *from, struct error *err);

/* Translation, rotation and scale of a node without a matrix, into a zeroed pose. */
MUST_CHECK bool import_pose(const struct gltf_node *node, struct scene_pose *pose,
                            struct error *err);

/* The encoded bytes of an image of the file, from its URI or buffer view; the caller frees `owned`.
 * A view is decoded the first time: from then on on any thread, beside others that read other
 * views.
 */
MUST_CHECK bool import_open_image(const struct importer *importer, size_t index,
                                  struct gltf_bytes *bytes, struct error *err);

/* Decodes the images and builds their levels. begin, after the textures: on further threads, while
 * the importer goes on; NULL with err set on failure. end: has all written where the blob, or its
 * head, has room for them, and completes the blob's image records. destroy: at any time; NULL does
 * nothing. */
struct pixel_job;
struct pixel_job *import_pixels_begin(const struct importer *importer, struct error *err);
MUST_CHECK bool import_pixels_end(struct pixel_job *job, void *blob, struct error *err);
void import_pixels_destroy(struct pixel_job *job);

/* Tells that a stage is so far. */
void importer_advance(const struct importer *importer, enum scene_import_stage stage, uint64_t done,
                      uint64_t total);

void importer_free_scratch(struct geometry_scratch *scratch);

/* Appends a sentence to SCENE_WARNINGS. */
MUST_CHECK bool importer_warn(struct importer *importer, struct error *err, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Copies `count` numbers to floats after checking their number and range [low, high]; an absent
 * array leaves `out` as it is. `what` names the field in the message. */
MUST_CHECK bool import_numbers(struct gltf_numbers numbers, size_t count, double low, double high,
                               float *out, const char *what, struct error *err);
MUST_CHECK bool import_number(double number, double low, double high, float *out, const char *what,
                              struct error *err);

#endif
