/* SPDX-License-Identifier: MIT */
/* A scene state at a time of its animations. */
#ifndef VITRAIL_RENDERER_SCENE_STATE_ANIMATION_H
#define VITRAIL_RENDERER_SCENE_STATE_ANIMATION_H

#include "renderer/scene/scene_state.h"

/* The poses of nodes that animations move. Zeroed = none. */
struct moved_nodes {
    struct scene_pose *poses;
    double (*locals)[16]; /* per pose */
    size_t count;
    float *weights;    /* borrowed: of morph targets, of the members that are still to come */
    bool *has_channel; /* per node of the whole scene: a channel of the animation moves, shows or
                          hides it, or moves its weights */
    bool has_members;  /* a channel changes a material or a light */
};

/* Shows all nodes but those that the file hides. */
void state_hide_nodes(struct scene_state *state);

/* Poses, weights and visibility. locals: per node, to point at what moved owns. ERROR_NOT_FOUND for
 * an animation that the scene does not have, ERROR_INVALID_REQUEST, ERROR_NO_MEMORY. */
MUST_CHECK bool state_animate_nodes(struct scene_state *state, const struct view *view,
                                    struct moved_nodes *moved, const double **locals,
                                    struct error *err);
void moved_nodes_finish(struct moved_nodes *moved);

/* Whether a mesh, a joint, a light or a camera hangs on a node that the animation moves, or a
 * material or a light changes. */
bool state_moves_anything(const struct scene *scene, const struct moved_nodes *moved);

/* Changes the materials of the state, which are those of the scene, and makes its file_lights. The
 * animation is known to be there. ERROR_NO_MEMORY. */
MUST_CHECK bool state_animate_members(struct scene_state *state, const struct view *view,
                                      struct error *err);

#endif
