/* SPDX-License-Identifier: MIT */
/* The supervisor's thread: a loop over one worker's messages, its deadlines and the queue. */
#include "server/supervisor.h"

#include <assert.h>
#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "protocol/limits.h"
#include "protocol/utf8.h"
#include "server/child.h"
#include "server/clock.h"
#include "server/flights.h"
#include "server/ipc.h"
#include "server/quarantine.h"
#include "server/warm_up.h"

enum {
    START_MS = 180000, /* a cold shader cache on a software rasteriser, with room */
    BACKOFF_MIN_MS = 500,
    BACKOFF_MAX_MS = 30000,
    STABLE_MS = 2000, /* a worker that lived this long, or rendered, may be replaced at once */
    PEER_STALL_S = 10,
    ATTEMPTS = 2,
    FORGOTTEN_PER_MESSAGE = 1000,
};

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
    struct flights flights;
    struct render_task *ended; /* outcome known, `done` not yet called */
    json_t *forgotten;         /* ids of deleted scenes that the worker has not been told of */
    struct child worker;       /* touched by the supervisor's thread only, but for its pid */
    enum worker_state state;
    int64_t state_ms, next_start_ms, last_event_ms;
    int backoff_ms;
    bool has_rendered;        /* since this worker is ready */
    struct error start_error; /* set while no worker can be started */
    struct device_capabilities device;
    bool has_device;
    uint64_t next_ticket;
    struct supervisor_totals totals;
};

static void wake(struct supervisor *supervisor)
{
    eventfd_write(supervisor->wake_fd, 1);
}

/* ---- ending tasks: decided under the mutex, told outside it ---- */

static void end_task(struct supervisor *supervisor, struct render_task *task)
{
    bool is_good = task->outcome.problem.code == ERROR_NONE;
    supervisor->totals.warm_ups += is_good && warm_up_is_step(task->question);
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

static void refuse_task(struct supervisor *supervisor, struct render_task *task,
                        const struct error *problem)
{
    task->outcome.problem = *problem;
    end_task(supervisor, task);
}

static void tell_ended(struct supervisor *supervisor)
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

static void refuse_waiting(struct supervisor *supervisor, const struct error *problem)
{
    for (struct render_task *task; (task = render_queue_pop(&supervisor->queue));)
        refuse_task(supervisor, task, problem);
}

/* ---- a worker's death ---- */

/* The task's scene, and those of its parts. Under the mutex. */
static bool check_quarantine(const struct supervisor *supervisor, const struct render_task *task,
                             struct error *err)
{
    bool is_good = quarantine_check(&supervisor->quarantine, task->scene, err);
    for (int i = 0; is_good && i < task->parts.count; i++)
        is_good = quarantine_check(&supervisor->quarantine, task->parts.ids[i], err);
    return is_good;
}

/* A crash condemns the scene; a missed deadline may be the fault of a request alone, so it counts
 * once the request is refused. Which scene of several it was is not known: the first is charged. */
static void charge(struct supervisor *supervisor, struct render_task *task, const char *how,
                   bool is_timeout)
{
    task->deaths++;
    bool is_last = task->deaths >= ATTEMPTS || task->question;
    if (!task->question && (!is_timeout || is_last))
        quarantine_add_death(&supervisor->quarantine, task->scene, how);
    if (!is_last) {
        supervisor->totals.retried++;
        render_queue_push_back(&supervisor->queue, task);
        return;
    }
    struct error problem = {0};
    error_set(&problem, ERROR_RENDER_FAILED,
              task->question ? "the question ended its worker (%d) with %s"
                             : "the render ended its worker %d times, the last time with %s",
              task->deaths, how);
    refuse_task(supervisor, task, &problem);
}

/* Requeues what the worker had, the guilty one first, and plans the next start. Under the mutex. */
static void settle_death(struct supervisor *supervisor, const char *how, bool is_timeout)
{
    struct flights *flights = &supervisor->flights;
    int guilty = flights_guilty(flights);
    struct render_task *charged = guilty >= 0 ? flights->list[guilty].task : NULL;
    if (charged)
        flights_remove(flights, guilty);
    while (flights->count > 0)
        render_queue_push_back(&supervisor->queue, flights->list[--flights->count].task);
    if (charged)
        charge(supervisor, charged, how, is_timeout);
    bool was_stable =
        supervisor->state == WORKER_READY &&
        (supervisor->has_rendered || charged || now_ms() - supervisor->state_ms > STABLE_MS);
    int doubled = supervisor->backoff_ms ? 2 * supervisor->backoff_ms : BACKOFF_MIN_MS;
    supervisor->backoff_ms = was_stable ? 0 : doubled < BACKOFF_MAX_MS ? doubled : BACKOFF_MAX_MS;
    supervisor->next_start_ms = now_ms() + supervisor->backoff_ms;
    if (supervisor->state == WORKER_STARTING) {
        struct error problem = {0};
        error_set(&problem, ERROR_NO_DEVICE, "the render worker does not start: it ended with %s",
                  how);
        if (supervisor->start_error.code == ERROR_NONE)
            supervisor->start_error = problem;
        refuse_waiting(supervisor, &supervisor->start_error);
    }
    supervisor->state = WORKER_NONE;
    supervisor->totals.worker_pid = 0;
    supervisor->totals.gpu_used_bytes = supervisor->totals.cache_bytes =
        supervisor->totals.cache_scenes = 0;
}

/* reason: why it is killed, or NULL when it ended by itself. */
static void bury_worker(struct supervisor *supervisor, const char *reason, bool is_timeout)
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
    settle_death(supervisor, how, is_timeout);
    pthread_mutex_unlock(&supervisor->mutex);
}

