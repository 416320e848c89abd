/* SPDX-License-Identifier: MIT */
/* The closed-form scenes whose answer is a transmittance over a receiver, one after the other:
 * each with a GLB, a view of the receiver that meets no caster, and the answer in f64 for any point
 * of the receiver. Thread: any.
 *
 * A1 parallel filters; A2 a slab under the angle a; A3 a wedge; A4 a sphere; A5 overlapping bodies
 * around the receiver; A6 exponential fog as a stack of slabs; A9 projected pictures; A10 a pane
 * whose filter depends on the angle; A11 a staircase of 1 to 3 steps. */
#ifndef VITRAIL_TESTS_SUPPORT_CLOSED_FORM_CATALOG_H
#define VITRAIL_TESTS_SUPPORT_CLOSED_FORM_CATALOG_H

#include "renderer/view.h"
#include "tests/support/closed_form_media.h"

enum { CASE_BODIES_MAX = 40 };

/* Wholly written by closed_form_case_init; private but for what the comments name. */
struct closed_form_case {
    const char *id;                 /* "A2", borrowed */
    char name[48];                  /* "A2 slab at 60 degrees" */
    struct closed_form_scene scene; /* glb, light */
    struct view view;               /* onto the receiver; size and quality are the caller's */
    bool is_even;                   /* one answer wherever the view looks */
    double normal[3], offset;       /* the receiver's plane: dot(normal, p) = offset */

    struct closed_form_body bodies[CASE_BODIES_MAX];
    int body_count;
    struct projector_scene_desc picture;
    struct tilted_scene_desc tilted;
    double fog_sigma0, fog_scale_m, fog_top_m;
    double facet_m;    /* spheres: how far inside a facet may lie */
    double step_error; /* fog: relative error of tau, because its steps are not the exponential */
};

int closed_form_case_count(void);
/* index: [0, count) */
void closed_form_case_init(struct closed_form_case *c, int index);
void closed_form_case_finish(struct closed_form_case *c);

/* Transmittance from the light to a point of the receiver. doubt: how far the scene itself may be
 * from it, where it has facets or steps; else 0. */
void closed_form_case_answer(const struct closed_form_case *c, const double point[3],
                             double transmittance[3], double doubt[3]);

/* Boxes and wedges at random in about [-1, 1]^3, 7 of them: overlapping, nested, one twice, two
 * that share a face, some mirrored; with has_filters every other one has a coloured surface. */
enum { RANDOM_BODIES = 7 };
void closed_form_random_bodies(uint64_t *seed, bool has_filters, struct closed_form_body *bodies);

#endif
