/* SPDX-License-Identifier: MIT */
/* Opening what a task shows. */
#include "server/front/task_scenes.h"

static int open_scene(struct scene_store *store, const char *id, const char *pointer,
                      struct error *err)
{
    struct error problem = {0};
    int fd = scene_store_open_blob(store, id, &problem);
    if (fd < 0)
        error_set_at(err, problem.code, pointer, "%s", problem.message);
    return fd;
}

bool task_open_scenes(struct render_task *task, struct scene_store *store,
                      const struct part_scenes *parts, struct error *err)
{
    task->blob_fd = open_scene(store, task->scene, "/scene", err);
    if (task->blob_fd < 0)
        return false;
    for (int i = 0; parts && i < parts->count; i++) {
        int fd = open_scene(store, parts->ids[i], "/parts", err);
        if (fd < 0)
            return false;
        task->part_fds[task->parts.count] = fd;
        if (!part_scenes_add(&task->parts, parts->ids[i]))
            return error_set(err, ERROR_INTERNAL, "more scenes of parts than a task holds");
    }
    return true;
}

bool task_has_scenes(struct scene_store *store, const char *scene, const struct part_scenes *parts,
                     struct error *err)
{
    static const char gone[] = "there is no scene '%.64s'";
    if (!scene_store_has(store, scene))
        return error_set_at(err, ERROR_NOT_FOUND, "/scene", gone, scene);
    for (int i = 0; parts && i < parts->count; i++)
        if (!scene_store_has(store, parts->ids[i]))
            return error_set_at(err, ERROR_NOT_FOUND, "/parts", gone, parts->ids[i]);
    return true;
}
