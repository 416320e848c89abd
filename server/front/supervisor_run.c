/* SPDX-License-Identifier: MIT */
/* The supervisor's thread: a loop over workers' messages, their deadlines and the queue. */
#include <poll.h>
#include <stdio.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

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

/* The slot's next start: at once after a worker that did something. Under the mutex. */
static void plan_start(struct worker_slot *slot, bool may_be_soon)
{
    int doubled = slot->backoff_ms ? 2 * slot->backoff_ms : BACKOFF_MIN_MS;
    slot->backoff_ms = may_be_soon ? 0 : doubled < BACKOFF_MAX_MS ? doubled : BACKOFF_MAX_MS;
    slot->next_start_ms = slot->is_hopeless ? INT64_MAX : now_ms() + slot->backoff_ms;
}

/* Under the mutex. */
static void note_failed_start(struct supervisor *supervisor, struct worker_slot *slot,
                              const char *how)
{
    if (slot->start_error.code == ERROR_NONE)
        error_set(&slot->start_error, ERROR_NO_DEVICE,
                  "the render worker does not start: it ended with %s", how);
    const struct error *problem = supervisor_start_problem(supervisor);
    if (problem)
        supervisor_refuse_waiting(supervisor, problem);
}

/* Requeues the jobs of a worker that ended, the culprit first, and plans the next start. Under the
 * mutex. */
static void settle_end(struct supervisor *supervisor, struct worker_slot *slot, const char *how,
                       bool is_timeout)
{
    struct worker_jobs *jobs = &slot->jobs;
    bool is_of_device = supervisor_blame_device(supervisor, slot, how, is_timeout);
    int culprit = is_of_device ? -1 : worker_jobs_culprit(jobs, is_timeout);
    struct render_task *charged = culprit >= 0 ? jobs->list[culprit].task : NULL;
    if (charged)
        worker_jobs_remove(jobs, culprit);
    while (jobs->count > 0)
        render_queue_push_back(&supervisor->queue, jobs->list[--jobs->count].task);
    if (charged)
        charge(supervisor, charged, how, is_timeout);
    bool was_stable = slot->state == WORKER_READY &&
                      (slot->has_rendered || charged || now_ms() - slot->state_ms > STABLE_MS);
    plan_start(slot, was_stable || is_of_device); /* there are not many devices */
    if (slot->state == WORKER_STARTING && !is_of_device)
        note_failed_start(supervisor, slot, how);
    worker_slot_note_end(slot);
}

void supervisor_reap_worker(struct supervisor *supervisor, struct worker_slot *slot,
                            const char *reason, bool is_timeout)
{
    char how[96], end[64];
    child_stop(&slot->process, reason ? 0 : 1000, end, sizeof end);
    utf8_copy(how, sizeof how, reason ? reason : end);
    log_write(supervisor->desc.log, LOG_WARNING, "%s ended with %s", slot->name, how);
    pthread_mutex_lock(&supervisor->mutex);
    if (is_timeout)
        slot->totals.timeouts++;
    else
        slot->totals.crashes++;
    settle_end(supervisor, slot, how, is_timeout);
    pthread_mutex_unlock(&supervisor->mutex);
}

/* ---- starting ---- */

enum { CACHE_PATH_BYTES = CONFIG_PATH_BYTES + 128 };

/* `cache/WHAT-DEVICE` of the state directory, the device made a part of a name. All workers have
 * the same files, since their devices are of one kind. */
static void name_cache_file(const struct config *config, const char *what, const char *suffix,
                            char path[CACHE_PATH_BYTES])
{
    char first[CONFIG_TEXT_BYTES], device[GL_DEVICE_NAME_BYTES];
    config_device(config, 0, first);
    snprintf(device, sizeof device, "%.*s", GL_DEVICE_NAME_BYTES - 1, first);
    for (char *at = device; *at; at++)
        if (*at == '/' || *at == ':')
            *at = '-';
    snprintf(path, CACHE_PATH_BYTES, "%s/cache/%s-%s%s", config->state_dir, what, device, suffix);
}

/* The first budget that was chosen holds for all, since coarser textures are other pictures. */
static uint64_t gpu_budget(const struct supervisor *supervisor)
{
    const struct config *config = supervisor->desc.config;
    if (config->workers > 1 && supervisor->has_device)
        return supervisor->device.gpu_budget_bytes;
    return config->gpu_budget_bytes / (uint64_t)config_sharers(config);
}

