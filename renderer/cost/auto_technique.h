/* SPDX-License-Identifier: MIT */
/* What `shadows: auto` becomes: the rasteriser's maps, or where that is forecast to be faster on
 * this device, ray tracing, of the whole frame or of the shadows alone. The choice depends on the
 * scene, the view, the device's measured speed and what was published of what frames took: never on
 * what happens to be cached or busy, so the same request has the same pixels until something else
 * is published; frames of a view in motion apart (choice_cache.h). Thread: any. */
#ifndef VITRAIL_RENDERER_COST_AUTO_TECHNIQUE_H
#define VITRAIL_RENDERER_COST_AUTO_TECHNIQUE_H

#include "renderer/base/content_key.h"
#include "renderer/cost/learning.h"
#include "renderer/frame_report.h"
#include "renderer/lights/light_reach.h"

enum auto_policy {
    AUTO_RASTER,    /* ray tracing only where it alone can (area lights) */
    AUTO_MEASURED,  /* the fastest, by the device's speed; AUTO_RASTER while that is unknown */
    AUTO_RAYTRACED, /* always, where the request leaves it open */
};

struct auto_settings { /* zeroed = AUTO_RASTER */
    enum auto_policy policy;
    struct device_speed speed;
    const struct learning *learned; /* borrowed; NULL: nothing was */
    uint64_t learned_print;         /* of all that it holds */
    enum shadow_technique timed;    /* drawn to be timed, whatever is faster; AUTO: none */
};

/* Arrays are by technique; those that are no candidates have nothing there. */
struct auto_choice {                 /* zeroed = nothing was chosen */
    bool is_open;                    /* the request left the choice to us, and there was one */
    enum shadow_technique technique; /* a candidate; AUTO where it was not open */
    bool is_timed;                   /* auto_settings.timed took it */
    double ms[SHADOWS_COUNT];        /* forecast; 0 where the policy needed none */
    struct learning_case cold[SHADOWS_COUNT];   /* of frames that build what they need, */
    struct learning_case frames[SHADOWS_COUNT]; /* and of those that were forecast */
    char because[REPORT_TEXT_BYTES];
};

/* By what was forecast and what was learned, over the frames that each technique would make. What
 * a view was last drawn by stays until another gains enough, so that equal views keep equal
 * pictures. Worth timing beside it is a technique of which little is known, which may gain a tenth
 * and is expected to take no more than twice as long. */
struct auto_pick {
    enum shadow_technique technique;
    struct learning_answer answers[SHADOWS_COUNT];
    bool has_runner_up;
    enum shadow_technique runner_up; /* worth timing */
};
struct auto_pick auto_pick(const struct learning_case frames[SHADOWS_COUNT],
                           const struct learning *learned); /* NULL: nothing was learned */

/* A frame of one technique that builds this share of its structures, [0, 1]. */
struct learning_case auto_case(const struct learning_case *cold, double built_share);

struct workload_kept;

struct auto_desc {
    const struct view *view;              /* required */
    const struct scene_state *state;      /* required */
    const struct camera *camera;          /* required */
    const struct auto_settings *settings; /* NULL = zeroed */
    int raster_samples;                   /* of the rasteriser for this view */
    uint64_t shadow_budget_bytes;         /* of all shadow structures; 0 = any */
    uint64_t depths_bytes;                /* as workload_desc has it */
    uint64_t view_key;                    /* of learning_case.view */
    struct light_reach *reach;  /* as workload_desc has it, where a forecast was needed; optional */
    struct workload_kept *kept; /* likewise; optional */
    struct content_key state_key; /* likewise */
};

/* A quality leaves the choice open when it has `shadows: auto` and says nothing that only maps have
 * (another resolution than the default, more taps than that, compressed or averaged lists) nor
 * linked lists. */
bool auto_quality_is_open(const struct view_quality *quality);

/* Open is a view whose quality is, with color among its outputs, where no light is one that only
 * rays can draw. */
MUST_CHECK bool auto_choose(struct auto_choice *choice, const struct auto_desc *desc,
                            struct error *err);

/* SHADOWS_RASTER_DEFAULT, unless another candidate gains by more than forecasts are off; of the
 * others the fastest. */
enum shadow_technique auto_fastest(const double ms[SHADOWS_COUNT]);

/* "120 ms ray traced, 80 ms rasterised": of all candidates whose time is not below 0. */
enum { AUTO_TIMES_BYTES = 128 };
void auto_times_text(const double ms[SHADOWS_COUNT], char text[AUTO_TIMES_BYTES]);

#endif
