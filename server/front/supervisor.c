/* SPDX-License-Identifier: MIT */
/* The tasks of the supervisor: taken from other threads, ended, counted. */
#include "server/front/supervisor.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "protocol/limits.h"
#include "server/base/clock.h"
#include "server/front/supervisor_internal.h"
#include "server/mapping/questions.h"

const struct error supervisor_nobody_waits = {ERROR_OVERLOADED, "the client left before its turn",
                                              ""};

static void wake(struct supervisor *supervisor)
{
    eventfd_write(supervisor->wake_fd, 1);
}

/* ---- ending ---- */

static void end_task(struct supervisor *supervisor, struct render_task *task)
{
    bool is_good = task->outcome.problem.code == ERROR_NONE;
    if (warm_up_is_step(task->question))
        warm_up_count(&supervisor->totals.warm_ups, task->outcome.answer);
    if (warm_up_continue(task)) {
        task->ticket = ++supervisor->next_ticket;
        warm_ups_add(&supervisor->warm_ups, task);
        return;
    }
    supervisor->totals.warm_ups.done += is_good && warm_up_is_step(task->question);
    if (task->question)
        supervisor->totals.answered += is_good;
    else if (is_good)
        supervisor->totals.rendered++;
    else if (task->is_cancelled)
        supervisor->totals.cancelled++;
    else
        supervisor->totals.failed++;
    task->next = supervisor->ended;
    supervisor->ended = task;
}

void supervisor_refuse(struct supervisor *supervisor, struct render_task *task,
                       const struct error *problem)
{
    task->outcome.problem = *problem;
    end_task(supervisor, task);
}

void supervisor_tell_ended(struct supervisor *supervisor)
{
    pthread_mutex_lock(&supervisor->mutex);
    struct render_task *ended = supervisor->ended;
    supervisor->ended = NULL;
    pthread_mutex_unlock(&supervisor->mutex);
    while (ended) {
        struct render_task *next = ended->next;
        ended->done(ended->context, &ended->outcome);
        render_task_destroy(ended);
        ended = next;
    }
}

void supervisor_refuse_waiting(struct supervisor *supervisor, const struct error *problem)
{
    for (struct render_task *task; (task = render_queue_pop(&supervisor->queue));)
        supervisor_refuse(supervisor, task, problem);
}

const struct error *supervisor_start_problem(const struct supervisor *supervisor)
{
    for (int i = 0; i < supervisor->slot_count; i++)
        if (supervisor->slots[i].start_error.code == ERROR_NONE)
            return NULL;
    return &supervisor->slots[0].start_error;
}

bool supervisor_check_quarantine(const struct supervisor *supervisor,
                                 const struct render_task *task, struct error *err)
{
    bool is_good = quarantine_check(&supervisor->quarantine, task->scene, err);
    for (int i = 0; is_good && i < task->resources.scene_count; i++)
        is_good = quarantine_check(&supervisor->quarantine, task->resources.scenes[i], err);
    return is_good;
}

/* ---- life ---- */

static bool init_slots(struct supervisor *supervisor)
{
    const struct config *config = supervisor->desc.config;
    for (int i = 0; i < config->workers; i++) {
        struct worker_slot *slot = &supervisor->slots[i];
        if (!worker_slot_init(slot, i + 1, config->workers == 1))
            return false;
        config_device(config, i, slot->device);
        supervisor->slot_count++;
    }
    return true;
}

struct supervisor *supervisor_create(const struct supervisor_desc *desc, struct error *err)
{
    struct supervisor *supervisor = calloc(1, sizeof *supervisor);
    if (!supervisor) {
        error_set(err, ERROR_NO_MEMORY, "supervisor");
        return NULL;
    }
    supervisor->desc = *desc;
    pthread_mutex_init(&supervisor->mutex, NULL);
    supervisor->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (supervisor->wake_fd >= 0 && init_slots(supervisor))
        supervisor->has_thread =
            pthread_create(&supervisor->thread, NULL, supervisor_run, supervisor) == 0;
    if (supervisor->has_thread)
        return supervisor;
    error_set(err, ERROR_INTERNAL, "supervisor: %s", strerror(errno));
    supervisor_destroy(supervisor);
    return NULL;
}

