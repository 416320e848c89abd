/* SPDX-License-Identifier: MIT */
/* What a task needs of what clients uploaded, opened for the worker. Thread: any. */
#ifndef VITRAIL_SERVER_FRONT_TASK_RESOURCES_H
#define VITRAIL_SERVER_FRONT_TASK_RESOURCES_H

#include "server/front/render_queue.h"
#include "server/front/resources.h"

/* Opens task->scene and what is needed beside it (NULL: nothing). ERROR_NOT_FOUND points at /scene,
 * /parts or /environment/image and names what is missing. */
MUST_CHECK bool task_open_resources(struct render_task *task, const struct resources *resources,
                                    const struct request_resources *needed, struct error *err);

/* Whether they are there, with the same problems: for what is answered without a task. */
MUST_CHECK bool task_has_resources(const struct resources *resources, const char *scene,
                                   const struct request_resources *needed, struct error *err);

#endif
