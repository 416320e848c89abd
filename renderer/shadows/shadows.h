/* SPDX-License-Identifier: MIT */
/* How much of a light arrives at a point: the shadow techniques under one interface, kept
 * between frames and rebuilt only when their own inputs changed. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOWS_H
#define VITRAIL_RENDERER_SHADOWS_SHADOWS_H

#include "renderer/base/yield_point.h"
#include "renderer/draw/scene_gpu.h"
#include "renderer/frame_report.h"
#include "renderer/gl/program.h"
#include "renderer/gl/scope.h"
#include "renderer/shadows/shadow_guesses.h"
#include "renderer/shadows/shadow_needs.h"

struct shadow_system;

struct shadow_system_desc {
    struct program_cache *programs; /* required */
    struct gpu_timeline *timeline;  /* required */
    const struct gl_limits *limits; /* required */
    uint64_t budget_bytes;          /* of all shadow structures; 0 means 2 GiB */
    uint64_t first_linked_elements; /* deep-linked: room per light to begin with; 0 means what
                                       the light's map had before, or 1 to 3 per texel */
    /* Optional: called before structures, or their construction, allocate so many bytes more,
     * within the budget. */
    void (*reserve)(void *context, uint64_t bytes);
    void *context;        /* of reserve */
    bool scans_on_device; /* deep: scan by shader even where the device is our own cores */
    bool layers_faces;    /* all faces of lights in one pass even there, if the device can */
    /* Bit i: deep-linked as published gets no lock of light i (modulo 64), as where all tries for
     * one ran out; for tests. */
    uint64_t refused_locks;
};

struct shadow_system *shadow_system_create(const struct shadow_system_desc *desc,
                                           struct error *err);
void shadow_system_destroy(struct shadow_system *shadows);

struct shadow_prepare_desc {
    const char *scene_key; /* part of every cache key */
    const struct scene_gpu *gpu;
    const struct scene_state *state;
    struct draw_arena *arena;
    double eye[3];             /* points that ask are relative to it ... */
    double eye_axes[3][3];     /* ... along these rows, orthonormal; all 0: the world's */
    struct shadow_grids grids; /* with the state's, where its quality holds them */
    const struct view_quality *quality;
    /* Of the state and quality; NULL: found here, for all lights. */
    const struct shadow_needs *needs;
    const bool *is_left_out; /* per light: true gets no structure in this call; NULL: none is */
    /* Optional; else all are built at once. Urgent frames may prepare other shadows meanwhile, and
     * leave the scene and the budget as they were. */
    const struct yield_point *yield;
    uint64_t first_count; /* with it: structures that urgent frames may wait for; 0 means 1, and
                             more as it goes */
    /* Optional: called with the share of the structures that stand, whenever some were built. */
    void (*advance)(const void *context, double share);
    const void *advance_context;
    uint64_t frame; /* its number where sizes of lists may be guessed and come with its picture;
                       0: they are read */
    bool is_again;  /* the report has the structures already */
};

/* Makes every shadow structure of state->lights valid: reuses, or rebuilds. A light without a
 * transparent caster in reach gets a plain depth map under AUTO; a light without any caster gets
 * none. Uploads shadow_record[] to BIND_SHADOWS. ERROR_OVER_BUDGET names the bytes needed and the
 * budget. */
MUST_CHECK bool shadow_system_prepare(struct shadow_system *shadows,
                                      const struct shadow_prepare_desc *desc,
                                      struct frame_report *report, struct error *err);
/* A number for a frame, unlike any before. */
uint64_t shadow_system_number_frame(struct shadow_system *shadows);
/* The sizes to be read back with the frame's picture: of the lists with guessed storage that the
 * frame has used since the last call. */
struct shadow_sent shadow_system_send_sizes(struct shadow_system *shadows, uint64_t frame);
void shadow_system_copy_sizes(const struct shadow_system *shadows, const struct shadow_sent *sent,
                              struct gl_buffer *to, uint64_t to_bytes);
/* They have come: into the report, which says has_cut_lists where lists had no room. sizes: as many
 * as were sent. */
void shadow_system_take_sizes(struct shadow_system *shadows, const struct shadow_sent *sent,
                              const struct deep_statistics *sizes, struct frame_report *report);
/* Begins the frame's report anew, without the structures so far, of which nothing is sent any
 * more. */
void shadow_system_untell_sizes(struct shadow_system *shadows, uint64_t frame);
void shadow_system_end_frame(struct shadow_system *shadows, uint64_t frame);
/* No list of the frame's structures is longer. */
uint64_t shadow_system_longest_list(const struct shadow_system *shadows);
/* Prepares a frame without any structure: no light has a record. */
MUST_CHECK bool shadow_system_prepare_none(struct shadow_system *shadows, size_t light_count,
                                           struct error *err);
/* Texels per side of a map face: what the quality asks for, within what the device has. */
int shadow_resolution(const struct view_quality *quality, const struct gl_limits *limits);
struct shadow_ways shadow_system_ways(const struct shadow_system *shadows);
uint64_t shadow_system_budget_bytes(const struct shadow_system *shadows);
/* Sets the budget from now on, and evicts what exceeds it. Between calls of the others. */
void shadow_system_set_budget(struct shadow_system *shadows, uint64_t budget_bytes);
/* The most memory that was in use while the present structures were built. */
uint64_t shadow_system_peak_bytes(const struct shadow_system *shadows);
/* Index of the light's shadow_record, or NO_SHADOW. */
uint32_t shadow_system_record(const struct shadow_system *shadows, size_t light);
/* Whether density grids are in the structure of the light. */
bool shadow_system_holds_grids(const struct shadow_system *shadows, size_t light);
/* Warns of what the structures of all lights have told the report, which shadow_system_prepare does
 * where no light is left out. */
void shadow_system_warn(struct frame_report *report);
/* #define items for programs that include shaders/shadows/shadow_query.glsl, and their bindings. */
const char *shadow_system_defines(const struct shadow_system *shadows);
void shadow_system_bind(const struct shadow_system *shadows, const struct gl_program *program);
/* Forgets all structures of a scene (it was detached or changed). */
void shadow_system_forget(struct shadow_system *shadows, const char *scene_key);
/* Frees device memory that no structure uses; between frames. */
void shadow_system_trim(struct shadow_system *shadows);
/* The same, after it has evicted the structures that the last frame did not use. */
void shadow_system_trim_unused(struct shadow_system *shadows);
uint64_t shadow_system_size_bytes(const struct shadow_system *shadows);

#endif