void supervisor_stop(struct supervisor *supervisor)
{
    if (!supervisor)
        return;
    if (supervisor->has_thread) {
        pthread_mutex_lock(&supervisor->mutex);
        supervisor->is_stopping = true;
        pthread_mutex_unlock(&supervisor->mutex);
        wake(supervisor);
        pthread_join(supervisor->thread, NULL);
        supervisor->has_thread = false;
    }
    struct error stopping = {ERROR_OVERLOADED, "the server is stopping", ""};
    pthread_mutex_lock(&supervisor->mutex);
    for (int i = 0; i < supervisor->slot_count; i++) {
        struct worker_jobs *jobs = &supervisor->slots[i].jobs;
        while (jobs->count > 0)
            supervisor_refuse(supervisor, jobs->list[--jobs->count].task, &stopping);
    }
    supervisor_refuse_waiting(supervisor, &stopping);
    warm_ups_drop(&supervisor->warm_ups, NULL);
    pthread_mutex_unlock(&supervisor->mutex);
    supervisor_tell_ended(supervisor);
}

void supervisor_destroy(struct supervisor *supervisor)
{
    if (!supervisor)
        return;
    supervisor_stop(supervisor);
    for (int i = 0; i < CONFIG_WORKERS_MAX; i++)
        worker_slot_finish(&supervisor->slots[i]);
    if (supervisor->wake_fd >= 0)
        close(supervisor->wake_fd);
    pthread_mutex_destroy(&supervisor->mutex);
    free(supervisor);
}

/* ---- for other threads ---- */

uint64_t supervisor_next_ticket(struct supervisor *supervisor)
{
    pthread_mutex_lock(&supervisor->mutex);
    uint64_t ticket = ++supervisor->next_ticket;
    pthread_mutex_unlock(&supervisor->mutex);
    return ticket;
}

bool supervisor_submit(struct supervisor *supervisor, struct render_task *task, struct error *err)
{
    bool is_good = true;
    task->queued_us = now_us();
    pthread_mutex_lock(&supervisor->mutex);
    const struct error *problem = supervisor_start_problem(supervisor);
    if (supervisor->is_stopping || supervisor->is_draining)
        is_good = error_set(err, ERROR_OVERLOADED, "the server is stopping");
    else if (problem)
        is_good = error_pass(err, problem);
    else
        is_good = supervisor_check_quarantine(supervisor, task, err);
    if (is_good && !render_queue_push(&supervisor->queue, task, LIMIT_QUEUE_DEPTH))
        is_good = error_set(err, ERROR_OVERLOADED, "%d renders are waiting, which is the limit",
                            LIMIT_QUEUE_DEPTH);
    supervisor->asked_ms = now_ms();
    pthread_mutex_unlock(&supervisor->mutex);
    if (is_good)
        wake(supervisor);
    return is_good;
}

void supervisor_warm_up(struct supervisor *supervisor, struct render_task *task)
{
    pthread_mutex_lock(&supervisor->mutex);
    supervisor->asked_ms = now_ms();
    warm_ups_add(&supervisor->warm_ups, task);
    pthread_mutex_unlock(&supervisor->mutex);
    wake(supervisor);
}

/* The job with this ticket, on whichever worker; NULL: none has it. Under the mutex. */
static struct worker_job *find_job(struct supervisor *supervisor, uint64_t ticket)
{
    for (int i = 0; i < supervisor->slot_count; i++) {
        struct worker_jobs *jobs = &supervisor->slots[i].jobs;
        int index = worker_jobs_find(jobs, ticket);
        if (index >= 0)
            return &jobs->list[index];
    }
    return NULL;
}

/* Likewise the newest with this request id. */
static struct worker_job *find_job_of_request(struct supervisor *supervisor, const char *request_id)
{
    struct worker_job *newest = NULL;
    for (int i = 0; i < supervisor->slot_count; i++) {
        struct worker_jobs *jobs = &supervisor->slots[i].jobs;
        int index = worker_jobs_find_request(jobs, request_id);
        if (index >= 0 && (!newest || jobs->list[index].task->ticket > newest->task->ticket))
            newest = &jobs->list[index];
    }
    return newest;
}

void supervisor_cancel(struct supervisor *supervisor, uint64_t ticket)
{
    pthread_mutex_lock(&supervisor->mutex);
    struct render_task *task = render_queue_remove(&supervisor->queue, ticket);
    struct worker_job *job = task ? NULL : find_job(supervisor, ticket);
    bool is_with_worker = job != NULL;
    if (task)
        supervisor->totals.cancelled++;
    if (job && !job->task->question)
        job->task->is_cancelled = true;
    pthread_mutex_unlock(&supervisor->mutex);
    if (is_with_worker)
        wake(supervisor);
    if (!task)
        return;
    task->outcome.problem = supervisor_nobody_waits;
    task->done(task->context, &task->outcome);
    render_task_destroy(task);
}

