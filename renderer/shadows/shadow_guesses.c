/* SPDX-License-Identifier: MIT */
/* The ring of records, and who uses them. */
#include "renderer/shadows/shadow_guesses.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum {
    RECORD_BYTES = sizeof(struct deep_statistics),
    RECORDS_FIRST = 1024, /* 80 KiB */
    SHARE = 4,            /* of the ring that the lights of one build may take */
};

void shadow_guesses_finish(struct shadow_guesses *guesses)
{
    gl_buffer_finish(&guesses->records);
    shadow_history_finish(&guesses->history);
    free(guesses->ring);
    free(guesses->uses);
    *guesses = (struct shadow_guesses){.frames = guesses->frames};
}

/* What the records before were is lost. */
static bool grow(struct shadow_guesses *guesses, size_t count, struct error *err)
{
    uint64_t capacity = guesses->capacity ? guesses->capacity : RECORDS_FIRST;
    while (capacity < SHARE * (uint64_t)count)
        capacity *= 2;
    if (capacity == guesses->capacity)
        return true;
    struct shadow_guess *ring = calloc(capacity, sizeof *ring);
    if (!ring)
        return error_set(err, ERROR_NO_MEMORY, "sizes of %zu shadow maps", count);
    const struct gl_buffer_desc desc = {.label = "shadow.deep.records",
                                        .size_bytes = capacity * RECORD_BYTES};
    if (!gl_buffer_reserve(&guesses->records, &desc, false, err)) {
        free(ring);
        return false;
    }
    free(guesses->ring);
    guesses->ring = ring;
    guesses->capacity = capacity;
    guesses->next = guesses->next ? guesses->next : 1; /* 0: of no map */
    guesses->oldest = guesses->next;
    return true;
}

bool shadow_guesses_open(struct shadow_guesses *guesses, size_t count, uint64_t *first,
                         struct error *err)
{
    if (!grow(guesses, count, err))
        return false;
    *first = guesses->next;
    guesses->next += count;
    if (guesses->next - guesses->oldest > guesses->capacity)
        guesses->oldest = guesses->next - guesses->capacity;
    for (uint64_t i = *first; i < guesses->next; i++)
        *shadow_guesses_find(guesses, i) = (struct shadow_guess){.state = SHADOW_GUESS_OPEN};
    return true;
}

struct shadow_guess *shadow_guesses_find(const struct shadow_guesses *guesses, uint64_t number)
{
    return number >= guesses->oldest && number < guesses->next
               ? &guesses->ring[number & (guesses->capacity - 1)]
               : NULL;
}

void shadow_guesses_read(const struct shadow_guesses *guesses, uint64_t number,
                         struct deep_statistics *sizes)
{
    *sizes = (struct deep_statistics){0}; /* a lost context reads nothing */
    gl_buffer_read(&guesses->records, (number & (guesses->capacity - 1)) * RECORD_BYTES,
                   RECORD_BYTES, sizes);
}

void shadow_guesses_settle(struct shadow_guesses *guesses, uint64_t number,
                           const struct deep_statistics *sizes)
{
    struct shadow_guess *guess = shadow_guesses_find(guesses, number);
    if (!guess || guess->state != SHADOW_GUESS_OPEN)
        return;
    guess->state = deep_statistics_fit(sizes, &guess->room) ? SHADOW_GUESS_FITS : SHADOW_GUESS_CUT;
    shadow_history_note(&guesses->history, guess->key, sizes);
}

bool shadow_guesses_use(struct shadow_guesses *guesses, const struct shadow_use *use,
                        struct error *err)
{
    if (guesses->use_count == guesses->use_capacity) {
        size_t capacity = guesses->use_capacity ? 2 * guesses->use_capacity : 64;
        struct shadow_use *grown = realloc(guesses->uses, capacity * sizeof *grown);
        if (!grown)
            return error_set(err, ERROR_NO_MEMORY, "%zu shadow maps in use", capacity);
        guesses->uses = grown;
        guesses->use_capacity = capacity;
    }
    guesses->uses[guesses->use_count++] = *use;
    return true;
}

void shadow_guesses_untell(struct shadow_guesses *guesses, uint64_t frame)
{
    for (size_t i = 0; i < guesses->use_count; i++)
        if (guesses->uses[i].frame == frame)
            guesses->uses[i].is_reported = false;
}

/* Takes those of the frame out; their number. NULL: they are only dropped. */
static size_t take_uses(struct shadow_guesses *guesses, uint64_t frame, struct shadow_use *taken)
{
    size_t kept = 0, count = 0;
    for (size_t i = 0; i < guesses->use_count; i++) {
        if (guesses->uses[i].frame != frame)
            guesses->uses[kept++] = guesses->uses[i];
        else if (taken)
            taken[count++] = guesses->uses[i];
        else
            count++;
    }
    guesses->use_count = kept;
    return count;
}

void shadow_guesses_drop(struct shadow_guesses *guesses, uint64_t frame)
{
    (void)take_uses(guesses, frame, NULL);
}

struct shadow_sent shadow_guesses_send(struct shadow_guesses *guesses, uint64_t frame)
{
    struct shadow_sent sent = {0};
    uint64_t end = 0;
    if (!guesses->use_count)
        return sent;
    sent.uses = calloc(guesses->use_count, sizeof *sent.uses);
    sent.use_count = take_uses(guesses, frame, sent.uses);
    sent.has_lost = !sent.uses && sent.use_count;
    if (!sent.uses)
        sent.use_count = 0;
    for (size_t i = 0; i < sent.use_count; i++) {
        uint64_t number = sent.uses[i].guess;
        sent.has_lost |= !shadow_guesses_find(guesses, number);
        if (!i || number < sent.first)
            sent.first = number;
        if (number >= end)
            end = number + 1;
    }
    sent.count = end - sent.first;
    if (sent.has_lost || !sent.use_count) {
        free(sent.uses);
        sent = (struct shadow_sent){.has_lost = sent.has_lost};
    }
    return sent;
}

void shadow_sent_finish(struct shadow_sent *sent)
{
    free(sent->uses);
    *sent = (struct shadow_sent){0};
}

uint64_t shadow_sent_bytes(const struct shadow_sent *sent)
{
    return sent->count * RECORD_BYTES;
}

void shadow_guesses_copy(const struct shadow_guesses *guesses, const struct shadow_sent *sent,
                         struct gl_buffer *to, uint64_t to_bytes)
{
    for (uint64_t i = sent->first, end = i + sent->count, run; i < end; i += run) {
        uint64_t at = i & (guesses->capacity - 1);
        run = end - i < guesses->capacity - at ? end - i : guesses->capacity - at;
        gl_buffer_copy(&guesses->records, at * RECORD_BYTES, to,
                       to_bytes + (i - sent->first) * RECORD_BYTES, run * RECORD_BYTES);
    }
}
