/* SPDX-License-Identifier: MIT */
/* Colors on their way from the device: each window's picture is packed into a buffer behind its
 * last pass, and copied into the frame's image when the device has got there, so that nobody has to
 * wait for it before. Two windows at a time: of one frame, or of one frame and of the next. Thread:
 * GL. */
#ifndef VITRAIL_RENDERER_SHADING_READBACK_H
#define VITRAIL_RENDERER_SHADING_READBACK_H

#include "renderer/gl/object.h"
#include "renderer/image/image.h"
#include "renderer/shadows/shadows.h"
#include "renderer/transparency/pixel_lists.h"
#include "renderer/window/window.h"

/* Sums of which counts.lookups is one; the word before them is counts.split_pixels. */
enum { READBACK_LOOKUP_WORDS = 64, READBACK_COUNT_WORDS = 1 + READBACK_LOOKUP_WORDS };

struct readback;

/* is_lazy, for tests: nothing has arrived before it is waited for, as on the slowest device. */
struct readback *readback_create(bool is_lazy, struct error *err);
void readback_destroy(struct readback *readback); /* accepts NULL */
uint64_t readback_size_bytes(const struct readback *readback);
/* Of this, what no picture is on its way in; giving it back to the device; and what windows of so
 * many pixels take. */
uint64_t readback_free_bytes(const struct readback *readback);
void readback_trim(struct readback *readback);
uint64_t readback_window_bytes(uint64_t pixels);

/* Lists whose sizes come with the picture. */
struct readback_guess {
    struct pixel_lists_guess lists;
    const struct gl_buffer *sizes; /* two words: struct list_sizes */
    struct list_history *history;  /* outlives the frame: learns of them */
    struct content_key key;        /* of the window there */
};

struct readback_desc { /* all required but the last five */
    const struct window_frame *frame;
    /* Of the whole frame: valid until it is collected or dropped; of U8: as a screen shows it. */
    struct image *color;
    const struct gl_buffer *counts;     /* NULL: nothing was counted; READBACK_COUNT_WORDS ... */
    uint64_t counts_offset_bytes;       /* ... from here on, added to the frame's report */
    const struct readback_guess *guess; /* NULL: none is guessed */
    struct shadow_system *shadows;      /* outlives the frame: sizes of lists that it guessed ... */
    uint64_t shadow_frame;              /* ... for the frame of this number; 0: none */
};
/* Sends the window's picture on its way; it is there at once where the device works while it is
 * asked. Where both ways are taken it waits for the older. */
MUST_CHECK bool readback_send(struct readback *readback, const struct readback_desc *desc,
                              struct error *err);

/* Whether nothing is on its way to the frame with this report that is not there, after waiting so
 * long at most. */
bool readback_wait(const struct readback *readback, const struct frame_report *report,
                   uint64_t timeout_ns);

/* Waits for all that is on its way to the frame, and puts it there; ERROR_NO_MEMORY, or what the
 * caller's gl_context_check says. The time of copying joins that of packing in the report. */
MUST_CHECK bool readback_collect(struct readback *readback, const struct frame_report *report,
                                 struct error *err);
/* The frame failed: what comes is not wanted. */
void readback_drop(struct readback *readback, const struct frame_report *report);

#endif