bool supervisor_get_progress(struct supervisor *supervisor, uint64_t ticket,
                             struct job_progress *progress)
{
    pthread_mutex_lock(&supervisor->mutex);
    const struct worker_job *job = find_job(supervisor, ticket);
    bool is_known = job && job->progress.stage[0];
    if (is_known)
        *progress = job->progress;
    pthread_mutex_unlock(&supervisor->mutex);
    return is_known;
}

/* Reads the status of the one that was submitted later; either may be absent. Under the mutex. */
static bool read_status(const struct render_task *queued, const struct worker_job *job,
                        struct render_status *status)
{
    *status = (struct render_status){.state = JOB_SENT};
    if (job && queued && job->task->ticket < queued->ticket)
        job = NULL;
    const struct render_task *task = job ? job->task : queued;
    if (!task)
        return false;
    if (job) {
        status->state = job->state;
        status->progress = job->progress;
    }
    memcpy(status->scene, task->scene, sizeof status->scene);
    status->elapsed_s = 1e-6 * (double)(now_us() - task->queued_us);
    return true;
}

bool supervisor_get_render(struct supervisor *supervisor, uint64_t ticket,
                           struct render_status *status)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool is_known = read_status(render_queue_find(&supervisor->queue, ticket),
                                find_job(supervisor, ticket), status);
    pthread_mutex_unlock(&supervisor->mutex);
    return is_known;
}

bool supervisor_find_render(struct supervisor *supervisor, const char *request_id,
                            struct render_status *status)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool is_known = read_status(render_queue_find_request(&supervisor->queue, request_id),
                                find_job_of_request(supervisor, request_id), status);
    pthread_mutex_unlock(&supervisor->mutex);
    return is_known;
}

void supervisor_drain(struct supervisor *supervisor)
{
    pthread_mutex_lock(&supervisor->mutex);
    supervisor->is_draining = true;
    pthread_mutex_unlock(&supervisor->mutex);
}

/* One under way is not to come back. */
static void end_warm_ups(struct worker_slot *slot, const char *scene)
{
    for (int i = 0; i < slot->jobs.count; i++) {
        struct render_task *task = slot->jobs.list[i].task;
        if (warm_up_is_step(task->question) && strcmp(task->scene, scene) == 0)
            task->is_cancelled = true;
    }
}

void supervisor_forget_scene(struct supervisor *supervisor, const char *scene)
{
    pthread_mutex_lock(&supervisor->mutex);
    quarantine_clear(&supervisor->quarantine, scene);
    warm_ups_drop(&supervisor->warm_ups, scene);
    for (int i = 0; i < supervisor->slot_count; i++) {
        end_warm_ups(&supervisor->slots[i], scene);
        worker_slot_forget(&supervisor->slots[i], scene);
    }
    pthread_mutex_unlock(&supervisor->mutex);
    wake(supervisor);
}

void supervisor_forget_environment(struct supervisor *supervisor, const char *id)
{
    pthread_mutex_lock(&supervisor->mutex);
    for (int i = 0; i < supervisor->slot_count; i++)
        worker_slot_forget(&supervisor->slots[i], id);
    pthread_mutex_unlock(&supervisor->mutex);
    wake(supervisor);
}

void supervisor_clear_scene(struct supervisor *supervisor, const char *scene)
{
    pthread_mutex_lock(&supervisor->mutex);
    quarantine_clear(&supervisor->quarantine, scene);
    pthread_mutex_unlock(&supervisor->mutex);
}

bool supervisor_is_ready(struct supervisor *supervisor, struct error *err)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool is_ready = false;
    const struct error *problem = supervisor_start_problem(supervisor);
    for (int i = 0; i < supervisor->slot_count; i++)
        is_ready = is_ready || supervisor->slots[i].state == WORKER_READY;
    if (supervisor->is_draining || supervisor->is_stopping)
        is_ready = error_set(err, ERROR_OVERLOADED, "the server is stopping");
    else if (!is_ready && problem)
        error_pass(err, problem);
    else if (!is_ready)
        error_set(err, ERROR_OVERLOADED, "the render worker is starting");
    pthread_mutex_unlock(&supervisor->mutex);
    return is_ready;
}

/* Sums of what each worker counts; of what they share (the program folder) the most that one saw.
 * `learned` is that of all that serve; where they differ, which passes, a print that none has.
 * Under the mutex. */
