/* SPDX-License-Identifier: MIT */
/* vitrail delete: makes the server forget scenes and environment maps. */
#include <stdio.h>
#include <string.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/scene_source.h"

struct delete_options {
    struct common_options common;
    bool force;
};

static bool delete_one(struct session *session, const char *text, bool is_forced,
                       struct failure *failure)
{
    bool is_map = strncmp(text, "environment:", 12) == 0;
    char id[SCENE_ID_BYTES];
    struct http_reply reply;
    char path[128], task[128];

    if (!(is_map ? environment_reference_resolve(session, text, id, failure)
                 : scene_reference_resolve(session, text, id, failure)))
        return false;
    snprintf(path, sizeof path, "/v1/%s/%s%s", is_map ? "environments" : "scenes", id,
             is_forced ? "?force=true" : "");
    snprintf(task, sizeof task, "deleting %s %s", is_map ? "environment map" : "scene", id);
    if (!session_ask(session, &(struct http_request){.method = "DELETE", .path = path}, task,
                     &reply, failure))
        return false;
    http_reply_finish(&reply);
    return true;
}

static bool delete_run(void *context, const struct text_list *ids, struct failure *failure)
{
    const struct delete_options *options = context;
    struct session session = {0};
    bool is_ok;

    is_ok = session_begin(&session, &options->common, failure);
    for (size_t i = 0; i < ids->count && is_ok; i++)
        is_ok = delete_one(&session, ids->items[i], options->force, failure);
    session_end(&session);
    return is_ok;
}

static const struct option OPTIONS[] = {
    {OPTION_FLAG, "force", 0, NULL, "also what a job that has not ended needs: its frames fail",
     offsetof(struct delete_options, force)},
    {0},
};

const struct command COMMAND_DELETE = {
    .name = "delete",
    .synopsis = "SCENE|environment:MAP...",
    .summary = "Make the server forget scenes and environment maps",
    .details = "SCENE and MAP are an id, the first digits of one (at least 4), or a name.\n"
               "Stops at the first one that fails; one that is not there is a failure.",
    .options = OPTIONS,
    .is_remote = true,
    .operands_min = 1,
    .operands_max = -1,
    .options_bytes = sizeof(struct delete_options),
    .run = delete_run,
};
