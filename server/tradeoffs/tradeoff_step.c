/* SPDX-License-Identifier: MIT */
/* Submits steps to the supervisor, waits for them, and abandons them when nobody wants them. */
#include "server/tradeoffs/tradeoff_step.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "server/base/ipc.h"
#include "server/front/task_resources.h"

enum {
    STEP_LIMIT_MS = 60000,
    RETRY_S = 1, /* while the queue of renders is full */
};

/* Shared by the thread that waits and the one that ends the render: the last of them frees it. */
struct step {
    struct tradeoffs *tradeoffs;
    bool is_done, is_abandoned; /* under the mutex */
    struct step_result result;
};

void step_result_finish(struct step_result *result)
{
    json_decref(result->measured);
    if (result->image_fd > 0)
        close(result->image_fd);
    *result = (struct step_result){.image_fd = -1};
}

/* On the supervisor's thread. */
static void measured(void *context, struct render_outcome *outcome)
{
    struct step *step = context;
    struct tradeoffs *tradeoffs = step->tradeoffs;
    pthread_mutex_lock(&tradeoffs->mutex);
    step->is_done = true;
    step->result = (struct step_result){outcome->answer, outcome->image_fd, outcome->problem};
    outcome->answer = NULL;
    outcome->image_fd = -1;
    bool is_abandoned = step->is_abandoned;
    pthread_cond_broadcast(&tradeoffs->changed);
    pthread_mutex_unlock(&tradeoffs->mutex);
    if (!is_abandoned)
        return;
    step_result_finish(&step->result);
    free(step);
}

static struct render_task *task_create(struct tradeoffs *tradeoffs, const struct step_desc *desc,
                                       struct error *err)
{
    struct render_task *task = render_task_create();
    char *text = render_request_to_json(desc->request);
    if (!task || !text) {
        error_set(err, ERROR_NO_MEMORY, "step of a trade-off");
        goto fail;
    }
    memcpy(task->scene, desc->request->scene, sizeof task->scene);
    task->question = json_incref(desc->measure);
    task->priority = RENDER_BATCH;
    task->limit_ms = desc->limit_ms > 0 ? desc->limit_ms : STEP_LIMIT_MS;
    struct request_resources resources;
    if (!render_request_resources(desc->request, &resources) ||
        !task_open_resources(task, tradeoffs->desc.resources, &resources, err))
        goto fail;
    task->request_fd = ipc_memfd_create("vitrail-request", text, strlen(text), err);
    if (task->request_fd < 0)
        goto fail;
    if (desc->reference_fd >= 0 && (task->reference_fd = dup(desc->reference_fd)) < 0) {
        error_set(err, ERROR_NO_MEMORY, "step of a trade-off: %s", strerror(errno));
        goto fail;
    }
    free(text);
    return task;

fail:
    free(text);
    render_task_destroy(task);
    return NULL;
}

/* Under the mutex. */
static bool must_end(const struct tradeoffs *tradeoffs, const struct tradeoff_entry *entry)
{
    return tradeoffs->is_stopping || entry->document.state != TRADEOFF_RUNNING;
}

/* True when the wait is over because nobody wants the result. */
static bool wait_for_room(struct tradeoffs *tradeoffs, const struct tradeoff_entry *entry)
{
    struct timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_sec += RETRY_S;
    pthread_mutex_lock(&tradeoffs->mutex);
    while (!must_end(tradeoffs, entry) &&
           pthread_cond_timedwait(&tradeoffs->changed, &tradeoffs->mutex, &until) == 0)
        continue;
    bool is_over = must_end(tradeoffs, entry);
    pthread_mutex_unlock(&tradeoffs->mutex);
    return is_over;
}

/* Submits the task, however often it takes while the queue is full. */
static enum step_outcome submit(struct tradeoffs *tradeoffs, struct tradeoff_entry *entry,
                                struct render_task *task, struct error *err)
{
    for (;;) {
        struct error problem = {0};
        if (supervisor_submit(tradeoffs->desc.supervisor, task, &problem))
            return STEP_DONE;
        if (problem.code != ERROR_OVERLOADED) {
            *err = problem;
            return STEP_FAILED;
        }
        if (wait_for_room(tradeoffs, entry))
            return STEP_INTERRUPTED;
    }
}

static enum step_outcome await(struct tradeoffs *tradeoffs, struct tradeoff_entry *entry,
                               struct step *step, uint64_t ticket, struct step_result *result)
{
    enum step_outcome outcome = STEP_INTERRUPTED;
    pthread_mutex_lock(&tradeoffs->mutex);
    while (!step->is_done && !must_end(tradeoffs, entry))
        pthread_cond_wait(&tradeoffs->changed, &tradeoffs->mutex);
    bool is_done = step->is_done;
    step->is_abandoned = !is_done;
    if (is_done) {
        *result = step->result;
        if (!must_end(tradeoffs, entry))
            outcome = result->problem.code == ERROR_NONE ? STEP_DONE : STEP_FAILED;
    }
    pthread_mutex_unlock(&tradeoffs->mutex);
    if (is_done)
        free(step);
    else
        supervisor_cancel(tradeoffs->desc.supervisor, ticket); /* which frees it, or the worker's
                                                                  answer does */
    return outcome;
}

enum step_outcome step_run(struct tradeoffs *tradeoffs, struct tradeoff_entry *entry,
                           const struct step_desc *desc, struct step_result *result)
{
    enum step_outcome outcome = STEP_FAILED;
    *result = (struct step_result){.image_fd = -1};
    struct step *step = calloc(1, sizeof *step);
    struct render_task *task = NULL;
    if (step && desc->measure)
        task = task_create(tradeoffs, desc, &result->problem);
    else
        error_set(&result->problem, ERROR_NO_MEMORY, "step of a trade-off");
    json_decref(desc->measure);
    if (task) {
        uint64_t ticket = supervisor_next_ticket(tradeoffs->desc.supervisor);
        step->tradeoffs = tradeoffs;
        task->ticket = ticket;
        task->context = step;
        task->done = measured;
        outcome = submit(tradeoffs, entry, task, &result->problem);
        if (outcome == STEP_DONE)
            return await(tradeoffs, entry, step, ticket, result);
    }
    render_task_destroy(task);
    free(step);
    return outcome;
}
