/* SPDX-License-Identifier: MIT */
/* A shadow technique as functions. Its plain data is a row of protocol/shadow_technique.h; each has
 * a file of its own, technique_NAME.c, and technique_table.c lists them. The planner, the builder,
 * shading and those who list programs ask the table and name no technique. */
#ifndef VITRAIL_RENDERER_SHADOWS_TECHNIQUE_H
#define VITRAIL_RENDERER_SHADOWS_TECHNIQUE_H

#include "protocol/shadow_technique.h"
#include "renderer/shadows/caster_variants.h"
#include "renderer/shadows/shadow_needs.h"

struct shadow_builder;
struct shadow_features;

/* A technique that rebuilds its structure between the layers that it composites gets a scope of its
 * own here. */
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
    const char *name;    /* as the frame report has it; NULL ends the passes of a technique */
    bool is_of_windows;  /* SHADOW_PER_WINDOW: once a window; else once a frame */
    bool is_conditional; /* left out where the pass that counts finds nothing */
    bool is_of_nodes;    /* only where lists are compressed: SHADOW_FLAG_NODES */
    /* SHADOW_PER_LIGHT: adds the programs of the pass. */
    void (*list_programs)(const struct shadow_pass *pass, const struct shadow_listing *listing,
                          struct program_list *list);
};

struct shadow_method {
    enum shadow_technique id; /* the row */
    enum shadow_scope scope;
    const struct shadow_pass *passes; /* in the order of execution, after shadow_depth_pass */
    /* The technique of lights that this one does not want; NULL: they shine without a shadow. */
    const struct shadow_method *otherwise;
    /* Whether a light with these casters has a shadow of this technique. Thread: any. */
    bool (*wants)(const struct shadow_casters *casters, const struct view_quality *quality);

    /* The rest is of SHADOW_PER_LIGHT. */
    uint32_t kind;        /* of its structures in shadow_record */
    const char *reused;   /* the report's name for structures that stood already */
    uint64_t texel_bytes; /* least memory of a texel, known before the structure is built */
    bool has_lists;       /* transparent casters are in the structure, in a list of each texel */
    bool has_nodes;       /* the lists are in the pool of nodes; else in that of events */
    bool is_walked;       /* a query visits every element before the receiver */
    bool follows_depths;  /* built after the opaque depths have left the target */
    /* Completes the map, whose frame and clip planes stand; optional. allowed_error: of lists that
     * take the place of exact ones, 0 for none. */
    void (*describe)(struct shadow_map *map, const struct shadow_casters *casters,
                     const struct view_quality *quality, double allowed_error);
    /* Adds what a query of the map needs of its program; optional. */
    void (*add_features)(struct shadow_features *features, const struct shadow_map *map);
    /* Builds the maps of this technique among the builds and passes over the others; optional.
     * Thread: GL. */
    bool (*build)(struct shadow_builder *builder, struct shadow_build *builds, size_t count,
                  const struct shadow_scene *scene, const char *because, struct error *err);
};

extern const struct shadow_method shadow_method_map, shadow_method_deep, shadow_method_linked,
    shadow_method_rays;

/* Opaque casters, drawn for the structure of every light. */
extern const struct shadow_pass shadow_depth_pass;

/* NULL of SHADOWS_NONE. */
const struct shadow_method *shadow_method_of(enum shadow_technique technique);
/* The technique whose structures have this kind; the kinds are 0 to SHADOW_KINDS - 1. */
enum { SHADOW_KINDS = 3 };
const struct shadow_method *shadow_method_of_kind(uint32_t kind);
/* The technique of a light with these casters; NULL: it shines without a shadow. */
const struct shadow_method *shadow_method_choose(const struct shadow_casters *casters,
                                                 const struct view_quality *quality);
/* Whether rays, or others, find the shadows of each window where the request names a technique. */
bool shadow_is_per_window(enum shadow_technique technique);

#endif
