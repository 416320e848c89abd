/* SPDX-License-Identifier: MIT */
/* The supervisor's thread: a loop over one worker's messages, its deadlines and the queue. */
#include <poll.h>
#include <stdio.h>
#include <sys/eventfd.h>

#include "protocol/utf8.h"
#include "renderer/base/device_choice.h"
#include "server/base/clock.h"
#include "server/base/ipc.h"
#include "server/front/supervisor_internal.h"
#include "server/mapping/device_messages.h"

enum {
    START_MS = 180000, /* a cold shader cache on a software rasteriser, with room */
    BACKOFF_MIN_MS = 500,
    BACKOFF_MAX_MS = 30000,
    STABLE_MS = 2000, /* a worker that lived this long, or rendered, may be replaced at once */
    PEER_STALL_S = 10,
    ATTEMPTS = 2,
};

/* ---- the end of a worker ---- */

/* A crash condemns the scene; a missed deadline may be the fault of a request alone, so it counts
 * once the request is refused. Which scene of several it was is not known: the first is charged. */
static void charge(struct supervisor *supervisor, struct render_task *task, const char *how,
                   bool is_timeout)
{
    task->crashes++;
    bool stands_alone = task->question || task->is_of_job;
    bool is_last = task->crashes >= ATTEMPTS || stands_alone;
    if (!stands_alone && (!is_timeout || is_last))
        quarantine_add_crash(&supervisor->quarantine, task->scene, how);
    if (!is_last) {
        supervisor->totals.retried++;
        render_queue_push_back(&supervisor->queue, task);
        return;
    }
    struct error problem = {0};
    error_set(&problem, ERROR_RENDER_FAILED,
              task->question    ? "the question ended its worker (%d) with %s"
              : task->is_of_job ? "the frame ended its worker (%d) with %s"
                                : "the render ended its worker %d times, the last time with %s",
              task->crashes, how);
    supervisor_refuse(supervisor, task, &problem);
}

/* Requeues the jobs of a worker that ended, the culprit first, and plans the next start. Under the
 * mutex. */
static void settle_end(struct supervisor *supervisor, const char *how, bool is_timeout)
{
    struct worker_jobs *jobs = &supervisor->jobs;
    bool is_of_device = supervisor_blame_device(supervisor, how, is_timeout);
    int culprit = is_of_device ? -1 : worker_jobs_culprit(jobs, is_timeout);
    struct render_task *charged = culprit >= 0 ? jobs->list[culprit].task : NULL;
    if (charged)
        worker_jobs_remove(jobs, culprit);
    while (jobs->count > 0)
        render_queue_push_back(&supervisor->queue, jobs->list[--jobs->count].task);
    if (charged)
        charge(supervisor, charged, how, is_timeout);
    bool was_stable =
        supervisor->state == WORKER_READY &&
        (supervisor->has_rendered || charged || now_ms() - supervisor->state_ms > STABLE_MS);
    int doubled = supervisor->backoff_ms ? 2 * supervisor->backoff_ms : BACKOFF_MIN_MS;
    supervisor->backoff_ms = was_stable || is_of_device ? 0 /* there are not many devices */
                             : doubled < BACKOFF_MAX_MS ? doubled
                                                        : BACKOFF_MAX_MS;
    supervisor->next_start_ms =
        supervisor->is_hopeless ? INT64_MAX : now_ms() + supervisor->backoff_ms;
    if (supervisor->state == WORKER_STARTING && !is_of_device) {
        struct error problem = {0};
        error_set(&problem, ERROR_NO_DEVICE, "the render worker does not start: it ended with %s",
                  how);
        if (supervisor->start_error.code == ERROR_NONE)
            supervisor->start_error = problem;
        supervisor_refuse_waiting(supervisor, &supervisor->start_error);
    }
    supervisor->state = WORKER_NONE;
    supervisor->totals.worker_pid = 0;
    supervisor->totals.gpu_used_bytes = supervisor->totals.cache_bytes =
        supervisor->totals.cache_scenes = 0;
    supervisor->totals.programs_built = supervisor->totals.programs_reused =
        supervisor->totals.programs_loaded = 0;
    supervisor->totals.timed = supervisor->totals.timings_stopped = 0;
}

