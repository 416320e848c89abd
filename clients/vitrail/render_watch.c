/* SPDX-License-Identifier: MIT */
/* An id of our own for the request, and what GET /v1/renders/{id} or /v1/uploads/{id} says of it.
 */
#include "clients/vitrail/render_watch.h"

#include <jansson.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>

enum { ID_BYTES = sizeof "vitrail-0123456789abcdef", PATH_BYTES = ID_BYTES + 16 };

/* A request with what is asked beside it. */
struct watched {
    struct http_request request;
    struct http_side side;
    char id[ID_BYTES], path[PATH_BYTES];
};

/* A server that says anything else reports no progress. */
static void take_as(struct progress *progress, enum progress_stage stage, const char *body)
{
    json_t *status = json_loads(body, 0, NULL);
    const json_t *reported = json_object_get(status, "progress");
    const char *state = json_string_value(json_object_get(status, "state"));
    const char *pass = json_string_value(json_object_get(reported, "stage"));
    const json_t *left_s = json_object_get(reported, "left_s");
    struct progress_render render = {.share = json_number_value(json_object_get(reported, "share")),
                                     .left_s =
                                         json_is_number(left_s) ? json_number_value(left_s) : -1};

    text_copy_printable(render.state, sizeof render.state, state ? state : "");
    text_copy_printable(render.pass, sizeof render.pass, pass ? pass : "");
    progress_note_render(progress, &render);
    progress_show(progress, stage, 0, 0);
    json_decref(status);
}

static void take_render(void *context, const char *body)
{
    take_as(context, PROGRESS_STAGE_RENDER, body);
}

static void take_upload(void *context, const char *body)
{
    take_as(context, PROGRESS_STAGE_DECODE, body);
}

/* Nothing is asked beside the request where nobody is shown the progress. */
static void watch(struct watched *watched, const struct http_request *request,
                  struct progress *progress, const char *folder,
                  void (*take)(void *context, const char *body))
{
    uint64_t bits;

    progress_note_render(progress, NULL);
    watched->request = *request;
    if (progress->kind == PROGRESS_NONE || getrandom(&bits, sizeof bits, 0) != sizeof bits)
        return;
    snprintf(watched->id, sizeof watched->id, "vitrail-%016llx", (unsigned long long)bits);
    snprintf(watched->path, sizeof watched->path, "/v1/%s/%s", folder, watched->id);
    watched->side = (struct http_side){.path = watched->path, .take = take, .context = progress};
    watched->request.request_id = watched->id;
    watched->request.side = &watched->side;
}

/* What is noted of this request goes with it. */
static bool ask(struct session *session, const struct watched *watched, const char *task,
                struct http_reply *reply, struct failure *failure)
{
    bool is_ok = session_ask(session, &watched->request, task, reply, failure);
    progress_note_render(&session->progress, NULL);
    return is_ok;
}

bool upload_watch_ask(struct session *session, const struct http_request *request, const char *task,
                      struct http_reply *reply, struct failure *failure)
{
    struct watched watched;

    watch(&watched, request, &session->progress, "uploads", take_upload);
    watched.request.sending = PROGRESS_STAGE_UPLOAD;
    watched.request.waiting = PROGRESS_STAGE_DECODE;
    return ask(session, &watched, task, reply, failure);
}

bool render_watch_ask(struct session *session, const struct http_request *request, const char *task,
                      struct http_reply *reply, struct failure *failure)
{
    struct watched watched;

    watch(&watched, request, &session->progress, "renders", take_render);
    watched.request.waiting = PROGRESS_STAGE_RENDER;
    watched.request.receiving = PROGRESS_STAGE_RECEIVE;
    if (!session_wait_until_ready(session, failure))
        return false;
    progress_show(&session->progress, PROGRESS_STAGE_RENDER, 0, 0);
    return ask(session, &watched, task, reply, failure);
}