/* ---- starting ---- */

static bool send_settings(struct supervisor *supervisor, struct error *err)
{
    const struct config *config = supervisor->desc.config;
    char speed_file[CONFIG_PATH_BYTES + 64];
    snprintf(speed_file, sizeof speed_file, "%s/cache/device-speed-%d.json", config->state_dir,
             config->device);
    json_t *settings =
        json_pack("{s:s,s:i,s:I,s:I,s:I,s:I,s:s,s:i,s:s}", "op", "configure", "device",
                  config->device, "gpu_budget_bytes", (json_int_t)config->gpu_budget_bytes,
                  "texture_budget_bytes", (json_int_t)config->texture_budget_bytes,
                  "texture_upload_bytes", (json_int_t)config->texture_upload_bytes, "cache_bytes",
                  (json_int_t)config->cache_bytes, "dump_shaders", config->dump_shaders, "auto",
                  (int)config->automatic, "speed_file", speed_file);
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
    supervisor->totals.worker_starts++;
    supervisor->totals.worker_pid = (int)supervisor->worker.pid;
    json_array_clear(supervisor->forgotten); /* a fresh worker knows no scenes */
    if (problem.code != ERROR_NONE) {
        error_wrap(&problem, "the render worker does not start");
        supervisor->start_error = problem;
        settle_death(supervisor, problem.message, false);
    }
    pthread_mutex_unlock(&supervisor->mutex);
}

/* ---- messages of the worker ---- */

static void take_image(struct supervisor *supervisor, struct render_task *task,
                       struct ipc_message *message)
{
    struct error problem = {0};
    task->outcome.stats = calloc(1, sizeof *task->outcome.stats);
    if (!task->outcome.stats)
        error_set(&problem, ERROR_NO_MEMORY, "stats of the frame");
    else if (frame_stats_from_json(json_object_get(message->json, "stats"), task->outcome.stats,
                                   &problem) &&
             (task->outcome.image_fd = ipc_message_take_fd(message, 0)) < 0)
        error_set(&problem, ERROR_INTERNAL, "the worker sent no image");
    if (problem.code == ERROR_NONE) {
        quarantine_forgive(&supervisor->quarantine, task->scene);
        supervisor->has_rendered = true;
        frame_stats_promise(task->outcome.stats, &task->promise);
    }
    refuse_task(supervisor, task, &problem); /* which, without a problem, is its success */
}

