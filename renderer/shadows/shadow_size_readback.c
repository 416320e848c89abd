/* SPDX-License-Identifier: MIT */
/* Takes in the sizes of maps that were guessed, when they are read back. */
#include <string.h>

#include "renderer/shadows/shadows_internal.h"

/* The sizes of a map are known: frees the room beyond them. */
static void close_map(struct shadow_system *shadows, struct shadow_map *map,
                      const struct deep_statistics *sizes)
{
    uint64_t total = deep_statistics_total(sizes);
    struct shadow_range rest = {map->events.first + total, map->events.count - total};
    struct error ignored = {0}; /* what cannot be freed is lost until the store is cleared */
    map->guess = 0;
    map->event_count = total;
    map->longest_list = sizes->longest;
    map->occupied_texels = sizes->occupied;
    map->events.count = total;
    if (!total)
        map->events.first = 0;
    (void)!shadow_store_free(&shadows->store, SHADOW_POOL_EVENTS, &rest, &ignored);
}

bool shadow_guess_stands(struct shadow_system *shadows, struct shadow_map *map, bool may_guess)
{
    struct deep_statistics sizes;
    const struct shadow_guess *guess = shadow_guesses_find(&shadows->guesses, map->guess);
    if (!guess || guess->state == SHADOW_GUESS_CUT)
        return false;
    if (may_guess)
        return true;
    gpu_timeline_will_wait(shadows->timeline);
    shadow_guesses_read(&shadows->guesses, map->guess, &sizes);
    shadow_guesses_settle(&shadows->guesses, map->guess, &sizes);
    if (guess->state != SHADOW_GUESS_FITS)
        return false;
    close_map(shadows, map, &sizes);
    return true;
}

bool shadow_sizes_use(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                      struct error *err)
{
    for (size_t i = 0; i < shadows->light_count; i++) {
        const struct shadow_map *map = shadows->light_maps[i];
        const struct shadow_use use = {
            .frame = desc->frame, .guess = map ? map->guess : 0, .is_reported = !desc->is_again};
        if (use.guess && !shadow_guesses_use(&shadows->guesses, &use, err))
            return false;
    }
    return true;
}

uint64_t shadow_system_number_frame(struct shadow_system *shadows)
{
    return ++shadows->guesses.frames;
}

struct shadow_sent shadow_system_send_sizes(struct shadow_system *shadows, uint64_t frame)
{
    return shadow_guesses_send(&shadows->guesses, frame);
}

void shadow_system_copy_sizes(const struct shadow_system *shadows, const struct shadow_sent *sent,
                              struct gl_buffer *to, uint64_t to_bytes)
{
    shadow_guesses_copy(&shadows->guesses, sent, to, to_bytes);
}

static struct shadow_map *find_open(const struct shadow_system *shadows, uint64_t guess)
{
    for (size_t i = 0; i < shadows->map_count; i++)
        if (shadows->maps[i]->guess == guess)
            return shadows->maps[i];
    return NULL;
}

static void take(struct shadow_system *shadows, const struct shadow_use *use,
                 const struct deep_statistics *sizes, struct frame_report *report)
{
    const struct shadow_guess *guess = shadow_guesses_find(&shadows->guesses, use->guess);
    struct shadow_map *map = find_open(shadows, use->guess);
    shadow_guesses_settle(&shadows->guesses, use->guess, sizes);
    if (!guess || guess->state == SHADOW_GUESS_CUT) {
        report->has_cut_lists = true;
        return;
    }
    if (map)
        close_map(shadows, map, sizes);
    if (use->is_reported)
        shadow_report_sizes(guess->flags, sizes, report);
}

void shadow_system_take_sizes(struct shadow_system *shadows, const struct shadow_sent *sent,
                              const struct deep_statistics *sizes, struct frame_report *report)
{
    report->has_cut_lists |= sent->has_lost;
    for (size_t i = 0; i < sent->use_count; i++)
        take(shadows, &sent->uses[i], &sizes[sent->uses[i].guess - sent->first], report);
}

void shadow_system_untell_sizes(struct shadow_system *shadows, uint64_t frame)
{
    shadow_guesses_untell(&shadows->guesses, frame);
}

void shadow_system_end_frame(struct shadow_system *shadows, uint64_t frame)
{
    shadow_guesses_drop(&shadows->guesses, frame);
}

uint64_t shadow_system_longest_list(const struct shadow_system *shadows)
{
    uint64_t longest = 0;
    for (size_t i = 0; i < shadows->light_count; i++)
        if (shadows->light_maps[i] && shadows->light_maps[i]->longest_list > longest)
            longest = shadows->light_maps[i]->longest_list;
    return longest;
}
