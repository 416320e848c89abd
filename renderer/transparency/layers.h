/* SPDX-License-Identifier: MIT */
/* The transparent surfaces of a window, as the method of the frame has found them
 * (renderer/transparency/method.h): what shading, outputs, traced shadows and the budget ask for.
 * Thread: GL. */
#ifndef VITRAIL_RENDERER_TRANSPARENCY_LAYERS_H
#define VITRAIL_RENDERER_TRANSPARENCY_LAYERS_H

#include "renderer/gl/object.h"

struct transparency_method;
struct window_bounds;

enum { PIXEL_LISTS_WORDS = 5 };

/* The buffers of methods that keep a list of each pixel (renderer/transparency/pixel_lists.h). */
struct pixel_lists {
    struct gl_buffer ends; /* u32 per pixel: of its range */
    struct gl_buffer left; /* u32 per pixel: entries counted and not yet written */
    struct gl_buffer scan;
    struct gl_buffer statistics; /* two words: as struct list_sizes */
    struct gl_buffer keys;       /* uvec4, two halves: depth, tie, entry, coverage */
    struct gl_buffer surfaces[PIXEL_LISTS_WORDS]; /* uvec4 per entry; the last two for lobes */
    struct gl_buffer colors;                      /* filled by shading: two vec4 per entry */
    uint64_t pixel_count;                         /* of the window */
    uint64_t list_bytes;  /* that the lists take; the buffers may be larger */
    uint64_t entry_count; /* that there is to be room for */
    bool has_two_halves;  /* the keys */
    uint64_t keys_offset; /* of the sorted half, in entries */
};

/* Those of methods that peel layers, which keep one entry or two for each pixel
 * (renderer/transparency/peeling.h). */
struct peeled_layers {
    struct gl_buffer state;       /* shaders/transparency/peeled_state.glsl */
    struct gl_buffer sums;        /* shaders/transparency/peeled_sums.glsl */
    uint64_t bytes;               /* that the window takes in all */
    uint64_t dropped;             /* layers of the window that are beyond the most that is peeled */
    struct window_bounds *bounds; /* owned: of the pixels that each set has layers of */
};

enum layers_outcome { LAYERS_FAILED, LAYERS_FOUND, LAYERS_TOO_MANY };

struct layers { /* zeroed = no method, and no surface */
    const struct transparency_method *method;
    uint64_t layer_count, longest; /* surfaces of the window, and of one pixel; or, guessed, those
                                      that there is room for */
    bool is_counted;     /* the method has counted the surfaces, and nobody has read their number */
    bool is_guessed;     /* the device alone knows their number */
    uint64_t most_bytes; /* that the method's buffers may take; 0: any */
    uint64_t missing_bytes; /* that the last surfaces would have taken, where those were too few */
    uint32_t lobes;         /* of the items: shader_needs_lobes */
    bool has_media, may_surround; /* of the items: struct geometry_items */
    struct pixel_lists lists;     /* of methods that keep lists, or count layers */
    struct peeled_layers peeled;  /* of those that peel */
};

/* Layers of this method from now on: those of another are dropped, with their memory. False: they
 * were of this one. */
bool layers_change_method(struct layers *layers, const struct transparency_method *method);
/* Limits the method's buffers from now on; 0: to nothing. Without a call they have no limit. */
void layers_set_budget(struct layers *layers, uint64_t bytes);
/* No surfaces, as of a window without anything transparent; the memory stays. */
void layers_clear(struct layers *layers);
/* Gives the memory back; the method stays. */
void layers_finish(struct layers *layers);
uint64_t layers_size_bytes(const struct layers *layers);

#endif
