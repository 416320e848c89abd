/* SPDX-License-Identifier: MIT */
/* /v1/scenes: bring, list, describe and forget scenes. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/router.h"
#include "server/upload.h"
#include "server/warm_up.h"

/* A POST on its way: the exchange owns it. */
struct scene_post {
    struct service *service;
    struct http_exchange *exchange;
    struct upload *upload; /* NULL once the decoders have it */
    char id[DIGEST_TEXT_BYTES];
};

static void scene_post_destroy(void *data)
{
    struct scene_post *post = data;
    upload_destroy(post->upload);
    free(post);
}

static void reply_stored(struct service *service, struct http_exchange *exchange, const char *id,
                         bool is_new)
{
    struct error problem = {0};
    json_t *summary = scene_store_get_summary(service->store, id, &problem);
    if (!summary) {
        http_reply_error(exchange, &problem);
        return;
    }
    http_reply_header(exchange, "Location", "/v1/scenes/%s", id);
    reply_json(exchange, is_new ? 201 : 200, summary);
}

static void open_post(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct error problem = {0};
    struct scene_post *post = calloc(1, sizeof *post);
    if (!post) {
        error_set(&problem, ERROR_NO_MEMORY, "upload");
        http_reply_error(exchange, &problem);
        return;
    }
    post->service = service;
    post->exchange = exchange;
    route_attach(exchange, post, scene_post_destroy);
    int spool_fd = -1;
    if (atomic_load(&service->is_draining))
        error_set(&problem, ERROR_OVERLOADED, "the server is stopping");
    else
        spool_fd = scene_store_open_spool(service->store, &problem);
    if (spool_fd >= 0)
        post->upload =
            upload_create(http_request_header(exchange, "Content-Type"), spool_fd, &problem);
    if (!post->upload) {
        http_reply_error(exchange, &problem);
        return;
    }
    http_request_take_body(
        exchange, &(struct http_body_sink){.context = post->upload,
                                           .write = upload_write,
                                           .max_bytes = service->config->max_upload_bytes});
}

/* Without it the first render of the scene takes longer, that is all. */
static void warm_up(struct service *service, const char *id)
{
    struct error ignored = {0};
    if (service->config->no_warm_up || atomic_load(&service->is_draining))
        return;
    struct render_task *task =
        warm_up_task(service->store, supervisor_next_ticket(service->supervisor),
                     &(struct warm_up_desc){.scene = id}, &ignored);
    if (task)
        supervisor_warm_up(service->supervisor, task);
}

/* On a thread of the decode pool. */
static void decoded(void *context, bool is_new, const struct error *problem)
{
    struct scene_post *post = context;
    if (problem->code != ERROR_NONE)
        http_reply_error(post->exchange, problem);
    else
        reply_stored(post->service, post->exchange, post->id, is_new);
    if (problem->code == ERROR_NONE)
        warm_up(post->service, post->id);
    http_resume(post->exchange);
}

static void run_post(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct error problem = {0};
    struct scene_post *post = route_attached(exchange);
    if (!upload_end(post->upload, post->id, &problem)) {
        http_reply_error(exchange, &problem);
        return;
    }
    metrics_count_upload(service->metrics, upload_size_bytes(post->upload));
    supervisor_forgive_scene(service->supervisor, post->id);
    if (scene_store_has(service->store, post->id)) {
        reply_stored(service, exchange, post->id, false);
        return;
    }
    struct decode_job_desc job = {
        .id = post->id, .upload = post->upload, .context = post, .done = decoded};
    /* A client that leaves now has its scene decoded all the same: it will most likely come back
     * with it. */
    http_wait(exchange, NULL, NULL, 0);
    post->upload = NULL;
    if (decode_pool_submit(service->decoders, &job, &problem))
        return;
    post->upload = job.upload;
    http_reply_error(exchange, &problem);
    http_resume(exchange);
}

static void run_list(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    json_t *scenes = scene_store_list(service->store);
    reply_json(exchange, 200, scenes ? json_pack("{s:o}", "scenes", scenes) : NULL);
}

static void reply_of_scene(struct http_exchange *exchange, const char *id, json_t *json,
                           const struct error *problem)
{
    if (!json) {
        http_reply_error(exchange, problem);
        return;
    }
    char tag[DIGEST_TEXT_BYTES + 2];
    snprintf(tag, sizeof tag, "\"%.64s\"", id);
    http_reply_header(exchange, "Cache-Control", "private, no-cache");
    if (reply_if_unchanged(exchange, tag))
        json_decref(json);
    else
        reply_json(exchange, 200, json);
}

static void run_get(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    json_t *summary = scene_store_get_summary(service->store, id, &problem);
    reply_of_scene(exchange, id, summary, &problem);
}

static void run_outline(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    json_t *outline = scene_store_get_outline(service->store, id, &problem);
    reply_of_scene(exchange, id, outline, &problem);
}

static void run_delete(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    if (!scene_store_remove(service->store, id, &problem)) {
        http_reply_error(exchange, &problem);
        return;
    }
    supervisor_forget_scene(service->supervisor, id);
    tradeoffs_forget_scene(service->tradeoffs, id);
    http_reply_empty(exchange, 204);
}

const struct route routes_scenes[] = {
    {"/v1/scenes", {{HTTP_GET, NULL, run_list}, {HTTP_POST, open_post, run_post}}},
    {"/v1/scenes/{id}", {{HTTP_GET, NULL, run_get}, {HTTP_DELETE, NULL, run_delete}}},
    {"/v1/scenes/{id}/outline", {{HTTP_GET, NULL, run_outline}}},
    {0},
};
