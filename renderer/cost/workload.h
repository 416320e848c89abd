/* SPDX-License-Identifier: MIT */
/* Counts what there is to do for a frame, from bounds and from a sample of the triangles: nothing
 * is rendered. The same scene, view and camera give the same numbers. CPU only. Thread: any. */
#ifndef VITRAIL_RENDERER_COST_WORKLOAD_H
#define VITRAIL_RENDERER_COST_WORKLOAD_H

#include "renderer/base/content_key.h"
#include "renderer/cost/edge_picks.h"
#include "renderer/forecast/forecast.h"
#include "renderer/lights/light_reach.h"
#include "renderer/scene/camera.h"

struct workload_desc {
    const struct view *view;         /* required */
    const struct scene_state *state; /* required */
    const struct camera *camera;     /* required */
    uint64_t depths_bytes;           /* that kept depths of density grids may take; 0: none are */
    struct light_reach *reach;       /* out, the caller's to finish: of the state's lights, who need
                                        not be asked again; optional */
    struct workload_kept *kept;      /* of earlier views; optional, the numbers are the same */
    struct content_key state_key;    /* of all that the state holds; required with `kept` */
};

MUST_CHECK bool workload_measure(struct workload *workload, const struct workload_desc *desc,
                                 struct error *err);

/* What no camera changes, of the last state: from one view of it to the next; and what no state of
 * the last scene does. */
struct workload_kept { /* zeroed = empty */
    struct content_key key;
    struct workload_map_load *loads; /* of each light; NULL: none */
    struct workload_edge *edges;     /* of a view in motion; NULL: none */
    size_t edge_count;
    struct edge_picks picks; /* of the scene */
};
void workload_kept_finish(struct workload_kept *kept); /* empty afterwards */

/* Layers that the transparency peels at a time; 0: it has others. */
int workload_peeled_sides(enum transparency transparency);

/* ---- the parts ---- */

/* A visible surface, somewhere. */
struct scene_sample {
    double position[3], normal[3]; /* world; unit, towards the eye */
    double weight;                 /* > 0 */
};

enum { SCENE_SAMPLES_MAX = 64, SCENE_COLUMNS = 32, SCENE_ROWS = 18 };

struct scene_sampling {
    double covered, layers, textures, triangles, triangles_in_view;
    double peeled_sides, peels, peeled_pixels, peeled_triangles; /* as struct workload */
    struct scene_sample points[SCENE_SAMPLES_MAX];
    int point_count;
    /* Depth of what is opaque in each cell of the picture, rows from below [m]; INFINITY: none. */
    float depths[SCENE_ROWS * SCENE_COLUMNS];
    float ends[SCENE_ROWS * SCENE_COLUMNS]; /* likewise, of planes in the middle of the cell */
};

/* What the maps of one light hold. */
struct workload_map_load {
    bool is_known;
    double faces, opaque, transparent, events; /* events: in units of a face's texels */
    double layers;                             /* where the view asks for maps that have several */
};

/* An edge of a triangle and what stands on it, of which a side of a shadow volume may go. */
struct workload_edge {
    double corners[4][3]; /* world: its ends, and what its triangles have besides */
    double normals[2][3]; /* as long as twice their areas */
    bool is_border;       /* of one triangle */
    double weight;        /* edges that it stands for */
    size_t item;          /* of the state */
};

/* What the camera sees, on a coarse grid. */
MUST_CHECK bool scene_sampling_run(struct scene_sampling *sampling,
                                   const struct workload_desc *desc, struct error *err);

/* Whether a light shines on a point of the air. */
bool workload_shines_into(const struct state_light *light, const double point[3]);
/* On a surface, seen from its upper side. */
bool workload_shines_on(const struct state_light *light, const struct scene_sample *point);

/* What shadow volumes cover. The rest of the workload stands. */
MUST_CHECK bool workload_measure_volumes(struct workload *workload,
                                         const struct workload_desc *desc,
                                         const struct scene_sampling *sampling,
                                         const struct light_reach *reach, struct error *err);

/* What density grids add: along rays through a coarse grid of the picture, and from there and from
 * visible surfaces to lights. */
void workload_measure_grids(struct workload *workload, const struct workload_desc *desc,
                            const struct scene_sampling *sampling);

#endif