void supervisor_reap_worker(struct supervisor *supervisor, const char *reason, bool is_timeout)
{
    char how[96], end[64];
    child_stop(&supervisor->worker, reason ? 0 : 1000, end, sizeof end);
    utf8_copy(how, sizeof how, reason ? reason : end);
    log_write(supervisor->desc.log, LOG_WARNING, "the worker ended with %s", how);
    pthread_mutex_lock(&supervisor->mutex);
    if (is_timeout)
        supervisor->totals.worker_timeouts++;
    else
        supervisor->totals.worker_crashes++;
    settle_end(supervisor, how, is_timeout);
    pthread_mutex_unlock(&supervisor->mutex);
}

/* ---- starting ---- */

enum { CACHE_PATH_BYTES = CONFIG_PATH_BYTES + 128 };

/* `cache/WHAT-DEVICE` of the state directory, the device made a part of a name. */
static void name_cache_file(const struct config *config, const char *what, const char *suffix,
                            char path[CACHE_PATH_BYTES])
{
    char device[GL_DEVICE_NAME_BYTES];
    snprintf(device, sizeof device, "%.*s", GL_DEVICE_NAME_BYTES - 1, config->device);
    for (char *at = device; *at; at++)
        if (*at == '/' || *at == ':')
            *at = '-';
    snprintf(path, CACHE_PATH_BYTES, "%s/cache/%s-%s%s", config->state_dir, what, device, suffix);
}

static bool send_settings(struct supervisor *supervisor, struct error *err)
{
    const struct config *config = supervisor->desc.config;
    char speed_file[CACHE_PATH_BYTES], texture_file[CACHE_PATH_BYTES];
    char observations_file[CACHE_PATH_BYTES], proof_file[CACHE_PATH_BYTES];
    char budgets_file[CACHE_PATH_BYTES], program_folder[CACHE_PATH_BYTES];
    snprintf(program_folder, sizeof program_folder, "%s/cache/programs", config->state_dir);
    name_cache_file(config, "device-speed", ".json", speed_file);
    name_cache_file(config, "texture-speed", ".json", texture_file);
    name_cache_file(config, "forecasts", ".json", observations_file);
    name_cache_file(config, "budgets", ".json", budgets_file);
    name_cache_file(config, "self-test", "", proof_file);
    json_t *settings = json_pack(
        "{s:s,s:o,s:s,s:s,s:s,s:I,s:I,s:I,s:i,s:i,s:I,s:s,s:s,s:I,s:i,s:s,s:s,s:i,s:s}", "op",
        "configure", "passed_over", device_reasons_to_json(&supervisor->trials.devices),
        "observations_file", observations_file, "budgets_file", budgets_file, "device",
        config->device, "gpu_budget_bytes", (json_int_t)config->gpu_budget_bytes,
        "texture_budget_bytes", (json_int_t)config->texture_budget_bytes, "texture_upload_bytes",
        (json_int_t)config->texture_upload_bytes, "texture_upload_ms", config->texture_upload_ms,
        "texture_compression", (int)config->texture_compression, "cache_bytes",
        (json_int_t)config->cache_bytes, "dump_shaders", config->dump_shaders, "program_folder",
        config->program_bytes ? program_folder : "", "program_budget_bytes",
        (json_int_t)config->program_bytes, "auto", (int)config->automatic, "speed_file", speed_file,
        "texture_file", texture_file, "self_test", (int)config->self_test, "proof_file",
        proof_file);
    bool is_sent = settings ? ipc_send(supervisor->worker.socket, settings, NULL, 0, err)
                            : error_set(err, ERROR_NO_MEMORY, "settings of the worker");
    json_decref(settings);
    return is_sent;
}

static void start_worker(struct supervisor *supervisor)
{
    struct error problem = {0};
    char cache_dir[CONFIG_PATH_BYTES + sizeof "/cache"];
    snprintf(cache_dir, sizeof cache_dir, "%s/cache", supervisor->desc.config->state_dir);
    if (child_start(&supervisor->worker, "worker", cache_dir, &problem) &&
        (!ipc_set_timeout(supervisor->worker.socket, PEER_STALL_S, &problem) ||
         !send_settings(supervisor, &problem)))
        child_stop(&supervisor->worker, 0, NULL, 0);
    pthread_mutex_lock(&supervisor->mutex);
    supervisor->state = WORKER_STARTING;
    supervisor->state_ms = now_ms();
    supervisor->has_rendered = false;
    supervisor->is_resting = true; /* what warm-ups make is kept until someone has asked */
    supervisor->totals.worker_starts++;
    supervisor->totals.worker_pid = (int)supervisor->worker.pid;
    json_array_clear(supervisor->forgotten); /* a fresh worker knows no scenes */
    if (problem.code != ERROR_NONE) {
        error_wrap(&problem, "the render worker does not start");
        supervisor->start_error = problem;
        settle_end(supervisor, problem.message, false);
    }
    pthread_mutex_unlock(&supervisor->mutex);
}

