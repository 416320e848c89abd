/* SPDX-License-Identifier: MIT */
/* Who waits for jobs, and who watches them. */
#include <stdlib.h>
#include <string.h>

#include "server/base/clock.h"
#include "server/jobs/jobs_internal.h"

/* ---- waiting ---- */

uint64_t jobs_new_ticket(struct jobs *jobs)
{
    pthread_mutex_lock(&jobs->mutex);
    uint64_t ticket = ++jobs->next_ticket;
    pthread_mutex_unlock(&jobs->mutex);
    return ticket;
}

bool jobs_wait(struct jobs *jobs, const struct job_wait *wait, uint64_t ticket, struct error *err)
{
    struct waiting *waiting = calloc(1, sizeof *waiting);
    if (!waiting)
        return error_set(err, ERROR_NO_MEMORY, "waiting");
    snprintf(waiting->id, sizeof waiting->id, "%s", wait->id);
    waiting->sequence = wait->sequence;
    waiting->due_ms = now_ms() + wait->wait_ms;
    waiting->ticket = ticket;
    waiting->context = wait->context;
    waiting->done = wait->done;
    pthread_mutex_lock(&jobs->mutex);
    bool is_good = !jobs->is_stopping;
    if (is_good) {
        waiting->next = jobs->waiting;
        jobs->waiting = waiting;
        pthread_cond_broadcast(&jobs->changed);
    }
    pthread_mutex_unlock(&jobs->mutex);
    if (is_good)
        return true;
    free(waiting);
    return error_set(err, ERROR_OVERLOADED, "the server is stopping");
}

void jobs_stop_waiting(void *context, uint64_t ticket)
{
    struct jobs *jobs = context;
    pthread_mutex_lock(&jobs->mutex);
    for (struct waiting *waiting = jobs->waiting; waiting; waiting = waiting->next)
        if (waiting->ticket == ticket)
            waiting->due_ms = 0;
    pthread_cond_broadcast(&jobs->changed);
    pthread_mutex_unlock(&jobs->mutex);
}

/* ---- whose wait is over ---- */

static bool is_due(struct jobs *jobs, const struct waiting *waiting)
{
    const struct farm_job *job = jobs_find(jobs, waiting->id);
    return !job || jobs->is_stopping || now_ms() >= waiting->due_ms || farm_job_has_ended(job) ||
           (waiting->sequence && job->record.sequence != waiting->sequence);
}

struct waiting *jobs_take_due(struct jobs *jobs)
{
    struct waiting *due = NULL, **link = &jobs->waiting;
    while (*link) {
        struct waiting *waiting = *link;
        if (!is_due(jobs, waiting)) {
            link = &waiting->next;
            continue;
        }
        *link = waiting->next;
        waiting->next = due;
        due = waiting;
    }
    return due;
}

void jobs_answer(struct waiting *due)
{
    for (struct waiting *next; due; due = next) {
        next = due->next;
        due->done(due->context);
        free(due);
    }
}

/* ---- watching ---- */

void jobs_notify_watches(struct jobs *jobs, const char *id)
{
    for (struct job_watch *watch = jobs->watches; watch; watch = watch->next)
        if (!id || strcmp(watch->id, id) == 0)
            watch->notify(watch->context);
}

struct job_watch *jobs_watch(struct jobs *jobs, const char *id, void *context,
                             void (*notify)(void *context), struct error *err)
{
    struct job_watch *watch = calloc(1, sizeof *watch);
    if (!watch) {
        error_set(err, ERROR_NO_MEMORY, "watching a job");
        return NULL;
    }
    snprintf(watch->id, sizeof watch->id, "%s", id);
    watch->jobs = jobs;
    watch->context = context;
    watch->notify = notify;
    pthread_mutex_lock(&jobs->mutex);
    bool is_known = jobs_find(jobs, id);
    if (is_known) {
        watch->next = jobs->watches;
        jobs->watches = watch;
    }
    pthread_mutex_unlock(&jobs->mutex);
    if (is_known)
        return watch;
    free(watch);
    jobs_not_found(id, err);
    return NULL;
}

void jobs_unwatch(struct job_watch *watch)
{
    if (!watch)
        return;
    struct jobs *jobs = watch->jobs;
    pthread_mutex_lock(&jobs->mutex);
    struct job_watch **link = &jobs->watches;
    while (*link && *link != watch)
        link = &(*link)->next;
    if (*link)
        *link = watch->next;
    pthread_mutex_unlock(&jobs->mutex);
    free(watch);
}
