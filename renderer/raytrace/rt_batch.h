/* SPDX-License-Identifier: MIT */
/* A batch of surfaces that some pixels show: gathered from sorted hits, lit together, composited
 * per sample. Pixels that one surface fills go a shorter way (rt_whole.h), with the same bits.
 * Transparent triangles are shaded once per pixel, opaque surfaces once as far as they are one
 * plane in one light, both in the middle of the samples that show the triangle seen first; where
 * light differs, at each sample (rt_batch_refine.h); where a pixel has more than four samples, once
 * per quarter (or smaller part) of it at least. Thread: one per batch. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_BATCH_H
#define VITRAIL_RENDERER_RAYTRACE_RT_BATCH_H

#include "renderer/image/image.h"
#include "renderer/raytrace/rt_haze_grid.h"
#include "renderer/raytrace/rt_light_set.h"
#include "renderer/raytrace/rt_packet.h"
#include "renderer/raytrace/rt_surface.h"
#include "renderer/raytrace/rt_walk.h"

enum { RT_TEXELS_MAX = 4 };

struct rt_point { /* where a sample's ray meets a surface */
    struct rt_hit hit;
    double point[3], direction[3]; /* relative to rt_scene.origin; of the ray */
    uint32_t bent; /* of a sample: 1 + index of what it sees behind its last step; 0: it goes
                      straight to its end */
};

struct rt_texel { /* where another sample of the pixel meets the surface */
    uint32_t triangle;
    float u, v;
};

struct rt_fragment { /* one surface in one pixel, as samples gather it */
    struct rt_hit hit;
    int x, y;
    int part; /* of the pixel; rt_sample */
    int sample_count;
    bool is_opaque;
    struct { /* over the samples that show the triangle of `hit`: rt_batch_light takes the mean */
        double u, v, point[3], direction[3];
        int count;
    } sum;
    struct rt_texel texels[RT_TEXELS_MAX - 1]; /* the base colour is the mean over these and hit,
                                              where a texture has no levels of detail */
    int texel_count;
};

struct rt_shading {     /* of a fragment: what compositing needs, and shadow rays add to */
    double radiance[3]; /* out, nt, before coverage */
    double filter[3];   /* of what lies behind; of transparent ones */
    double alpha;
    float base[3]; /* colour of the texture, so that contrast is that of the light; 1: none */
    bool is_ground;
    double unshadowed[3]; /* of the ground: its radiance if nothing cast a shadow */
};

struct rt_start {     /* of a fragment's shadow rays; one line of the cache */
    double point[3];  /* relative to rt_scene.origin */
    double offset[3]; /* the surface's normal, of smooth meshes its own, rt_scene.nudge_m long */
    uint32_t mesh, triangle;
    uint32_t excluded_node; /* rt_ray's */
};

#define RT_BACKGROUND UINT32_MAX

struct rt_step {       /* of one sample, front to back; the last one is the background */
    uint32_t fragment; /* or RT_BACKGROUND */
    float through[3];  /* of the media since the step before */
};

struct rt_ray_job { /* one shadow ray, waiting */
    uint32_t fragment, light;
    float direction[3], distance_m;
    float weight[3];     /* radiance that the light adds where nothing is between */
    bool is_transparent; /* the fragment */
};

struct rt_job;

struct rt_batch_desc {
    struct rt_job *job;                          /* required; what is cancelled is left unlit */
    const struct rt_scene *scene;                /* required */
    const struct view *view;                     /* required */
    const struct camera *camera;                 /* required */
    const struct rt_light_set *light_set;        /* required */
    const struct environment_light *environment; /* optional */
    const struct rt_haze_grid *haze;             /* required where the view has an atmosphere */
    double eye_sigma[3];                         /* of a perspective camera */
    int samples;                                 /* per pixel */
    const double (*places)[2]; /* required; of the samples in their pixel, y down; borrowed */
    double way[2][3]; /* of rays to those of the next pixel, or part of one, to the right and
                         down: in metres, perspective: at depth 1 */
};

struct rt_wholes;

struct rt_batch { /* zeroed before init; arrays grow and are kept */
    struct rt_batch_desc desc;
    struct rt_fragment *fragments;
    struct rt_shading *shadings; /* of each fragment; likewise starts */
    struct rt_start *starts;
    struct rt_step *steps;
    float (*air)[3];         /* of each step: what haze and grids scatter since the step before */
    uint32_t *sample_ends;   /* of each sample's steps */
    struct rt_point *points; /* of each sample: where it ends on something opaque, else its
                                direction alone */
    int (*pixels)[2];
    struct rt_ray_job *jobs;
    uint32_t *sorted; /* numbers of jobs */
    struct rt_light_blocks *blocks;
    uint32_t *light_counts; /* of waiting jobs, by light and is_transparent */
    size_t fragment_count, step_count, sample_count, pixel_count, job_count;
    size_t fragment_capacity, step_capacity, air_capacity, sample_capacity;
    size_t pixel_capacity;
    bool has_bends;          /* some surface bends rays: the next four are in use */
    struct rt_walker walker; /* of their ways from there on */
    struct view beyond;      /* how these are lit */
    struct rt_seen *bent;    /* at their ends */
    size_t bent_count, bent_capacity;
    size_t pixel_fragments;     /* first fragment of the pixel being gathered */
    struct rt_haze_sight sight; /* of the sample being gathered, where there is haze */
    bool has_air, has_grids;    /* haze or grids; grids */
    struct rt_lighting smoke;   /* of what grids scatter, and haze beside lamps */
    struct rt_wholes *wholes;   /* owned; NULL: all pixels are gathered by rt_batch_add */
    struct rt_packet packet;
    struct rt_hits scratch;
    uint64_t shadow_rays, surfaces, lights_listed, lights_reaching; /* raytrace_stats */
    bool has_overflowed, is_cancelled;
};

MUST_CHECK bool rt_batch_init(struct rt_batch *batch, const struct rt_batch_desc *desc,
                              struct error *err);
void rt_batch_finish(struct rt_batch *batch); /* accepts zeroed */

struct rt_sample {
    int x, y, index;     /* pixel, y down; number of the sample in it */
    int part;            /* samples of one part of the pixel share the shading of a surface */
    const double *place; /* in the pixel, y down */
    const struct rt_ray *ray;
    const struct rt_hits *hits; /* in order */
};
/* Samples come pixel by pixel, in the order of their numbers. False when memory runs out. */
MUST_CHECK bool rt_batch_add(struct rt_batch *batch, const struct rt_sample *sample);

/* Whether it is time to shade; only between pixels. */
bool rt_batch_is_full(const struct rt_batch *batch);

/* The batch's footprint of the pixel at a hit. view_z: metres along the view direction. */
void rt_batch_footprint(const struct rt_batch *batch, const struct rt_hit *hit, double view_z,
                        const double direction[3], struct rt_footprint *footprint);

/* Whether a triangle goes on where another one of its mesh is: they lean alike, and the hit at t is
 * on the plane of the samples that are known. Normals: unit; offset: from there to the hit. */
bool rt_batch_continues(const struct rt_batch *batch, const double known[3], const double own[3],
                        const double offset[3], double t);

void rt_fragment_add(struct rt_fragment *fragment, const struct rt_point *point);
MUST_CHECK bool rt_batch_reserve_fragments(struct rt_batch *batch, size_t count);

/* Lights all surfaces, writes the pixels and empties the batch. */
void rt_batch_shade(struct rt_batch *batch);

#endif
