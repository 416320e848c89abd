/* SPDX-License-Identifier: MIT */
/* Opens and closes what every command that talks to a server needs. */
#include "clients/vitrail/session.h"

#include <stdlib.h>
#include <string.h>

#define DEFAULT_SERVER "http://127.0.0.1:8090"

enum {
    DEATH_POLL_MS = 20,
    END_POLLS = 50, /* a daemon's connections close a moment before it is known to be dead */
    READY_POLL_MS = 50,
    READY_S = 120 /* the worker's self-test on a cold software rasteriser */
};

/* Asks /readyz until the private server has a device. */
static bool wait_until_ready(struct session *session, struct failure *failure)
{
    const struct http_request request = {.method = "GET", .path = "/readyz"};
    double give_up_s = session->deadline_s > 0 ? session->deadline_s : clock_s() + READY_S;

    for (;;) {
        struct http_reply reply;
        bool is_answered = http_send(session->client, &request, &reply, failure);
        bool is_ready = is_answered && reply.status == 200;
        bool is_late = clock_s() >= give_up_s;
        if (is_answered && !is_ready && is_late) {
            fail_from_reply(failure, &(struct failure_reply){.task = "starting a private server",
                                                             .status = reply.status,
                                                             .body = reply.body ? reply.body : "",
                                                             .body_bytes = reply.body_bytes});
            failure->exit_code = EXIT_CODE_UNAVAILABLE;
        }
        http_reply_finish(&reply);
        session->is_starting = !is_ready;
        if (is_ready)
            return true;
        if (failure->exit_code) {
            struct failure ended = {0};
            if (!spawned_server_check(&session->spawned, &ended))
                *failure = ended;
            return false;
        }
        progress_show(&session->progress, PROGRESS_STAGE_START, 0, 0);
        if (!spawned_server_check(&session->spawned, failure) ||
            !interrupt_sleep(&session->interrupt, READY_POLL_MS, failure))
            return false;
    }
}

bool session_begin(struct session *session, const struct common_options *options,
                   struct failure *failure)
{
    double deadline_s = options->timeout_s.value > 0 ? clock_s() + options->timeout_s.value : 0;
    const char *url = options->server ? options->server : getenv("VITRAIL_SERVER");

    *session = (struct session){.options = options};
    progress_init(&session->progress, options->progress_kind);
    if (!interrupt_init(&session->interrupt, failure))
        return false;
    if (options->spawn) {
        if (!spawned_server_start(&session->spawned,
                                  &(struct spawn_desc){.state_dir = options->state_dir,
                                                       .interrupt = &session->interrupt,
                                                       .progress = &session->progress,
                                                       .deadline_s = deadline_s},
                                  failure))
            return false;
        url = session->spawned.url;
    }
    session->client = http_client_create(
        &(struct http_client_desc){.base_url = url && *url ? url : DEFAULT_SERVER,
                                   .interrupt = &session->interrupt,
                                   .progress = &session->progress,
                                   .deadline_s = deadline_s},
        failure);
    if (!session->client)
        return false;
    session->deadline_s = deadline_s;
    session->is_starting = options->spawn;
    return true;
}

void session_end(struct session *session)
{
    progress_hide(&session->progress);
    http_client_destroy(session->client);
    spawned_server_stop(&session->spawned);
    interrupt_finish(&session->interrupt);
    *session = (struct session){0};
}

/* A private server that broke off: says why it died, and, if it was ready, that the same call may
 * well succeed. */
static void explain_end(struct session *session, struct failure *failure)
{
    struct failure ended = {0}, ignored = {0};

    for (int i = 0; i < END_POLLS && !ended.exit_code; i++)
        if (spawned_server_check(&session->spawned, &ended) &&
            !interrupt_sleep(&session->interrupt, DEATH_POLL_MS, &ignored))
            return;
    if (ended.exit_code)
        *failure = ended;
    if (!session->is_starting)
        failure->exit_code = EXIT_CODE_TEMPORARY;
}

bool session_wait_until_ready(struct session *session, struct failure *failure)
{
    return !session->is_starting || wait_until_ready(session, failure);
}

static bool needs_device(const struct http_request *request)
{
    static const char scenes[] = "/v1/scenes";
    return strncmp(request->path, scenes, sizeof scenes - 1) != 0;
}

bool session_ask(struct session *session, const struct http_request *request, const char *task,
                 struct http_reply *reply, struct failure *failure)
{
    if (needs_device(request) && !session_wait_until_ready(session, failure))
        return false;
    if (http_ask(session->client, request, task, reply, failure))
        return true;
    if (session->spawned.keeper > 0 && failure->http_status == 0 &&
        (failure->exit_code == EXIT_CODE_UNAVAILABLE || failure->exit_code == EXIT_CODE_TEMPORARY))
        explain_end(session, failure);
    return false;
}

json_t *reply_json(const struct http_reply *reply, const char *task, struct failure *failure)
{
    json_t *json =
        json_loadb(reply->body ? reply->body : "", reply->body_bytes, JSON_DECODE_ANY, NULL);

    if (!json)
        fail(failure, EXIT_CODE_UNAVAILABLE,
             "%s was answered without JSON; is this a vitrail server?", task);
    return json;
}

json_t *session_get_json(struct session *session, const char *path, const char *task,
                         struct failure *failure)
{
    struct http_reply reply;
    json_t *json;

    if (!session_ask(session, &(struct http_request){.method = "GET", .path = path}, task, &reply,
                     failure))
        return NULL;
    json = reply_json(&reply, task, failure);
    http_reply_finish(&reply);
    return json;
}
