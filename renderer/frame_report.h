/* SPDX-License-Identifier: MIT */
/* What one frame cost, what it modelled and why. Filled by the renderer, copied by value. */
#ifndef VITRAIL_RENDERER_FRAME_REPORT_H
#define VITRAIL_RENDERER_FRAME_REPORT_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/shadow_technique.h"

enum {
    REPORT_PASSES_MAX = 64,
    REPORT_NAME_BYTES = 48,
    REPORT_TEXT_BYTES = 200,
    REPORT_WARNINGS_MAX = 32,
    REPORT_REUSED_MAX = 16,
    REPORT_BYTES_MAX = 16,
};

/* The coarse stages of Server-Timing. Encode and queue are added by those who do them. */
enum report_stage {
    REPORT_SHADOW,
    REPORT_LIGHT_LIST,
    REPORT_SHADE,
    REPORT_READBACK,
    REPORT_STAGE_COUNT
};

struct report_pass {
    char pass[REPORT_NAME_BYTES];      /* "shadow.deep", "gbuffer", ... */
    char because[REPORT_TEXT_BYTES];   /* the requirement that called for it */
    char technique[REPORT_NAME_BYTES]; /* "deep", "map", "clustered", "lists", "" */
    double ms; /* true on this device: GPU timer where it is honest, fenced wall clock where the
                  device is our own processors; else NAN: not known */
};

struct report_bytes {
    char structure[REPORT_NAME_BYTES];
    uint64_t bytes;
};

/* All in bytes but level_bias, in levels, coarse_count and compressed_count, in textures,
 * compressed_rmse and upload_ms. All 0: the scene has none. Ray-traced frames read the levels from
 * the scene's file, mapped, never compressed: resident_bytes are what the GPU would hold. */
struct report_textures {
    uint64_t budget_bytes, resident_bytes; /* of all scenes */
    uint64_t wanted_bytes;                 /* of the levels that the frame asked for */
    uint64_t pending_bytes; /* to be written before what the budget allows is there */
    uint64_t written_bytes; /* for this frame */
    uint64_t coarse_count;  /* textures drawn without some level that was asked for */
    uint32_t level_bias;    /* levels withheld for want of budget: the most of any texture */
    uint64_t compressed_count, compressed_bytes; /* textures drawn so, colours only */
    double compressed_rmse; /* of theirs, in their finest level, of 1, as coded */
    double upload_ms;       /* wall clock spent on what was written, the device's work included */
};

struct frame_report {
    struct report_pass passes[REPORT_PASSES_MAX];
    int pass_count;
    char order[REPORT_PASSES_MAX][REPORT_NAME_BYTES]; /* of passes; report_order_pass */
    int order_count;
    double stage_ms[REPORT_STAGE_COUNT]; /* NAN where a pass of it has no known time */
    double total_ms;  /* wall clock of the whole frame in the renderer, without pauses */
    double paused_ms; /* while other frames went before the rest of this one */
    struct {
        uint64_t lights, shadowed_lights;
        uint64_t draws, triangles; /* drawables of the camera's passes, each pass counted */
        uint64_t draw_calls;       /* that took them: consecutive ones of one state share a call */
        uint64_t culled;           /* drawables outside of the image's view */
        uint64_t shadow_draws;     /* casters that the faces of built shadow maps see, ... */
        uint64_t shadow_culled;    /* ... and those of the scene that they do not see */
        uint64_t light_batches;    /* 1: all lights at once; more: as many as the budget of shadow
                                      structures asked for; 0: no shadow structure was needed */
        uint64_t light_slices;     /* dispatches of shading over the pieces of light lists, of each
                                      window and batch: more than these where lists are too long
                                      for one shader invocation (renderer/shading/loop_steps.h) */
        uint64_t split_pixels;     /* rasterised, in which samples of one surface were shaded each
                                      by itself, because light differs */
        uint64_t unseen_lights;    /* they reach nothing in view, and have no structure */
        uint64_t events;           /* transmittance events in all deep maps that the frame uses */
        uint64_t longest_list;     /* events of one texel */
        double mean_list;          /* events per texel that has any */
        uint64_t lookups;          /* shadow queries issued, taps counted each */
        uint64_t shadow_rays;      /* traced towards lights */
        uint64_t transparent_fragments; /* entries of the camera's per-pixel lists */
        uint64_t longest_pixel_list;
        uint64_t light_list_entries;
        uint64_t shadow_maps_built, shadow_maps_reused;
        uint64_t states_reused;   /* 1: the scene's transforms stood from the last frame */
        uint64_t feature_edges;   /* drawn over the picture, of those in view */
        uint64_t outlined_pixels; /* of highlights */
        uint64_t gbuffers_drawn, gbuffers_reused; /* per window */
        uint64_t light_lists_built, light_lists_reused;
        uint64_t pixel_lists_built, pixel_lists_reused;
        uint64_t plans_made, plans_reused; /* one of them is 1: the plan was made, or kept */
        uint64_t programs_built;  /* shader programs composed and compiled for this frame */
        uint64_t programs_reused; /* uses of programs that earlier work had made */
        uint64_t programs_loaded; /* taken from what an earlier start had compiled */
    } counts;
    struct report_compression { /* of deep shadow maps that are approximated; all 0: none is */
        uint64_t maps, events, nodes; /* events of their exact lists; nodes in their place */
        uint64_t exact_bytes, node_bytes;
        uint64_t windows; /* pieces that they were built in: one each, more for want of memory */
        int prefilter;    /* samples per side of a texel */
        double max_error; /* of a transmittance at any depth, against the mean of the samples */
    } compression;
    struct report_textures textures;
    struct report_bytes bytes[REPORT_BYTES_MAX]; /* what the frame's picture is made from, whatever
                                                    else is resident */
    int byte_count;
    uint64_t resident_bytes; /* of all that counts against the budget, after the frame */
    char reused[REPORT_REUSED_MAX][REPORT_NAME_BYTES]; /* "scene", "shadow.deep", ... */
    int reused_count;
    char warnings[REPORT_WARNINGS_MAX][REPORT_TEXT_BYTES];
    int warning_count;
    struct {                             /* what `shadows: auto` became; because "": nothing */
        char because[REPORT_TEXT_BYTES]; /* was open */
        enum shadow_technique shadows;   /* `map` where no light has a transparent caster */
        double expected_ms;              /* 0: not known */
    } chosen;
    bool is_kept_picture; /* nothing was drawn but what lies over it: it teaches nothing */
    bool has_cut_lists;   /* some did not find the room that was guessed: the frame is made again */
    bool has_lost_window; /* what came of it could not be read back: the frame has failed */
    bool error_is_exact;  /* of light's way to the surfaces of the color output nothing is left out
                             or approximated, but for the sampling of texels */
};

/* A pass has a line for each reason, and beyond half of the lines one for all further reasons. Each
 * silently stops at its cap; warnings say in the last slot that more were dropped. */
void report_add_pass(struct frame_report *report, const char *pass, const char *because,
                     const char *technique, double ms, enum report_stage stage);
/* The order of passes from now on, whenever their times become known; others follow. Names beyond
 * the cap are not kept. */
void report_order_pass(struct frame_report *report, const char *pass);
void report_add_bytes(struct frame_report *report, const char *structure, uint64_t bytes);
/* Of memory that windows or batches of lights use one after the other: the most of any counts. 0
 * makes no entry. */
void report_raise_bytes(struct frame_report *report, const char *structure, uint64_t bytes);
void report_add_reused(struct frame_report *report, const char *what);
void report_warn(struct frame_report *report, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

#endif
