/* SPDX-License-Identifier: MIT */
/* What jobs need of what clients uploaded: it is kept until they have ended. */
#include <string.h>

#include "server/front/task_resources.h"
#include "server/jobs/jobs_internal.h"

bool farm_job_has_resources(const struct jobs *jobs, const struct farm_job *job, struct error *err)
{
    const struct render_request *render = &job->request.render;
    struct request_resources needed;
    if (!render_request_resources(render, &needed))
        return error_set_at(err, ERROR_TOO_LARGE, "/view/parts",
                            "/view/parts: more than %d different scenes", LIMIT_PART_SCENES);
    return task_has_resources(jobs->desc.resources, render->scene, &needed, err);
}

static bool needs(const struct farm_job *job, enum resource_kind kind, const char *id)
{
    struct request_resources needed;
    if (farm_job_has_ended(job) || !render_request_resources(&job->request.render, &needed))
        return false;
    if (kind == RESOURCE_ENVIRONMENT)
        return strcmp(needed.environment, id) == 0;
    bool is_needed = strcmp(job->request.render.scene, id) == 0;
    for (int i = 0; i < needed.scene_count; i++)
        is_needed |= strcmp(needed.scenes[i], id) == 0;
    return is_needed;
}

/* Under the mutex. */
static bool is_free(const struct jobs *jobs, enum resource_kind kind, const char *id,
                    struct error *err)
{
    const char *first = "";
    int count = 0;
    char others[32] = "";
    for (int i = 0; i < jobs->count; i++)
        if (needs(jobs->list[i], kind, id) && count++ == 0)
            first = jobs->list[i]->record.id;
    if (count > 1)
        snprintf(others, sizeof others, " and %d more", count - 1);
    return count == 0 ||
           error_set(err, ERROR_CONFLICT,
                     "%s '%.64s' is needed by job %s%s, which %s not ended: cancel %s first, or "
                     "delete it all the same (?force=true)",
                     resource_info(kind)->noun, id, first, others, count > 1 ? "have" : "has",
                     count > 1 ? "them" : "it");
}

bool jobs_remove_resource(struct jobs *jobs, enum resource_kind kind, const char *id,
                          bool is_forced, struct error *err)
{
    pthread_mutex_lock(&jobs->disk); /* no job is accepted between the look and the removal */
    pthread_mutex_lock(&jobs->mutex);
    bool is_good = is_forced || is_free(jobs, kind, id, err);
    pthread_mutex_unlock(&jobs->mutex);
    is_good =
        is_good && resource_store_remove(resources_store(jobs->desc.resources, kind), id, err);
    pthread_mutex_unlock(&jobs->disk);
    return is_good;
}
