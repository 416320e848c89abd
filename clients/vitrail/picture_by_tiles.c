/* SPDX-License-Identifier: MIT */
/* A job of one frame: submitted, waited for, fetched, forgotten. */
#include "clients/vitrail/picture_by_tiles.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/picture_tiles.h"

enum { TILE_PX = 2048, POLL_MS = 500, PATH_BYTES = 128 };

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
        "the job of tiles", &reply, failure);
    json_t *job = is_ok ? reply_json(&reply, "the job of tiles", failure) : NULL;
    const char *id = json_string_value(json_object_get(job, "id"));
    snprintf(path, PATH_BYTES, "/v1/jobs/%.32s", id ? id : "");
    is_ok = job && (id || fail(failure, EXIT_CODE_UNAVAILABLE, "the server names no job"));
    json_decref(job);
    http_reply_finish(&reply);
    return is_ok;
}

/* True in *is_over once it has ended, or waits for somebody. */
static bool look(struct session *session, const char *path, bool *is_over, struct failure *failure)
{
    json_t *job = session_get_json(session, path, "the job of tiles", failure);
    const json_t *tiles = json_object_get(job, "tiles"), *problem = json_object_get(job, "problem");
    const char *state = json_string_value(json_object_get(job, "state"));
    const char *detail = json_string_value(json_object_get(problem, "detail"));
    bool is_paused = json_is_true(json_object_get(job, "paused"));
    if (!job)
        return false;
    progress_show(&session->progress, PROGRESS_STAGE_FRAMES,
                  (uint64_t)json_integer_value(json_object_get(tiles, "done")),
                  (uint64_t)json_integer_value(json_object_get(tiles, "count")));
    *is_over = is_paused || json_is_string(json_object_get(job, "ended"));
    bool is_ok = !*is_over || (state && !strcmp(state, "done")) ||
                 fail(failure, is_paused ? EXIT_CODE_TEMPORARY : EXIT_CODE_REFUSED,
                      "the picture was not made in tiles: %s", detail ? detail : "no reason");
    json_decref(job);
    return is_ok;
}

static bool wait_and_fetch(struct session *session, const char *path, struct output_file *image,
                           struct failure *failure)
{
    struct http_reply reply = {0};
    char file[PATH_BYTES + 32];
    bool is_over = false, is_ok = true;
    while (is_ok && !is_over)
        is_ok = look(session, path, &is_over, failure) &&
                (is_over || interrupt_sleep(&session->interrupt, POLL_MS, failure));
    snprintf(file, sizeof file, "%s/frames/1/picture", path);
    is_ok = is_ok && session_ask(session,
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
                           "the job of tiles", &reply, &ignored);
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
