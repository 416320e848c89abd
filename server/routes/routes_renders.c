/* SPDX-License-Identifier: MIT */
/* /v1/renders and /v1/frames: one-shot images, how far they are and what they cost. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "protocol/limits.h"
#include "protocol/plan_document.h"
#include "protocol/request_tree.h"
#include "server/base/ipc.h"
#include "server/front/task_resources.h"
#include "server/http/negotiate.h"
#include "server/mapping/format_mapping.h"
#include "server/routes/router.h"
#include "server/routes/text_body.h"
#include "server/views/image_tag.h"

/* A POST on its way: the exchange owns it. */
struct render_post {
    struct service *service;
    struct http_exchange *exchange;
    struct text_body body;
    char *canonical;                /* the request, before anything is chosen */
    char digest[DIGEST_TEXT_BYTES]; /* of it, and of what is chosen from */
    bool has_target;                /* the picture's tag is known when it is there */
    enum image_format format;
    int plan_format; /* enum plan_format: the plan is asked for; -1: the image */
    uint64_t ticket;
};

static void render_post_destroy(void *data)
{
    struct render_post *post = data;
    text_body_finish(&post->body);
    free(post->canonical);
    free(post);
}

static void open_post(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct error problem = {0};
    const char *type = http_request_header(exchange, "Content-Type");
    struct render_post *post = NULL;
    if (!negotiate_is_type(type, "application/json"))
        error_set(&problem, ERROR_UNSUPPORTED_MEDIA_TYPE,
                  "Content-Type '%.80s': a render is application/json", type ? type : "");
    else if (!(post = calloc(1, sizeof *post)))
        error_set(&problem, ERROR_NO_MEMORY, "request");
    if (!post) {
        http_reply_error(exchange, &problem);
        return;
    }
    post->service = service;
    post->exchange = exchange;
    route_attach(exchange, post, render_post_destroy);
    struct http_body_sink sink = text_body_sink(&post->body, LIMIT_REQUEST_JSON_BYTES);
    http_request_take_body(exchange, &sink);
}

/* ---- what is asked for ---- */

static bool choose_format(struct render_post *post, struct render_request *request,
                          struct error *err)
{
    unsigned formats = frame_image_formats(request->outputs);
    if (request->format != REQUEST_FORMAT_ANY) {
        post->format = image_format_from_request(request);
        return (formats & 1u << post->format) ||
               error_set_at(err, ERROR_UNSUPPORTED, "/format",
                            "format: %s cannot hold that output; use exr%s",
                            image_format_name(post->format),
                            formats & 1u << IMAGE_FORMAT_PNG ? " or png" : "");
    }
    if (!negotiate_format(http_request_header(post->exchange, "Accept"), formats, &post->format,
                          err))
        return false;
    request->format = request_format_of_image(post->format);
    return true;
}

/* ?explain=1 leaves the form of the plan to Accept, ?explain=svg names it. */
static bool choose_plan_format(struct render_post *post, struct error *err)
{
    static const char *const types[] = {"application/json", "text/plain", "text/vnd.graphviz",
                                        "image/svg+xml", NULL};
    static const char *const known[] = {"explain", NULL};
    const char *form = http_request_query(post->exchange, "explain");
    post->plan_format = -1;
    if (!http_request_check_query(post->exchange, known, err))
        return false;
    if (!form)
        return true;
    if (strcmp(form, "1") == 0)
        return negotiate_type(http_request_header(post->exchange, "Accept"), types,
                              &post->plan_format, err);
    for (int i = 0; plan_format_name(i); i++)
        if (strcmp(form, plan_format_name(i)) == 0)
            post->plan_format = i;
    return post->plan_format >= 0 ||
           error_set(err, ERROR_INVALID_REQUEST,
                     "?explain=%.40s is none of 1, json, text, dot, svg and glsl", form);
}

/* ---- the reply ---- */

