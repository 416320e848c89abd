/* SPDX-License-Identifier: MIT */
/* /v1/scenes: bring, make, list, describe, rename and forget scenes. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "glb/demo_scene.h"
#include "protocol/json_read.h"
#include "protocol/limits.h"
#include "protocol/scene_summary.h"
#include "server/front/upload.h"
#include "server/front/warm_up.h"
#include "server/routes/router.h"
#include "server/routes/text_body.h"

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
    json_t *summary = resource_store_get_summary(service->resources.scenes, id, &problem);
    if (!summary) {
        http_reply_error(exchange, &problem);
        return;
    }
    http_reply_header(exchange, "Location", "/v1/scenes/%s", id);
    reply_json(exchange, is_new ? 201 : 200, summary);
}

struct post_query {
    const char *name;  /* NULL: the scene is called as its file */
    const char *scene; /* which of the file; NULL: its own choice */
};

static bool read_query(const struct http_exchange *exchange, bool is_file, struct post_query *query,
                       struct error *err)
{
    const char *const known[] = {"name", is_file ? "scene" : NULL, NULL};
    query->name = http_request_query(exchange, "name");
    query->scene = http_request_query(exchange, "scene");
    return http_request_check_query(exchange, known, err) &&
           (!query->name || scene_name_check(query->name, err) || error_wrap(err, "?name=")) &&
           (!query->scene || scene_name_check(query->scene, err) || error_wrap(err, "?scene="));
}

/* Puts into the upload what was asked for beside its bytes. */
static bool set_query(struct upload *upload, const struct post_query *query,
                      const char *default_name, struct error *err)
{
    const char *name = query->name ? query->name : default_name;
    return (!name || upload_set_name(upload, name, err)) &&
           (!query->scene || upload_choose_scene(upload, query->scene, err));
}

/* A post with an empty upload, attached to its exchange; NULL with the reply made. */
static struct scene_post *begin_post(struct service *service, struct http_exchange *exchange,
                                     const char *content_type, const char *default_name)
{
    struct error problem = {0};
    int spool_fd = -1;
    struct post_query query = {0};
    struct scene_post *post = calloc(1, sizeof *post);
    if (post) {
        post->service = service;
        post->exchange = exchange;
        route_attach(exchange, post, scene_post_destroy);
    }
    if (!post)
        error_set(&problem, ERROR_NO_MEMORY, "upload");
    else if (read_query(exchange, !default_name, &query, &problem) &&
             atomic_load(&service->is_draining))
        error_set(&problem, ERROR_OVERLOADED, "the server is stopping");
    else if (problem.code == ERROR_NONE)
        spool_fd = state_dir_open_spool(service->resources.state, &problem);
    if (spool_fd >= 0)
        post->upload = upload_create(content_type, spool_fd, &problem);
    if (post && post->upload && set_query(post->upload, &query, default_name, &problem))
        return post;
    http_reply_error(exchange, &problem);
    return NULL;
}

static void open_post(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct scene_post *post =
        begin_post(service, exchange, http_request_header(exchange, "Content-Type"), NULL);
    if (post)
        http_request_take_body(
            exchange, &(struct http_body_sink){.context = post->upload,
                                               .write = upload_write,
                                               .max_bytes = service->config->max_upload_bytes});
}

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

/* The scene was stored before: a name that is given now is the one that counts. */
static void reply_stored_before(struct scene_post *post)
{
    struct error problem = {0};
    const char *name = http_request_query(post->exchange, "name");
    if (name && !resource_store_rename(post->service->resources.scenes, post->id, name, &problem))
        http_reply_error(post->exchange, &problem);
    else
        reply_stored(post->service, post->exchange, post->id, false);
}

/* On a thread of the decode pool. */
static void decoded(void *context, bool is_new, const struct error *problem)
{
    struct scene_post *post = context;
    if (problem->code != ERROR_NONE)
        http_reply_error(post->exchange, problem);
    else if (!is_new)
        reply_stored_before(post);
    else
        reply_stored(post->service, post->exchange, post->id, true);
    if (problem->code == ERROR_NONE && is_new)
        warm_up(post->service, post->id);
    http_resume(post->exchange);
}

/* A client that leaves now has its scene decoded all the same: it will most likely come back with
 * it. */
