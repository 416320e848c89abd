/* SPDX-License-Identifier: MIT */
/* The least loaded worker, with what its scene costs elsewhere. */
#include "server/front/placement.h"

static bool is_urgent(const struct render_task *task)
{
    return task->priority == RENDER_INTERACTIVE;
}

static bool serves(const struct worker_slot *slot)
{
    return slot->state == WORKER_READY && !slot->is_deaf;
}

/* Jobs that go before a task; only_urgent: of those that wait for nothing else. */
static int load_of(const struct worker_slot *slot, bool only_urgent)
{
    int load = 0;
    for (int i = 0; i < slot->jobs.count; i++) {
        const struct worker_job *job = &slot->jobs.list[i];
        load += job->state != JOB_ENCODING && (!only_urgent || is_urgent(job->task));
    }
    return load;
}

/* Whether a is the better of two that both have the scene, or both have not. */
static bool is_better(const struct worker_slot *a, const struct worker_slot *b, bool only_urgent)
{
    int first = load_of(a, only_urgent) - load_of(b, only_urgent);
    int second = load_of(a, false) - load_of(b, false);
    return first ? first < 0 : second ? second < 0 : a->sent_count < b->sent_count;
}

static bool has_room(const struct worker_slot *slot, const struct render_task *task)
{
    return worker_jobs_have_room(&slot->jobs, task->priority);
}

int placement_choose(const struct worker_slot *slots, int count, const struct render_task *task)
{
    int with = -1, without = -1;
    int home = task->home - 1;
    if (home >= 0 && home < count && serves(&slots[home]))
        return has_room(&slots[home], task) ? home : -1;
    for (int i = 0; i < count; i++) {
        if (!serves(&slots[i]))
            continue;
        bool has_scene = worker_slot_has_scene(&slots[i], task->scene);
        int *best = has_scene ? &with : &without;
        if (!has_scene && !has_room(&slots[i], task))
            continue;
        if (*best < 0 || is_better(&slots[i], &slots[*best], has_scene && is_urgent(task)))
            *best = i;
    }
    if (with < 0)
        return without;
    int queue = load_of(&slots[with], is_urgent(task));
    if (without >= 0 && load_of(&slots[without], false) + PLACEMENT_QUEUE <= queue)
        return without;
    return has_room(&slots[with], task) ? with : -1;
}

static bool must_wait(const struct render_queue *queue, const struct render_task *task)
{
    return task->question && !is_urgent(task) && queue->first[RENDER_INTERACTIVE];
}

struct render_task *placement_take(struct render_queue *queue, const struct worker_slot *slots,
                                   int count, int *chosen)
{
    for (int priority = 0; priority < RENDER_PRIORITY_COUNT; priority++)
        for (const struct render_task *task = queue->first[priority]; task; task = task->next) {
            if (must_wait(queue, task))
                return NULL;
            *chosen = placement_choose(slots, count, task);
            if (*chosen >= 0)
                return render_queue_remove(queue, task->ticket);
        }
    return NULL;
}
