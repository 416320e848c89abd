/* SPDX-License-Identifier: MIT */
/* Opening what a task shows. */
#include "server/front/task_resources.h"

#include <string.h>

static int open_blob(struct resource_store *store, const char *id, const char *pointer,
                     struct error *err)
{
    struct error problem = {0};
    int fd = resource_store_open_blob(store, id, &problem);
    if (fd < 0)
        error_set_at(err, problem.code, pointer, "%s", problem.message);
    return fd;
}

bool task_open_resources(struct render_task *task, const struct resources *resources,
                         const struct request_resources *needed, struct error *err)
{
    task->blob_fd = open_blob(resources->scenes, task->scene, "/scene", err);
    if (task->blob_fd < 0)
        return false;
    for (int i = 0; needed && i < needed->scene_count; i++) {
        int fd = open_blob(resources->scenes, needed->scenes[i], "/parts", err);
        if (fd < 0)
            return false;
        task->part_fds[task->resources.scene_count] = fd;
        if (!request_resources_add_scene(&task->resources, needed->scenes[i]))
            return error_set(err, ERROR_INTERNAL, "more scenes of parts than a task holds");
    }
    if (needed)
        memcpy(task->resources.environment, needed->environment, sizeof needed->environment);
    if (!request_environment_is_uploaded(task->resources.environment))
        return true;
    task->environment_fd =
        open_blob(resources->environments, needed->environment, "/environment/image", err);
    return task->environment_fd >= 0;
}

bool task_has_resources(const struct resources *resources, const char *scene,
                        const struct request_resources *needed, struct error *err)
{
    static const char gone[] = "there is no scene '%.64s'";
    if (!resource_store_has(resources->scenes, scene))
        return error_set_at(err, ERROR_NOT_FOUND, "/scene", gone, scene);
    for (int i = 0; needed && i < needed->scene_count; i++)
        if (!resource_store_has(resources->scenes, needed->scenes[i]))
            return error_set_at(err, ERROR_NOT_FOUND, "/parts", gone, needed->scenes[i]);
    return !needed || !request_environment_is_uploaded(needed->environment) ||
           resource_store_has(resources->environments, needed->environment) ||
           error_set_at(err, ERROR_NOT_FOUND, "/environment/image",
                        "there is no environment map '%.64s'", needed->environment);
}
