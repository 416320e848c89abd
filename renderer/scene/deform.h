/* SPDX-License-Identifier: MIT */
/* Vertices of skinned and morphed primitives in a pose: the one definition that the rasteriser, the
 * ray tracer and all that measures geometry read. glTF 2.0, sections 3.7.2.2 and 3.7.3.3. CPU only.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_DEFORM_H
#define VITRAIL_RENDERER_SCENE_DEFORM_H

#include "renderer/base/content_key.h"
#include "renderer/scene/scene.h"

/* Vertices of one pose, and differences of morph targets that are added up for it. */
enum { DEFORM_VERTICES_MAX = 1 << 24, DEFORM_DELTAS_MAX = 1 << 26 };

struct state_deformed {               /* one primitive of one node that is shown */
    uint32_t node, index;             /* of the node, and of the primitive, in the scene */
    struct scene_primitive primitive; /* vertices count into the arrays of state_deforms, indices
                                         are the scene's; bounds are those of the pose */
    /* World from its vertices: of a morphed one that of its node; of a skinned one, which the
     * transform of its node does not move, a shift to the skin's first joint. */
    double world[16];
    double determinant; /* of world from the vertices at rest; its sign is that of most joints */
    struct content_key pose; /* of all that its vertices come from but the scene itself */
    uint64_t scene_serial;   /* of that scene */
    uint32_t joint_count;    /* 0: it follows none */
};

struct state_deforms {            /* zeroed: none */
    struct state_deformed *items; /* owned; in the order of nodes, then of primitives */
    size_t count;
    float *positions, *normals; /* owned */
    float *tangents;            /* owned; NULL where no primitive has any */
    uint32_t vertex_count;
    uint64_t serial; /* of this evaluation, no other has it; 0: none was made */
    float *weights;  /* owned; of the deformed nodes of the scene, or of its parts in their order */
};

/* Puts the weights at rest where animations change them. */
MUST_CHECK bool deforms_init(struct state_deforms *deforms, const struct scene *scene,
                             struct error *err);
void deforms_finish(struct state_deforms *deforms);

/* Evaluates what is visible. world, is_visible: per node of the scene. ERROR_INVALID_SCENE where a
 * position is not finite, ERROR_TOO_LARGE above the limits. */
MUST_CHECK bool deforms_evaluate(struct state_deforms *deforms, const struct scene *scene,
                                 const double (*world)[16], const bool *is_visible,
                                 struct error *err);

/* The first of so many deformations whose primitive is this or a later one; their number if there
 * is none. */
uint32_t deformation_from(const struct scene_deformation *deformations, uint32_t count,
                          uint32_t primitive);

/* The first joint of a node's skin, NULL where it has none, and the joint's node; both nodes are
 * the scene's, also of a composed one. */
const struct scene_joint *deform_first_joint(const struct scene *scene, uint32_t node,
                                             uint32_t *joint_node);
/* How a joint, whose node is at joint_world, places the mesh at rest. */
void deform_joint_matrix(const double *joint_world, const struct scene_joint *joint,
                         double out[16]);

#endif