/* ---- the loop ---- */

static int64_t timeout_ms(const struct supervisor *supervisor)
{
    return 1000ll * supervisor->desc.config->render_timeout_s;
}

static int start_limit_ms(const struct supervisor *supervisor)
{
    return supervisor->trials.current ? DEVICE_TRIAL_MS : START_MS;
}

/* The limit of the job that a late worker is charged with. Under the mutex. */
static int limit_s(const struct supervisor *supervisor)
{
    int culprit = worker_jobs_culprit(&supervisor->jobs, true);
    if (supervisor->state == WORKER_STARTING || supervisor->trials.current || culprit < 0)
        return start_limit_ms(supervisor) / 1000;
    const struct worker_job *job = &supervisor->jobs.list[culprit];
    return (int)(worker_job_limit_ms(job, timeout_ms(supervisor)) / 1000);
}

/* By when the worker must have said something. Under the mutex. */
static int64_t next_deadline(const struct supervisor *supervisor)
{
    bool is_trying = supervisor->trials.current != 0; /* of one that serves: its speed */
    return supervisor->state == WORKER_STARTING || is_trying
               ? supervisor->state_ms + start_limit_ms(supervisor)
               : worker_jobs_deadline(&supervisor->jobs, timeout_ms(supervisor),
                                      supervisor->last_event_ms);
}

/* Starts, feeds and checks the worker. Returns how long poll may sleep. */
static int look_around(struct supervisor *supervisor)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool must_start = supervisor->state == WORKER_NONE && now_ms() >= supervisor->next_start_ms;
    pthread_mutex_unlock(&supervisor->mutex);
    if (must_start)
        start_worker(supervisor);
    pthread_mutex_lock(&supervisor->mutex);
    bool is_deaf = supervisor->state == WORKER_READY && !supervisor_feed_worker(supervisor);
    int allowed_s = limit_s(supervisor);
    int64_t now = now_ms();
    int64_t until =
        supervisor->state == WORKER_NONE ? supervisor->next_start_ms : next_deadline(supervisor);
    bool is_late = supervisor->state != WORKER_NONE && now >= until;
    int64_t due = supervisor_idle_due_ms(supervisor);
    pthread_mutex_unlock(&supervisor->mutex);
    if (is_deaf) {
        supervisor_reap_worker(supervisor, NULL, false);
        return 0;
    }
    if (is_late) {
        char reason[64];
        snprintf(reason, sizeof reason, "a missed deadline of %d s", allowed_s);
        supervisor_reap_worker(supervisor, reason, true);
        return 0;
    }
    int64_t left = (due < until ? due : until) - now;
    return left > 60000 ? 60000 : left < 0 ? 0 : (int)left;
}

void *supervisor_run(void *argument)
{
    struct supervisor *supervisor = argument;
    for (;;) {
        pthread_mutex_lock(&supervisor->mutex);
        bool is_stopping = supervisor->is_stopping;
        pthread_mutex_unlock(&supervisor->mutex);
        if (is_stopping)
            break;
        int sleep_ms = look_around(supervisor);
        supervisor_tell_ended(supervisor);
        supervisor_tell_hopeless(supervisor);
        struct pollfd fds[2] = {{.fd = supervisor->wake_fd, .events = POLLIN},
                                {.fd = supervisor->worker.socket, .events = POLLIN}};
        if (poll(fds, supervisor->worker.pid > 0 ? 2 : 1, sleep_ms) <= 0)
            continue;
        eventfd_t ignored;
        if (fds[0].revents)
            eventfd_read(supervisor->wake_fd, &ignored);
        if (fds[1].revents && supervisor->worker.pid > 0)
            supervisor_receive(supervisor);
        supervisor_tell_ended(supervisor);
    }
    child_stop(&supervisor->worker, supervisor->jobs.count > 0 ? 0 : 2000, NULL, 0);
    return NULL;
}
