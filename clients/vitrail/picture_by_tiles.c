/* SPDX-License-Identifier: MIT */
/* A job of one frame: submitted, waited for, fetched, forgotten. */
#include "clients/vitrail/picture_by_tiles.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/vitrail/job_watch.h"
#include "protocol/picture_tiles.h"

enum { TILE_PX = 2048, PATH_BYTES = 128 };

static const char noun[] = "the job of tiles";

bool picture_is_by_tiles(const json_t *request)
{
    return !json_is_object(json_object_get(request, "tile")) &&
           picture_needs_tiles(json_integer_value(json_object_get(request, "width")),
                               json_integer_value(json_object_get(request, "height")));
}

/* What a request says of its image and a view does not. */
static json_t *take_output(json_t *view)
{
    static const char *const of_image[] = {"outputs", "format", "quality_percent"};
    static const char *const others[] = {"output", "provenance", "tile", "scene"};
    json_t *output = json_pack("{s:s}", "name", "picture");
    json_t *single = json_object_get(view, "output");
    if (json_is_string(single))
        json_object_set_new(output, "outputs", json_pack("[O]", single));
    for (size_t i = 0; i < sizeof of_image / sizeof *of_image; i++) {
        json_t *value = json_object_get(view, of_image[i]);
        if (value && !json_is_null(value))
            json_object_set(output, of_image[i], value);
        json_object_del(view, of_image[i]);
    }
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        json_object_del(view, others[i]);
    return output;
}

static char *job_of(const json_t *request, json_t *tiles)
{
    json_t *scene = json_object_get(request, "scene");
    json_t *provenance = json_object_get(request, "provenance");
    json_t *view = json_deep_copy(request), *output = take_output(view);
    json_t *job = json_pack("{s:O?,s:o,s:[o],s:o,s:b,s:b}", "scene", scene, "view", view, "outputs",
                            output, "tiles", tiles ? json_incref(tiles) : json_integer(TILE_PX),
                            "animate", 0, "provenance", !json_is_false(provenance));
    char *text = job ? json_dumps(job, JSON_COMPACT) : NULL;
    json_decref(job);
    return text;
}

static bool submit(struct session *session, const char *body, char path[PATH_BYTES],
                   struct failure *failure)
{
    struct http_reply reply = {0};
    bool is_ok = session_ask(
        session,
        &(struct http_request){
            .method = "POST", .path = "/v1/jobs", .content_type = "application/json", .body = body},
        noun, &reply, failure);
    json_t *job = is_ok ? reply_json(&reply, noun, failure) : NULL;
    const char *id = json_string_value(json_object_get(job, "id"));
    snprintf(path, PATH_BYTES, "/v1/jobs/%.32s", id ? id : "");
    is_ok = job && (id || fail(failure, EXIT_CODE_UNAVAILABLE, "the server names no job"));
    json_decref(job);
    http_reply_finish(&reply);
    return is_ok;
}

static bool wait(struct session *session, const char *path, struct failure *failure)
{
    const struct job_watch watch = {
        .session = session, .path = path, .noun = noun, .parts = "tiles"};
    json_t *job = job_watch_wait(&watch, failure);
    bool is_ok = job && job_watch_judge(&watch, job, failure);
    json_decref(job);
    return is_ok;
}

static bool wait_and_fetch(struct session *session, const char *path, struct output_file *image,
                           struct failure *failure)
{
    struct http_reply reply = {0};
    char file[PATH_BYTES + 32];
    snprintf(file, sizeof file, "%s/frames/1/picture", path);
    bool is_ok = wait(session, path, failure) &&
                 session_ask(session,
                             &(struct http_request){.method = "GET",
                                                    .path = file,
                                                    .accept = "*/*",
                                                    .sink = image,
                                                    .receiving = PROGRESS_STAGE_RECEIVE},
                             "the picture", &reply, failure);
    http_reply_finish(&reply);
    return is_ok;
}

/* Cancels it first where it has not ended, after a signal, too. That it cannot be forgotten is no
 * failure. */
static void forget(struct session *session, const char *path)
{
    char queries[2][PATH_BYTES + 16];
    int signal = session->interrupt.signal;
    session->interrupt.signal = 0; /* another one ends this, too */
    snprintf(queries[0], sizeof queries[0], "%s", path);
    snprintf(queries[1], sizeof queries[1], "%s?forget=true", path);
    for (int i = 0; i < 2; i++) {
        struct http_reply reply = {0};
        struct failure ignored = {0};
        (void)!session_ask(session, &(struct http_request){.method = "DELETE", .path = queries[i]},
                           noun, &reply, &ignored);
        http_reply_finish(&reply);
    }
    session->interrupt.signal = signal ? signal : session->interrupt.signal;
}

bool picture_make_by_tiles(struct session *session, const json_t *request, json_t *tiles,
                           struct output_file *image, struct failure *failure)
{
    char path[PATH_BYTES];
    char *body = job_of(request, tiles);
    if (!body)
        return fail_no_memory(failure);
    bool is_submitted =
        session_wait_until_ready(session, failure) && submit(session, body, path, failure);
    bool is_ok = is_submitted && wait_and_fetch(session, path, image, failure);
    if (is_submitted)
        forget(session, path);
    free(body);
    return is_ok;
}
