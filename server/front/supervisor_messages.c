/* SPDX-License-Identifier: MIT */
/* The messages of the worker, and the messages to it. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "protocol/utf8.h"
#include "server/base/clock.h"
#include "server/base/ipc.h"
#include "server/front/supervisor_internal.h"
#include "server/mapping/questions.h"

enum { FORGOTTEN_PER_MESSAGE = 1000 };

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
    struct frame_stats *stats = task->outcome.stats;
    if (stats && problem.code == ERROR_NONE) {
        quarantine_clear(&supervisor->quarantine, task->scene);
        supervisor->has_rendered = true;
        warm_ups_note_drawn(&supervisor->warm_ups, task->scene);
        const char *drawn = json_string_value(json_object_get(message->json, "drawn"));
        utf8_copy(task->outcome.drawn, sizeof task->outcome.drawn, drawn ? drawn : "");
    }
    supervisor_refuse(supervisor, task, &problem); /* without a problem the task succeeds */
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
    supervisor_refuse(supervisor, task, &problem);
}

/* Takes in what the worker says of one job. Under the mutex. */
static void flight_message(struct supervisor *supervisor, const char *op,
                           struct ipc_message *message)
{
    uint64_t id = (uint64_t)json_integer_value(json_object_get(message->json, "id"));
    int index = worker_jobs_find(&supervisor->jobs, id);
    if (index < 0)
        return;
    struct worker_job *job = &supervisor->jobs.list[index];
    struct render_task *task = job->task;
    if (strcmp(op, "begin") == 0) {
        task->outcome.queue_ms = 1e-3 * (double)(now_us() - task->queued_us);
        supervisor->totals.overlapped +=
            !task->question && worker_jobs_have(&supervisor->jobs, JOB_ENCODING);
        supervisor->totals.ahead +=
            !task->question && worker_jobs_have(&supervisor->jobs, JOB_ON_DEVICE);
    }
    if (strcmp(op, "progress") == 0) {
        const char *stage = json_string_value(json_object_get(message->json, "stage"));
        job_progress_note(&job->progress, stage ? stage : "",
                          json_number_value(json_object_get(message->json, "share")), now_ms());
        return;
    }
    bool was_on_device = job->state == JOB_ON_DEVICE;
    if (strcmp(op, "lost") == 0)
        worker_jobs_note_lost(&supervisor->jobs, index);
    else if (was_on_device)
        worker_jobs_note_free_device(&supervisor->jobs, now_ms());
    if (worker_job_note(job, op, now_ms()))
        return;
    if (strcmp(op, "done") == 0) {
        worker_jobs_remove(&supervisor->jobs, index);
        take_image(supervisor, task, message);
    } else if (strcmp(op, "answer") == 0) {
        worker_jobs_remove(&supervisor->jobs, index);
        take_answer(supervisor, task, message);
    } else if (strcmp(op, "error") == 0) {
        struct error problem = {0};
        ipc_error_from_json(json_object_get(message->json, "error"), &problem);
        worker_jobs_remove(&supervisor->jobs, index);
        supervisor_refuse(supervisor, task,
                          task->is_cancelled ? &supervisor_nobody_waits : &problem);
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
    totals->programs_loaded = number(json, "programs_loaded");
    totals->programs_kept = number(json, "programs_kept");
    totals->programs_kept_bytes = number(json, "programs_kept_bytes");
    totals->gpu_used_bytes = number(json, "gpu_used_bytes");
    totals->timed = number(json, "timed");
    totals->timings_stopped = number(json, "timings_stopped");
    totals->learned = number(json, "learned");
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

/* The worker has measured the device's speed, which was pending. */
static bool measured_message(struct supervisor *supervisor, const json_t *json, struct error *err)
{
    struct device_capabilities device;
    if (!device_capabilities_from_json(json_object_get(json, "device"), &device, err))
        return false;
    pthread_mutex_lock(&supervisor->mutex);
    supervisor->device = device;
    device_trials_succeed(&supervisor->trials);
    pthread_mutex_unlock(&supervisor->mutex);
    log_speed(supervisor, &device.automatic);
    return true;
}

static void log_blocks(struct supervisor *supervisor, const struct device_blocks *blocks)
{
    if (blocks->is_measured)
        log_write(
            supervisor->desc.log, LOG_INFO,
            "compressed textures: %s, from %d levels withheld (0: never); a sample takes %.3g "
            "ns, of BC1 %.3g, of BC3 %.3g; compressing %.3g MB/s (%s)",
            blocks->policy, blocks->from_levels, blocks->whole_ns, blocks->bc1_ns, blocks->bc3_ns,
            blocks->encode_bytes_per_ms / 1e3, blocks->note);
    else
        log_write(supervisor->desc.log, LOG_INFO, "compressed textures: %s%s%s", blocks->policy,
                  blocks->note[0] ? ", " : "", blocks->note);
}

static void log_devices(struct supervisor *supervisor, const struct device_capabilities *device)
{
    for (int i = 0; i < CAPABILITIES_DEVICES && *device->devices[i]; i++)
        log_write(supervisor->desc.log, LOG_INFO, "%s", device->devices[i]);
    log_write(supervisor->desc.log, LOG_INFO, "budget of GPU memory: %llu bytes, %s",
              (unsigned long long)device->gpu_budget_bytes, device->gpu_budget_source);
    if (*device->warning)
        log_write(supervisor->desc.log, LOG_WARNING, "%s", device->warning);
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
    supervisor->jobs.depth = depth < 1                       ? 1
                             : depth > WORKER_JOBS_DEPTH_MAX ? WORKER_JOBS_DEPTH_MAX
                                                             : (int)depth;
    supervisor->state = WORKER_READY;
    supervisor->state_ms = now_ms();
    supervisor->start_error = (struct error){0};
    if (device.automatic.is_pending) /* the last step is still to come */
        device_trials_abandon(&supervisor->trials);
    else
        device_trials_succeed(&supervisor->trials);
    pthread_mutex_unlock(&supervisor->mutex);
    log_write(supervisor->desc.log, LOG_INFO, "the worker is ready: %s, %s", device.renderer,
              device.version);
    log_devices(supervisor, &device);
    log_speed(supervisor, &device.automatic);
    log_blocks(supervisor, &device.blocks);
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
    supervisor_note_no_device(supervisor, json);
}

void supervisor_receive(struct supervisor *supervisor)
{
    struct ipc_message message;
    struct error problem = {0};
    enum ipc_status status = ipc_receive(supervisor->worker.socket, &message, &problem);
    if (status != IPC_MESSAGE) {
        supervisor_reap_worker(supervisor, status == IPC_CLOSED ? NULL : "a broken message", false);
        return;
    }
    const char *op = json_string_value(json_object_get(message.json, "op"));
    if (!op)
        op = "";
    bool is_good = true, is_lost = strcmp(op, "lost") == 0;
    if (strcmp(op, "hello") == 0)
        is_good = hello_message(supervisor, message.json, &problem);
    else if (strcmp(op, "measured") == 0)
        is_good = measured_message(supervisor, message.json, &problem);
    else if (strcmp(op, "failed") == 0)
        failed_message(supervisor, message.json);
    else if (strcmp(op, "trying") == 0)
        supervisor_try_device(supervisor, message.json);
    pthread_mutex_lock(&supervisor->mutex);
    if (strcmp(op, "progress") != 0) /* which prolongs no deadline */
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
        supervisor_reap_worker(supervisor, problem.message, false);
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

/* request, scene, scenes of parts; environment map and reference where there is one. */
static int list_fds(const struct render_task *task, int fds[IPC_FDS_MAX])
{
    int count = 0;
    if (task->request_fd < 0) /* whether the speed is known is asked without */
        return 0;
    fds[count++] = task->request_fd;
    fds[count++] = task->blob_fd;
    for (int i = 0; i < task->resources.scene_count; i++)
        fds[count++] = task->part_fds[i];
    if (task->environment_fd >= 0)
        fds[count++] = task->environment_fd;
    if (task->reference_fd >= 0)
        fds[count++] = task->reference_fd;
    return count;
}

static json_t *list_parts(const struct render_task *task)
{
    json_t *ids = json_array();
    for (int i = 0; i < task->resources.scene_count; i++)
        json_array_append_new(ids, json_string(task->resources.scenes[i]));
    return ids;
}

/* Sending never blocks: messages are small, and at most `depth` of them wait. Under the mutex. */
static bool send_task(struct supervisor *supervisor, struct render_task *task)
{
    json_t *message = json_pack(
        "{s:s,s:I,s:s,s:b,s:s,s:b,s:b,s:o,s:s,s:O*,s:O*,s:O*,s:O*,s:o*}", "op",
        task->question ? "ask" : "render", "id", (json_int_t)task->ticket, "scene", task->scene,
        "urgent", task->priority == RENDER_INTERACTIVE, "format", image_format_name(task->format),
        "reuse", task->expects_reuse, "coarse", task->may_be_coarse, "parts", list_parts(task),
        "environment", task->resources.environment, "question", task->question, "offer",
        task->offer, "stated_error", task->stated_error, "asked_quality", task->asked_quality,
        "forget", take_forgotten(supervisor));
    int fds[IPC_FDS_MAX], fd_count = list_fds(task, fds);
    struct error problem = {0};
    bool is_sent = message && ipc_send(supervisor->worker.socket, message, fds, fd_count, &problem);
    json_decref(message);
    worker_jobs_add(&supervisor->jobs, task, now_ms());
    if (!warm_up_is_step(task->question))
        supervisor->is_resting = false;
    return is_sent;
}

/* Sends a message without descriptors, and takes the reference to it. */
static bool send_small(struct supervisor *supervisor, json_t *message)
{
    bool is_sent = message && ipc_send(supervisor->worker.socket, message, NULL, 0, NULL);
    json_decref(message);
    return is_sent;
}

int64_t supervisor_idle_due_ms(const struct supervisor *supervisor)
{
    int rest_s = supervisor->desc.config->rest_s;
    bool warms_up = supervisor->warm_ups.count > 0;
    if (supervisor->state != WORKER_READY || supervisor->jobs.count > 0 ||
        supervisor->is_draining || (!warms_up && (supervisor->is_resting || rest_s == 0)))
        return INT64_MAX;
    int64_t since = supervisor->asked_ms > supervisor->last_event_ms ? supervisor->asked_ms
                                                                     : supervisor->last_event_ms;
    return since + (warms_up ? WARM_UP_IDLE_MS : 1000ll * rest_s);
}

/* Under the mutex. */
static bool send_idle(struct supervisor *supervisor)
{
    if (now_ms() < supervisor_idle_due_ms(supervisor))
        return true;
    if (!supervisor->warm_ups.count) {
        supervisor->is_resting = true;
        return send_small(supervisor, json_pack("{s:s}", "op", "rest"));
    }
    struct render_task *task = warm_ups_take(&supervisor->warm_ups);
    struct error problem = {0};
    if (supervisor_check_quarantine(supervisor, task, &problem))
        return send_task(supervisor, task);
    render_task_destroy(task);
    return true;
}

/* Tells the worker which of its renders nobody waits for any more. Under the mutex. */
static bool send_cancelled(struct supervisor *supervisor)
{
    for (int i = 0; i < supervisor->jobs.count; i++) {
        struct worker_job *job = &supervisor->jobs.list[i];
        if (!job->task->is_cancelled || job->is_notified || job->state == JOB_ENCODING)
            continue;
        job->is_notified = true;
        if (!send_small(supervisor, json_pack("{s:s,s:I}", "op", "cancel", "id",
                                              (json_int_t)job->task->ticket)))
            return false;
    }
    return true;
}

/* The next task that the worker has room for, or NULL. Under the mutex. */
static struct render_task *next_task(struct supervisor *supervisor)
{
    struct render_task *task = NULL;
    if (worker_jobs_have_room(&supervisor->jobs, RENDER_INTERACTIVE))
        task = render_queue_pop_urgent(&supervisor->queue);
    if (!task && worker_jobs_have_room(&supervisor->jobs, RENDER_NORMAL))
        task = render_queue_pop_patient(&supervisor->queue);
    return task;
}

bool supervisor_feed_worker(struct supervisor *supervisor)
{
    if (!send_cancelled(supervisor))
        return false;
    for (struct render_task *task; (task = next_task(supervisor));) {
        struct error problem = {0};
        if (task->is_cancelled) /* the worker that had it died first */
            supervisor_refuse(supervisor, task, &supervisor_nobody_waits);
        else if (!supervisor_check_quarantine(supervisor, task, &problem))
            supervisor_refuse(supervisor, task, &problem);
        else if (!send_task(supervisor, task))
            return false;
    }
    json_t *ids = supervisor->jobs.count == 0 ? take_forgotten(supervisor) : NULL;
    if (!ids)
        return send_idle(supervisor);
    return send_small(supervisor, json_pack("{s:s,s:o}", "op", "forget", "forget", ids));
}
