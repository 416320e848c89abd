/* SPDX-License-Identifier: MIT */
/* Requests to /v1/views. */
#include "clients/vitrail/view_client.h"

#include "clients/vitrail/scene_defaults.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "clients/vitrail/render_watch.h"

bool view_id_is_valid(const char *text, struct failure *failure)
{
    if (strlen(text) == 16 && strspn(text, "0123456789abcdef") == 16)
        return true;
    return fail(failure, EXIT_CODE_USAGE, "'%s' is not a view id: 16 hexadecimal digits", text);
}

const char *view_client_format(const char *path, struct failure *failure)
{
    static const char *const known[][2] = {
        {".png", "png"}, {".jpg", "jpeg"}, {".jpeg", "jpeg"}, {".webp", "webp"}, {".exr", "exr"}};
    const char *dot = strrchr(path, '.');

    for (size_t i = 0; dot && i < sizeof known / sizeof *known; i++)
        if (!strcasecmp(dot, known[i][0]))
            return known[i][1];
    fail(failure, EXIT_CODE_USAGE, "cannot tell the format of '%s': use .png, .jpg, .webp or .exr",
         path);
    return NULL;
}

/* Sends a JSON body; the reply is the caller's to finish. */
static bool send_json(struct session *session, const char *method, const char *path,
                      const json_t *body, const char *task, struct http_reply *reply,
                      struct failure *failure)
{
    char *text = json_dumps(body, JSON_COMPACT | JSON_REAL_PRECISION(17));
    bool is_ok;

    if (!text)
        return fail_no_memory(failure);
    is_ok = session_ask(
        session,
        &(struct http_request){
            .method = method, .path = path, .content_type = "application/json", .body = text},
        task, reply, failure);
    free(text);
    return is_ok;
}

json_t *view_client_make(struct session *session, const char *scene,
                         const struct file_options *options, bool has_defaults, json_t *members,
                         struct failure *failure)
{
    struct scene_push push = {0};
    struct http_reply reply = {0};
    json_t *summary = NULL;
    if (members && scene_source_bring(session, scene, options, members, &push, failure) &&
        (!has_defaults || scene_defaults_ask(session, push.id, members, failure)) &&
        send_json(session, "POST", "/v1/views", members, "the view", &reply, failure))
        summary = reply_json(&reply, "the view", failure);
    http_reply_finish(&reply);
    json_decref(members);
    return summary;
}

bool view_client_patch(struct session *session, const char *id, const json_t *patch,
                       struct failure *failure)
{
    struct http_reply reply = {0};
    char path[128];
    bool is_ok;

    snprintf(path, sizeof path, "/v1/views/%s", id);
    is_ok = send_json(session, "PATCH", path, patch, "the patch", &reply, failure);
    http_reply_finish(&reply);
    return is_ok;
}

bool view_client_delete(struct session *session, const char *id, struct failure *failure)
{
    struct http_reply reply = {0};
    char path[128];
    bool is_ok;

    snprintf(path, sizeof path, "/v1/views/%s", id);
    is_ok = session_ask(session, &(struct http_request){.method = "DELETE", .path = path},
                        "deleting the view", &reply, failure);
    http_reply_finish(&reply);
    return is_ok;
}

bool view_client_save(struct session *session, const char *id, const char *query, const char *path,
                      struct failure *failure)
{
    struct output_file image = {0};
    struct http_reply reply = {0};
    const char *format = view_client_format(path, failure);
    char from[256];
    bool is_ok = format && output_file_open(&image, path, failure);

    snprintf(from, sizeof from, "/v1/views/%s/image?format=%s%s", id, format ? format : "", query);
    is_ok = is_ok &&
            render_watch_ask(session,
                             &(struct http_request){
                                 .method = "GET", .path = from, .accept = "*/*", .sink = &image},
                             "the image", &reply, failure);
    if (is_ok && strncmp(reply.content_type, "image/", 6) != 0)
        is_ok =
            fail(failure, EXIT_CODE_UNAVAILABLE,
                 "the image was answered with '%s'; is this a vitrail server?", reply.content_type);
    is_ok = is_ok && output_file_commit(&image, failure);
    output_file_finish(&image);
    http_reply_finish(&reply);
    return is_ok;
}
