/* SPDX-License-Identifier: MIT */
/* The list of scenes to warm up. */
#include "server/front/warm_up.h"

#include <stdio.h>
#include <string.h>

#include "server/base/ipc.h"
#include "server/mapping/questions.h"

static void nobody_waits(void *context, struct render_outcome *outcome)
{
    (void)context;
    (void)outcome;
}

struct render_task *warm_up_task(const struct resources *resources, uint64_t ticket,
                                 const struct warm_up_desc *desc, struct error *err)
{
    char text[DIGEST_TEXT_BYTES + 64];
    struct render_task *task = render_task_create();
    if (!task) {
        error_set(err, ERROR_NO_MEMORY, "warm-up");
        return NULL;
    }
    int length = snprintf(text, sizeof text, "{\"scene\":\"%.64s\"}", desc->scene);
    snprintf(task->scene, sizeof task->scene, "%s", desc->scene);
    task->ticket = ticket;
    task->priority = RENDER_BATCH;
    task->done = nobody_waits;
    task->question = json_pack("{s:s,s:b}", "warm_up", "all", "at_start", desc->is_at_start);
    task->blob_fd = resource_store_open_blob(resources->scenes, desc->scene, err);
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

/* Scenes that were drawn have most of it; of those of a start the last used came first. */
static int least_wanted(const struct warm_ups *warm_ups)
{
    int at_start = -1;
    for (int i = 0; i < warm_ups->count; i++) {
        if (strcmp(warm_up_asked(warm_ups->tasks[i]->question), "all") != 0)
            return i;
        if (json_is_true(json_object_get(warm_ups->tasks[i]->question, "at_start")))
            at_start = i;
    }
    return at_start >= 0 ? at_start : 0;
}

void warm_ups_add(struct warm_ups *warm_ups, struct render_task *task)
{
    warm_ups_drop(warm_ups, task->scene);
    warm_ups->tasks[warm_ups->count++] = task;
    if (warm_ups->count <= WARM_UPS_MAX)
        return;
    render_task_destroy(take(warm_ups, least_wanted(warm_ups)));
    warm_ups->dropped++;
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

static void ask_for(struct render_task *task, const char *what)
{
    json_object_set_new(task->question, "warm_up", json_string(what));
}

void warm_ups_note_drawn(struct warm_ups *warm_ups, const char *scene)
{
    for (int i = 0; i < warm_ups->count; i++)
        if (strcmp(warm_ups->tasks[i]->scene, scene) == 0 &&
            strcmp(warm_up_asked(warm_ups->tasks[i]->question), "all") == 0)
            ask_for(warm_ups->tasks[i], "structures");
}

bool warm_up_continue(struct render_task *task)
{
    const char *left = json_string_value(json_object_get(task->outcome.answer, "left"));
    if (!warm_up_is_step(task->question) || task->is_cancelled ||
        task->outcome.problem.code != ERROR_NONE || !left)
        return false;
    json_int_t tries = json_integer_value(json_object_get(task->question, "tries")) + 1;
    json_object_set_new(task->question, "tries", json_integer(tries));
    ask_for(task, tries < WARM_UP_TRIES ? left : "programs");
    json_decref(task->outcome.answer);
    task->outcome.answer = NULL;
    return true;
}

static uint64_t number(const json_t *json, const char *key)
{
    return (uint64_t)json_integer_value(json_object_get(json, key));
}

void warm_up_count(struct warm_up_totals *totals, const json_t *answer)
{
    totals->interrupted += json_object_get(answer, "left") != NULL;
    totals->pictures += number(answer, "pictures");
    totals->shadow_maps_built += number(answer, "shadow_maps_built");
    totals->ray_structures_built += number(answer, "ray_structures_built");
    totals->programs_built += number(answer, "programs_built");
}
