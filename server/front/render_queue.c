/* SPDX-License-Identifier: MIT */
/* One list per priority. */
#include "server/front/render_queue.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct render_task *render_task_create(void)
{
    struct render_task *task = calloc(1, sizeof *task);
    if (task)
        task->request_fd = task->blob_fd = task->environment_fd = task->reference_fd =
            task->outcome.image_fd = -1;
    return task;
}

void render_task_destroy(struct render_task *task)
{
    if (!task)
        return;
    int fds[] = {task->request_fd, task->blob_fd, task->environment_fd, task->reference_fd,
                 task->outcome.image_fd};
    for (size_t i = 0; i < sizeof fds / sizeof fds[0]; i++)
        if (fds[i] >= 0)
            close(fds[i]);
    for (int i = 0; i < task->resources.scene_count; i++)
        close(task->part_fds[i]);
    free(task->outcome.stats);
    json_decref(task->outcome.answer);
    json_decref(task->question);
    json_decref(task->offer);
    json_decref(task->stated_error);
    json_decref(task->asked_quality);
    free(task);
}

bool render_queue_push(struct render_queue *queue, struct render_task *task, size_t max_count)
{
    if (queue->count >= max_count)
        return false;
    struct render_task **at = &queue->first[task->priority];
    while (*at)
        at = &(*at)->next;
    *at = task;
    task->next = NULL;
    queue->count++;
    return true;
}

void render_queue_push_back(struct render_queue *queue, struct render_task *task)
{
    task->next = queue->first[task->priority];
    queue->first[task->priority] = task;
    queue->count++;
}

struct render_task *render_queue_pop(struct render_queue *queue)
{
    for (int i = 0; i < RENDER_PRIORITY_COUNT; i++)
        if (queue->first[i])
            return render_queue_remove(queue, queue->first[i]->ticket);
    return NULL;
}

struct render_task *render_queue_remove(struct render_queue *queue, uint64_t ticket)
{
    for (int i = 0; i < RENDER_PRIORITY_COUNT; i++)
        for (struct render_task **at = &queue->first[i]; *at; at = &(*at)->next)
            if ((*at)->ticket == ticket) {
                struct render_task *task = *at;
                *at = task->next;
                task->next = NULL;
                queue->count--;
                return task;
            }
    return NULL;
}

const struct render_task *render_queue_find(const struct render_queue *queue, uint64_t ticket)
{
    for (int i = 0; i < RENDER_PRIORITY_COUNT; i++)
        for (const struct render_task *task = queue->first[i]; task; task = task->next)
            if (task->ticket == ticket)
                return task;
    return NULL;
}

const struct render_task *render_queue_find_request(const struct render_queue *queue,
                                                    const char *request_id)
{
    const struct render_task *newest = NULL;
    for (int i = 0; i < RENDER_PRIORITY_COUNT; i++)
        for (const struct render_task *task = queue->first[i]; task; task = task->next)
            if (task->request_id && strcmp(task->request_id, request_id) == 0 &&
                (!newest || task->ticket > newest->ticket))
                newest = task;
    return newest;
}

int64_t render_queue_oldest_us(const struct render_queue *queue, int64_t otherwise)
{
    int64_t oldest = otherwise;
    for (int i = 0; i < RENDER_PRIORITY_COUNT; i++)
        for (const struct render_task *task = queue->first[i]; task; task = task->next)
            if (task->queued_us < oldest)
                oldest = task->queued_us;
    return oldest;
}
