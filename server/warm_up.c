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
    task->question = json_pack("{s:s}", "warm_up", "all");
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

static void ask_for_programs(struct render_task *task)
{
    json_object_set_new(task->question, "warm_up", json_string("programs"));
}

void warm_ups_note_drawn(struct warm_ups *warm_ups, const char *scene)
{
    for (int i = 0; i < warm_ups->count; i++)
        if (strcmp(warm_ups->tasks[i]->scene, scene) == 0)
            ask_for_programs(warm_ups->tasks[i]);
}

bool warm_up_continue(struct render_task *task)
{
    if (!warm_up_is_step(task->question) || task->is_cancelled ||
        task->outcome.problem.code != ERROR_NONE ||
        !json_is_false(json_object_get(task->outcome.answer, "is_complete")))
        return false;
    json_decref(task->outcome.answer);
    task->outcome.answer = NULL;
    ask_for_programs(task);
    return true;
}

bool warm_up_is_step(const json_t *question)
{
    return json_object_get(question, "warm_up") != NULL;
}

static bool draw_once(struct renderer *renderer, const char *scene, const struct view *view,
                      struct error *err)
{
    struct frame frame = {0};
    bool is_good = renderer_render(renderer, scene, view, &frame, err);
    frame_finish(&frame);
    return is_good;
}

/* In motion, pictures have one sample per pixel (protocol/view_document.h). */
static bool warm_up(const struct warm_up_step_desc *desc, struct view *view, bool *is_complete,
                    struct error *err)
{
    const struct renderer_warm_up_desc programs = {.shall_stop = desc->shall_stop,
                                                   .context = desc->context};
    const char *scene = desc->request->scene;
    const char *what = json_string_value(json_object_get(desc->question, "warm_up"));
    bool draws = what && strcmp(what, "all") == 0;
    *is_complete = true;
    for (int in_motion = 0; in_motion < 2 && *is_complete; in_motion++) {
        if (in_motion)
            view->quality.samples = view->quality.shadow_taps = 1;
        if ((draws && !draw_once(desc->renderer, scene, view, err)) ||
            !renderer_warm_up(desc->renderer, scene, view, &programs, is_complete, err))
            return false;
    }
    return true;
}

json_t *warm_up_step(const struct warm_up_step_desc *desc, struct error *err)
{
    struct view view;
    struct view_storage storage = {0};
    bool is_complete = false;
    bool is_good = view_from_request(desc->request, &storage, &view, err) &&
                   warm_up(desc, &view, &is_complete, err);
    view_storage_finish(&storage);
    if (!is_good)
        return NULL;
    json_t *answer = json_pack("{s:b}", "is_complete", is_complete);
    if (!answer)
        error_set(err, ERROR_NO_MEMORY, "warm-up");
    return answer;
}