static void take_answer(struct supervisor *supervisor, struct render_task *task,
                        struct ipc_message *message)
{
    struct error problem = {0};
    task->outcome.answer = json_incref(json_object_get(message->json, "result"));
    task->outcome.image_fd = ipc_message_take_fd(message, 0);
    if (!task->outcome.answer)
        error_set(&problem, ERROR_INTERNAL, "the worker sent no answer");
    supervisor->has_rendered = true;
    refuse_task(supervisor, task, &problem);
}

static const struct error nobody_waits = {ERROR_OVERLOADED, "the client left before its turn", ""};

/* What the worker says of one flight. Under the mutex. */
static void flight_message(struct supervisor *supervisor, const char *op,
                           struct ipc_message *message)
{
    uint64_t id = (uint64_t)json_integer_value(json_object_get(message->json, "id"));
    int index = flights_find(&supervisor->flights, id);
    if (index < 0)
        return;
    struct flight *flight = &supervisor->flights.list[index];
    struct render_task *task = flight->task;
    if (strcmp(op, "begin") == 0)
        task->outcome.queue_ms = 1e-3 * (double)(now_us() - task->queued_us);
    if (flights_note(flight, op, now_ms()))
        return;
    if (strcmp(op, "done") == 0) {
        flights_remove(&supervisor->flights, index);
        take_image(supervisor, task, message);
    } else if (strcmp(op, "answer") == 0) {
        flights_remove(&supervisor->flights, index);
        take_answer(supervisor, task, message);
    } else if (strcmp(op, "error") == 0) {
        struct error problem = {0};
        ipc_error_from_json(json_object_get(message->json, "error"), &problem);
        flights_remove(&supervisor->flights, index);
        refuse_task(supervisor, task, task->is_cancelled ? &nobody_waits : &problem);
    }
}

static uint64_t number(const json_t *json, const char *key)
{
    return (uint64_t)json_integer_value(json_object_get(json, key));
}

static void totals_message(struct supervisor *supervisor, const json_t *json)
{
    struct supervisor_totals *totals = &supervisor->totals;
    totals->programs_built = number(json, "programs_built");
    totals->programs_reused = number(json, "programs_reused");
    totals->gpu_used_bytes = number(json, "gpu_used_bytes");
    totals->cache_bytes = number(json, "cache_bytes");
    totals->cache_scenes = number(json, "cache_scenes");
    totals->cache_hits = number(json, "cache_hits");
    totals->cache_misses = number(json, "cache_misses");
    totals->cache_evictions = number(json, "cache_evictions");
}

static void log_speed(struct supervisor *supervisor, const struct device_auto *automatic)
{
    if (automatic->is_measured)
        log_write(supervisor->desc.log, LOG_INFO,
                  "shadows auto takes the faster by forecast: looking into a shadow map %.3g ns, a "
                  "shadow ray %.3g ns, a texel of a map %.3g ns (%s)",
                  automatic->lookup_ns, automatic->shadow_ray_ns, automatic->texel_ns,
                  automatic->note);
    else
        log_write(supervisor->desc.log, LOG_INFO, "shadows auto: %s%s%s", automatic->policy,
                  automatic->note[0] ? ", " : "", automatic->note);
}

static bool hello_message(struct supervisor *supervisor, const json_t *json, struct error *err)
{
    struct device_capabilities device;
    if (!device_capabilities_from_json(json_object_get(json, "device"), &device, err))
        return false;
    json_int_t depth = json_integer_value(json_object_get(json, "depth"));
    pthread_mutex_lock(&supervisor->mutex);
    supervisor->device = device;
    supervisor->has_device = true;
    supervisor->flights.depth = depth < 1                   ? 1
                                : depth > FLIGHTS_DEPTH_MAX ? FLIGHTS_DEPTH_MAX
                                                            : (int)depth;
    supervisor->state = WORKER_READY;
    supervisor->state_ms = now_ms();
    supervisor->start_error = (struct error){0};
    pthread_mutex_unlock(&supervisor->mutex);
    log_write(supervisor->desc.log, LOG_INFO, "the worker is ready: %s, %s", device.renderer,
              device.version);
    log_speed(supervisor, &device.automatic);
    if (supervisor->desc.on_ready)
        supervisor->desc.on_ready(supervisor->desc.context);
    return true;
}

