/* SPDX-License-Identifier: MIT */
/* A shadow technique as functions. Its plain data is a row of protocol/shadow_technique.h; each has
 * a file of its own, technique_NAME.c, and technique_table.c lists them. The planner, the builder,
 * shading and the lists of programs ask the table and name no technique. */
#ifndef VITRAIL_RENDERER_SHADOWS_TECHNIQUE_H
#define VITRAIL_RENDERER_SHADOWS_TECHNIQUE_H

#include "protocol/shadow_technique.h"
#include "renderer/forecast/forecast.h"
#include "renderer/shadows/caster_variants.h"
#include "renderer/shadows/shadow_needs.h"

struct frame_report;
struct shadow_builder;
struct shadow_features;
struct shadow_finder;
struct shadow_record;

enum shadow_scope {
    SHADOW_PER_LIGHT,  /* a structure in the space of the light, kept between frames */
    SHADOW_PER_WINDOW, /* the light that arrives at each point of a window, after its light lists */
};

struct shadow_listing {      /* what the programs of a light's passes follow from; all required */
    struct caster_view view; /* of the map; each pass sets its own caster_pass */
    const struct shadow_casters *casters;
    bool scans_on_host;
};

/* One description of a pass, for the plan, for explaining and for warming up. */
struct shadow_pass {
    const char *name; /* as the frame report has it; NULL ends the passes of a technique */
    enum shadow_technique technique; /* AUTO: that of the lights; else reported so for all */
    bool is_of_windows;              /* SHADOW_PER_WINDOW: once a window; else once a frame */
    bool is_conditional;             /* left out where the pass that counts finds nothing */
    bool is_of_nodes;                /* only where lists are compressed: SHADOW_FLAG_NODES */
    enum caster_pass casters[2];     /* of shadow_texels.h: how they are drawn; 1: if faithful */
    /* SHADOW_PER_LIGHT: adds the programs of the pass. */
    void (*list_programs)(const struct shadow_pass *pass, const struct shadow_listing *listing,
                          struct program_list *list);
};

/* How the self-test draws a structure before the device is trusted with it
 * (renderer/frame/scene_selftest.h). */
struct shadow_trial {
    const char *name;            /* reported of a failure; NULL ends the trials of a structure */
    struct view_quality quality; /* the resolution is the self-test's own */
};

struct shadow_building { /* what the lists of a batch of lights are made of; all required */
    const struct shadow_structure *structure; /* whose maps are built */
    struct shadow_build *builds;
    size_t count;
    const struct shadow_scene *scene;
    const char *because;
};

/* How shadows are found and what keeps them. Techniques that differ in their queries alone share
 * one. */
struct shadow_structure {
    enum shadow_scope scope;
    const struct shadow_pass *passes; /* in the order of execution, after shadow_depth_pass */
    /* One at least; a frame needs the one that is as `faithful`, or else the first. */
    const struct shadow_trial *trials;
    /* Share of the time of all others that it must be forecast to take before `auto` compares it:
     * what a forecast is off by; 0: any. And triangles above which some devices refuse it; 0: any.
     */
    double least_gain, sure_triangles;
    double noise; /* that pixels of its trials may be off by, relative; 0: of none */
    /* Adds what the shadows of a frame take, beside its surfaces. Thread: any. */
    void (*forecast)(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT]);
    /* The error of shadows (forecast.h); NULL: none, so that edges alone are off. Thread: any. */
    double (*forecast_error)(const struct forecast_setting *setting);

    /* Of SHADOW_PER_WINDOW: what finds the shadows. */
    const struct shadow_finder *finder;

    /* The rest is of SHADOW_PER_LIGHT; functions are optional. */
    uint64_t texel_bytes; /* least memory of a texel, known before the structure is built */
    bool filters;         /* transparent casters are in the structure ... */
    bool has_lists;       /* ... in a list of each texel, */
    bool has_texels;      /* or in four floats of each: shadow_texels.h */
    bool has_nodes;       /* the lists are in the pool of nodes; else in that of events */
    bool is_walked;       /* a query visits every element before the receiver */
    bool follows_depths;  /* built after the opaque depths have left the target */
    /* Whether lists hold every transmittance as it is; NULL: with each quality. */
    bool (*is_exact)(const struct view_quality *quality);
    /* Whether density grids cast into the lists; NULL: never, so that they shadow their light apart
     * from the map. */
    bool (*holds_grids)(const struct view_quality *quality);
    /* Completes the map, whose frame and clip planes stand. allowed_error: of lists that take the
     * place of exact ones, 0 for none. */
    void (*describe)(struct shadow_map *map, const struct shadow_casters *casters,
                     const struct view_quality *quality, double allowed_error);
    /* Adds what a query of the map needs of its program. */
    void (*add_features)(struct shadow_features *features, const struct shadow_map *map);
    /* Divides the casters of the build, and says how many layers its map has, before memory is
     * taken for any. */
    bool (*divide)(struct shadow_build *build, const struct scene_state *state, struct error *err);
    /* Builds the maps of this structure among the builds and passes over the others. Thread: GL. */
    bool (*build)(struct shadow_builder *builder, const struct shadow_building *building,
                  struct error *err);
    /* Fills what queries read of the lists; the rest of the record stands. */
    void (*record)(const struct shadow_map *map, struct shadow_record *record);
    /* Binds what queries read of the lists. Thread: GL. */
    void (*bind)(const struct shadow_store *store);
    /* maps: of each light of the frame, NULL without a shadow; those of other structures are passed
     * over. */
    void (*report)(const struct shadow_map *const *maps, size_t count, struct frame_report *report);
    /* Warns of what the reports of all lights of a frame, which may come in batches, tell. */
    void (*warn)(struct frame_report *report);
    /* Gives the memory of the lists back; empty ranges are none. */
    bool (*drop)(struct shadow_store *store, struct shadow_map *map, struct error *err);
};

