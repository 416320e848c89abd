/* SPDX-License-Identifier: MIT */
/* Exact per-pixel lists of transparent surfaces: count, scan, scatter, sort. Any number of layers.
 * Thread: GL. */
#ifndef VITRAIL_RENDERER_TRANSPARENCY_PIXEL_LISTS_H
#define VITRAIL_RENDERER_TRANSPARENCY_PIXEL_LISTS_H

#include "renderer/transparency/method.h"

enum {
    PIXEL_LISTS_ENTRY_BYTES = 32,      /* of the widest buffers: two vec4 */
    PIXEL_LISTS_ENTRIES_MAX = 4 << 20, /* these in 128 MiB, the storage block of every device */
    PIXEL_LISTS_LONGEST_MAX = 20000,   /* merging and compositing stay under 65,535 loop steps */
};

/* Entries that the lists of one window may have. */
uint64_t pixel_lists_entries_max(const struct gl_limits *limits);
/* The functions of struct transparency_method. A single list beyond PIXEL_LISTS_LONGEST_MAX is
 * ERROR_OVER_BUDGET. */
extern const struct transparency_pass pixel_lists_passes[];
MUST_CHECK bool pixel_lists_count(struct layers *layers, const struct window_frame *frame,
                                  const struct geometry_items *items, struct error *err);
enum layers_outcome pixel_lists_find(struct layers *layers, const struct window_frame *frame,
                                     const struct geometry_items *items,
                                     const struct list_sizes *room, struct error *err);
void pixel_lists_list_programs(const struct window_frame *frame, const struct geometry_items *items,
                               struct program_list *list);
extern const struct surface_kind pixel_lists_surfaces;
MUST_CHECK bool pixel_lists_light(struct layers *layers, const struct window_frame *frame,
                                  const struct geometry_items *items,
                                  const struct surface_lighter *lighter, struct error *err);
int pixel_lists_count_sets(const struct layers *layers);
void pixel_lists_bind(const struct layers *layers, const struct gl_program *program);
const struct gl_buffer *pixel_lists_ends(const struct layers *layers);
void pixel_lists_report(const struct layers *layers, struct frame_report *report);
void pixel_lists_clear(struct layers *layers);
void pixel_lists_finish(struct layers *layers);
uint64_t pixel_lists_size_bytes(const struct layers *layers);
/* Members of a struct transparency_method that finds, keeps and lights its surfaces in lists; its
 * `id` and its `compositing` are its own. */
#define PIXEL_LISTS_MEMBERS \
    PIXEL_LISTS_LIGHTING, .list_programs = pixel_lists_list_programs, .find = pixel_lists_find
/* The same without finding them. */
#define PIXEL_LISTS_LIGHTING                                                                     \
    .passes = pixel_lists_passes, .surfaces = &pixel_lists_surfaces, .count = pixel_lists_count, \
    .light = pixel_lists_light, .count_sets = pixel_lists_count_sets, .bind = pixel_lists_bind,  \
    .ends = pixel_lists_ends, .report = pixel_lists_report, .clear = pixel_lists_clear,          \
    .finish = pixel_lists_finish, .size_bytes = pixel_lists_size_bytes

/* For a method whose lists have another order: as find and list_programs, but with a function that
 * draws the fragments with a program of lists_scatter.glsl. */
struct pixel_lists_order {
    bool (*scatter)(const struct window_frame *frame, const struct geometry_items *items,
                    struct error *err);
};
enum layers_outcome pixel_lists_find_by(const struct pixel_lists_order *order,
                                        struct layers *layers, const struct window_frame *frame,
                                        const struct geometry_items *items,
                                        const struct list_sizes *room, struct error *err);
extern const char pixel_lists_scattering_pass[];
void pixel_lists_list_sorting(const struct window_frame *frame, struct program_list *list);

/* For a method that counts surfaces as lists do, and keeps entries of its own number. */
extern const char pixel_lists_counting_pass[], pixel_lists_lighting_pass[];
void pixel_lists_list_counting(const struct window_frame *frame, const struct geometry_items *items,
                               struct program_list *list);
/* Begins a window: counts its surfaces, or takes the count that is there, and waits for their
 * numbers, which are 0 where nothing transparent is in view. */
MUST_CHECK bool pixel_lists_find_sizes(struct layers *layers, const struct window_frame *frame,
                                       const struct geometry_items *items, struct error *err);
/* Whether the budget has room for so many entries, with one half of keys, and so many bytes beside
 * them; else the missing_bytes are known. Then reserves the buffers of the entries. */
bool pixel_lists_find_room(struct layers *layers, uint64_t entry_count, uint64_t beside_bytes);
MUST_CHECK bool pixel_lists_reserve(struct layers *layers, struct error *err);

/* Of guessed lists: what the device says of them, when it has come. */
struct pixel_lists_guess {
    struct list_sizes room;
    uint64_t pixels_bytes, entry_bytes; /* of memory */
};
struct pixel_lists_guess pixel_lists_guess_of(const struct layers *layers);
void pixel_lists_guess_report(const struct pixel_lists_guess *guess, const struct list_sizes *sizes,
                              struct frame_report *report);

#endif
