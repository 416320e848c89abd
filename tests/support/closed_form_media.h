/* SPDX-License-Identifier: MIT */
/* Bodies of homogeneous media whose attenuation along any segment is known in f64, and scenes of
 * them as GLB. Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_CLOSED_FORM_MEDIA_H
#define VITRAIL_TESTS_SUPPORT_CLOSED_FORM_MEDIA_H

#include "tests/support/closed_form_scenes.h"

enum closed_form_shape {
    BODY_BOX,    /* low to high */
    BODY_WEDGE,  /* the part of the box below the plane from the edge (low x, low y) to (high x,
                    high y): as thick as x - low x times its slope */
    BODY_SPHERE, /* the sphere inside the box, whose middle and least width it has; 128 x 64 facets
                    with their corners on it */
};

struct closed_form_body {
    enum closed_form_shape shape;
    double low[3], high[3];
    float remains[3]; /* of white light after `distance`; all 1 with distance 0: an opaque body */
    float distance;   /* m */
    float filter[3];  /* of each crossing of the surface; all zero means 1 */
    bool is_mirrored; /* by its node */
    bool is_double_sided;
    bool glows; /* an opaque body: unlit and white, else a receiver */
};

/* Extinction per metre, from the numbers as f32 holds them. */
void closed_form_sigma(const struct closed_form_body *body, double sigma[3]);

/* Length of the part of the segment that lies inside; spheres without their facets. crossings: 0 to
 * 2, of the surface between the ends. */
double closed_form_length(const struct closed_form_body *body, const double from[3],
                          const double to[3], int *crossings);

/* Where the segment first meets an opaque body, as a share of its length; 1 when it meets none. */
double closed_form_opaque_at(const struct closed_form_body *bodies, int count, const double from[3],
                             const double to[3]);

/* exp(-sum sigma length) times the filters of all crossings; 0 when an opaque body is in the way.
 * An end on a surface is taken as on its outside. */
void closed_form_through(const struct closed_form_body *bodies, int count, const double from[3],
                         const double to[3], double transmittance[3]);

struct media_scene_desc {
    const struct closed_form_body *bodies; /* borrowed */
    int count;
    bool has_floor;    /* receiver y = 0, |x|, |z| <= floor_half */
    double floor_half; /* m; 0 means 4 */
    double wall[3][3]; /* a glowing (unlit, white) wall: corner and edges; all zero means none */
    struct closed_form_light light; /* intensity 0 means none */
};
void media_scene_build(const struct media_scene_desc *desc, struct closed_form_scene *scene);

#endif