static void reply_image(struct render_post *post, struct render_outcome *outcome)
{
    struct service *service = post->service;
    struct frame_stats *stats = outcome->stats;
    struct error problem = {0};
    struct stat image;
    char timing[FRAME_SERVER_TIMING_BYTES], tag[IMAGE_TAG_BYTES], id[FRAME_ID_BYTES];
    if (fstat(outcome->image_fd, &image) != 0 || !frames_make_id(id, &problem)) {
        error_set(&problem, ERROR_INTERNAL, "the image of the worker cannot be read");
        http_reply_error(post->exchange, &problem);
        return;
    }
    memcpy(stats->id, id, sizeof id);
    frame_stats_close(stats, outcome->queue_ms, 1e3 * http_exchange_seconds(post->exchange));
    frame_stats_server_timing(stats, timing, sizeof timing);
    frames_add(service->frames, id, frame_stats_to_json_text(stats));
    metrics_count_frame(service->metrics, stats);
    resource_store_note_use(service->resources.scenes, stats->scene);
    http_reply_header(post->exchange, "Server-Timing", "%s", timing);
    http_reply_header(post->exchange, "Link", "</v1/frames/%s>; rel=\"describedby\"", id);
    http_reply_header(post->exchange, "Cache-Control", "private, no-cache");
    http_reply_header(post->exchange, "Vary", "Accept");
    const struct made_image made = {post->digest, outcome->drawn, outcome->worker};
    if (service_tag_image(service, &made, tag) && reply_if_unchanged(post->exchange, tag))
        return;
    int fd = outcome->image_fd;
    outcome->image_fd = -1;
    http_reply_fd(post->exchange, 200, image_format_media_type(post->format), fd,
                  (uint64_t)image.st_size);
}

static void reply_plan(struct render_post *post, struct render_outcome *outcome)
{
    struct error problem = {0};
    struct stat text;
    if (fstat(outcome->image_fd, &text) != 0) {
        error_set(&problem, ERROR_INTERNAL, "the plan of the worker cannot be read");
        http_reply_error(post->exchange, &problem);
        return;
    }
    int fd = outcome->image_fd;
    outcome->image_fd = -1;
    http_reply_header(post->exchange, "Cache-Control", "no-store");
    http_reply_header(post->exchange, "Vary", "Accept");
    http_reply_fd(post->exchange, 200, plan_format_media_type(post->plan_format), fd,
                  (uint64_t)text.st_size);
}

/* On a thread of the supervisor, or of who cancelled. */
static void rendered(void *context, struct render_outcome *outcome)
{
    struct render_post *post = context;
    if (outcome->problem.code == ERROR_NONE && post->plan_format >= 0)
        reply_plan(post, outcome);
    else if (outcome->problem.code == ERROR_NONE)
        reply_image(post, outcome);
    else
        http_reply_error(post->exchange, &outcome->problem);
    http_resume(post->exchange);
}

/* ---- the request ---- */

static bool offer(const struct render_post *post, struct render_task *task,
                  const struct render_request *request, struct error *err)
{
    struct request_resources resources;
    (void)!render_request_resources(request, &resources); /* prepare refuses too many */
    const struct tradeoff_view view = {.scene = request->scene,
                                       .width_px = request->width,
                                       .height_px = request->height,
                                       .quality = &request->quality,
                                       .resources = &resources,
                                       .reference_text = request_reference_text_of,
                                       .context = request};
    return tradeoffs_offer(post->service->tradeoffs, &view, false, &task->offer, err);
}

static bool prepare(struct render_post *post, struct render_task *task, struct error *err)
{
    struct render_request request;
    if (!render_request_parse(post->body.text ? post->body.text : "", post->body.size_bytes,
                              &request, err))
        return false;
    text_body_finish(&post->body);
    bool is_good = choose_plan_format(post, err) &&
                   (post->plan_format >= 0 || choose_format(post, &request, err)) &&
                   offer(post, task, &request, err) &&
                   ((post->canonical = render_request_to_json(&request)) ||
                    error_set(err, ERROR_NO_MEMORY, "request"));
    if (is_good)
        image_digest(post->canonical, task->offer, post->digest);
    post->has_target = request_quality_asks(&request.quality);
    struct request_resources resources;
    is_good = render_request_resources(&request, &resources) && is_good;
    memcpy(task->scene, request.scene, sizeof task->scene);
    render_request_finish(&request);
    if (!is_good)
        return false;
    if (!task_open_resources(task, &post->service->resources, &resources, err))
        return false;
    task->request_fd =
        ipc_memfd_create("vitrail-request", post->canonical, strlen(post->canonical), err);
    if (post->plan_format >= 0 &&
        !(task->question = json_pack("{s:s}", "explain", plan_format_name(post->plan_format))))
        return error_set(err, ERROR_NO_MEMORY, "question");
    task->format = post->format;
    task->priority = image_priority(http_request_header(post->exchange, "Priority"));
    return task->request_fd >= 0;
}

