/* SPDX-License-Identifier: MIT */
/* What `shadows: auto` becomes: the rasteriser's maps, or where that is forecast to be faster on
 * this device, ray tracing, of the whole frame or of the shadows alone. The choice depends on the
 * scene, the view, the device's measured speed and what was published of what frames took: never on
 * what happens to be cached or busy, so the same request has the same pixels until something else
 * is published. Thread: any. */
#ifndef VITRAIL_RENDERER_COST_AUTO_TECHNIQUE_H
#define VITRAIL_RENDERER_COST_AUTO_TECHNIQUE_H

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
    int timed; /* 0, or 1 + the technique that is drawn to be timed, whatever is faster */
};

struct auto_choice {           /* zeroed = nothing was chosen */
    bool is_open;              /* the request left the choice to us, and there was one */
    bool takes_traced;         /* the whole frame */
    bool takes_traced_shadows; /* rasterised, as `raytraced-shadows` is */
    bool is_timed;             /* auto_settings.timed took it */
    double raster_ms, traced_ms, traced_shadows_ms;   /* forecast; 0 where the policy needed none */
    struct learning_case cold[FORECAST_TECHNIQUES];   /* of frames that build what they need, */
    struct learning_case frames[FORECAST_TECHNIQUES]; /* and of those that were forecast */
    char because[REPORT_TEXT_BYTES];
};

/* By what was forecast and what was learned, over the frames that each technique would make. What
 * a view was last drawn by stays until another gains enough, so that equal views keep equal
 * pictures. Worth timing beside it is a technique of which little is known, which may gain a tenth
 * and is expected to take no more than twice as long. */
struct auto_pick {
    enum forecast_technique technique;
    struct learning_answer answers[FORECAST_TECHNIQUES];
    bool has_runner_up;
    enum forecast_technique runner_up; /* worth timing */
};
struct auto_pick auto_pick(const struct learning_case frames[FORECAST_TECHNIQUES],
                           const struct learning *learned); /* NULL: nothing was learned */

/* A frame of one technique that builds this share of its structures, [0, 1]. */
struct learning_case auto_case(const struct learning_case *cold, double built_share);

struct auto_desc {
    const struct view *view;              /* required */
    const struct scene_state *state;      /* required */
    const struct camera *camera;          /* required */
    const struct auto_settings *settings; /* NULL = zeroed */
    int raster_samples;                   /* of the rasteriser for this view */
    uint64_t shadow_budget_bytes;         /* of all shadow structures; 0 = any */
    uint64_t view_key;                    /* of learning_case.view */
    struct light_reach *reach; /* as workload_desc has it, where a forecast was needed; optional */
};

/* A request leaves the choice open when it asks for color with `shadows: auto`, says nothing that
 * only maps have (another resolution than 1024, more than 4 taps, compressed or averaged lists) nor
 * linked lists, and its lights are none that only rays can draw. */
MUST_CHECK bool auto_choose(struct auto_choice *choice, const struct auto_desc *desc,
                            struct error *err);
double auto_choice_ms(const struct auto_choice *choice); /* what it is expected to take, or 0 */
enum forecast_technique auto_choice_technique(const struct auto_choice *choice);
/* The technique that a request would name for it: of maps `deep`. */
enum shadow_technique auto_choice_shadows(const struct auto_choice *choice);

#endif