static void failed_message(struct supervisor *supervisor, const json_t *json)
{
    struct error problem = {0};
    ipc_error_from_json(json_object_get(json, "error"), &problem);
    problem.code = ERROR_NO_DEVICE;
    log_write(supervisor->desc.log, LOG_ERROR, "no usable device: %s", problem.message);
    pthread_mutex_lock(&supervisor->mutex);
    supervisor->start_error = problem;
    pthread_mutex_unlock(&supervisor->mutex);
}

/* One message, or the end of the stream. */
static void receive(struct supervisor *supervisor)
{
    struct ipc_message message;
    struct error problem = {0};
    enum ipc_status status = ipc_receive(supervisor->worker.socket, &message, &problem);
    if (status != IPC_MESSAGE) {
        bury_worker(supervisor, status == IPC_CLOSED ? NULL : "a broken message", false);
        return;
    }
    const char *op = json_string_value(json_object_get(message.json, "op"));
    if (!op)
        op = "";
    bool is_good = true, is_lost = strcmp(op, "lost") == 0;
    if (strcmp(op, "hello") == 0)
        is_good = hello_message(supervisor, message.json, &problem);
    else if (strcmp(op, "failed") == 0)
        failed_message(supervisor, message.json);
    pthread_mutex_lock(&supervisor->mutex);
    supervisor->last_event_ms = now_ms();
    if (strcmp(op, "totals") == 0)
        totals_message(supervisor, message.json);
    else
        flight_message(supervisor, op, &message);
    pthread_mutex_unlock(&supervisor->mutex);
    if (is_lost)
        ipc_error_from_json(json_object_get(message.json, "error"), &problem);
    ipc_message_finish(&message);
    if (!is_good || is_lost)
        bury_worker(supervisor, problem.message, false);
}

/* ---- sending ---- */

/* New reference to a few ids that the worker shall forget; NULL when there are none. Under the
 * mutex. */
static json_t *take_forgotten(struct supervisor *supervisor)
{
    size_t count = json_array_size(supervisor->forgotten);
    if (count == 0)
        return NULL;
    json_t *ids = json_array();
    for (size_t i = 0; ids && i < FORGOTTEN_PER_MESSAGE && count > 0; i++, count--) {
        json_array_append(ids, json_array_get(supervisor->forgotten, count - 1));
        json_array_remove(supervisor->forgotten, count - 1);
    }
    return ids;
}

/* request, scene, scenes of parts, reference where there is one. */
static int list_fds(const struct render_task *task, int fds[IPC_FDS_MAX])
{
    int count = 0;
    fds[count++] = task->request_fd;
    fds[count++] = task->blob_fd;
    for (int i = 0; i < task->parts.count; i++)
        fds[count++] = task->part_fds[i];
    if (task->reference_fd >= 0)
        fds[count++] = task->reference_fd;
    return count;
}

static json_t *list_parts(const struct render_task *task)
{
    json_t *ids = json_array();
    for (int i = 0; i < task->parts.count; i++)
        json_array_append_new(ids, json_string(task->parts.ids[i]));
    return ids;
}

/* Messages are small and at most `depth` of them wait, so sending never blocks. Under the mutex. */
static bool send_task(struct supervisor *supervisor, struct render_task *task)
{
    json_t *message = json_pack(
        "{s:s,s:I,s:s,s:b,s:s,s:b,s:b,s:o,s:O*,s:o*}", "op", task->question ? "ask" : "render",
        "id", (json_int_t)task->ticket, "scene", task->scene, "urgent",
        task->priority == RENDER_INTERACTIVE, "format", image_format_name(task->format), "reuse",
        task->expects_reuse, "coarse", task->may_be_coarse, "parts", list_parts(task), "question",
        task->question, "forget", take_forgotten(supervisor));
    int fds[IPC_FDS_MAX], fd_count = list_fds(task, fds);
    struct error problem = {0};
    bool is_sent = message && ipc_send(supervisor->worker.socket, message, fds, fd_count, &problem);
    json_decref(message);
    flights_add(&supervisor->flights, task, now_ms());
    return is_sent;
}

