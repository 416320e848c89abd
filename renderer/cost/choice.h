/* SPDX-License-Identifier: MIT */
/* Chooses a setting by the error or the time that was asked for, from measured rows or from the
 * models below. Pure functions. Thread: any.
 *
 * Errors are the root mean square error of linear colour under the exposure, cut to [0, 1] (1 =
 * the white of the screen), against the ray-traced reference; times are milliseconds of one frame
 * in the renderer. */
#ifndef VITRAIL_RENDERER_COST_CHOICE_H
#define VITRAIL_RENDERER_COST_CHOICE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/quality_setting.h"
#include "renderer/forecast/forecast.h"
#include "renderer/view.h"

struct choice_row {
    struct quality_setting setting;
    double ms;    /* the time that can be promised, not the mean */
    double error; /* INFINITY: not known, so never promised */
    double bytes; /* of its shadow maps and of the window, of the models; 0: not known */
};

/* What is asked for, and what was said and must stay. */
struct quality_target {
    double max_error, budget_ms;                 /* 0 = not asked for; at least one is */
    enum shadow_technique shadows;               /* AUTO = open */
    int shadow_resolution, shadow_taps, samples; /* 0 = open */
    double shadow_compression;                   /* likewise, and of rows with deep lists */
    int shadow_prefilter;
    int atmosphere_samples;         /* likewise, where there is haze or smoke */
    enum transparency transparency; /* AUTO = open */
    unsigned needs;                 /* enum shadow_can: what else is asked of the technique */
};

struct choice {
    const struct choice_row *row;   /* one of the rows */
    bool keeps_error, keeps_budget; /* true also where it was not asked for */
};

/* With max_error: the fastest row at most that far off; with both: that among the rows within the
 * budget. With budget_ms alone: the most accurate row within it, of equals the faster. When no row
 * keeps all: with both, the most accurate within the budget, else the fastest within the error,
 * else the fastest; with one, the row nearest to it. Of equals the first counts. A row without
 * shadows is none for a budget where another takes at most half as long again as that and is half
 * as far off: then no row keeps the budget. With max_error it is one where it keeps that. False
 * when no row goes with what was said. */
bool choice_make(const struct choice_row *rows, size_t count, const struct quality_target *target,
                 struct choice *choice);

/* Whether a row goes with what was said: open members go with all, and a map's parameters do not
 * hinder a technique that has none. */
bool choice_row_fits(const struct choice_row *row, const struct quality_target *target);

/* ---- without a measurement ---- */

/* What the models know of a frame; taken from counts, nothing is rendered. */
struct choice_frame {
    int width_px, height_px;
    uint64_t lights;    /* that may cast a shadow */
    uint64_t triangles; /* of the scene */
    bool has_haze;
    bool has_grids;            /* of density */
    int peeled_sides;          /* of the transparency that is asked for, as struct workload */
    bool is_warm;              /* what is kept between frames is there, */
    double shadow_bytes;       /* but for shadow maps beyond this budget, which are made anew for
                                  each; 0 = any */
    struct device_speed speed; /* zeroed: that of the machine of the fit */
};

/* Models, so what they promise is called estimated.
 *   time: renderer/cost/technique_forecast, for a scene of which only these counts are known: the
 *   rest is as in the mean of the shared scenes (choice.c).
 *   error: a constant of the technique, below which four of five settings measured on shared
 *   scenes are (docs/explanation/cost-model.md), over the root of the image's side:
 * edges are wrong, and their share of the pixels is one over the side. Camera edges by samples;
 * shadow edges by the width of a texel, sqrt(taps) / shadow_resolution. Fills rows for the
 * technique that was said, else for the candidates of `auto`; with what was said of resolution,
 * taps, samples and, in haze, atmosphere samples, else with those of the sweep. Returns their
 * number, which is not 0. */
enum { CHOICE_ESTIMATES_MAX = 384 }; /* 40 of each technique of maps, and in haze 120 */
size_t choice_estimate(const struct choice_frame *frame, const struct quality_target *target,
                       struct choice_row rows[CHOICE_ESTIMATES_MAX]);

/* Rows of more samples than any ray-traced one has, up to 256: its time by the samples (too careful
 * where building weighs), its error as the model's falls. Without a ray-traced row nothing is
 * added, nor beyond `capacity`. Returns the count. */
size_t choice_add_traced(struct choice_row *rows, size_t count, size_t capacity);

/* The candidate of `auto` that is drawn as that technique where no light wants the candidate's own
 * (struct shadow_method.otherwise): deep shadow maps of opaque casters are plain maps. Without one,
 * the technique itself. */
enum shadow_technique choice_candidate_of(enum shadow_technique drawn);

/* A row of another view of the same scene on the same device: time by the pixels (the shadow maps
 * cost the same, so this is too careful where the image shrinks), error as it was. */
struct choice_row choice_scale(const struct choice_row *row, double pixels_there,
                               double pixels_here);

#endif
