/* SPDX-License-Identifier: MIT */
/* What workers say. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "protocol/utf8.h"
#include "server/base/clock.h"
#include "server/base/ipc.h"
#include "server/front/supervisor_internal.h"
#include "server/mapping/questions.h"

static void take_image(struct supervisor *supervisor, struct worker_slot *slot,
                       struct render_task *task, struct ipc_message *message)
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
        slot->has_rendered = true;
        slot->totals.rendered++;
        task->outcome.worker = slot->number;
        warm_ups_note_drawn(&supervisor->warm_ups, task->scene);
        const char *drawn = json_string_value(json_object_get(message->json, "drawn"));
        utf8_copy(task->outcome.drawn, sizeof task->outcome.drawn, drawn ? drawn : "");
    }
    supervisor_refuse(supervisor, task, &problem); /* without a problem the task succeeds */
}

static void take_answer(struct supervisor *supervisor, struct worker_slot *slot,
                        struct render_task *task, struct ipc_message *message)
{
    struct error problem = {0};
    task->outcome.answer = json_incref(json_object_get(message->json, "result"));
    task->outcome.image_fd = ipc_message_take_fd(message, 0);
    if (!task->outcome.answer)
        error_set(&problem, ERROR_INTERNAL, "the worker sent no answer");
    else
        slot->totals.answered++;
    slot->has_rendered = true;
    supervisor_refuse(supervisor, task, &problem);
}

/* Takes in what the worker says of one job. Under the mutex. */
static void flight_message(struct supervisor *supervisor, struct worker_slot *slot, const char *op,
                           struct ipc_message *message)
{
    uint64_t id = (uint64_t)json_integer_value(json_object_get(message->json, "id"));
    int index = worker_jobs_find(&slot->jobs, id);
    if (index < 0)
        return;
    struct worker_job *job = &slot->jobs.list[index];
    struct render_task *task = job->task;
    if (strcmp(op, "begin") == 0) {
        task->outcome.queue_ms = 1e-3 * (double)(now_us() - task->queued_us);
        supervisor->totals.overlapped +=
            !task->question && worker_jobs_have(&slot->jobs, JOB_ENCODING);
        supervisor->totals.ahead += !task->question && worker_jobs_have(&slot->jobs, JOB_ON_DEVICE);
    }
    if (strcmp(op, "progress") == 0) {
        const char *stage = json_string_value(json_object_get(message->json, "stage"));
        job_progress_note(&job->progress, stage ? stage : "",
                          json_number_value(json_object_get(message->json, "share")), now_ms());
        return;
    }
    bool was_on_device = job->state == JOB_ON_DEVICE;
    if (strcmp(op, "lost") == 0)
        worker_jobs_note_lost(&slot->jobs, index);
    else if (was_on_device)
        worker_jobs_note_free_device(&slot->jobs, now_ms());
    if (worker_job_note(job, op, now_ms()))
        return;
    if (strcmp(op, "done") == 0) {
        worker_jobs_remove(&slot->jobs, index);
        take_image(supervisor, slot, task, message);
    } else if (strcmp(op, "answer") == 0) {
        worker_jobs_remove(&slot->jobs, index);
        take_answer(supervisor, slot, task, message);
    } else if (strcmp(op, "error") == 0) {
        struct error problem = {0};
        ipc_error_from_json(json_object_get(message->json, "error"), &problem);
        worker_jobs_remove(&slot->jobs, index);
        supervisor_refuse(supervisor, task,
                          task->is_cancelled ? &supervisor_nobody_waits : &problem);
    }
}

static uint64_t number(const json_t *json, const char *key)
{
    return (uint64_t)json_integer_value(json_object_get(json, key));
}

static void totals_message(struct worker_slot *slot, const json_t *json)
{
    struct worker_totals *totals = &slot->totals;
    totals->programs_built = number(json, "programs_built");
    totals->programs_reused = number(json, "programs_reused");
    totals->programs_loaded = number(json, "programs_loaded");
    totals->programs_kept = number(json, "programs_kept");
    totals->programs_kept_bytes = number(json, "programs_kept_bytes");
    totals->gpu_used_bytes = number(json, "gpu_used_bytes");
    totals->timed = number(json, "timed");
    totals->timings_stopped = number(json, "timings_stopped");
    totals->learned = number(json, "learned");
    totals->learned_kept = number(json, "learned_kept");
    totals->cache_bytes = number(json, "cache_bytes");
    totals->cache_scenes = number(json, "cache_scenes");
    totals->cache_hits = number(json, "cache_hits");
    totals->cache_misses = number(json, "cache_misses");
    totals->cache_evictions = number(json, "cache_evictions");
}

static void add_lessons(json_t **to, json_t *lessons)
{
    *to = *to ? *to : json_array();
    json_array_extend(*to, lessons);
    while (json_array_size(*to) > WORKER_LESSONS_MAX)
        json_array_remove(*to, 0);
}

/* What frames of a worker teach `auto` goes to the one that keeps; while there is none, nowhere.
 * Under the mutex. */
static void pass_lessons(struct supervisor *supervisor, const struct worker_slot *slot,
                         json_t *lessons)
{
    const struct worker_slot *found = supervisor_keeper(supervisor);
    if (!lessons || slot->is_keeper || !found)
        return;
    add_lessons(&supervisor->slots[found->number - 1].lessons, lessons);
}

/* What its promised frames took goes to all others: one that starts later reads what the keeper
 * wrote. Under the mutex. */
