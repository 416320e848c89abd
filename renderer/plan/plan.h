/* SPDX-License-Identifier: MIT */
/* What a frame requires and the passes that follow, known before anything is drawn. The renderer
 * runs the steps of the plan (frame_run.c); the list of passes is for explaining and warming up.
 * Requirements decide passes and shader variants as in Lexolights (Peciva 2012, 3.2). Plain data.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_PLAN_PLAN_H
#define VITRAIL_RENDERER_PLAN_PLAN_H

#include "renderer/cost/auto_technique.h"
#include "renderer/frame_report.h"
#include "renderer/gl/context.h"
#include "renderer/plan/technique_check.h"
#include "renderer/view.h"

/* About in the order in which passes follow from them. */
enum plan_need {
    PLAN_NEED_TRACED,           /* colour comes from the ray tracer */
    PLAN_NEED_OPAQUE_SHADOWS,   /* some light has opaque casters in reach */
    PLAN_NEED_FILTERED_SHADOWS, /* some light has transparent casters in reach */
    PLAN_NEED_TRACED_SHADOWS,   /* rays find the shadows of a rasterised picture */
    PLAN_NEED_VISIBILITY,       /* rays find what is in the way of a map's light */
    PLAN_NEED_SURFACES,         /* a rasterised picture has opaque or masked items in view */
    PLAN_NEED_LAYERS,           /* transparent items are in view */
    PLAN_NEED_ANTIALIASING,     /* more than one sample per pixel */
    PLAN_NEED_LIGHTS,           /* something shines */
    PLAN_NEED_ATMOSPHERE,       /* lights shine into haze before the camera */
    PLAN_NEED_SMOKE,            /* lights shine into density grids of a rasterised picture */
    PLAN_NEED_REFRACTION,       /* layers in view bend what is behind them */
    PLAN_NEED_COLOR,            /* lit colour was asked for */
    PLAN_NEED_DEEP,             /* a deep image of the layers */
    PLAN_NEED_AUXILIARY,        /* depth, normal, ids */
    PLAN_NEED_OVERLAY,          /* edges or an outline over the colour */
    PLAN_NEED_COUNT
};

struct shadow_method;
struct transparency_method;

struct plan_requirement {
    enum plan_need need;
    bool is_met;                     /* false: what it would call for is left out */
    char because[REPORT_TEXT_BYTES]; /* why, or why not */
};

/* What the executor calls: a step runs its passes, which are neighbours. */
enum plan_step {
    PLAN_STEP_TRACE, /* once a frame: */
    PLAN_STEP_SHADOWS,
    PLAN_STEP_RAYS,
    PLAN_STEP_SURFACES, /* once a window: */
    PLAN_STEP_LAYERS,
    PLAN_STEP_LIGHT_LISTS,
    PLAN_STEP_SHADOW_POINTS, /* may ask for smaller windows, as layers do */
    PLAN_STEP_SHADE,
    PLAN_STEP_REFRACT,
    PLAN_STEP_ACCUMULATE, /* where samples come in rounds */
    PLAN_STEP_DEEP,       /* may ask for smaller windows */
    PLAN_STEP_READ,
    PLAN_STEP_AUXILIARY,
    PLAN_STEP_OVERLAY, /* once a frame, after all windows */
    PLAN_STEP_COUNT
};

struct plan_pass {
    char pass[REPORT_NAME_BYTES]; /* as the frame report will call it */
    char technique[REPORT_NAME_BYTES];
    enum plan_need need; /* the requirement that calls for it */
    enum plan_step step; /* that runs it */
    bool is_conditional; /* left out where the pass that counts finds nothing */
    uint64_t bytes;      /* memory that it takes, as far as it is known before; else 0 */
};

enum { PLAN_PASSES_MAX = 32 };

struct plan {
    struct plan_requirement requirements[PLAN_NEED_COUNT]; /* by enum plan_need */
    struct plan_pass passes[PLAN_PASSES_MAX];              /* in the order of execution */
    int pass_count;
    int samples;        /* per pixel, of the colour */
    uint32_t lobes;     /* of drawn surfaces: shader_needs_lobes */
    int target_samples; /* per pixel, of the rasterised targets */
    bool has_glow;      /* lamps are seen in haze that is rasterised (renderer/scene/haze_glow.h) */
    int rounds;         /* of these, of the colour: renderer/base/sample_pattern.h */
    size_t opaque_items, transparent_items;    /* in view */
    bool has_layers;                           /* of the scene, something is transparent */
    size_t bending_items;                      /* of the latter: MATERIAL_BENDS */
    size_t lights_by_technique[SHADOWS_COUNT]; /* those with a shadow, by that of each */
    size_t traced_lights;                      /* of these: shadowed by rays */
    /* Casters that the technique of the request cannot answer for: another one does. */
    size_t unfit_casters;
    enum shadow_technique unfit_technique;      /* with them: that of the request */
    const struct shadow_method *window_shadows; /* that of traced_lights; NULL without any */
    size_t unshadowed_lights;                   /* shine without a structure */
    size_t unfiltered_lights; /* plain maps let their light pass transparent casters unchanged */
    /* struct technique_demand */
    size_t gray_lights, layered_lights, bodied_lights, excluding_lights;
    size_t unseen_lights;                           /* brighten nothing in view */
    size_t compressed_lights;                       /* of the deep ones: their lists become nodes */
    const struct transparency_method *transparency; /* that draws what is transparent in view */
    unsigned layer_needs;                           /* enum transparency_can: what is asked of it */
    unsigned transparency_lacks; /* enum transparency_can: why it is not the one asked for */
    uint64_t shadow_texels;
    size_t least_batches;      /* of shadowed lights, by what is known of their structures before: 1
                                  where all may fit the budget, 0 without any */
    struct auto_choice choice; /* that of the view; the plan chooses nothing */
    struct technique_lacks lacks; /* of the technique: what the frame warns of */
};

#define PLAN_RAYS "rays" /* technique of passes that see what is in the way of a map's light */

const char *plan_need_name(int need); /* "color", "layers", ...; NULL past the last */
bool plan_has_step(const struct plan *plan, enum plan_step step);
/* Whether the colour is shown by a pass of its own, behind rounds or what is added to a picture
 * over a backdrop (renderer/shading/accumulation.h). */
bool plan_accumulates(const struct plan *plan, const struct view *view);
/* Passes of one step are neighbours: the step begins where the one before it was another. */
bool plan_begins_step(const struct plan *plan, int pass);
size_t plan_shadowed_lights(const struct plan *plan); /* of all techniques */

/* Samples per pixel of the rasterised colour, 1 without it. The default is 1 where the targets of
 * the device have no more: antialiased lists need one that says which samples survived the depth
 * test. */
int plan_samples(const struct view *view, const struct gl_limits *limits);

#endif
