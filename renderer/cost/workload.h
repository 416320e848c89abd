/* SPDX-License-Identifier: MIT */
/* How much there is to do for a frame, in counts that the models of renderer/cost/forecast turn
 * into time: taken from bounds and from a sample of the triangles, nothing is rendered. The same
 * scene, view and camera give the same numbers. CPU only. Thread: any. */
#ifndef VITRAIL_RENDERER_COST_WORKLOAD_H
#define VITRAIL_RENDERER_COST_WORKLOAD_H

#include "renderer/lights/light_reach.h"
#include "renderer/scene/camera.h"

struct workload {
    double pixels;
    double covered;   /* share of the pixels that show something opaque, [0, 1] */
    double layers;    /* mean transparent surfaces per pixel before what is opaque */
    double lit;       /* mean lights that shine on a visible surface; area lights count once per
                         sample */
    double listed;    /* mean lights in the list of a visible surface, which it walks: those without
                         a range always, others where its cluster meets their reach */
    double textures;  /* mean textures of the material of a visible surface */
    double triangles; /* of all drawables, and of those in view */
    double triangles_in_view;
    size_t lights, shadowed_lights; /* that reach the view; that have casters as well */
    size_t deep_lights;             /* of the shadowed: with transparent casters */
    double map_faces;               /* of all shadowed lights; deep ones among them */
    double deep_faces;
    double map_triangles;  /* opaque casters, drawn into a face each */
    double deep_triangles; /* transparent ones */
    double deep_share;     /* events over texels of the deep faces */
};

struct workload_desc {
    const struct view *view;         /* required */
    const struct scene_state *state; /* required */
    const struct camera *camera;     /* required */
    struct light_reach *reach;       /* out, the caller's to finish: of the state's lights, who need
                                        not be asked again; optional */
};

MUST_CHECK bool workload_measure(struct workload *workload, const struct workload_desc *desc,
                                 struct error *err);

/* ---- the parts ---- */

/* A visible surface, somewhere. */
struct survey_point {
    double position[3], normal[3]; /* world; unit, towards the eye */
    double weight;                 /* > 0 */
};

enum { SURVEY_POINTS_MAX = 64 };

struct survey {
    double covered, layers, textures, triangles, triangles_in_view;
    struct survey_point points[SURVEY_POINTS_MAX];
    int point_count;
};

/* What the camera sees, on a coarse grid. */
MUST_CHECK bool survey_view(struct survey *survey, const struct workload_desc *desc,
                            struct error *err);

#endif
