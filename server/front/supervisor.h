/* SPDX-License-Identifier: MIT */
/* Owns the workers: starts them, feeds them renders, watches their deadlines, replaces them. Which
 * one gets a render is in server/front/placement.h. Thread: any; owns one thread.
 *
 * A render whose worker dies or overruns its deadline is tried once more, then refused with
 * ERROR_RENDER_FAILED. Renders that the worker had not begun lose nothing. A scene that ends two
 * workers in a row is quarantined until it is posted again; a device that does so before it serves
 * is passed over for the next one (server/front/device_trials.h). */
#ifndef VITRAIL_SERVER_FRONT_SUPERVISOR_H
#define VITRAIL_SERVER_FRONT_SUPERVISOR_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/capabilities.h"
#include "protocol/error.h"
#include "server/base/config.h"
#include "server/base/log.h"
#include "server/front/render_queue.h"
#include "server/front/warm_up.h"
#include "server/front/worker_jobs.h"
#include "server/front/worker_slot.h"

struct supervisor;

struct supervisor_desc {
    const struct config *config; /* required, borrowed */
    const struct log *log;       /* required, borrowed */
    void *context;
    /* Optional; on the supervisor's thread, each time a worker is ready. */
    void (*on_ready)(void *context);
    /* Optional; likewise, once: drivers ended workers, no device is left, and none is started any
       more. why: all in one line; borrowed during the call. */
    void (*on_hopeless)(void *context, const char *why);
};
struct supervisor *supervisor_create(const struct supervisor_desc *desc, struct error *err);

/* Refuses what waits and runs, and what comes later, with ERROR_OVERLOADED; ends the workers.
 * Destroy does so, too, where it was not done before. Both accept NULL. */
void supervisor_stop(struct supervisor *supervisor);
void supervisor_destroy(struct supervisor *supervisor);

uint64_t supervisor_next_ticket(struct supervisor *supervisor); /* never 0, never twice */

/* Takes the task if it succeeds. ERROR_OVERLOADED when the queue is full, ERROR_NO_DEVICE when no
 * worker can be started, ERROR_RENDER_FAILED when the scene is quarantined. */
MUST_CHECK bool supervisor_submit(struct supervisor *supervisor, struct render_task *task,
                                  struct error *err);

/* Takes a task of warm_up_task: sent once the worker has been idle; where an image of its scene
 * is made before, less is left to do (server/front/warm_up.h). */
void supervisor_warm_up(struct supervisor *supervisor, struct render_task *task);

/* Ends a waiting task with ERROR_OVERLOADED. A render that the worker has ends so a little later,
 * or is done; a question goes on. No-op for unknown tickets. */
void supervisor_cancel(struct supervisor *supervisor, uint64_t ticket);

/* The progress of a render that the worker has had for a while; false: not known. */
bool supervisor_get_progress(struct supervisor *supervisor, uint64_t ticket,
                             struct job_progress *progress);

/* A render or a plan that a client waits for. */
struct render_status {
    char scene[DIGEST_TEXT_BYTES];
    enum job_state state; /* JOB_SENT also where it waits in the queue */
    double elapsed_s;     /* since it was submitted */
    struct job_progress progress;
};
/* False: none with that ticket is in work. */
bool supervisor_get_render(struct supervisor *supervisor, uint64_t ticket,
                           struct render_status *status);
/* Finds a render by its request id; of several the newest. */
bool supervisor_find_render(struct supervisor *supervisor, const char *request_id,
                            struct render_status *status);

/* Stop (or begin again) to take renders: submit answers ERROR_OVERLOADED while draining. */
void supervisor_drain(struct supervisor *supervisor);

/* Workers drop their copies of a deleted scene; a new upload of a scene ends its quarantine. */
void supervisor_forget_scene(struct supervisor *supervisor, const char *scene);
/* Likewise of a deleted environment map. */
void supervisor_forget_environment(struct supervisor *supervisor, const char *id);
void supervisor_clear_scene(struct supervisor *supervisor, const char *scene);

/* ERROR_NO_DEVICE or ERROR_OVERLOADED says why no render would be served now. */
MUST_CHECK bool supervisor_is_ready(struct supervisor *supervisor, struct error *err);

/* False while no worker has ever been ready. */
bool supervisor_get_device(struct supervisor *supervisor, struct device_capabilities *device);

/* The print of what a worker has learned, by its number; 0: nothing. */
uint64_t supervisor_get_learned(struct supervisor *supervisor, int worker);

/* Budgets of the device's memory for each worker, as configured, 0 for the defaults [bytes].
 * Pictures beyond them may have coarser textures, or compressed shadows if these were asked for. */
struct supervisor_budgets {
    uint64_t gpu, textures;
};
struct supervisor_budgets supervisor_get_budgets(struct supervisor *supervisor);

struct supervisor_totals {
    uint64_t rendered, failed, cancelled, retried;
    uint64_t answered; /* questions, such as steps of trade-offs; in none of the others */
    uint64_t waiting, in_flight, quarantined;
    double oldest_wait_s;
    struct warm_up_totals warm_ups;
    uint64_t overlapped;          /* renders that began while an earlier one was being encoded */
    uint64_t ahead;               /* renders that began while an earlier one was on the device */
    struct worker_totals workers; /* of all; pid: of the first that runs */
};
struct supervisor_totals supervisor_get_totals(struct supervisor *supervisor);

struct worker_status {
    int number; /* 1 for the first */
    bool is_ready;
    int in_flight;
    char device[CONFIG_TEXT_BYTES]; /* what it is asked to open */
    struct worker_totals totals;
    struct error problem; /* why it cannot be started */
};
/* Fills one for each worker; their number. */
int supervisor_get_workers(struct supervisor *supervisor,
                           struct worker_status workers[CONFIG_WORKERS_MAX]);

#endif
