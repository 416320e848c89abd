/* SPDX-License-Identifier: MIT */
/* What the parts of the shadow system share: shadows.c builds and caches the structures,
 * shadow_records.c makes them available to shading, shadow_report.c reports them. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOWS_INTERNAL_H
#define VITRAIL_RENDERER_SHADOWS_SHADOWS_INTERNAL_H

#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/shadow_programs.h"
#include "renderer/shadows/shadows.h"

/* Structures of one frame that are built in several turns, because urgent frames go in between. */
struct shadow_progress {
    uint64_t number;                /* of shadow_system.progresses */
    uint64_t built;                 /* so far */
    bool is_interrupted;            /* the turn ended before all were built */
    char opaque[REPORT_TEXT_BYTES]; /* why, in the words of the first turn */
    char transparent[REPORT_TEXT_BYTES];
};

struct shadow_system {
    struct gpu_timeline *timeline;
    struct shadow_store store;
    struct caster_painter painter;
    struct shadow_builder builder;
    struct shadow_guesses guesses;
    struct shadow_map **maps; /* all that stand, of any scene */
    size_t map_count, map_capacity;
    uint64_t frame;      /* number of the frame being prepared */
    uint64_t progresses; /* number of the last that began */

    /* of the current frame */
    struct shadow_map **light_maps; /* per light, NULL without a shadow */
    uint32_t *light_records;        /* per light, NO_SHADOW without */
    size_t light_count, light_capacity;
    struct shadow_build *builds;
    size_t build_count, build_capacity;
    struct shadow_progress *progress; /* NULL: all are built in one turn */
    size_t done_count;                /* with it: of builds, those that stand */
    int resolution, taps;
    double allowed_error; /* of lists that take the place of exact ones; 0: none do */
    bool is_frugal;       /* they are built one by one, each with no more memory than it needs */
    struct content_key refused;    /* of the maps whose exact lists last exceeded the budget, ... */
    uint64_t refused_budget_bytes; /* ... which was this */
    struct gl_buffer records;
    struct gl_texture record_view;
    char defines[SHADOW_DEFINES_BYTES];
};

/* Rows of eye_from_world. */
void shadow_eye_axes(const struct shadow_prepare_desc *desc, double axes[3][3]);

/* The records of the frame's lights, on the device and bound, and the defines of their lookups. */
MUST_CHECK bool shadow_records_upload(struct shadow_system *shadows,
                                      const struct shadow_prepare_desc *desc, struct error *err);

/* Whether the open map may be used: its sizes come with the picture or, where they may not, are
 * read, and it had room for them. */
bool shadow_guess_stands(struct shadow_system *shadows, struct shadow_map *map, bool may_guess);
/* Notes that the frame uses its open maps. */
MUST_CHECK bool shadow_sizes_use(struct shadow_system *shadows,
                                 const struct shadow_prepare_desc *desc, struct error *err);

/* Counts, bytes and warnings of the frame's structures. */
void shadow_report_fill(const struct shadow_system *shadows, struct frame_report *report);

/* Reports maps whose sizes were read back with the frame's picture. */
void shadow_report_sizes(uint32_t map_flags, const struct deep_statistics *sizes,
                         struct frame_report *report);

/* The casters drawn and culled by the builds of this frame. */
void shadow_report_casters(const struct shadow_system *shadows, const struct scene_state *state,
                           struct frame_report *report);

#endif
