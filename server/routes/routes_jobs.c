/* SPDX-License-Identifier: MIT */
/* /v1/jobs: submitting, reading, changing and ending jobs. Their results: routes_job_results.c. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json_read.h"
#include "protocol/limits.h"
#include "server/http/negotiate.h"
#include "server/jobs/jobs.h"
#include "server/routes/route_query.h"
#include "server/routes/router.h"
#include "server/routes/text_body.h"

enum { WAIT_MAX_S = 60, FRAMES_DEFAULT = 100, FRAMES_MAX = 1000, TAG_BYTES = 64 };

static void open_job(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service, (void)id;
    text_body_open(exchange, "a job", false);
}

static void open_change(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service, (void)id;
    text_body_open(exchange, "a change of a job", true);
}

/* The tag of a job's document is the number of its last change. */
static void reply_job(struct service *service, struct http_exchange *exchange, int status,
                      const char *id)
{
    struct error problem = {0};
    char tag[TAG_BYTES];
    json_t *job = jobs_get(service->jobs, id, &problem);
    if (!job) {
        http_reply_error(exchange, &problem);
        return;
    }
    snprintf(tag, sizeof tag, "\"%s-%lld\"", id,
             (long long)json_integer_value(json_object_get(job, "sequence")));
    http_reply_header(exchange, "Cache-Control", "private, no-cache");
    if (status == 200 && reply_if_unchanged(exchange, tag)) {
        json_decref(job);
        return;
    }
    if (status != 200)
        http_reply_header(exchange, "ETag", "%s", tag);
    reply_json(exchange, status, job);
}

/* ---- POST ---- */

static void run_post(struct service *service, struct http_exchange *exchange, const char *unused)
{
    (void)unused;
    struct error problem = {0};
    struct text_body *body = route_attached(exchange);
    const char *key = http_request_header(exchange, "Idempotency-Key");
    char id[JOB_ID_BYTES];
    bool is_new;
    if (!jobs_submit(service->jobs, body->text ? body->text : "", body->size_bytes, key, id,
                     &is_new, &problem)) {
        http_reply_error(exchange, &problem);
        return;
    }
    http_reply_header(exchange, "Location", "/v1/jobs/%s", id);
    if (!is_new)
        http_reply_header(exchange, "Idempotency-Replayed", "true");
    reply_job(service, exchange, 202, id);
}

/* ---- GET ---- */

static void run_list(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct error problem = {0};
    json_t *list = jobs_list(service->jobs, &problem);
    if (list)
        reply_json(exchange, 200, json_pack("{s:o}", "jobs", list));
    else
        http_reply_error(exchange, &problem);
}

/* A GET that waits: the exchange owns it. */
struct job_get {
    struct service *service;
    struct http_exchange *exchange;
    char id[JOB_ID_BYTES];
};

/* On the thread of the jobs. */
static void waited(void *context)
{
    struct job_get *get = context;
    struct http_exchange *exchange = get->exchange;
    reply_job(get->service, exchange, 200, get->id);
    http_resume(exchange);
}

/* The seconds of "Prefer: wait=N" (RFC 7240 4.3), at most WAIT_MAX_S; 0: none. */
static int wait_of(const struct http_exchange *exchange)
{
    const char *prefer = http_request_header(exchange, "Prefer");
    const char *wait = prefer ? strstr(prefer, "wait=") : NULL;
    int seconds = wait ? atoi(wait + 5) : 0;
    return seconds < 0 ? 0 : seconds > WAIT_MAX_S ? WAIT_MAX_S : seconds;
}

/* The number in a tag of this job; 0: there is none. */
static uint32_t sequence_of(const struct http_exchange *exchange, const char *id)
{
    const char *tag = http_request_header(exchange, "If-None-Match");
    const char *found = tag ? strstr(tag, id) : NULL;
    return found && found[strlen(id)] == '-' ? (uint32_t)strtoul(found + strlen(id) + 1, NULL, 10)
                                             : 0;
}

