/* SPDX-License-Identifier: MIT */
/* An id of our own for the request, and what GET /v1/renders/{id} says of it. */
#include "clients/vitrail/render_watch.h"

#include <jansson.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>

enum { ID_BYTES = sizeof "vitrail-0123456789abcdef" };

/* A server that says anything else tells no progress. */
static void take(void *context, const char *body)
{
    struct progress *progress = context;
    json_t *status = json_loads(body, 0, NULL);
    const json_t *told = json_object_get(status, "progress");
    const char *state = json_string_value(json_object_get(status, "state"));
    const char *pass = json_string_value(json_object_get(told, "stage"));
    const json_t *left_s = json_object_get(told, "left_s");
    struct progress_render render = {.share = json_number_value(json_object_get(told, "share")),
                                     .left_s =
                                         json_is_number(left_s) ? json_number_value(left_s) : -1};

    text_copy_printable(render.state, sizeof render.state, state ? state : "");
    text_copy_printable(render.pass, sizeof render.pass, pass ? pass : "");
    progress_note_render(progress, &render);
    progress_show(progress, PROGRESS_STAGE_RENDER, 0, 0);
    json_decref(status);
}

bool render_watch_ask(struct session *session, const struct http_request *request, const char *task,
                      struct http_reply *reply, struct failure *failure)
{
    struct progress *progress = &session->progress;
    struct http_request watched = *request;
    char id[ID_BYTES], path[ID_BYTES + sizeof "/v1/renders/"];
    uint64_t bits;
    const struct http_side side = {.path = path, .take = take, .context = progress};
    bool is_ok;

    watched.waiting = PROGRESS_STAGE_RENDER;
    watched.receiving = PROGRESS_STAGE_RECEIVE;
    if (progress->kind != PROGRESS_NONE && getrandom(&bits, sizeof bits, 0) == sizeof bits) {
        snprintf(id, sizeof id, "vitrail-%016llx", (unsigned long long)bits);
        snprintf(path, sizeof path, "/v1/renders/%s", id);
        watched.request_id = id;
        watched.side = &side;
    }
    if (!session_wait_until_ready(session, failure))
        return false;
    progress_note_render(progress, NULL);
    progress_show(progress, PROGRESS_STAGE_RENDER, 0, 0);
    is_ok = session_ask(session, &watched, task, reply, failure);
    progress_note_render(progress, NULL);
    return is_ok;
}
