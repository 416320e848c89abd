/* SPDX-License-Identifier: MIT */
/* What a face of a shadow volume covers of a picture, as shaders/shadows/volume_faces.comp.glsl
 * finds it: a few pixels, or tiles with points behind the nearest part of it in their row. CPU
 * only. Thread: any. */
#ifndef VITRAIL_RENDERER_COST_VOLUME_COVER_H
#define VITRAIL_RENDERER_COST_VOLUME_COVER_H

#include "renderer/cost/workload.h"

struct volume_cover {
    const struct camera *camera;
    int width_px, height_px;
    /* In each cell of the picture, rows from below [m]: the depth of what is opaque and may have
     * light; 0: there is none. */
    double ends[SCENE_ROWS][SCENE_COLUMNS];
};

void volume_cover_init(struct volume_cover *cover, const struct workload_desc *desc,
                       const struct scene_sampling *sampling, const struct state_light *light);

/* Corners in a circle, in view space (right, up, depth, 1); what lies at infinity ends in 0. */
struct volume_outline {
    double corners[4][4];
};
struct volume_outline volume_outline_of_triangle(const struct camera *camera, const double a[3],
                                                 const double b[3], const double c[3]);
struct volume_outline volume_outline_of_side(const struct camera *camera,
                                             const struct state_light *light,
                                             const double ends[2][3]);

/* Pixels. */
double volume_cover_measure(const struct volume_cover *cover, const struct volume_outline *outline);
/* Those of the box around all of it in the picture, whatever lies there: no fewer. */
double volume_cover_most(const struct volume_cover *cover, const struct volume_outline *outline);

#endif
