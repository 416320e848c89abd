/* SPDX-License-Identifier: MIT */
/* Animations of nodes at a time: glTF 2.0 specification, section 3.11 and appendix C, in f64.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_ANIMATION_H
#define VITRAIL_RENDERER_SCENE_ANIMATION_H

#include "renderer/scene/scene.h"

/* Sets what the animation moves of poses and weights; the rest of poses, scene->pose_count of them,
 * and of weights, scene->target_weight_count of morph targets, stays as it is. Before its first key
 * and after its last one a channel holds the value of that key. animation is an index of the scene.
 * Rotations come out as unit quaternions. */
void animation_evaluate(const struct scene *scene, uint32_t animation, double time_s,
                        struct scene_pose *poses, float *weights);

/* Numbers of a key of the channel, whose path, target and member are in range. */
uint32_t scene_channel_components(const struct scene *scene, const struct scene_channel *channel);

/* What the channel holds at the time; out: scene_channel_components() of them. */
void animation_evaluate_channel(const struct scene *scene, const struct scene_channel *channel,
                                double time_s, double *out);

#endif
