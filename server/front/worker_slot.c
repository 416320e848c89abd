/* SPDX-License-Identifier: MIT */
/* One worker's place, and its list of scenes. */
#include "server/front/worker_slot.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool worker_slot_init(struct worker_slot *slot, int number, bool is_alone)
{
    *slot = (struct worker_slot){.number = number};
    if (is_alone)
        snprintf(slot->name, sizeof slot->name, "the worker");
    else
        snprintf(slot->name, sizeof slot->name, "worker %d", number);
    slot->forgotten = json_array();
    return slot->forgotten;
}

void worker_slot_finish(struct worker_slot *slot)
{
    json_decref(slot->forgotten);
    json_decref(slot->lessons);
    json_decref(slot->times);
    free(slot->hopeless);
    slot->forgotten = slot->lessons = slot->times = NULL;
    slot->hopeless = NULL;
}

void worker_slot_note_end(struct worker_slot *slot)
{
    struct worker_totals *totals = &slot->totals;
    slot->state = WORKER_NONE;
    slot->is_keeper = slot->is_deaf = false;
    slot->sent_count = 0;
    slot->told_learned = 0;
    json_decref(slot->lessons);
    json_decref(slot->times);
    slot->lessons = slot->times = NULL;
    totals->pid = 0;
    totals->gpu_used_bytes = totals->cache_bytes = totals->cache_scenes = 0;
    totals->programs_built = totals->programs_reused = totals->programs_loaded = 0;
    totals->timed = totals->timings_stopped = 0;
}

static int find(const struct worker_slot *slot, const char *scene)
{
    for (int i = 0; i < slot->sent_count; i++)
        if (strcmp(slot->sent[i].id, scene) == 0)
            return i;
    return -1;
}

static int find_oldest(const struct worker_slot *slot)
{
    int oldest = 0;
    for (int i = 1; i < slot->sent_count; i++)
        if (slot->sent[i].when < slot->sent[oldest].when)
            oldest = i;
    return oldest;
}

void worker_slot_note_sent(struct worker_slot *slot, const char *scene)
{
    int index = find(slot, scene);
    if (!*scene)
        return;
    if (index < 0)
        index = slot->sent_count < WORKER_SCENES_MAX ? slot->sent_count++ : find_oldest(slot);
    snprintf(slot->sent[index].id, sizeof slot->sent[index].id, "%s", scene);
    slot->sent[index].when = ++slot->sent_clock;
}

bool worker_slot_has_scene(const struct worker_slot *slot, const char *scene)
{
    return find(slot, scene) >= 0;
}

void worker_slot_forget(struct worker_slot *slot, const char *id)
{
    int index = find(slot, id);
    if (index >= 0)
        slot->sent[index] = slot->sent[--slot->sent_count];
    if (slot->state != WORKER_NONE)
        json_array_append_new(slot->forgotten, json_string(id));
}
