/* SPDX-License-Identifier: MIT */
/* vitrail delete: makes the server forget scenes. */
#include <stdio.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/scene_source.h"

struct delete_options {
    struct common_options common;
};

static bool delete_scene(struct session *session, const char *id, struct failure *failure)
{
    struct http_reply reply;
    char path[128], task[128];

    snprintf(path, sizeof path, "/v1/scenes/%s", id);
    snprintf(task, sizeof task, "deleting scene %s", id);
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
    for (size_t i = 0; i < ids->count && is_ok; i++) {
        char id[SCENE_ID_BYTES];
        is_ok = scene_reference_resolve(&session, ids->items[i], id, failure) &&
                delete_scene(&session, id, failure);
    }
    session_end(&session);
    return is_ok;
}

const struct command COMMAND_DELETE = {
    .name = "delete",
    .synopsis = "SCENE...",
    .summary = "Make the server forget scenes",
    .details = "SCENE is an id, the first digits of one (at least 4), or a name.\n"
               "Stops at the first one that fails; one that is not there is a failure.",
    .is_remote = true,
    .operands_min = 1,
    .operands_max = -1,
    .options_bytes = sizeof(struct delete_options),
    .run = delete_run,
};