static void submit(struct scene_post *post, const struct decode_job_desc *job)
{
    struct error problem = {0};
    http_wait(post->exchange, NULL, NULL, 0);
    post->upload = NULL;
    if (decode_pool_submit(post->service->decoders, job, &problem))
        return;
    post->upload = job->upload;
    http_reply_error(post->exchange, &problem);
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
    supervisor_clear_scene(service->supervisor, post->id);
    if (resource_store_has(service->resources.scenes, post->id)) {
        reply_stored_before(post);
        return;
    }
    submit(post, &(struct decode_job_desc){
                     .id = post->id, .upload = post->upload, .context = post, .done = decoded});
}

/* Generates the demo scene in the front itself, where it needs no sandbox. Thread: of the decode
 * pool. */
static bool fill_demo(void *context, struct upload *upload, char id[DIGEST_TEXT_BYTES],
                      struct error *err)
{
    struct scene_post *post = context;
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
    struct scene_post *post = begin_post(service, exchange, "model/gltf-binary", "demo");
    if (post)
        submit(post,
               &(struct decode_job_desc){
                   .upload = post->upload, .context = post, .fill = fill_demo, .done = decoded});
}

static void run_list(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    json_t *scenes = resource_store_list(service->resources.scenes);
    reply_json(exchange, 200, scenes ? json_pack("{s:o}", "scenes", scenes) : NULL);
}

/* The name can change, all else that is told of an id stays as it is. */
static void reply_of_scene(struct http_exchange *exchange, const char *id, json_t *json,
                           const struct error *problem)
{
    if (!json) {
        http_reply_error(exchange, problem);
        return;
    }
    const char *name = json_string_value(json_object_get(json, "name"));
    char name_digest[DIGEST_TEXT_BYTES] = "", tag[DIGEST_TEXT_BYTES + 16];
    struct error ignored = {0};
    struct digest *digest = name ? digest_create(&ignored) : NULL;
    if (digest) {
        digest_write(digest, name, strlen(name));
        digest_end(digest, name_digest);
    }
    digest_destroy(digest);
    snprintf(tag, sizeof tag, "\"%.64s%s%.8s\"", id, *name_digest ? "-" : "", name_digest);
    http_reply_header(exchange, "Cache-Control", "private, no-cache");
    if (reply_if_unchanged(exchange, tag))
        json_decref(json);
    else
        reply_json(exchange, 200, json);
}

static void run_get(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    json_t *summary = resource_store_get_summary(service->resources.scenes, id, &problem);
    reply_of_scene(exchange, id, summary, &problem);
}

static void run_outline(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    json_t *outline = resource_store_get_outline(service->resources.scenes, id, &problem);
    reply_of_scene(exchange, id, outline, &problem);
}

static void open_patch(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service, (void)id;
    text_body_open(exchange, "a patch of a scene", true);
}

/* {"name": TEXT or null} */
static bool patch(struct service *service, const char *id, const struct text_body *body,
                  struct error *err)
{
    static const char *const known[] = {"name", NULL};
    json_t *json = json_load_checked(body->text ? body->text : "", body->size_bytes,
                                     LIMIT_REQUEST_JSON_BYTES, err);
    struct json_node root = json_root(json, err), name = json_member(&root, "name");
    const char *text = NULL;
    struct error bad_name = {0};
    bool is_good = json && json_expect_object(&root, known) && json_read_name(&name, &text);
    if (is_good && text && !scene_name_check(text, &bad_name))
        is_good = json_refuse(&name, bad_name.code, "%s", bad_name.message);
    if (is_good && json_object_get(json, "name"))
        is_good = resource_store_rename(service->resources.scenes, id, text, err);
    json_decref(json);
    return is_good;
}

static void run_patch(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    if (patch(service, id, route_attached(exchange), &problem))
        run_get(service, exchange, id);
    else
        http_reply_error(exchange, &problem);
}

static void run_delete(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    if (!resource_store_remove(service->resources.scenes, id, &problem)) {
        http_reply_error(exchange, &problem);
        return;
    }
    supervisor_forget_scene(service->supervisor, id);
    tradeoffs_forget_scene(service->tradeoffs, id);
    http_reply_empty(exchange, 204);
}

const struct route routes_scenes[] = {
    {"/v1/scenes", {{HTTP_GET, NULL, run_list}, {HTTP_POST, open_post, run_post}}},
    {"/v1/scenes/demo", {{HTTP_POST, NULL, run_demo}}}, /* before ids */
    {"/v1/scenes/{id}",
     {{HTTP_GET, NULL, run_get},
      {HTTP_PATCH, open_patch, run_patch},
      {HTTP_DELETE, NULL, run_delete}}},
    {"/v1/scenes/{id}/outline", {{HTTP_GET, NULL, run_outline}}},
    {0},
};