static void pass_times(struct supervisor *supervisor, const struct worker_slot *from, json_t *times)
{
    for (int i = 0; times && i < supervisor->slot_count; i++) {
        struct worker_slot *slot = &supervisor->slots[i];
        if (slot != from && slot->state == WORKER_READY)
            add_lessons(&slot->times, times);
    }
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
static bool measured_message(struct supervisor *supervisor, struct worker_slot *slot,
                             const json_t *json, struct error *err)
{
    struct device_capabilities device;
    if (!device_capabilities_from_json(json_object_get(json, "device"), &device, err))
        return false;
    pthread_mutex_lock(&supervisor->mutex);
    supervisor->device = slot->capabilities = device;
    device_trials_succeed(&slot->trials);
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

static void nobody_waits(void *context, struct render_outcome *outcome)
{
    (void)context;
    (void)outcome;
}

/* Others wait until the keeper knows the device's speed: it is to find it out at once. Under the
 * mutex. */
static void ask_for_speed(struct supervisor *supervisor, const struct worker_slot *slot)
{
    struct render_task *task = render_task_create();
    if (!task || !(task->question = json_pack("{s:b}", "speed", true))) {
        render_task_destroy(task); /* a picture that goes by it has it found out, too */
        return;
    }
    task->ticket = ++supervisor->next_ticket;
    task->priority = RENDER_INTERACTIVE;
    task->home = slot->number;
    task->queued_us = now_us();
    task->done = nobody_waits;
    render_queue_push_back(&supervisor->queue, task);
}

/* A worker whose pictures would differ from those of the others is not used. Under the mutex. */
static void refuse_device(struct supervisor *supervisor, struct worker_slot *slot,
                          const struct error *problem)
{
    device_trials_abandon(&slot->trials);
    supervisor_give_up(supervisor, slot, strdup(problem->message));
}

static bool hello_message(struct supervisor *supervisor, struct worker_slot *slot,
                          const json_t *json, struct error *err)
{
    struct device_capabilities device;
    if (!device_capabilities_from_json(json_object_get(json, "device"), &device, err))
        return false;
    json_int_t depth = json_integer_value(json_object_get(json, "depth"));
    pthread_mutex_lock(&supervisor->mutex);
    if (!supervisor_check_device(supervisor, slot, &device, err)) {
        refuse_device(supervisor, slot, err);
        pthread_mutex_unlock(&supervisor->mutex);
        return false;
    }
    supervisor->device = slot->capabilities = device;
    supervisor->has_device = true;
    slot->jobs.depth = depth < 1                       ? 1
                       : depth > WORKER_JOBS_DEPTH_MAX ? WORKER_JOBS_DEPTH_MAX
                                                       : (int)depth;
    slot->state = WORKER_READY;
    slot->state_ms = now_ms();
    slot->start_error = (struct error){0};
    if (device.automatic.is_pending) /* the last step is still to come */
        device_trials_abandon(&slot->trials);
    else
        device_trials_succeed(&slot->trials);
    if (device.automatic.is_pending && supervisor->slot_count > 1)
        ask_for_speed(supervisor, slot);
    pthread_mutex_unlock(&supervisor->mutex);
    log_write(supervisor->desc.log, LOG_INFO, "%s is ready: %s, %s", slot->name, device.renderer,
              device.version);
    if (slot->is_keeper) { /* it is the same for all */
        log_devices(supervisor, &device);
        log_speed(supervisor, &device.automatic);
        log_blocks(supervisor, &device.blocks);
    }
    if (supervisor->desc.on_ready)
        supervisor->desc.on_ready(supervisor->desc.context);
    return true;
}

static void failed_message(struct supervisor *supervisor, struct worker_slot *slot,
                           const json_t *json)
{
    struct error problem = {0};
    ipc_error_from_json(json_object_get(json, "error"), &problem);
    problem.code = ERROR_NO_DEVICE;
    log_write(supervisor->desc.log, LOG_ERROR, "no usable device: %s", problem.message);
    pthread_mutex_lock(&supervisor->mutex);
    slot->start_error = problem;
    pthread_mutex_unlock(&supervisor->mutex);
    supervisor_note_no_device(supervisor, slot, json);
}

void supervisor_receive(struct supervisor *supervisor, struct worker_slot *slot)
{
    struct ipc_message message;
    struct error problem = {0};
    enum ipc_status status = ipc_receive(slot->process.socket, &message, &problem);
    if (status != IPC_MESSAGE) {
        supervisor_reap_worker(supervisor, slot, status == IPC_CLOSED ? NULL : "a broken message",
                               false);
        return;
    }
    const char *op = json_string_value(json_object_get(message.json, "op"));
    if (!op)
        op = "";
    bool is_good = true, is_lost = strcmp(op, "lost") == 0;
    if (strcmp(op, "hello") == 0)
        is_good = hello_message(supervisor, slot, message.json, &problem);
    else if (strcmp(op, "measured") == 0)
        is_good = measured_message(supervisor, slot, message.json, &problem);
    else if (strcmp(op, "failed") == 0)
        failed_message(supervisor, slot, message.json);
    else if (strcmp(op, "trying") == 0)
        supervisor_try_device(supervisor, slot, message.json);
    pthread_mutex_lock(&supervisor->mutex);
    if (strcmp(op, "progress") != 0) /* which prolongs no deadline */
        slot->last_event_ms = now_ms();
    if (strcmp(op, "totals") == 0) {
        totals_message(slot, message.json);
        pass_lessons(supervisor, slot, json_object_get(message.json, "lessons"));
        pass_times(supervisor, slot, json_object_get(message.json, "times"));
    } else {
        flight_message(supervisor, slot, op, &message);
    }
    pthread_mutex_unlock(&supervisor->mutex);
    if (is_lost)
        ipc_error_from_json(json_object_get(message.json, "error"), &problem);
    ipc_message_finish(&message);
    if (!is_good || is_lost)
        supervisor_reap_worker(supervisor, slot, problem.message, false);
}
