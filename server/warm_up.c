/* SPDX-License-Identifier: MIT */
/* The list of scenes to warm up, and what a worker does for one. */
#include "server/warm_up.h"

#include <stdio.h>
#include <string.h>

#include "server/ipc.h"
#include "server/view_mapping.h"

static void nobody_waits(void *context, struct render_outcome *outcome)
{
    (void)context;
    (void)outcome;
}

struct render_task *warm_up_task(struct scene_store *store, uint64_t ticket, const char *scene,
                                 struct error *err)
{
    char text[DIGEST_TEXT_BYTES + 64];
    struct render_task *task = render_task_create();
    if (!task) {
        error_set(err, ERROR_NO_MEMORY, "warm-up");
        return NULL;
    }
    int length =
        snprintf(text, sizeof text, "{\"scene\":\"%.64s\",\"width\":64,\"height\":48}", scene);
    snprintf(task->scene, sizeof task->scene, "%s", scene);
    task->ticket = ticket;
    task->priority = RENDER_BATCH;
    task->done = nobody_waits;
    task->question = json_pack("{s:b}", "warm_up", 1);
    task->blob_fd = scene_store_open_blob(store, scene, err);
    if (task->blob_fd >= 0)
        task->request_fd = ipc_memfd_create("vitrail-request", text, (size_t)length, err);
    if (task->request_fd >= 0 && task->question)
        return task;
    error_set(err, ERROR_NO_MEMORY, "warm-up");
    render_task_destroy(task);
    return NULL;
}

static struct render_task *take(struct warm_ups *warm_ups, int index)
{
    struct render_task *task = warm_ups->tasks[index];
    warm_ups->count--;
    memmove(&warm_ups->tasks[index], &warm_ups->tasks[index + 1],
            (size_t)(warm_ups->count - index) * sizeof warm_ups->tasks[0]);
    return task;
}

void warm_ups_add(struct warm_ups *warm_ups, struct render_task *task)
{
    warm_ups_drop(warm_ups, task->scene);
    if (warm_ups->count == WARM_UPS_MAX)
        render_task_destroy(take(warm_ups, 0));
    warm_ups->tasks[warm_ups->count++] = task;
}

struct render_task *warm_ups_take(struct warm_ups *warm_ups)
{
    return warm_ups->count ? take(warm_ups, 0) : NULL;
}

void warm_ups_drop(struct warm_ups *warm_ups, const char *scene)
{
    for (int i = warm_ups->count; i-- > 0;)
        if (!scene || strcmp(warm_ups->tasks[i]->scene, scene) == 0)
            render_task_destroy(take(warm_ups, i));
}

bool warm_up_is_step(const json_t *question)
{
    return json_object_get(question, "warm_up") != NULL;
}

json_t *warm_up_step(struct renderer *renderer, const struct render_request *request,
                     struct error *err)
{
    struct view view;
    struct frame frame = {0};
    struct view_storage storage = {0};
    bool is_good = view_from_request(request, &storage, &view, err) &&
                   renderer_render(renderer, request->scene, &view, &frame, err);
    view_storage_finish(&storage);
    if (!is_good)
        return NULL;
    json_t *answer =
        json_pack("{s:I}", "programs_built", (json_int_t)frame.report.counts.programs_built);
    frame_finish(&frame);
    if (!answer)
        error_set(err, ERROR_NO_MEMORY, "warm-up");
    return answer;
}
