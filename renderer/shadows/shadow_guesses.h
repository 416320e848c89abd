/* SPDX-License-Identifier: MIT */
/* Lights whose lists were built in room that was guessed: what the device counted stays there, in a
 * record per light, until a picture brings it along. Until then their maps are open, and every
 * frame that uses them asks, too. Records begin anew when their number is spent; one that was
 * overwritten is lost, and counts as one that did not fit. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_GUESSES_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_GUESSES_H

#include "renderer/gl/object.h"
#include "renderer/shadows/shadow_sizes.h"

enum shadow_guess_state { SHADOW_GUESS_OPEN, SHADOW_GUESS_FITS, SHADOW_GUESS_CUT };

struct shadow_guess {
    struct content_key key; /* in the history */
    struct deep_statistics room;
    uint32_t flags; /* of the map */
    enum shadow_guess_state state;
};

struct shadow_use { /* of an open map by a frame that runs */
    uint64_t frame, guess;
    bool is_reported; /* its report is to have the sizes */
};

struct shadow_guesses { /* zeroed = empty */
    struct shadow_history history;
    struct gl_buffer records; /* struct deep_statistics each; capacity of them */
    struct shadow_guess *ring;
    uint64_t capacity;     /* a power of two */
    uint64_t oldest, next; /* numbers, from 1 on: of the first in the ring, and behind the last */
    struct shadow_use *uses;
    size_t use_count, use_capacity;
    uint64_t frames; /* numbers given to frames */
};

void shadow_guesses_finish(struct shadow_guesses *guesses);

/* Records for so many lights; *first is the number of the first of them. */
MUST_CHECK bool shadow_guesses_open(struct shadow_guesses *guesses, size_t count, uint64_t *first,
                                    struct error *err);
/* NULL: its record is lost. */
struct shadow_guess *shadow_guesses_find(const struct shadow_guesses *guesses, uint64_t number);
/* The device's words of it: waits. */
void shadow_guesses_read(const struct shadow_guesses *guesses, uint64_t number,
                         struct deep_statistics *sizes);
/* Takes in the counts of the device: decides whether the guess fits, and updates the history. */
void shadow_guesses_settle(struct shadow_guesses *guesses, uint64_t number,
                           const struct deep_statistics *sizes);

/* The frame of this number uses the map of the guess. */
MUST_CHECK bool shadow_guesses_use(struct shadow_guesses *guesses, const struct shadow_use *use,
                                   struct error *err);
/* The frame ends: what it used and was not sent is forgotten. */
void shadow_guesses_drop(struct shadow_guesses *guesses, uint64_t frame);
/* The report of the frame begins anew. */
void shadow_guesses_untell(struct shadow_guesses *guesses, uint64_t frame);

/* The sizes that are read back with a picture: consecutive records. The frame uses some. */
struct shadow_sent { /* zeroed = nothing */
    uint64_t first, count;
    struct shadow_use *uses; /* owned */
    size_t use_count;
    bool has_lost; /* a record of the frame is lost */
};
/* The sizes that the frame has used since the last call. has_lost is set if memory runs out. */
struct shadow_sent shadow_guesses_send(struct shadow_guesses *guesses, uint64_t frame);
void shadow_sent_finish(struct shadow_sent *sent);
uint64_t shadow_sent_bytes(const struct shadow_sent *sent);
/* Copies the records to another buffer. */
void shadow_guesses_copy(const struct shadow_guesses *guesses, const struct shadow_sent *sent,
                         struct gl_buffer *to, uint64_t to_bytes);

#endif