/* NULL where the reply is there: a refusal, or that nothing has changed. */
static struct render_task *make_task(struct render_post *post)
{
    struct error problem = {0};
    struct http_exchange *exchange = post->exchange;
    char tag[IMAGE_TAG_BYTES];
    struct render_task *task = render_task_create();
    if (!task)
        error_set(&problem, ERROR_NO_MEMORY, "render");
    if (!task || !prepare(post, task, &problem)) {
        render_task_destroy(task);
        http_reply_error(exchange, &problem);
        return NULL;
    }
    if (post->plan_format < 0 &&
        service_find_tag(post->service, post->digest, post->has_target, tag) &&
        negotiate_tag_matches(http_request_header(exchange, "If-None-Match"), tag)) {
        render_task_destroy(task);
        http_reply_header(exchange, "Vary", "Accept");
        http_reply_header(exchange, "Cache-Control", "private, no-cache");
        reply_if_unchanged(exchange, tag);
        return NULL;
    }
    task->ticket = post->ticket;
    task->request_id = http_request_id(exchange);
    task->context = post;
    task->done = rendered;
    return task;
}

/* ---- the device's speed, where the request goes by it ---- */

static bool waits_for_speed(const struct render_post *post)
{
    struct device_capabilities device;
    struct render_request request;
    struct error ignored = {0}; /* prepare tells */
    if (!supervisor_get_device(post->service->supervisor, &device) ||
        !device.automatic.is_pending ||
        !render_request_parse(post->body.text ? post->body.text : "", post->body.size_bytes,
                              &request, &ignored))
        return false;
    bool waits = request.quality.shadows == SHADOWS_AUTO || request_quality_asks(&request.quality);
    render_request_finish(&request);
    return waits;
}

/* The device's speed is known, and choices that need it can be made. Thread: of the supervisor. */
static void speed_known(void *context, struct render_outcome *outcome)
{
    struct render_post *post = context;
    struct error problem = outcome->problem;
    struct render_task *task = NULL;
    if (problem.code == ERROR_NONE)
        task = make_task(post);
    else
        http_reply_error(post->exchange, &problem);
    if (task && supervisor_submit(post->service->supervisor, task, &problem))
        return;
    if (task)
        http_reply_error(post->exchange, &problem);
    render_task_destroy(task);
    http_resume(post->exchange);
}

static struct render_task *make_speed_task(struct render_post *post)
{
    struct error problem = {0};
    struct render_task *task = render_task_create();
    if (task && (task->question = json_pack("{s:b}", "speed", true))) {
        task->ticket = post->ticket;
        task->context = post;
        task->done = speed_known;
        return task;
    }
    render_task_destroy(task);
    error_set(&problem, ERROR_NO_MEMORY, "question");
    http_reply_error(post->exchange, &problem);
    return NULL;
}

static void run_post(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct render_post *post = route_attached(exchange);
    post->ticket = supervisor_next_ticket(service->supervisor);
    struct render_task *task = waits_for_speed(post) ? make_speed_task(post) : make_task(post);
    if (task)
        reply_by_worker(service, exchange, task);
}

/* ---- how far it is ---- */

static json_t *status_to_json(const struct render_status *status, const char *request_id)
{
    static const char *const states[] = {[JOB_SENT] = "waiting",
                                         [JOB_BEGUN] = "rendering",
                                         [JOB_PAUSED] = "paused",
                                         [JOB_ON_DEVICE] = "rendering",
                                         [JOB_ENCODING] = "encoding"};
    bool has_progress = status->progress.stage[0] && status->state != JOB_ENCODING;
    json_t *progress = has_progress ? job_progress_to_json(&status->progress) : NULL;
    return json_pack("{s:s,s:s,s:s,s:f,s:o*}", "request_id", request_id, "scene", status->scene,
                     "state", states[status->state], "elapsed_s",
                     round(10 * status->elapsed_s) / 10, "progress", progress);
}

static void run_status(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    struct render_status status;
    uint64_t of_view = view_images_find_render(service->view_images, id);
    if (of_view ? supervisor_get_render(service->supervisor, of_view, &status)
                : supervisor_find_render(service->supervisor, id, &status)) {
        reply_json(exchange, 200, status_to_json(&status, id));
        return;
    }
    error_set(&problem, ERROR_NOT_FOUND,
              "no render with the request id '%.64s' is in work: it has ended, or none was asked "
              "for with that X-Request-Id",
              id);
    http_reply_error(exchange, &problem);
}

static void run_frame(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    char *json = frames_get(service->frames, id, &problem);
    if (!json) {
        http_reply_error(exchange, &problem);
        return;
    }
    http_reply_header(exchange, "Cache-Control", "private, max-age=86400, immutable");
    http_reply_bytes(exchange, 200, "application/json", json, strlen(json));
    free(json);
}

const struct route routes_renders[] = {
    {"/v1/renders", {{HTTP_POST, open_post, run_post}}},
    {"/v1/renders/{id}", {{HTTP_GET, NULL, run_status}}},
    {"/v1/frames/{id}", {{HTTP_GET, NULL, run_frame}}},
    {0},
};
