/* SPDX-License-Identifier: MIT */
/* The scenes that a task needs, opened for the worker. Thread: any. */
#ifndef VITRAIL_SERVER_FRONT_TASK_SCENES_H
#define VITRAIL_SERVER_FRONT_TASK_SCENES_H

#include "server/front/render_queue.h"
#include "server/front/scene_store.h"

/* Opens task->scene and those of parts (NULL: none). ERROR_NOT_FOUND points at /scene or /parts and
 * names what is missing. */
MUST_CHECK bool task_open_scenes(struct render_task *task, struct scene_store *store,
                                 const struct part_scenes *parts, struct error *err);

/* Whether they are there, with the same problems: for what is answered without a task. */
MUST_CHECK bool task_has_scenes(struct scene_store *store, const char *scene,
                                const struct part_scenes *parts, struct error *err);

#endif
