/* SPDX-License-Identifier: MIT */
/* Which worker gets a task, by the scenes that each has and the jobs that it has to do.
 *
 * - A task that names its home (the worker of a live view) waits for that one, as long as it
 *   serves.
 * - Else it goes to the least loaded of the workers that have its scene. Another one loads the
 *   scene only where its load is less by PLACEMENT_QUEUE or more.
 * - A scene that no worker has goes to the least loaded one, of equals to that with the fewest
 *   scenes.
 *
 * The load is the number of jobs that go before the task: those that are not being encoded. An
 * urgent task whose scene is there makes others pause, so only urgent ones count for it; where its
 * scene has yet to be loaded it waits like all others. Pure functions. */
#ifndef VITRAIL_SERVER_FRONT_PLACEMENT_H
#define VITRAIL_SERVER_FRONT_PLACEMENT_H

#include "server/front/worker_slot.h"

enum { PLACEMENT_QUEUE = 2 /* one under way and one behind it: as much as keeps a worker busy */ };

/* The index of the slot; -1: none serves, or the one that shall has no room now. */
int placement_choose(const struct worker_slot *slots, int count, const struct render_task *task);

/* Takes the first task from the queue that a worker has room for, and tells the index of its slot.
 * Urgent ones come first. While any of them waits no question is begun that is not urgent, since
 * they could not preempt it, nor what waits behind it. NULL: no worker has room. */
struct render_task *placement_take(struct render_queue *queue, const struct worker_slot *slots,
                                   int count, int *chosen);

#endif