static struct worker_totals sum_workers(const struct supervisor *supervisor)
{
    struct worker_totals sum = {0};
    bool has_learned = false;
    for (int i = 0; i < supervisor->slot_count; i++) {
        const struct worker_slot *slot = &supervisor->slots[i];
        const struct worker_totals *one = &slot->totals;
        sum.starts += one->starts;
        sum.crashes += one->crashes;
        sum.timeouts += one->timeouts;
        sum.programs_built += one->programs_built;
        sum.programs_reused += one->programs_reused;
        sum.programs_loaded += one->programs_loaded;
        sum.timed += one->timed;
        sum.timings_stopped += one->timings_stopped;
        sum.gpu_used_bytes += one->gpu_used_bytes;
        sum.cache_bytes += one->cache_bytes;
        sum.cache_scenes += one->cache_scenes;
        sum.cache_hits += one->cache_hits;
        sum.cache_misses += one->cache_misses;
        sum.cache_evictions += one->cache_evictions;
        if (one->programs_kept_bytes > sum.programs_kept_bytes) {
            sum.programs_kept = one->programs_kept;
            sum.programs_kept_bytes = one->programs_kept_bytes;
        }
        sum.pid = sum.pid ? sum.pid : one->pid;
        bool counts = slot->state == WORKER_READY || supervisor->slot_count == 1;
        if (counts && has_learned && sum.learned != one->learned)
            sum.learned = 31 * sum.learned + one->learned + (uint64_t)slot->number;
        else if (counts)
            sum.learned = one->learned;
        has_learned = has_learned || counts;
    }
    return sum;
}

bool supervisor_get_device(struct supervisor *supervisor, struct device_capabilities *device)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool has_device = supervisor->has_device;
    *device = supervisor->device;
    const struct worker_totals workers = sum_workers(supervisor);
    device->gpu_used_bytes = workers.gpu_used_bytes;
    device->automatic.learned = workers.learned;
    pthread_mutex_unlock(&supervisor->mutex);
    return has_device;
}

uint64_t supervisor_get_learned(struct supervisor *supervisor, int worker)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool is_known = worker > 0 && worker <= supervisor->slot_count;
    uint64_t learned = is_known ? supervisor->slots[worker - 1].totals.learned : 0;
    pthread_mutex_unlock(&supervisor->mutex);
    return learned;
}

struct supervisor_budgets supervisor_get_budgets(struct supervisor *supervisor)
{
    const struct config *config = supervisor->desc.config;
    struct device_capabilities device;
    uint64_t sharers = (uint64_t)config_sharers(config);
    bool is_chosen = !config->gpu_budget_bytes && supervisor_get_device(supervisor, &device);
    return (struct supervisor_budgets){is_chosen ? device.gpu_budget_bytes
                                                 : config->gpu_budget_bytes / sharers,
                                       config->texture_budget_bytes / sharers};
}

struct supervisor_totals supervisor_get_totals(struct supervisor *supervisor)
{
    pthread_mutex_lock(&supervisor->mutex);
    struct supervisor_totals totals = supervisor->totals;
    int64_t now = now_us();
    totals.workers = sum_workers(supervisor);
    totals.waiting = supervisor->queue.count;
    for (int i = 0; i < supervisor->slot_count; i++)
        totals.in_flight += (uint64_t)supervisor->slots[i].jobs.count;
    totals.quarantined = (uint64_t)quarantine_count(&supervisor->quarantine);
    totals.warm_ups.dropped = supervisor->warm_ups.dropped;
    totals.oldest_wait_s = 1e-6 * (double)(now - render_queue_oldest_us(&supervisor->queue, now));
    pthread_mutex_unlock(&supervisor->mutex);
    return totals;
}

int supervisor_get_workers(struct supervisor *supervisor,
                           struct worker_status workers[CONFIG_WORKERS_MAX])
{
    pthread_mutex_lock(&supervisor->mutex);
    int count = supervisor->slot_count;
    for (int i = 0; i < count; i++) {
        const struct worker_slot *slot = &supervisor->slots[i];
        workers[i] = (struct worker_status){.number = slot->number,
                                            .is_ready = slot->state == WORKER_READY,
                                            .in_flight = slot->jobs.count,
                                            .totals = slot->totals,
                                            .problem = slot->start_error};
        snprintf(workers[i].device, sizeof workers[i].device, "%s", slot->device);
    }
    pthread_mutex_unlock(&supervisor->mutex);
    return count;
}
