/* SPDX-License-Identifier: MIT */
/* Triangles, points and a light, what the grid of `area` answers about them on the device, and the
 * definition of it in f64. A failed call fails the cmocka test that called. Thread: GL. */
#ifndef VITRAIL_TESTS_SUPPORT_AREA_STAGE_H
#define VITRAIL_TESTS_SUPPORT_AREA_STAGE_H

#include "renderer/shadows/area_grid.h"
#include "tests/support/shadow_rig.h"

/* The point of index i belongs to the pixel (COLUMN + i % WIDTH, BOTTOM - i / WIDTH), from which
 * the places of samples on the light follow. */
enum { AREA_STAGE_WIDTH = 64, AREA_STAGE_BOTTOM = 1000, AREA_STAGE_COLUMN = 17 };

struct area_triangle {
    double at[3][3];
    double filter; /* of all channels, 0: opaque */
};

struct area_stage {                  /* zeroed: empty */
    struct area_triangle *triangles; /* owned */
    uint32_t triangle_count;
    double (*points)[3]; /* owned */
    uint32_t point_count;
    struct state_light light;
    uint32_t samples;
    uint64_t pairs_max;  /* of struct area_grid */
    uint32_t loop_steps; /* of struct area_grid_desc */
    bool is_faithful;
    /* Optional, borrowed: asking takes its casters to the device as frames do, and puts their
     * triangles here, with the filter of red. */
    const struct scene_state *state;
};

struct area_answer { /* of the device */
    uint32_t (*filters)[2], (*places)[2], *firsts, *pairs, *cells;
    struct area_counts counts;
    struct area_light light;
};

void area_stage_finish(struct area_stage *stage);
/* A triangle to be placed; its address holds until the next one. */
struct area_triangle *area_stage_add(struct area_stage *stage, double filter);
/* Points at random, at most `reach` from the origin along each axis. */
void area_stage_scatter(struct area_stage *stage, uint32_t count, double reach, uint64_t seed);
/* A light at (0.1, height, -0.2) that shines down, a little askew. */
struct state_light area_stage_light(enum scene_light_type type, double height, double size);

/* Positions of triangles and points become what the device has: rounded to f32. */
MUST_CHECK bool area_stage_ask(const struct shadow_rig *rig, struct area_stage *stage,
                               struct area_answer *answer, struct error *err);
struct area_answer area_stage_must_ask(const struct shadow_rig *rig, struct area_stage *stage);
void area_answer_finish(struct area_answer *answer);

/* traced_filter.glsl: one channel of what is left of a sample. */
double area_answer_channel(const uint32_t words[2], int channel);
double area_answer_filter(const uint32_t words[2]); /* red */
/* Over all samples of a point. */
double area_answer_mean(const struct area_stage *stage, const struct area_answer *answer,
                        uint32_t point);

/* -- The definition -- */

/* The place of a sample on the light, as a point's pixel has it. */
void area_stage_sample(const struct area_stage *stage, uint32_t point, uint32_t index,
                       double at[3]);
/* Of parallel light: a place far away on the way to it. Of others nothing changes. */
void area_stage_aim(const struct area_stage *stage, const double point[3], double at[3]);
bool area_stage_is_before_light(const struct area_stage *stage, const double point[3]);

enum area_meeting { AREA_MEETS_NOT, AREA_MEETS, AREA_MEETING_HANGS /* on rounding */ };
/* The segment from a point to a place on the light. */
enum area_meeting area_triangle_meet(const struct area_triangle *triangle, const double from[3],
                                     const double to[3]);

#endif
