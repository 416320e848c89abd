/* SPDX-License-Identifier: MIT */
/* How long jobs are kept, and by which clock. The system's clock may jump by years and come back,
 * so it only makes the times that jobs state. Ages and the order of ends go by the time that
 * servers ran with this state directory: a monotonic clock that goes on where the last one saved
 * it. */
#include <stdlib.h>
#include <time.h>

#include "server/base/clock.h"
#include "server/jobs/jobs_internal.h"

enum { SAVE_EVERY_MS = 600000 /* what a server that is killed forgets of the time that it ran */ };
static const int64_t DAY_MS = 86400000;

/* ---- clocks ---- */

int64_t jobs_ran_ms(const struct jobs *jobs)
{
    return jobs->ran_before_ms + now_ms() - jobs->began_ms;
}

int64_t farm_job_now_s(const struct farm_job *job)
{
    int64_t now = time(NULL);
    now = now > job->record.created_s ? now : job->record.created_s;
    return now > job->record.started_s ? now : job->record.started_s;
}

void jobs_note_end(struct jobs *jobs, struct farm_job *job, enum farm_job_state state)
{
    job->record.state = state;
    job->record.ended_s = farm_job_now_s(job);
    job->record.ended_ms = jobs_ran_ms(jobs);
    jobs->order_is_stale = true;
    jobs->look_ms = 0;
}

/* ---- which may go ---- */

/* Whether the server may forget it by itself. */
static bool may_go(const struct farm_job *job)
{
    return farm_job_has_ended(job) && !*job->request.directory && !job->is_awaited;
}

/* Until it has been kept long enough; negative: it has. */
static int64_t left_ms(const struct jobs *jobs, const struct farm_job *job)
{
    int64_t age_ms = jobs_ran_ms(jobs) - job->record.ended_ms;
    return jobs->desc.config->job_retention_days * DAY_MS - age_ms;
}

int64_t jobs_expire_s(const struct jobs *jobs, const struct farm_job *job)
{
    if (!jobs->desc.config->job_retention_days || !may_go(job))
        return 0;
    int64_t left = left_ms(jobs, job);
    return time(NULL) + (left > 0 ? left / 1000 : 0);
}

/* Of those that may go, the one that ended first; NULL: none. */
static struct farm_job *first_to_go(const struct jobs *jobs)
{
    struct farm_job *first = NULL;
    for (int i = 0; i < jobs->count; i++) {
        struct farm_job *job = jobs->list[i];
        if ((!first || job->record.ended_ms < first->record.ended_ms) && may_go(job))
            first = job;
    }
    return first;
}

static uint64_t kept_bytes(const struct jobs *jobs)
{
    uint64_t bytes = 0;
    for (int i = 0; i < jobs->count; i++)
        bytes += *jobs->list[i]->request.directory ? 0 : jobs->list[i]->result_bytes;
    return bytes;
}

static bool is_too_much(const struct jobs *jobs, uint64_t more_bytes)
{
    uint64_t limit = jobs->desc.config->job_results_bytes;
    return limit && kept_bytes(jobs) + more_bytes > limit;
}

/* ---- forgetting ---- */

static bool forget(struct jobs *jobs, struct farm_job *job, enum forget_reason reason,
                   struct error *err)
{
    log_write(jobs->desc.log, LOG_INFO, "job %s is forgotten with its results: %s", job->record.id,
              reason == FORGET_AGE ? "it ended long enough ago"
                                   : "the results of jobs take what they may");
    return jobs_forget_ended(jobs, job, reason, err);
}

bool jobs_make_room_for(struct jobs *jobs, const struct farm_job *job, uint64_t size_bytes,
                        struct error *err)
{
    while (!*job->request.directory) {
        pthread_mutex_lock(&jobs->mutex);
        bool must_go = is_too_much(jobs, size_bytes);
        struct farm_job *first = must_go ? first_to_go(jobs) : NULL;
        pthread_mutex_unlock(&jobs->mutex);
        if (!must_go)
            return true;
        if (!first)
            return error_set(err, ERROR_TOO_LARGE,
                             "jobs that are still needed have as many bytes of results as the "
                             "server keeps, %llu (--job-results-bytes)",
                             (unsigned long long)jobs->desc.config->job_results_bytes);
        if (!forget(jobs, first, FORGET_BYTES, err))
            return false;
    }
    return true;
}

/* The next to be forgotten, and why; NULL: none, and *wait_ms is until there may be one. Under the
 * mutex. */
static struct farm_job *next_to_forget(const struct jobs *jobs, enum forget_reason *reason,
                                       int64_t *wait_ms)
{
    struct farm_job *first = first_to_go(jobs);
    *wait_ms = SAVE_EVERY_MS;
    *reason = FORGET_BYTES;
    if (!first || is_too_much(jobs, 0))
        return first;
    *reason = FORGET_AGE;
    if (!jobs->desc.config->job_retention_days)
        return NULL;
    int64_t left = left_ms(jobs, first);
    *wait_ms = left < *wait_ms ? left : *wait_ms;
    return left <= 0 ? first : NULL;
}

void jobs_retain(struct jobs *jobs)
{
    struct error problem = {0};
    struct farm_job *job = NULL;
    int64_t wait_ms = SAVE_EVERY_MS;
    pthread_mutex_lock(&jobs->disk);
    bool is_good = job_store_set_ran_ms(jobs->store, jobs_ran_ms(jobs), &problem);
    do {
        enum forget_reason reason;
        pthread_mutex_lock(&jobs->mutex);
        jobs->look_ms = INT64_MAX;
        job = next_to_forget(jobs, &reason, &wait_ms);
        pthread_mutex_unlock(&jobs->mutex);
        is_good = is_good && (!job || forget(jobs, job, reason, &problem));
    } while (job && is_good);
    if (!is_good) /* such as a full disk: later again */
        log_write(jobs->desc.log, LOG_WARNING, "%s", problem.message);
    pthread_mutex_lock(&jobs->mutex);
    int64_t look_ms = now_ms() + (is_good ? wait_ms : SAVE_EVERY_MS);
    jobs->look_ms = look_ms < jobs->look_ms ? look_ms : jobs->look_ms;
    pthread_mutex_unlock(&jobs->mutex);
    pthread_mutex_unlock(&jobs->disk);
}
