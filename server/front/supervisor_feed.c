/* SPDX-License-Identifier: MIT */
/* Gives workers their work: tasks from the queue, and what they do for want of any. */
#include <stdlib.h>

#include "server/base/clock.h"
#include "server/base/ipc.h"
#include "server/front/placement.h"
#include "server/front/supervisor_internal.h"
#include "server/mapping/questions.h"

enum { FORGOTTEN_PER_MESSAGE = 1000 };

/* New reference to a few ids that the worker shall forget; NULL when there are none. Under the
 * mutex. */
static json_t *take_forgotten(struct worker_slot *slot)
{
    size_t count = json_array_size(slot->forgotten);
    if (count == 0)
        return NULL;
    json_t *ids = json_array();
    for (size_t i = 0; ids && i < FORGOTTEN_PER_MESSAGE && count > 0; i++, count--) {
        json_array_append(ids, json_array_get(slot->forgotten, count - 1));
        json_array_remove(slot->forgotten, count - 1);
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
static bool send_task(struct worker_slot *slot, struct render_task *task)
{
    json_t *message = json_pack(
        "{s:s,s:I,s:s,s:b,s:s,s:b,s:b,s:o,s:s,s:O*,s:O*,s:O*,s:O*,s:o*}", "op",
        task->question ? "ask" : "render", "id", (json_int_t)task->ticket, "scene", task->scene,
        "urgent", task->priority == RENDER_INTERACTIVE, "format", image_format_name(task->format),
        "reuse", task->expects_reuse, "coarse", task->may_be_coarse, "parts", list_parts(task),
        "environment", task->resources.environment, "question", task->question, "offer",
        task->offer, "stated_error", task->stated_error, "asked_quality", task->asked_quality,
        "forget", take_forgotten(slot));
    int fds[IPC_FDS_MAX], fd_count = list_fds(task, fds);
    struct error problem = {0};
    bool is_sent = message && ipc_send(slot->process.socket, message, fds, fd_count, &problem);
    json_decref(message);
    worker_jobs_add(&slot->jobs, task, now_ms());
    worker_slot_note_sent(slot, task->scene);
    for (int i = 0; i < task->resources.scene_count; i++)
        worker_slot_note_sent(slot, task->resources.scenes[i]);
    if (!warm_up_is_step(task->question))
        slot->is_resting = false;
    return is_sent;
}

/* Sends a message without descriptors, and takes the reference to it. */
static bool send_small(struct worker_slot *slot, json_t *message)
{
    bool is_sent = message && ipc_send(slot->process.socket, message, NULL, 0, NULL);
    json_decref(message);
    return is_sent;
}

/* Whether this is the worker that the next warm-up goes to. Under the mutex. */
static bool warms_up(const struct supervisor *supervisor, const struct worker_slot *slot)
{
    const struct warm_ups *warm_ups = &supervisor->warm_ups;
    return warm_ups->count > 0 && placement_choose(supervisor->slots, supervisor->slot_count,
                                                   warm_ups->tasks[0]) == slot->number - 1;
}

int64_t supervisor_idle_due_ms(const struct supervisor *supervisor, const struct worker_slot *slot)
{
    int rest_s = supervisor->desc.config->rest_s;
    if (slot->state != WORKER_READY || slot->jobs.count > 0 || supervisor->is_draining)
        return INT64_MAX;
    bool is_to_warm_up = warms_up(supervisor, slot);
    if (!is_to_warm_up && (slot->is_resting || rest_s == 0))
        return INT64_MAX;
    int64_t since =
        supervisor->asked_ms > slot->last_event_ms ? supervisor->asked_ms : slot->last_event_ms;
    return since + (is_to_warm_up ? WARM_UP_IDLE_MS : 1000ll * rest_s);
}

/* Under the mutex. */
static bool send_idle(struct supervisor *supervisor, struct worker_slot *slot)
{
    if (now_ms() < supervisor_idle_due_ms(supervisor, slot))
        return true;
    if (!warms_up(supervisor, slot)) {
        slot->is_resting = true;
        return send_small(slot, json_pack("{s:s}", "op", "rest"));
    }
    struct render_task *task = warm_ups_take(&supervisor->warm_ups);
    struct error problem = {0};
    if (supervisor_check_quarantine(supervisor, task, &problem))
        return send_task(slot, task);
    render_task_destroy(task);
    return true;
}

/* Tells the worker which of its renders nobody waits for any more. Under the mutex. */
static bool send_cancelled(struct worker_slot *slot)
{
    for (int i = 0; i < slot->jobs.count; i++) {
        struct worker_job *job = &slot->jobs.list[i];
        if (!job->task->is_cancelled || job->is_notified || job->state == JOB_ENCODING)
            continue;
        job->is_notified = true;
        if (!send_small(
                slot, json_pack("{s:s,s:I}", "op", "cancel", "id", (json_int_t)job->task->ticket)))
            return false;
    }
    return true;
}

static void give_tasks(struct supervisor *supervisor)
{
    int chosen = 0;
    for (struct render_task *task; (task = placement_take(&supervisor->queue, supervisor->slots,
                                                          supervisor->slot_count, &chosen));) {
        struct worker_slot *slot = &supervisor->slots[chosen];
        struct error problem = {0};
        if (task->is_cancelled) /* the worker that had it died first */
            supervisor_refuse(supervisor, task, &supervisor_nobody_waits);
        else if (!supervisor_check_quarantine(supervisor, task, &problem))
            supervisor_refuse(supervisor, task, &problem);
        else if (!send_task(slot, task))
            slot->is_deaf = true; /* it is given no more */
    }
}

/* Tells a worker that the keeper has written down more, for it to read. Under the mutex. */
static bool tell_learned(const struct supervisor *supervisor, struct worker_slot *slot)
{
    const struct worker_slot *keeper = supervisor_keeper(supervisor);
    uint64_t learned = keeper ? keeper->totals.learned_kept : 0;
    if (!learned || slot->is_keeper || learned == slot->totals.learned ||
        learned == slot->told_learned)
        return true;
    slot->told_learned = learned;
    return send_small(slot, json_pack("{s:s}", "op", "learned"));
}

/* Under the mutex. */
static bool send_lessons(struct worker_slot *slot)
{
    json_t *lessons = slot->lessons, *times = slot->times;
    slot->lessons = slot->times = NULL;
    return (!lessons && !times) || send_small(slot, json_pack("{s:s,s:o*,s:o*}", "op", "lessons",
                                                              "lessons", lessons, "times", times));
}

void supervisor_feed(struct supervisor *supervisor)
{
    for (int i = 0; i < supervisor->slot_count; i++) {
        struct worker_slot *slot = &supervisor->slots[i];
        if (slot->state == WORKER_READY && !slot->is_deaf)
            slot->is_deaf =
                !send_cancelled(slot) || !tell_learned(supervisor, slot) || !send_lessons(slot);
    }
    give_tasks(supervisor);
    for (int i = 0; i < supervisor->slot_count; i++) {
        struct worker_slot *slot = &supervisor->slots[i];
        if (slot->state != WORKER_READY || slot->is_deaf)
            continue;
        json_t *ids = slot->jobs.count == 0 ? take_forgotten(slot) : NULL;
        slot->is_deaf =
            ids ? !send_small(slot, json_pack("{s:s,s:o}", "op", "forget", "forget", ids))
                : !send_idle(supervisor, slot);
    }
}
