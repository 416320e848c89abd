/* SPDX-License-Identifier: MIT */
/* /v1/views: make, list, read, patch and forget views. */
#include "server/routes/route_query.h"
#include "server/routes/router.h"

#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "protocol/problem.h"
#include "server/http/negotiate.h"
#include "server/routes/text_body.h"

static void open_post(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service, (void)id;
    text_body_open(exchange, "a view", false);
}

static void open_patch(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service, (void)id;
    text_body_open(exchange, "a patch of a view", true);
}

/* ---- replies ---- */

static void add_revision(struct http_exchange *exchange, uint64_t revision)
{
    http_reply_header(exchange, "ETag", "\"%llu\"", (unsigned long long)revision);
}

/* 412 says the present revision as the tag and as a member; all else is a plain problem. */
static void reply_refusal(struct http_exchange *exchange, const struct error *problem,
                          uint64_t revision)
{
    char *text = problem->code == ERROR_PRECONDITION_FAILED
                     ? problem_to_json(problem, http_request_id(exchange))
                     : NULL;
    json_t *json = text ? json_loads(text, 0, NULL) : NULL;
    free(text);
    text = NULL;
    if (json && json_object_set_new(json, "revision", json_integer((json_int_t)revision)) == 0)
        text = json_dumps(json, JSON_COMPACT);
    json_decref(json);
    if (text) {
        add_revision(exchange, revision);
        http_reply_bytes(exchange, error_code_http_status(problem->code), PROBLEM_MEDIA_TYPE, text,
                         strlen(text));
    } else {
        http_reply_error(exchange, problem);
    }
    free(text);
}

static void reply_view(struct http_exchange *exchange, int status, json_t *summary)
{
    add_revision(exchange, (uint64_t)json_integer_value(json_object_get(summary, "revision")));
    reply_json(exchange, status, summary);
}

/* ---- handlers ---- */

static void run_post(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    static const char *const known[] = {"expires_s", NULL};
    struct error problem = {0};
    char address[HTTP_ADDRESS_BYTES];
    const struct text_body *body = route_attached(exchange);
    http_request_address(exchange, address);
    struct view_make_desc desc = {
        .json = body->text ? body->text : "", .length = body->size_bytes, .address = address};
    json_t *summary = http_request_check_query(exchange, known, &problem) &&
                              query_int(exchange, "expires_s", 1, 86400, &desc.expires_s, &problem)
                          ? views_make(service->views, &desc, &problem)
                          : NULL;
    if (!summary) {
        http_reply_error(exchange, &problem);
        return;
    }
    http_reply_header(exchange, "Location", "/v1/views/%s",
                      json_string_value(json_object_get(summary, "id")));
    reply_view(exchange, 201, summary);
}

static void run_list(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    json_t *views = views_list(service->views);
    reply_json(exchange, 200, views ? json_pack("{s:o}", "views", views) : NULL);
}

static void run_get(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    char tag[32];
    json_t *view = views_get(service->views, id, true, &problem);
    if (!view) {
        http_reply_error(exchange, &problem);
        return;
    }
    snprintf(tag, sizeof tag, "\"%lld\"",
             (long long)json_integer_value(json_object_get(view, "revision")));
    http_reply_header(exchange, "Cache-Control", "private, no-cache");
    if (reply_if_unchanged(exchange, tag))
        json_decref(view);
    else
        reply_json(exchange, 200, view);
}

static void run_patch(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    uint64_t revision = 0;
    const struct text_body *body = route_attached(exchange);
    const struct view_condition condition = {.if_match = http_request_header(exchange, "If-Match")};
    struct view_patch patch = {
        .json = view_patch_load(body->text ? body->text : "", body->size_bytes, &problem)};
    json_t *summary = patch.json
                          ? views_patch(service->views, id, &patch, &condition, &revision, &problem)
                          : NULL;
    json_decref(patch.json);
    if (summary)
        reply_view(exchange, 200, summary);
    else
        reply_refusal(exchange, &problem, revision);
}

static void run_delete(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    uint64_t revision = 0;
    const struct view_condition condition = {.if_match = http_request_header(exchange, "If-Match")};
    if (views_remove(service->views, id, &condition, &revision, &problem))
        http_reply_empty(exchange, 204);
    else
        reply_refusal(exchange, &problem, revision);
}

const struct route routes_views[] = {
    {"/v1/views", {{HTTP_GET, NULL, run_list}, {HTTP_POST, open_post, run_post}}},
    {"/v1/views/{id}",
     {{HTTP_GET, NULL, run_get},
      {HTTP_PATCH, open_patch, run_patch},
      {HTTP_DELETE, NULL, run_delete}}},
    {0},
};