static void run_get(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    int seconds = wait_of(exchange);
    struct job_get *get = seconds > 0 && strlen(id) < JOB_ID_BYTES ? calloc(1, sizeof *get) : NULL;
    if (!get) {
        reply_job(service, exchange, 200, id);
        return;
    }
    *get = (struct job_get){.service = service, .exchange = exchange};
    memcpy(get->id, id, strlen(id) + 1);
    route_attach(exchange, get, free);
    uint64_t ticket = jobs_new_ticket(service->jobs);
    http_reply_header(exchange, "Preference-Applied", "wait=%d", seconds);
    http_wait(exchange, jobs_stop_waiting, service->jobs, ticket);
    const struct job_wait wait = {.id = get->id,
                                  .sequence = sequence_of(exchange, id),
                                  .wait_ms = 1000 * (int64_t)seconds,
                                  .context = get,
                                  .done = waited};
    if (jobs_wait(service->jobs, &wait, ticket, &problem))
        return;
    http_reply_error(exchange, &problem);
    http_resume(exchange);
}

static void run_frames(struct service *service, struct http_exchange *exchange, const char *id)
{
    static const char *const known[] = {"first", "count", NULL};
    struct error problem = {0};
    int first = 0, count = FRAMES_DEFAULT;
    json_t *frames = NULL;
    if (http_request_check_query(exchange, known, &problem) &&
        query_int(exchange, "first", 0, LIMIT_JOB_FRAMES, &first, &problem) &&
        query_int(exchange, "count", 1, FRAMES_MAX, &count, &problem))
        frames = jobs_get_frames(service->jobs, id, first, count, &problem);
    if (frames)
        reply_json(exchange, 200, frames);
    else
        http_reply_error(exchange, &problem);
}

/* ---- PATCH ---- */

static bool read_change(const struct text_body *body, struct job_change *change, struct error *err)
{
    static const char *const known[] = {"paused", "priority", "retry_failed", NULL};
    json_t *value = json_load_checked(body->text ? body->text : "", body->size_bytes,
                                      LIMIT_REQUEST_JSON_BYTES, err);
    if (!value)
        return false;
    struct json_node root = json_root(value, err);
    *change = (struct job_change){0};
    bool is_good = json_expect_object(&root, known);
    if (is_good) {
        struct json_node paused = json_member(&root, "paused");
        struct json_node priority = json_member(&root, "priority");
        struct json_node retry = json_member(&root, "retry_failed");
        change->has_paused = paused.value;
        change->has_priority = priority.value;
        is_good = json_read_bool(&paused, &change->is_paused) &&
                  json_read_int(&priority, 0, 100, &change->priority) &&
                  json_read_bool(&retry, &change->retries);
    }
    json_decref(value);
    return is_good;
}

static void run_patch(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    struct job_change change;
    if (read_change(route_attached(exchange), &change, &problem) &&
        jobs_change(service->jobs, id, &change, &problem))
        reply_job(service, exchange, 200, id);
    else
        http_reply_error(exchange, &problem);
}

/* ---- DELETE ---- */

/* Cancels; with ?forget=true removes one that has ended. */
static void run_delete(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    bool must_forget = false;
    bool is_good = query_flag(exchange, "forget", &must_forget, &problem) &&
                   (must_forget ? jobs_forget(service->jobs, id, &problem)
                                : jobs_cancel(service->jobs, id, &problem));
    if (!is_good)
        http_reply_error(exchange, &problem);
    else if (must_forget)
        http_reply_empty(exchange, 204);
    else
        reply_job(service, exchange, 200, id);
}

const struct route routes_jobs[] = {
    {"/v1/jobs", {{HTTP_GET, NULL, run_list}, {HTTP_POST, open_job, run_post}}},
    {"/v1/jobs/{id}",
     {{HTTP_GET, NULL, run_get},
      {HTTP_PATCH, open_change, run_patch},
      {HTTP_DELETE, NULL, run_delete}}},
    {"/v1/jobs/{id}/frames", {{HTTP_GET, NULL, run_frames}}},
    {0},
};
