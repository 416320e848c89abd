/* SPDX-License-Identifier: MIT */
/* The order between jobs: which of those that a job is to come after have not ended yet. It is
 * found anew from the states of the jobs whenever one ends, so nothing of it is on the disk. */
#include <stdlib.h>
#include <string.h>

#include "server/jobs/jobs_internal.h"

enum { NAMES_BYTES = 96 };

bool farm_job_is_waiting(const struct farm_job *job)
{
    return job->record.state == FARM_JOB_QUEUED && job->unmet;
}

static int compare_numbers(const void *key, const void *element)
{
    int64_t number = *(const int64_t *)key;
    const struct farm_job *const *job = element;
    return (number > (*job)->record.number) - (number < (*job)->record.number);
}

static struct farm_job *find_number(const struct jobs *jobs, int64_t number)
{
    struct farm_job **found = jobs->count > 0 ? bsearch(&number, jobs->list, (size_t)jobs->count,
                                                        sizeof jobs->list[0], compare_numbers)
                                              : NULL;
    return found ? *found : NULL;
}

/* Notes why the job cannot begin: the one with that index has ended badly, or is not there. */
static void note_broken(struct farm_job *job, int index, const struct farm_job *other)
{
    static const char *const then[] = {
        [JOB_AFTER_FAILURE_CANCEL] = "cancelled, since", [JOB_AFTER_FAILURE_WAIT] = "waits, since"};
    const char *became = !other                                      ? "is not there any more"
                         : other->record.state == FARM_JOB_CANCELLED ? "was cancelled"
                                                                     : "failed";
    if (!job->broken) {
        job->broken_why = (struct error){0};
        error_set(&job->broken_why, ERROR_CONFLICT, "%s job %s, which is to end before, %s",
                  then[job->request.after_failure], job->request.after[index], became);
    }
    job->broken |= 1u << index;
}

static void find_unmet(const struct jobs *jobs, struct farm_job *job)
{
    job->unmet = job->broken = 0;
    for (int i = 0; i < job->request.after_count; i++) {
        const struct farm_job *other = find_number(jobs, job->after[i]);
        bool has_ended = !other || farm_job_has_ended(other);
        bool is_done = other && other->record.state == FARM_JOB_DONE;
        if (is_done || (has_ended && job->request.after_failure == JOB_AFTER_FAILURE_RUN))
            continue;
        job->unmet |= 1u << i;
        if (has_ended)
            note_broken(job, i, other);
    }
}

bool job_order_resolve(struct jobs *jobs, struct farm_job *job, bool is_kept, struct error *err)
{
    for (int i = 0; i < job->request.after_count; i++) {
        struct farm_job *other = jobs_find(jobs, job->request.after[i]);
        char pointer[32];
        snprintf(pointer, sizeof pointer, "/after/%d", i);
        if (!other && !is_kept)
            return error_set_at(err, ERROR_UNSUPPORTED, pointer,
                                "%s: there is no job '%s' to wait for, or it was forgotten",
                                pointer, job->request.after[i]);
        job->after[i] = other ? other->record.number : 0;
        if (other)
            other->is_awaited = true;
    }
    find_unmet(jobs, job);
    return true;
}

static bool must_cancel(const struct farm_job *job)
{
    return farm_job_is_waiting(job) && job->broken &&
           job->request.after_failure == JOB_AFTER_FAILURE_CANCEL;
}

static void find_awaited(struct jobs *jobs)
{
    for (int i = 0; i < jobs->count; i++)
        jobs->list[i]->is_awaited = false;
    for (int i = 0; i < jobs->count; i++) {
        const struct farm_job *job = jobs->list[i];
        for (int k = 0; k < job->request.after_count; k++) {
            struct farm_job *other = find_number(jobs, job->after[k]);
            if (other)
                other->is_awaited |= job->record.state == FARM_JOB_QUEUED;
        }
    }
}

bool job_order_update(struct jobs *jobs)
{
    bool is_any_broken = false;
    jobs->order_is_stale = false;
    find_awaited(jobs);
    for (int i = 0; i < jobs->count; i++) {
        struct farm_job *job = jobs->list[i];
        if (job->request.after_count == 0 || job->record.state != FARM_JOB_QUEUED)
            continue;
        uint32_t unmet = job->unmet, broken = job->broken;
        find_unmet(jobs, job);
        if (unmet && !job->unmet)
            jobs_join_queue(jobs, job);
        if (unmet != job->unmet || broken != job->broken)
            jobs_note_change(jobs, job);
        is_any_broken |= must_cancel(job);
    }
    return is_any_broken;
}

void job_order_cancel_broken(struct jobs *jobs)
{
    struct error problem = {0};
    bool is_good = true;
    for (int i = 0; is_good; i++) {
        char id[JOB_ID_BYTES] = "";
        pthread_mutex_lock(&jobs->mutex);
        while (i < jobs->count && !must_cancel(jobs->list[i]))
            i++;
        if (i < jobs->count)
            memcpy(id, jobs->list[i]->record.id, sizeof id);
        pthread_mutex_unlock(&jobs->mutex);
        if (!*id)
            return;
        is_good = jobs_cancel_broken(jobs, id, &problem) || problem.code == ERROR_NOT_FOUND;
        if (!is_good) /* it waits on, and is tried again when another job ends */
            log_write(jobs->desc.log, LOG_ERROR, "job %s: %s", id, problem.message);
        problem = (struct error){0};
    }
}

bool job_order_may_forget(const struct jobs *jobs, const struct farm_job *job, struct error *err)
{
    char names[NAMES_BYTES] = "";
    int count = 0;
    for (int i = 0; i < jobs->count; i++) {
        const struct farm_job *other = jobs->list[i];
        bool is_after = false;
        for (int k = 0; k < other->request.after_count; k++)
            is_after |= other->after[k] == job->record.number;
        if (is_after && other->record.state == FARM_JOB_QUEUED && count++ == 0)
            snprintf(names, sizeof names, "job %s", other->record.id);
    }
    if (count > 1)
        snprintf(names + strlen(names), sizeof names - strlen(names), " and %d more", count - 1);
    return count == 0 ||
           error_set(err, ERROR_CONFLICT,
                     "job '%s' cannot be forgotten before %s has begun, which comes after it",
                     job->record.id, names);
}