/* When the next warm-up may be sent; INT64_MAX for none, or none for now. Under the mutex. */
static int64_t warm_up_due_ms(const struct supervisor *supervisor)
{
    if (!supervisor->warm_ups.count || supervisor->state != WORKER_READY ||
        supervisor->flights.count > 0 || supervisor->is_draining)
        return INT64_MAX;
    int64_t since = supervisor->asked_ms > supervisor->last_event_ms ? supervisor->asked_ms
                                                                     : supervisor->last_event_ms;
    return since + WARM_UP_IDLE_MS;
}

/* Under the mutex. */
static bool send_warm_up(struct supervisor *supervisor)
{
    if (now_ms() < warm_up_due_ms(supervisor))
        return true;
    struct render_task *task = warm_ups_take(&supervisor->warm_ups);
    struct error problem = {0};
    if (check_quarantine(supervisor, task, &problem))
        return send_task(supervisor, task);
    render_task_destroy(task);
    return true;
}

/* Takes the reference. */
static bool send_small(struct supervisor *supervisor, json_t *message)
{
    bool is_sent = message && ipc_send(supervisor->worker.socket, message, NULL, 0, NULL);
    json_decref(message);
    return is_sent;
}

/* Tells the worker which of its renders nobody waits for any more. Under the mutex. */
static bool send_cancelled(struct supervisor *supervisor)
{
    for (int i = 0; i < supervisor->flights.count; i++) {
        struct flight *flight = &supervisor->flights.list[i];
        if (!flight->task->is_cancelled || flight->is_told || flight->state == FLIGHT_ENCODING)
            continue;
        flight->is_told = true;
        if (!send_small(supervisor, json_pack("{s:s,s:I}", "op", "cancel", "id",
                                              (json_int_t)flight->task->ticket)))
            return false;
    }
    return true;
}

/* What the worker has room for. Under the mutex. */
static struct render_task *next_task(struct supervisor *supervisor)
{
    struct render_task *task = NULL;
    if (flights_have_room(&supervisor->flights, RENDER_INTERACTIVE))
        task = render_queue_pop_urgent(&supervisor->queue);
    if (!task && flights_have_room(&supervisor->flights, RENDER_NORMAL))
        task = render_queue_pop_patient(&supervisor->queue);
    return task;
}

/* Under the mutex. False when the worker no longer listens; then its socket will say so, too. */
static bool feed_worker(struct supervisor *supervisor)
{
    if (!send_cancelled(supervisor))
        return false;
    for (struct render_task *task; (task = next_task(supervisor));) {
        struct error problem = {0};
        if (task->is_cancelled) /* before the worker died that had it */
            refuse_task(supervisor, task, &nobody_waits);
        else if (!check_quarantine(supervisor, task, &problem))
            refuse_task(supervisor, task, &problem);
        else if (!send_task(supervisor, task))
            return false;
    }
    json_t *ids = supervisor->flights.count == 0 ? take_forgotten(supervisor) : NULL;
    if (!ids)
        return send_warm_up(supervisor);
    return send_small(supervisor, json_pack("{s:s,s:o}", "op", "forget", "forget", ids));
}

/* ---- the loop ---- */

static int64_t timeout_ms(const struct supervisor *supervisor)
{
    return 1000ll * supervisor->desc.config->render_timeout_s;
}

/* Of the flight that a late worker is charged with. Under the mutex. */
static int limit_s(const struct supervisor *supervisor)
{
    int guilty = flights_guilty(&supervisor->flights);
    if (supervisor->state == WORKER_STARTING || guilty < 0)
        return START_MS / 1000;
    const struct flight *flight = &supervisor->flights.list[guilty];
    return (int)(flight_limit_ms(flight, timeout_ms(supervisor)) / 1000);
}

