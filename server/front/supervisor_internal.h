/* SPDX-License-Identifier: MIT */
/* What the parts of the supervisor share. supervisor.c holds the tasks and serves other threads,
 * supervisor_run.c starts and ends the worker, supervisor_messages.c speaks with it. */
#ifndef VITRAIL_SERVER_FRONT_SUPERVISOR_INTERNAL_H
#define VITRAIL_SERVER_FRONT_SUPERVISOR_INTERNAL_H

#include <jansson.h>
#include <pthread.h>

#include "server/base/child.h"
#include "server/base/config.h"
#include "server/front/device_trials.h"
#include "server/front/worker_jobs.h"
#include "server/front/quarantine.h"
#include "server/front/supervisor.h"
#include "server/front/warm_up.h"

enum worker_state { WORKER_NONE, WORKER_STARTING, WORKER_READY };

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
    struct worker_jobs jobs;
    struct render_task *ended; /* outcome known, `done` not yet called */
    json_t *forgotten;         /* ids of deleted scenes that are still to be sent to the worker */
    struct child worker;       /* touched by the supervisor's thread only, but for its pid */
    enum worker_state state;
    int64_t state_ms, next_start_ms, last_event_ms;
    int backoff_ms;
    bool is_resting;          /* since nobody asked for --rest-s */
    bool has_rendered;        /* since this worker is ready */
    struct error start_error; /* set while no worker can be started */
    struct device_trials trials;
    bool is_hopeless, is_hopeless_reported; /* no worker is started any more */
    char *hopeless;                         /* owned: why, set with the former; or NULL */
    struct device_capabilities device;
    bool has_device;
    uint64_t next_ticket;
    struct supervisor_totals totals;
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

/* ---- the worker ---- */

void *supervisor_run(void *supervisor); /* the thread */

/* Kills the worker if it still runs, and requeues its jobs. reason: why it is killed; NULL: it
 * ended by itself. */
void supervisor_reap_worker(struct supervisor *supervisor, const char *reason, bool is_timeout);

/* ---- devices whose drivers end workers ---- */

/* The worker says which device it tries. */
void supervisor_try_device(struct supervisor *supervisor, const json_t *message);
/* The worker says that it can take no device. */
void supervisor_note_no_device(struct supervisor *supervisor, const json_t *message);
/* Whether the worker ended while it tried a device, which is then tried again or passed over. Under
 * the mutex. */
bool supervisor_blame_device(struct supervisor *supervisor, const char *how, bool is_hang);
/* Calls on_hopeless once, when no worker is started any more. */
void supervisor_tell_hopeless(struct supervisor *supervisor);

/* ---- its messages ---- */

/* Takes one message, or reaps the worker at the end of the stream. */
void supervisor_receive(struct supervisor *supervisor);

/* Sends as many tasks as the worker has room for. False when the worker no longer listens; its
 * socket then ends, too. Under the mutex. */
bool supervisor_feed_worker(struct supervisor *supervisor);

/* When the idle worker is to be sent something: a warm-up, or the request to trim its memory.
 * INT64_MAX: nothing, or not before something else happens. Under the mutex. */
int64_t supervisor_idle_due_ms(const struct supervisor *supervisor);

#endif
