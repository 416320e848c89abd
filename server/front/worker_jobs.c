/* SPDX-License-Identifier: MIT */
/* The list of jobs in flight, and their states. */
#include "server/front/worker_jobs.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static bool is_urgent(const struct render_task *task)
{
    return task->priority == RENDER_INTERACTIVE;
}

bool worker_jobs_have_room(const struct worker_jobs *jobs, enum render_priority priority)
{
    int others = 0;
    for (int i = 0; i < jobs->count; i++)
        others += is_urgent(jobs->list[i].task) == (priority == RENDER_INTERACTIVE);
    return others < jobs->depth;
}

void worker_jobs_add(struct worker_jobs *jobs, struct render_task *task, int64_t now_ms)
{
    assert(jobs->count < 2 * WORKER_JOBS_DEPTH_MAX);
    jobs->list[jobs->count++] =
        (struct worker_job){.task = task, .state = JOB_SENT, .since_ms = now_ms};
}

void worker_jobs_remove(struct worker_jobs *jobs, int index)
{
    jobs->count--;
    memmove(&jobs->list[index], &jobs->list[index + 1],
            (size_t)(jobs->count - index) * sizeof jobs->list[0]);
}

static int find_state(const struct worker_jobs *jobs, enum job_state state)
{
    for (int i = 0; i < jobs->count; i++)
        if (jobs->list[i].state == state)
            return i;
    return -1;
}

bool worker_jobs_have(const struct worker_jobs *jobs, enum job_state state)
{
    return find_state(jobs, state) >= 0;
}

int worker_jobs_find(const struct worker_jobs *jobs, uint64_t ticket)
{
    for (int i = 0; i < jobs->count; i++)
        if (jobs->list[i].task->ticket == ticket)
            return i;
    return -1;
}

int worker_jobs_find_request(const struct worker_jobs *jobs, const char *request_id)
{
    int newest = -1;
    for (int i = 0; i < jobs->count; i++) {
        const struct render_task *task = jobs->list[i].task;
        if (task->request_id && strcmp(task->request_id, request_id) == 0 &&
            (newest < 0 || task->ticket > jobs->list[newest].task->ticket))
            newest = i;
    }
    return newest;
}

void job_progress_note(struct job_progress *progress, const char *stage, double share,
                       int64_t now_ms)
{
    enum { PACE_MS = 500 }; /* of a stage, before its end is estimated */
    if (strcmp(progress->stage, stage) != 0 || share < progress->share) {
        *progress = (struct job_progress){.first_share = share, .since_ms = now_ms};
        snprintf(progress->stage, sizeof progress->stage, "%s", stage);
    }
    double took_ms = (double)(now_ms - progress->since_ms), made = share - progress->first_share;
    progress->share = share;
    progress->left_s = took_ms >= PACE_MS && made > 0 ? 1e-3 * took_ms * (1 - share) / made : -1;
}

json_t *job_progress_to_json(const struct job_progress *progress)
{
    json_t *left =
        progress->left_s >= 0 ? json_real(round(10 * progress->left_s) / 10) : json_null();
    return json_pack("{s:s,s:f,s:o}", "stage", progress->stage, "share",
                     round(1000 * progress->share) / 1000, "left_s", left);
}

bool worker_job_note(struct worker_job *job, const char *op, int64_t now_ms)
{
    int64_t since_ms = now_ms;
    if (strcmp(op, "begin") == 0) {
        job->state = JOB_BEGUN;
    } else if (strcmp(op, "paused") == 0) {
        job->state = JOB_PAUSED;
        job->ran_ms = now_ms - job->since_ms;
    } else if (strcmp(op, "resumed") == 0) {
        job->state = JOB_BEGUN;
        since_ms = now_ms - job->ran_ms;
    } else if (strcmp(op, "submitted") == 0) {
        job->state = JOB_ON_DEVICE;
        since_ms = job->since_ms;
    } else if (strcmp(op, "rendered") == 0) {
        job->state = JOB_ENCODING;
    } else {
        return false;
    }
    job->since_ms = since_ms;
    return true;
}

static bool is_begun(const struct worker_job *job)
{
    return job->state == JOB_BEGUN || job->state == JOB_ON_DEVICE;
}

void worker_jobs_note_free_device(struct worker_jobs *jobs, int64_t now_ms)
{
    for (int i = 0; i < jobs->count; i++)
        if (is_begun(&jobs->list[i]))
            jobs->list[i].since_ms = now_ms;
}

void worker_jobs_note_lost(struct worker_jobs *jobs, int index)
{
    for (int i = 0; i < jobs->count; i++)
        if (is_begun(&jobs->list[i]))
            jobs->list[i].state = i == index ? JOB_BEGUN : JOB_SENT;
}

int worker_jobs_culprit(const struct worker_jobs *jobs, bool is_late)
{
    int begun = find_state(jobs, JOB_BEGUN), paused = find_state(jobs, JOB_PAUSED);
    int on_device = find_state(jobs, JOB_ON_DEVICE);
    if (on_device >= 0 && (begun < 0 || (is_late && on_device < begun)))
        return on_device;
    return begun >= 0 ? begun : paused >= 0 ? paused : jobs->count > 0 ? 0 : -1;
}

int64_t worker_job_limit_ms(const struct worker_job *job, int64_t limit_ms)
{
    bool is_own = job->task->limit_ms > 0 && is_begun(job);
    return is_own ? job->task->limit_ms : limit_ms;
}

int64_t worker_jobs_deadline(const struct worker_jobs *jobs, int64_t limit_ms,
                             int64_t last_event_ms)
{
    int64_t earliest = INT64_MAX;
    bool has_begun = worker_jobs_have(jobs, JOB_BEGUN) || worker_jobs_have(jobs, JOB_ON_DEVICE);
    bool has_paused = worker_jobs_have(jobs, JOB_PAUSED);
    for (int i = 0; i < jobs->count; i++) {
        const struct worker_job *job = &jobs->list[i];
        int64_t since = job->since_ms;
        bool waits = job->state == JOB_SENT || job->state == JOB_PAUSED;
        if (waits && (has_begun || (has_paused && job->state == JOB_SENT)))
            continue; /* it waits for the job that runs */
        if (waits && since < last_event_ms)
            since = last_event_ms;
        int64_t end = since + worker_job_limit_ms(job, limit_ms);
        if (end < earliest)
            earliest = end;
    }
    return earliest;
}