/* When the worker must have done something. Under the mutex. */
static int64_t next_deadline(const struct supervisor *supervisor)
{
    return supervisor->state == WORKER_STARTING
               ? supervisor->state_ms + START_MS
               : flights_deadline(&supervisor->flights, timeout_ms(supervisor),
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
    bool is_deaf = supervisor->state == WORKER_READY && !feed_worker(supervisor);
    int allowed_s = limit_s(supervisor);
    int64_t now = now_ms();
    int64_t until =
        supervisor->state == WORKER_NONE ? supervisor->next_start_ms : next_deadline(supervisor);
    bool is_late = supervisor->state != WORKER_NONE && now >= until;
    int64_t due = warm_up_due_ms(supervisor);
    pthread_mutex_unlock(&supervisor->mutex);
    if (is_deaf) {
        bury_worker(supervisor, NULL, false);
        return 0;
    }
    if (is_late) {
        char reason[64];
        snprintf(reason, sizeof reason, "a missed deadline of %d s", allowed_s);
        bury_worker(supervisor, reason, true);
        return 0;
    }
    int64_t left = (due < until ? due : until) - now;
    return left > 60000 ? 60000 : left < 0 ? 0 : (int)left;
}

static void *supervisor_run(void *argument)
{
    struct supervisor *supervisor = argument;
    for (;;) {
        pthread_mutex_lock(&supervisor->mutex);
        bool is_stopping = supervisor->is_stopping;
        pthread_mutex_unlock(&supervisor->mutex);
        if (is_stopping)
            break;
        int sleep_ms = look_around(supervisor);
        tell_ended(supervisor);
        struct pollfd fds[2] = {{.fd = supervisor->wake_fd, .events = POLLIN},
                                {.fd = supervisor->worker.socket, .events = POLLIN}};
        if (poll(fds, supervisor->worker.pid > 0 ? 2 : 1, sleep_ms) <= 0)
            continue;
        eventfd_t ignored;
        if (fds[0].revents)
            eventfd_read(supervisor->wake_fd, &ignored);
        if (fds[1].revents && supervisor->worker.pid > 0)
            receive(supervisor);
        tell_ended(supervisor);
    }
    child_stop(&supervisor->worker, supervisor->flights.count > 0 ? 0 : 2000, NULL, 0);
    return NULL;
}

/* ---- life ---- */

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
    supervisor->forgotten = json_array();
    if (supervisor->wake_fd >= 0 && supervisor->forgotten)
        supervisor->has_thread =
            pthread_create(&supervisor->thread, NULL, supervisor_run, supervisor) == 0;
    if (supervisor->has_thread)
        return supervisor;
    error_set(err, ERROR_INTERNAL, "supervisor: %s", strerror(errno));
    supervisor_destroy(supervisor);
    return NULL;
}

