/* SPDX-License-Identifier: MIT */
/* What the builders of the closed-form scenes share. */
#ifndef VITRAIL_TESTS_SUPPORT_CLOSED_FORM_INTERNAL_H
#define VITRAIL_TESTS_SUPPORT_CLOSED_FORM_INTERNAL_H

#include "tests/support/closed_form_scenes.h"

/* Clears the scene and begins its file; gives it room for pane_count panes. */
struct glb_builder *closed_form_begin(struct closed_form_scene *scene, const char *name,
                                      int pane_count);
/* Finishes the file into the scene and destroys the builder. */
void closed_form_end(struct closed_form_scene *scene, struct glb_builder *builder);

/* Opaque white-ish receivers of scene->albedo; returns the material. */
int closed_form_receiver(struct closed_form_scene *scene, struct glb_builder *builder);
/* One quad as a node; its normal is u x v. */
void closed_form_quad(struct glb_builder *builder, const char *name, int material,
                      const double corner[3], const double u[3], const double v[3]);
void closed_form_floor(struct closed_form_scene *scene, struct glb_builder *builder, double half);
/* A node with a new material for scene->panes[index]. */
void closed_form_add_pane(struct glb_builder *builder, const struct closed_form_pane *pane);
void closed_form_add_light(struct closed_form_scene *scene, struct glb_builder *builder);
void closed_form_camera(struct glb_builder *builder, const char *name, const double eye[3],
                        const double target[3], double fov_y_deg);
/* A camera that looks straight at a plane through target and sees `half` metres of it upward and
 * downward of the middle: world points lie linearly in the picture. */
void closed_form_camera_onto(struct glb_builder *builder, const char *name, const double eye[3],
                             const double target[3], double half);

/* Uniform in [low, high); advances the state. */
double closed_form_random(uint64_t *state, double low, double high);

#endif
