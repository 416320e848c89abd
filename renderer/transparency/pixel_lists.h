/* SPDX-License-Identifier: MIT */
/* Exact per-pixel lists of transparent surfaces: count, scan, scatter, sort. Any number of layers.
 * Thread: GL. */
#ifndef VITRAIL_RENDERER_TRANSPARENCY_PIXEL_LISTS_H
#define VITRAIL_RENDERER_TRANSPARENCY_PIXEL_LISTS_H

#include "renderer/transparency/list_sizes.h"
#include "renderer/window/geometry.h"

enum {
    PIXEL_LISTS_ENTRY_BYTES = 32,      /* of the widest buffers: two vec4 */
    PIXEL_LISTS_ENTRIES_MAX = 4 << 20, /* these in 128 MiB, the storage block of every device */
    PIXEL_LISTS_LONGEST_MAX = 20000,   /* merging and compositing stay under 65,535 loop steps */
};

struct pixel_lists {
    struct gl_buffer ends; /* u32 per pixel: of its range */
    struct gl_buffer left; /* u32 per pixel: entries counted and not yet written */
    struct gl_buffer scan, statistics;
    struct gl_buffer keys; /* uvec4, two halves: depth, tie, entry, coverage */
    struct gl_buffer surfaces[3];
    struct gl_buffer colors;       /* filled by shading: two vec4 per entry */
    uint64_t pixel_count;          /* of the window */
    uint64_t entry_count, longest; /* of the lists; or, guessed, what they have room for */
    bool is_counted;     /* pixel_lists_count: `left`, `ends` and `statistics` stand, unread */
    bool is_guessed;     /* how large they are is in `statistics` alone: two words, as list_sizes */
    uint64_t list_bytes; /* that the lists take; the buffers may be larger */
    uint64_t keys_offset;  /* of the sorted half, in entries */
    uint64_t most_bytes;   /* that the buffers may take; 0: any */
    uint64_t lacked_bytes; /* that the last lists would have taken, where those were too few */
    bool has_media, may_surround; /* of the items listed: struct geometry_items */
};

enum pixel_lists_outcome { PIXEL_LISTS_FAILED, PIXEL_LISTS_BUILT, PIXEL_LISTS_TOO_MANY };

/* Entries that the lists of one window may have. */
uint64_t pixel_lists_entries_max(const struct gl_limits *limits);
/* Counts the fragments of a window ahead of its lists, and waits for nothing: behind the next wait
 * of any kind pixel_lists_build, which is then to be called for the same window and items, reads
 * their number without another one. pixel_lists_clear forgets it. */
MUST_CHECK bool pixel_lists_count(struct pixel_lists *lists, const struct window_frame *frame,
                                  const struct geometry_items *items, struct error *err);
/* Builds the lists of one window. With `room` the device is not waited for: lists that have not
 * found room are cut, never beyond their storage, and only `statistics` says so. NULL, or room that
 * there is no memory for, or fragments that are counted already: their sizes are read first.
 * TOO_MANY asks the caller to split the window, for entries or, with lacked_bytes, for memory; err
 * is then untouched. A single list beyond PIXEL_LISTS_LONGEST_MAX is ERROR_OVER_BUDGET. Nothing
 * transparent in view: built, with no entries. */
enum pixel_lists_outcome pixel_lists_build(struct pixel_lists *lists,
                                           const struct window_frame *frame,
                                           const struct geometry_items *items,
                                           const struct list_sizes *room, struct error *err);
/* The programs that building lists of these items takes, and may take; of frame what
 * geometry_list_transparent needs. Thread: any. */
void pixel_lists_list_programs(const struct window_frame *frame, const struct geometry_items *items,
                               struct program_list *list);
/* Empty lists, as of a window without anything transparent. */
void pixel_lists_clear(struct pixel_lists *lists);
/* Adds the lists to the counts and their memory to the bytes. Not of guessed ones. */
void pixel_lists_report(const struct pixel_lists *lists, struct frame_report *report);
/* Of guessed lists: what the device says of them, when it has come. */
struct pixel_lists_guess {
    struct list_sizes room;
    uint64_t pixels_bytes, entry_bytes; /* of memory */
};
struct pixel_lists_guess pixel_lists_guess_of(const struct pixel_lists *lists);
void pixel_lists_guess_report(const struct pixel_lists_guess *guess, const struct list_sizes *sizes,
                              struct frame_report *report);
/* For the programs that read the lists: bindings and u_keys_offset. */
void pixel_lists_bind(const struct pixel_lists *lists, const struct gl_program *program);
void pixel_lists_finish(struct pixel_lists *lists);
uint64_t pixel_lists_size_bytes(const struct pixel_lists *lists);

#endif
