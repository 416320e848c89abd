/* SPDX-License-Identifier: MIT */
/* What the parts of the supervisor share. supervisor.c holds the tasks and serves other threads,
 * supervisor_run.c starts and ends workers, supervisor_messages.c takes in what they say,
 * supervisor_feed.c sends them work. */
#ifndef VITRAIL_SERVER_FRONT_SUPERVISOR_INTERNAL_H
#define VITRAIL_SERVER_FRONT_SUPERVISOR_INTERNAL_H

#include <jansson.h>
#include <pthread.h>

#include "server/base/config.h"
#include "server/front/quarantine.h"
#include "server/front/supervisor.h"
#include "server/front/warm_up.h"
#include "server/front/worker_slot.h"

struct supervisor {
    struct supervisor_desc desc;
    pthread_t thread;
    bool has_thread;
    int wake_fd;
    pthread_mutex_t mutex; /* guards all below */
    bool is_stopping, is_draining;
    struct render_queue queue;
    struct warm_ups warm_ups; /* sent when there is nothing else to do */
    int64_t asked_ms;         /* when someone last submitted a task */
    struct quarantine quarantine;
    struct render_task *ended; /* outcome known, `done` not yet called */
    struct worker_slot slots[CONFIG_WORKERS_MAX];
    int slot_count;
    bool is_hopeless_reported;
    struct device_capabilities device; /* of all workers; its speed as the keeper found it */
    bool has_device;
    uint64_t next_ticket;
    struct supervisor_totals totals; /* what is counted here, and not by worker */
};

/* ---- tasks: decided under the mutex, reported outside it ---- */

/* Ends the task: with success if `problem` is none. Under the mutex. */
void supervisor_refuse(struct supervisor *supervisor, struct render_task *task,
                       const struct error *problem);
void supervisor_refuse_waiting(struct supervisor *supervisor, const struct error *problem);
void supervisor_tell_ended(struct supervisor *supervisor);

/* The problem of a task whose client has left. */
extern const struct error supervisor_nobody_waits;

/* Checks the task's scene and those of its parts. Under the mutex. */
bool supervisor_check_quarantine(const struct supervisor *supervisor,
                                 const struct render_task *task, struct error *err);

/* Why no worker can be started, as the first one has it; NULL: one serves, or is to come. Under the
 * mutex. */
const struct error *supervisor_start_problem(const struct supervisor *supervisor);

/* ---- workers ---- */

void *supervisor_run(void *supervisor); /* the thread */

/* The one that measures and learns for all, and writes that down; NULL: none runs. Under the mutex.
 */
const struct worker_slot *supervisor_keeper(const struct supervisor *supervisor);

/* Whether a worker's device is such that its pictures are those of the others; err says what
 * differs. Under the mutex. */
bool supervisor_check_device(const struct supervisor *supervisor, const struct worker_slot *slot,
                             const struct device_capabilities *device, struct error *err);

/* Kills the worker if it still runs, and requeues its jobs. reason: why it is killed; NULL: it
 * ended by itself. */
void supervisor_reap_worker(struct supervisor *supervisor, struct worker_slot *slot,
                            const char *reason, bool is_timeout);

/* ---- devices whose drivers end workers ---- */

/* The worker says which device it tries. */
void supervisor_try_device(struct supervisor *supervisor, struct worker_slot *slot,
                           const json_t *message);
/* The worker says that it can take no device. */
void supervisor_note_no_device(struct supervisor *supervisor, struct worker_slot *slot,
                               const json_t *message);
/* Whether the worker ended while it tried a device, which is then tried again or passed over. Under
 * the mutex. */
bool supervisor_blame_device(struct supervisor *supervisor, struct worker_slot *slot,
                             const char *how, bool is_hang);
/* No worker is started in the slot any more; ends what waits where that was the last one. Takes the
 * text, which may be NULL. Under the mutex. */
void supervisor_give_up(struct supervisor *supervisor, struct worker_slot *slot, char *why);
/* Calls on_hopeless once, when no worker is started any more. */
void supervisor_tell_hopeless(struct supervisor *supervisor);

/* ---- messages ---- */

/* Takes one message, or reaps the worker at the end of the stream. */
void supervisor_receive(struct supervisor *supervisor, struct worker_slot *slot);

/* Sends workers as many tasks as they have room for, and notes which no longer listen: their
 * sockets then end, too. Under the mutex. */
void supervisor_feed(struct supervisor *supervisor);

/* When the idle worker is to be sent something: a warm-up, or the request to trim its memory.
 * INT64_MAX: nothing, or not before something else happens. Under the mutex. */
int64_t supervisor_idle_due_ms(const struct supervisor *supervisor, const struct worker_slot *slot);

#endif