void supervisor_destroy(struct supervisor *supervisor)
{
    if (!supervisor)
        return;
    if (supervisor->has_thread) {
        pthread_mutex_lock(&supervisor->mutex);
        supervisor->is_stopping = true;
        pthread_mutex_unlock(&supervisor->mutex);
        wake(supervisor);
        pthread_join(supervisor->thread, NULL);
    }
    struct error stopping = {ERROR_OVERLOADED, "the server is stopping", ""};
    pthread_mutex_lock(&supervisor->mutex);
    struct flights *flights = &supervisor->flights;
    while (flights->count > 0)
        refuse_task(supervisor, flights->list[--flights->count].task, &stopping);
    refuse_waiting(supervisor, &stopping);
    warm_ups_drop(&supervisor->warm_ups, NULL);
    pthread_mutex_unlock(&supervisor->mutex);
    tell_ended(supervisor);
    json_decref(supervisor->forgotten);
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
    if (supervisor->is_stopping || supervisor->is_draining)
        is_good = error_set(err, ERROR_OVERLOADED, "the server is stopping");
    else if (supervisor->start_error.code != ERROR_NONE)
        is_good =
            error_set(err, supervisor->start_error.code, "%s", supervisor->start_error.message);
    else
        is_good = check_quarantine(supervisor, task, err);
    if (is_good && !render_queue_push(&supervisor->queue, task, LIMIT_QUEUE_DEPTH))
        is_good = error_set(err, ERROR_OVERLOADED, "%d renders are waiting, which is the limit",
                            LIMIT_QUEUE_DEPTH);
    supervisor->asked_ms = now_ms();
    if (is_good && !task->question)
        warm_ups_drop(&supervisor->warm_ups, task->scene); /* the render does that */
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

void supervisor_cancel(struct supervisor *supervisor, uint64_t ticket)
{
    pthread_mutex_lock(&supervisor->mutex);
    struct render_task *task = render_queue_remove(&supervisor->queue, ticket);
    int flight = task ? -1 : flights_find(&supervisor->flights, ticket);
    if (task)
        supervisor->totals.cancelled++;
    if (flight >= 0 && !supervisor->flights.list[flight].task->question)
        supervisor->flights.list[flight].task->is_cancelled = true;
    pthread_mutex_unlock(&supervisor->mutex);
    if (flight >= 0)
        wake(supervisor);
    if (!task)
        return;
    task->outcome.problem = nobody_waits;
    task->done(task->context, &task->outcome);
    render_task_destroy(task);
}

void supervisor_drain(struct supervisor *supervisor)
{
    pthread_mutex_lock(&supervisor->mutex);
    supervisor->is_draining = true;
    pthread_mutex_unlock(&supervisor->mutex);
}

void supervisor_forget_scene(struct supervisor *supervisor, const char *scene)
{
    pthread_mutex_lock(&supervisor->mutex);
    quarantine_forgive(&supervisor->quarantine, scene);
    warm_ups_drop(&supervisor->warm_ups, scene);
    if (supervisor->state != WORKER_NONE)
        json_array_append_new(supervisor->forgotten, json_string(scene));
    pthread_mutex_unlock(&supervisor->mutex);
    wake(supervisor);
}

void supervisor_forgive_scene(struct supervisor *supervisor, const char *scene)
{
    pthread_mutex_lock(&supervisor->mutex);
    quarantine_forgive(&supervisor->quarantine, scene);
    pthread_mutex_unlock(&supervisor->mutex);
}

bool supervisor_is_ready(struct supervisor *supervisor, struct error *err)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool is_ready = false;
    if (supervisor->is_draining || supervisor->is_stopping)
        error_set(err, ERROR_OVERLOADED, "the server is stopping");
    else if (supervisor->state == WORKER_READY)
        is_ready = true;
    else if (supervisor->start_error.code != ERROR_NONE)
        error_set(err, supervisor->start_error.code, "%s", supervisor->start_error.message);
    else
        error_set(err, ERROR_OVERLOADED, "the render worker is starting");
    pthread_mutex_unlock(&supervisor->mutex);
    return is_ready;
}

bool supervisor_get_device(struct supervisor *supervisor, struct device_capabilities *device)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool has_device = supervisor->has_device;
    *device = supervisor->device;
    device->gpu_used_bytes = supervisor->totals.gpu_used_bytes;
    pthread_mutex_unlock(&supervisor->mutex);
    return has_device;
}

struct supervisor_totals supervisor_get_totals(struct supervisor *supervisor)
{
    pthread_mutex_lock(&supervisor->mutex);
    struct supervisor_totals totals = supervisor->totals;
    int64_t now = now_us();
    totals.waiting = supervisor->queue.count;
    totals.in_flight = (uint64_t)supervisor->flights.count;
    totals.quarantined = (uint64_t)quarantine_count(&supervisor->quarantine);
    totals.oldest_wait_s = 1e-6 * (double)(now - render_queue_oldest_us(&supervisor->queue, now));
    pthread_mutex_unlock(&supervisor->mutex);
    return totals;
}
