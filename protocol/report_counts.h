/* SPDX-License-Identifier: MIT */
/* What a frame counts: the renderer fills it in (renderer/frame_report.h), and clients read it
 * (protocol/frame_stats.h). Plain data. */
#ifndef VITRAIL_PROTOCOL_REPORT_COUNTS_H
#define VITRAIL_PROTOCOL_REPORT_COUNTS_H

#include <stdint.h>

struct report_counts {
    uint64_t lights, shadowed_lights;
    uint64_t draws, triangles; /* drawables of the camera's passes, each pass counted */
    uint64_t draw_calls;       /* that took them: consecutive ones of one state share a call */
    uint64_t culled;           /* drawables outside of the image's view */
    uint64_t shadow_draws;     /* casters that the faces of built shadow maps see, ... */
    uint64_t shadow_culled;    /* ... and those of the scene that they do not see */
    uint64_t light_batches;    /* 1: all lights at once; more: as many as the budget of shadow
                                  structures asked for; 0: no shadow structure was needed */
    /* Dispatches of shading over the pieces of light lists, of each window and batch: more than
     * these where lists are too long for one shader invocation (renderer/shading/loop_steps.h).
     */
    uint64_t light_chunks;
    uint64_t rounds;                /* of samples, whose mean the rasterised picture is; 0: ray
                                       traced, or no picture */
    uint64_t split_pixels;          /* rasterised, in which samples of one surface were shaded each
                                       by itself, because light differs */
    uint64_t unseen_lights;         /* they reach nothing in view, and have no structure */
    uint64_t events;                /* transmittance events in all deep maps that the frame uses */
    uint64_t longest_list;          /* events of one texel */
    double mean_list;               /* events per texel that has any */
    uint64_t lookups;               /* shadow queries issued, taps counted each */
    uint64_t shadow_rays;           /* traced towards lights */
    uint64_t transparent_fragments; /* entries of the camera's per-pixel lists */
    uint64_t longest_pixel_list;
    uint64_t peeled_layers;  /* one after the other, where layers are peeled: most of a window */
    uint64_t dropped_layers; /* transparent_fragments that the method had no room for */
    uint64_t light_list_entries;
    uint64_t shadow_maps_built, shadow_maps_reused;
    uint64_t states_reused;   /* 1: the scene's transforms stood from the last frame */
    uint64_t feature_edges;   /* drawn over the picture, of those in view */
    uint64_t outlined_pixels; /* of highlights */
    uint64_t gbuffers_drawn, gbuffers_reused; /* per window */
    uint64_t light_lists_built, light_lists_reused;
    uint64_t pixel_lists_built, pixel_lists_reused;
    uint64_t plans_made, plans_reused; /* one of them is 1: the plan was made, or kept */
    uint64_t programs_built;           /* shader programs composed and compiled for this frame */
    uint64_t programs_reused;          /* uses of programs that earlier work had made */
    uint64_t programs_loaded;          /* taken from what an earlier start had compiled */
};

/* Of deep shadow maps that are approximated; all 0: none is. */
struct report_compression {
    uint64_t maps, events, nodes; /* events of their exact lists; nodes in their place */
    uint64_t exact_bytes, node_bytes;
    uint64_t windows;   /* pieces that they were built in: one each, more for want of memory */
    uint64_t prefilter; /* samples per side of a texel */
    double max_error;   /* of a transmittance at any depth, against the mean of the samples */
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
    uint64_t level_bias;    /* levels withheld for want of budget: the most of any texture */
    uint64_t compressed_count, compressed_bytes; /* textures drawn so, colours only */
    double compressed_rmse; /* of theirs, in their finest level, of 1, as coded */
    double upload_ms;       /* wall clock spent on what was written, the device's work included */
};

#endif
