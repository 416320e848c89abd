/* SPDX-License-Identifier: MIT */
/* /v1/scenes: bring, make, list, describe, rename and forget scenes. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "glb/demo_scene.h"
#include "server/front/warm_up.h"
#include "server/routes/resource_routes.h"
#include "server/routes/text_body.h"

/* Asks for a warm-up. If it fails, only the first render of the scene takes longer. */
static void warm_up(struct service *service, const char *id)
{
    struct error ignored = {0};
    if (service->config->no_warm_up || atomic_load(&service->is_draining))
        return;
    struct render_task *task =
        warm_up_task(&service->resources, supervisor_next_ticket(service->supervisor),
                     &(struct warm_up_desc){.scene = id}, &ignored);
    if (task)
        supervisor_warm_up(service->supervisor, task);
}

static void open_post(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct resource_post *post =
        resource_post_begin(service, exchange,
                            &(struct resource_post_desc){
                                .kind = RESOURCE_SCENE, .takes_scene = true, .stored = warm_up});
    if (post)
        resource_post_take_body(post);
}

static void run_post(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service, (void)id;
    struct resource_post *post = route_attached(exchange);
    if (resource_post_end(post))
        resource_post_submit(post, NULL);
}

/* Generates the demo scene in the front itself, where it needs no sandbox. Thread: of the decode
 * pool. */
static bool fill_demo(void *context, struct upload *upload, char id[DIGEST_TEXT_BYTES],
                      struct error *err)
{
    struct resource_post *post = context;
    const struct service *service = post->service;
    void *glb = NULL;
    size_t size_bytes = 0;
    bool is_good = demo_scene_build(&(struct demo_scene_desc){0}, &glb, &size_bytes, err);
    if (is_good && size_bytes > service->config->max_upload_bytes)
        is_good = error_set(err, ERROR_TOO_LARGE,
                            "the demo scene has %zu bytes, this server takes up to %llu",
                            size_bytes, (unsigned long long)service->config->max_upload_bytes);
    is_good =
        is_good && upload_write(upload, glb, size_bytes, err) && upload_end(upload, post->id, err);
    free(glb);
    if (!is_good)
        return false;
    memcpy(id, post->id, sizeof post->id);
    supervisor_clear_scene(service->supervisor, post->id);
    return true;
}

static void run_demo(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct resource_post *post =
        resource_post_begin(service, exchange,
                            &(struct resource_post_desc){.kind = RESOURCE_SCENE,
                                                         .content_type = "model/gltf-binary",
                                                         .default_name = "demo",
                                                         .stored = warm_up});
    if (post)
        resource_post_submit(post, fill_demo);
}

static void run_list(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    resource_reply_list(service, exchange, RESOURCE_SCENE);
}

static void run_get(struct service *service, struct http_exchange *exchange, const char *id)
{
    resource_reply_summary(service, exchange, RESOURCE_SCENE, id);
}

static void run_outline(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    json_t *outline = resource_store_get_outline(service->resources.scenes, id, &problem);
    resource_reply(exchange, id, outline, &problem);
}

static void open_patch(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service, (void)id;
    text_body_open(exchange, "a patch of a scene", true);
}

static void run_patch(struct service *service, struct http_exchange *exchange, const char *id)
{
    resource_reply_patched(service, exchange, RESOURCE_SCENE, id);
}

static void run_delete(struct service *service, struct http_exchange *exchange, const char *id)
{
    if (!resource_delete(service, exchange, RESOURCE_SCENE, id))
        return;
    supervisor_forget_scene(service->supervisor, id);
    tradeoffs_forget_scene(service->tradeoffs, id);
    http_reply_empty(exchange, 204);
}

static void run_upload(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    struct decode_status status;
    if (!decode_pool_find(service->decoders, id, &status)) {
        error_set(
            &problem, ERROR_NOT_FOUND,
            "no upload with the request id '%.64s' is being read: it has ended, its bytes are "
            "still to come, or none was posted with that X-Request-Id",
            id);
        http_reply_error(exchange, &problem);
        return;
    }
    json_t *progress = status.stage[0] ? json_pack("{s:s,s:f}", "stage", status.stage, "share",
                                                   round(1000 * status.share) / 1000)
                                       : NULL;
    reply_json(exchange, 200,
               json_pack("{s:s,s:s,s:f,s:o*}", "request_id", id, "state",
                         status.is_decoding ? "decoding" : "waiting", "elapsed_s",
                         round(10 * status.elapsed_s) / 10, "progress", progress));
}

const struct route routes_scenes[] = {
    {"/v1/scenes", {{HTTP_GET, NULL, run_list}, {HTTP_POST, open_post, run_post}}},
    {"/v1/scenes/demo", {{HTTP_POST, NULL, run_demo}}}, /* before ids */
    {"/v1/scenes/{id}",
     {{HTTP_GET, NULL, run_get},
      {HTTP_PATCH, open_patch, run_patch},
      {HTTP_DELETE, NULL, run_delete}}},
    {"/v1/scenes/{id}/outline", {{HTTP_GET, NULL, run_outline}}},
    {"/v1/uploads/{id}", {{HTTP_GET, NULL, run_upload}}},
    {0},
};
