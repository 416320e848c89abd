/* SPDX-License-Identifier: MIT */
/* Compares what a frame asks of its shadow technique with what the technique can do, by its row in
 * the table. The frame is then drawn, refused, or drawn otherwise with a warning. No other place
 * compares them. A light that a technique does not want falls back to another one by struct
 * shadow_method. Pure. Thread: any. */
#ifndef VITRAIL_RENDERER_PLAN_TECHNIQUE_CHECK_H
#define VITRAIL_RENDERER_PLAN_TECHNIQUE_CHECK_H

#include "protocol/error.h"
#include "renderer/frame_report.h"
#include "renderer/view.h"

struct technique_demand {
    const struct view_quality *quality; /* required; as the plan has chosen it */
    bool is_rasterised;                 /* the colour */
    size_t lights;                      /* of the scene */
    size_t area_lights;                 /* of these */
    size_t unfiltered_lights; /* of these: transparent casters are in reach, and filter nothing */
    size_t gray_lights;       /* they do, without colour */
    size_t layered_lights;    /* they do, for all that is transparent behind the first alike */
    size_t bodied_lights;     /* they do, but for what lies within one mesh or in haze */
    size_t excluding_lights;  /* they do, though their materials leave objects out */
    bool is_hazy;             /* the view has haze, which lights shine into */
    bool has_grids;           /* the scene has density grids, and the colour is asked for */
    size_t window_lights;     /* of these: shadowed for each window, after its light lists */
    /* That of a light with media among its casters which it filters light by, and cannot follow it
     * in; AUTO: there is none. */
    enum shadow_technique thick_media;
    /* Casters that a technique cannot answer for, which therefore another one does; 0: none. */
    size_t unfit_casters;
    enum shadow_technique asked; /* with unfit_casters */
    const char *fall_back;       /* the warning of struct shadow_method.fall_back; NULL: none */
};

enum { TECHNIQUE_LACKS_MAX = 8 };
struct technique_lacks { /* warnings */
    char texts[TECHNIQUE_LACKS_MAX][REPORT_TEXT_BYTES];
    int count;
};

/* Checks, before there is a plan, that some technique takes so many samples per pixel; 0: the
 * default. Else ERROR_INVALID_REQUEST. */
MUST_CHECK bool technique_check_samples(const struct view_quality *quality, struct error *err);
/* ERROR_INVALID_REQUEST where the frame cannot be drawn by the technique. */
MUST_CHECK bool technique_check(const struct technique_demand *demand,
                                struct technique_lacks *lacks, struct error *err);

#endif