static bool send_settings(struct supervisor *supervisor, struct worker_slot *slot,
                          struct error *err)
{
    const struct config *config = supervisor->desc.config;
    char speed_file[CACHE_PATH_BYTES], texture_file[CACHE_PATH_BYTES];
    char observations_file[CACHE_PATH_BYTES], proof_file[CACHE_PATH_BYTES];
    char budgets_file[CACHE_PATH_BYTES], program_folder[CACHE_PATH_BYTES];
    int sharers = config_sharers(config);
    snprintf(program_folder, sizeof program_folder, "%s/cache/programs", config->state_dir);
    name_cache_file(config, "device-speed", ".json", speed_file);
    name_cache_file(config, "texture-speed", ".json", texture_file);
    name_cache_file(config, "forecasts", ".json", observations_file);
    name_cache_file(config, "budgets", ".json", budgets_file);
    name_cache_file(config, "self-test", "", proof_file);
    json_t *settings = json_pack(
        "{s:s,s:b,s:i,s:o,s:s,s:s,s:s,s:I,s:I,s:I,s:i,s:i,s:I,s:s,s:s,s:I,s:i,s:s,s:s,s:i,s:s}",
        "op", "configure", "keeps", slot->is_keeper, "sharers", sharers, "passed_over",
        device_reasons_to_json(&slot->trials.devices), "observations_file", observations_file,
        "budgets_file", budgets_file, "device", slot->device, "gpu_budget_bytes",
        (json_int_t)gpu_budget(supervisor), "texture_budget_bytes",
        (json_int_t)(config->texture_budget_bytes / (uint64_t)sharers), "texture_upload_bytes",
        (json_int_t)config->texture_upload_bytes, "texture_upload_ms", config->texture_upload_ms,
        "texture_compression", (int)config->texture_compression, "cache_bytes",
        (json_int_t)config->cache_bytes, "dump_shaders", config->dump_shaders, "program_folder",
        config->program_bytes ? program_folder : "", "program_budget_bytes",
        (json_int_t)config->program_bytes, "auto", (int)config->automatic, "speed_file", speed_file,
        "texture_file", texture_file, "self_test", (int)config->self_test, "proof_file",
        proof_file);
    bool is_sent = settings ? ipc_send(slot->process.socket, settings, NULL, 0, err)
                            : error_set(err, ERROR_NO_MEMORY, "settings of the worker");
    json_decref(settings);
    return is_sent;
}

/* keeper: another worker that is one; NULL: none is. */
static void start_worker(struct supervisor *supervisor, struct worker_slot *slot,
                         const struct worker_slot *keeper)
{
    struct error problem = {0};
    char cache_dir[CONFIG_PATH_BYTES + sizeof "/cache"];
    snprintf(cache_dir, sizeof cache_dir, "%s/cache", supervisor->desc.config->state_dir);
    const struct config *config = supervisor->desc.config;
    const struct child_desc child = {.role = "worker",
                                     .cache_dir = cache_dir,
                                     .threads = config->workers > 1 ? config_threads(config) : 0};
    slot->is_keeper = !keeper;
    if (keeper && !slot->totals.starts) /* it knows of drivers that crash */
        slot->trials.devices = keeper->trials.devices;
    if (child_start(&slot->process, &child, &problem) &&
        (!ipc_set_timeout(slot->process.socket, PEER_STALL_S, &problem) ||
         !send_settings(supervisor, slot, &problem)))
        child_stop(&slot->process, 0, NULL, 0);
    pthread_mutex_lock(&supervisor->mutex);
    slot->state = WORKER_STARTING;
    slot->state_ms = now_ms();
    slot->has_rendered = false;
    slot->is_resting = true; /* what warm-ups make is kept until someone has asked */
    slot->totals.starts++;
    slot->totals.pid = (int)slot->process.pid;
    json_array_clear(slot->forgotten); /* a fresh worker knows no scenes */
    if (problem.code != ERROR_NONE) {
        error_wrap(&problem, "the render worker does not start");
        slot->start_error = problem;
        settle_end(supervisor, slot, problem.message, false);
    }
    pthread_mutex_unlock(&supervisor->mutex);
}

/* ---- the loop ---- */

static int64_t timeout_ms(const struct supervisor *supervisor)
{
    return 1000ll * supervisor->desc.config->render_timeout_s;
}

static int start_limit_ms(const struct worker_slot *slot)
{
    return slot->trials.current ? DEVICE_TRIAL_MS : START_MS;
}

/* The limit of the job that a late worker is charged with. Under the mutex. */
static int limit_s(const struct supervisor *supervisor, const struct worker_slot *slot)
{
    int culprit = worker_jobs_culprit(&slot->jobs, true);
    if (slot->state == WORKER_STARTING || slot->trials.current || culprit < 0)
        return start_limit_ms(slot) / 1000;
    const struct worker_job *job = &slot->jobs.list[culprit];
    return (int)(worker_job_limit_ms(job, timeout_ms(supervisor)) / 1000);
}

/* By when the worker must have said something. Under the mutex. */
static int64_t next_deadline(const struct supervisor *supervisor, const struct worker_slot *slot)
{
    bool is_trying = slot->trials.current != 0; /* of one that serves: its speed */
    return slot->state == WORKER_STARTING || is_trying
               ? slot->state_ms + start_limit_ms(slot)
               : worker_jobs_deadline(&slot->jobs, timeout_ms(supervisor), slot->last_event_ms);
}