struct shadow_method {
    enum shadow_technique id;                 /* the row */
    const struct shadow_structure *structure; /* required */
    const char *reused; /* SHADOW_PER_LIGHT: the report's name for structures that stood already */
    /* Of structures that filter: NAME of shaders/shadows/shadow_lookup_NAME.glsl, which looks them
     * up. */
    const char *lookup;
    /* The technique of lights that this one does not want; NULL: they shine without a shadow. */
    const struct shadow_method *otherwise;
    /* Whether a light with these casters has a shadow of this technique. Thread: any. */
    bool (*wants)(const struct shadow_casters *casters, const struct view_quality *quality);
    /* Of SHADOW_PER_WINDOW: whether it can find what light loses to a caster; NULL: to any. Where
     * one does not fit, the whole frame has the other technique, with a warning. Thread: any. */
    bool (*fits)(const struct scene_state *state, const struct state_item *item,
                 const struct view_quality *quality);
    const struct shadow_method *instead; /* required with `fits`; has none itself */
    /* Whether the device has what a form of it takes, and the casters are such that it can follow
     * them, else ERROR_UNSUPPORTED; NULL: always. Thread: any. */
    bool (*check)(const struct scene_state *state, const struct view_quality *quality,
                  const struct gl_limits *limits, struct error *err);
    /* What is done in place of the form that was asked for, as a warning; NULL, of the function
     * too: nothing. Thread: any. */
    const char *(*fall_back)(const struct scene_state *state, const struct view_quality *quality);
};

extern const struct shadow_structure shadow_structure_map, shadow_structure_deep,
    shadow_structure_linked, shadow_structure_rays, shadow_structure_translucent,
    shadow_structure_stochastic, shadow_structure_colored, shadow_structure_composited,
    shadow_structure_area, shadow_structure_volume, shadow_structure_moments,
    shadow_structure_silhouette;
extern const struct shadow_method shadow_method_map, shadow_method_deep, shadow_method_rays;

/* Opaque casters, drawn for the structure of every light. */
extern const struct shadow_pass shadow_depth_pass;

/* The structures, one after the other; NULL past the last. */
const struct shadow_structure *shadow_structure_at(size_t index);
/* NULL of SHADOWS_NONE. AUTO, where no plan has chosen, and a whole renderer, of frames that are
 * rasterised after all, have that of SHADOWS_RASTER_DEFAULT. */
const struct shadow_method *shadow_method_of(enum shadow_technique technique);
/* The technique of a light with these casters; NULL: it shines without a shadow. */
const struct shadow_method *shadow_method_choose(const struct shadow_casters *casters,
                                                 const struct view_quality *quality);
/* Whether density grids cast into the lists of lights with this quality. Thread: any. */
bool shadow_quality_holds_grids(const struct view_quality *quality);
/* Casters of the scene that do not fit; 0 of NULL. Thread: any. */
size_t shadow_method_count_unfit(const struct shadow_method *method,
                                 const struct scene_state *state,
                                 const struct view_quality *quality);
/* struct shadow_method.wants of techniques that are for transparent casters alone. */
bool shadow_wants_transparent(const struct shadow_casters *casters,
                              const struct view_quality *quality);
/* Likewise, of techniques that are for all casters. */
bool shadow_wants_any(const struct shadow_casters *casters, const struct view_quality *quality);
/* What finds its shadows; NULL of NULL, and of techniques with structures. */
const struct shadow_finder *shadow_finder_of(const struct shadow_method *method);
/* Whether a finder finds the shadows of each window where the request names a technique. */
bool shadow_is_per_window(enum shadow_technique technique);

#endif