/* The first worker that starts becomes the keeper: it tests and measures the device and learns how
 * fast it is, and writes all that to files, alone. The others start when it serves and its speed is
 * known, and read them; so choices by speed, and with them pictures, are the same on all. Under the
 * mutex. */
static bool may_start(const struct worker_slot *keeper)
{
    return !keeper || (keeper->state == WORKER_READY && !keeper->capabilities.automatic.is_pending);
}

static void start_workers(struct supervisor *supervisor)
{
    for (int i = 0; i < supervisor->slot_count; i++) {
        struct worker_slot *slot = &supervisor->slots[i];
        pthread_mutex_lock(&supervisor->mutex);
        const struct worker_slot *keeper = supervisor_keeper(supervisor);
        bool must_start =
            slot->state == WORKER_NONE && now_ms() >= slot->next_start_ms && may_start(keeper);
        pthread_mutex_unlock(&supervisor->mutex);
        if (must_start)
            start_worker(supervisor, slot, keeper);
    }
}

/* By when to look at a slot without a worker. Under the mutex. */
static int64_t next_start(const struct supervisor *supervisor, const struct worker_slot *slot)
{
    /* that the keeper serves is a message, which wakes this thread */
    return may_start(supervisor_keeper(supervisor)) ? slot->next_start_ms : INT64_MAX;
}

/* Ends a worker that is deaf or late. Returns by when to look at it again. */
static int64_t check_worker(struct supervisor *supervisor, struct worker_slot *slot)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool is_deaf = slot->is_deaf;
    int allowed_s = limit_s(supervisor, slot);
    int64_t until =
        slot->state == WORKER_NONE ? next_start(supervisor, slot) : next_deadline(supervisor, slot);
    bool is_late = slot->state != WORKER_NONE && now_ms() >= until;
    int64_t due = supervisor_idle_due_ms(supervisor, slot);
    pthread_mutex_unlock(&supervisor->mutex);
    if (is_deaf) {
        supervisor_reap_worker(supervisor, slot, NULL, false);
        return 0;
    }
    if (is_late) {
        char reason[64];
        snprintf(reason, sizeof reason, "a missed deadline of %d s", allowed_s);
        supervisor_reap_worker(supervisor, slot, reason, true);
        return 0;
    }
    return due < until ? due : until;
}

/* Starts, feeds and checks the workers. Returns how long poll may sleep. */
static int look_around(struct supervisor *supervisor)
{
    int64_t until = INT64_MAX;
    start_workers(supervisor);
    pthread_mutex_lock(&supervisor->mutex);
    supervisor_feed(supervisor);
    pthread_mutex_unlock(&supervisor->mutex);
    for (int i = 0; i < supervisor->slot_count; i++) {
        int64_t due = check_worker(supervisor, &supervisor->slots[i]);
        until = due < until ? due : until;
    }
    int64_t left = until - now_ms();
    return left > 60000 ? 60000 : left < 0 ? 0 : (int)left;
}

static bool must_stop(struct supervisor *supervisor)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool is_stopping = supervisor->is_stopping;
    pthread_mutex_unlock(&supervisor->mutex);
    return is_stopping;
}

/* Waits for other threads and for what workers say, and takes it in. */
static void take_messages(struct supervisor *supervisor, int sleep_ms)
{
    struct pollfd fds[CONFIG_WORKERS_MAX + 1] = {{.fd = supervisor->wake_fd, .events = POLLIN}};
    for (int i = 0; i < supervisor->slot_count; i++) {
        const struct child *process = &supervisor->slots[i].process;
        fds[i + 1] =
            (struct pollfd){.fd = process->pid > 0 ? process->socket : -1, .events = POLLIN};
    }
    if (poll(fds, (nfds_t)supervisor->slot_count + 1, sleep_ms) <= 0)
        return;
    eventfd_t ignored;
    if (fds[0].revents)
        eventfd_read(supervisor->wake_fd, &ignored);
    for (int i = 0; i < supervisor->slot_count; i++)
        if (fds[i + 1].revents)
            supervisor_receive(supervisor, &supervisor->slots[i]);
}

void *supervisor_run(void *argument)
{
    struct supervisor *supervisor = argument;
    while (!must_stop(supervisor)) {
        int sleep_ms = look_around(supervisor);
        supervisor_tell_ended(supervisor);
        supervisor_tell_hopeless(supervisor);
        take_messages(supervisor, sleep_ms);
        supervisor_tell_ended(supervisor);
    }
    for (int i = 0; i < supervisor->slot_count; i++) /* all at once, before one is waited for */
        if (supervisor->slots[i].process.pid > 0)
            shutdown(supervisor->slots[i].process.socket, SHUT_RDWR);
    for (int i = 0; i < supervisor->slot_count; i++)
        child_stop(&supervisor->slots[i].process, supervisor->slots[i].jobs.count > 0 ? 0 : 2000,
                   NULL, 0);
    return NULL;
}
