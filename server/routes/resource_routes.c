/* SPDX-License-Identifier: MIT */
/* Posts from their first byte to their reply, and the description of a resource. */
#include "server/routes/resource_routes.h"

#include <stdlib.h>
#include <string.h>

#include "protocol/json_read.h"
#include "protocol/limits.h"
#include "protocol/scene_summary.h"
#include "server/routes/route_query.h"
#include "server/routes/text_body.h"

/* ---- posts ---- */

static struct resource_store *store_of(const struct resource_post *post)
{
    return resources_store(&post->service->resources, post->desc.kind);
}

static void post_destroy(void *data)
{
    struct resource_post *post = data;
    upload_destroy(post->upload);
    free(post);
}

static void reply_stored(struct resource_post *post, bool is_new)
{
    struct error problem = {0};
    json_t *summary = resource_store_get_summary(store_of(post), post->id, &problem);
    if (!summary) {
        http_reply_error(post->exchange, &problem);
        return;
    }
    http_reply_header(post->exchange, "Location", "/v1/%s/%s",
                      resource_info(post->desc.kind)->folder, post->id);
    reply_json(post->exchange, is_new ? 201 : 200, summary);
}

struct post_query {
    const char *name;  /* NULL: as its file */
    const char *scene; /* which of the file; NULL: its own choice */
    struct upload_reading reading;
};

static bool read_deflection(const char *text, double *deflection, struct error *err)
{
    char *end = NULL;
    bool is_decimal = strspn(text, "0123456789.eE+-") == strlen(text);
    *deflection = is_decimal ? strtod(text, &end) : 0;
    return (is_decimal && *end == '\0' && *deflection >= SCENE_DEFLECTION_LEAST &&
            *deflection <= SCENE_DEFLECTION_MOST) ||
           error_set(err, ERROR_INVALID_REQUEST,
                     "?deflection=%.40s is no number of units of the file in [%g, %g]", text,
                     SCENE_DEFLECTION_LEAST, SCENE_DEFLECTION_MOST);
}

/* ?format=, ?unit=, ?up= and ?deflection= */
static bool read_reading(const struct http_exchange *exchange, struct upload_reading *reading,
                         struct error *err)
{
    const char *format = http_request_query(exchange, "format");
    const char *unit = http_request_query(exchange, "unit");
    const char *up = http_request_query(exchange, "up");
    const char *deflection = http_request_query(exchange, "deflection");
    reading->has_format = format;
    if (format && !scene_format_from_name(format, &reading->format))
        return error_set(err, ERROR_INVALID_REQUEST,
                         "?format=%.40s is no format of scenes; /v1/capabilities lists them",
                         format);
    if (unit && !(reading->unit_m = scene_unit_from_name(unit)))
        return error_set(err, ERROR_INVALID_REQUEST, "?unit=%.40s is not mm, cm, m, in or ft",
                         unit);
    if (up && strcmp(up, "y") != 0 && strcmp(up, "z") != 0)
        return error_set(err, ERROR_INVALID_REQUEST, "?up=%.40s is neither y nor z", up);
    reading->up = up ? *up : '\0';
    return !deflection || read_deflection(deflection, &reading->deflection, err);
}

static bool read_query(const struct http_exchange *exchange, bool takes_scene,
                       struct post_query *query, struct error *err)
{
    const char *const known[] = {
        "name", takes_scene ? "scene" : NULL, "format", "unit", "up", "deflection", NULL};
    query->name = http_request_query(exchange, "name");
    query->scene = http_request_query(exchange, "scene");
    return http_request_check_query(exchange, known, err) &&
           (!query->name || scene_name_check(query->name, err) || error_wrap(err, "?name=")) &&
           (!query->scene || scene_name_check(query->scene, err) || error_wrap(err, "?scene=")) &&
           (!takes_scene || read_reading(exchange, &query->reading, err));
}

/* Puts into the upload what was asked for beside its bytes. */
static bool set_query(struct upload *upload, const struct post_query *query,
                      const char *default_name, struct error *err)
{
    const char *name = query->name ? query->name : default_name;
    upload_read_as(upload, &query->reading);
    return (!name || upload_set_name(upload, name, err)) &&
           (!query->scene || upload_choose_scene(upload, query->scene, err));
}

struct resource_post *resource_post_begin(struct service *service, struct http_exchange *exchange,
                                          const struct resource_post_desc *desc)
{
    struct error problem = {0};
    int spool_fd = -1;
    struct post_query query = {0};
    const char *type =
        desc->content_type ? desc->content_type : http_request_header(exchange, "Content-Type");
    struct resource_post *post = calloc(1, sizeof *post);
    if (post) {
        *post = (struct resource_post){.desc = *desc, .service = service, .exchange = exchange};
        route_attach(exchange, post, post_destroy);
    }
    if (!post)
        error_set(&problem, ERROR_NO_MEMORY, "upload");
    else if (read_query(exchange, desc->takes_scene, &query, &problem) &&
             atomic_load(&service->is_draining))
        error_set(&problem, ERROR_OVERLOADED, "the server is stopping");
    else if (problem.code == ERROR_NONE)
        spool_fd = state_dir_open_spool(service->resources.state, &problem);
    if (spool_fd >= 0)
        post->upload = upload_create(desc->kind, type, spool_fd, &problem);
    if (post && post->upload && set_query(post->upload, &query, desc->default_name, &problem))
        return post;
    http_reply_error(exchange, &problem);
    return NULL;
}

void resource_post_take_body(struct resource_post *post)
{
    http_request_take_body(
        post->exchange,
        &(struct http_body_sink){.context = post->upload,
                                 .write = upload_write,
                                 .max_bytes = post->service->config->max_upload_bytes});
}

/* It was stored before: a name that is given now is the one that counts. */
static void reply_stored_before(struct resource_post *post)
{
    struct error problem = {0};
    const char *name = http_request_query(post->exchange, "name");
    if (name && !resource_store_rename(store_of(post), post->id, name, &problem))
        http_reply_error(post->exchange, &problem);
    else
        reply_stored(post, false);
}

bool resource_post_end(struct resource_post *post)
{
    struct error problem = {0};
    if (!upload_end(post->upload, post->id, &problem)) {
        http_reply_error(post->exchange, &problem);
        return false;
    }
    metrics_count_upload(post->service->metrics, upload_size_bytes(post->upload));
    if (post->desc.kind == RESOURCE_SCENE)
        supervisor_clear_scene(post->service->supervisor, post->id);
    if (!resource_store_has(store_of(post), post->id))
        return true;
    reply_stored_before(post);
    return false;
}

/* On a thread of the decode pool. */
static void decoded(void *context, bool is_new, const struct error *problem)
{
    struct resource_post *post = context;
    if (problem->code != ERROR_NONE)
        http_reply_error(post->exchange, problem);
    else if (!is_new)
        reply_stored_before(post);
    else
        reply_stored(post, true);
    if (problem->code == ERROR_NONE && is_new && post->desc.stored)
        post->desc.stored(post->service, post->id);
    http_resume(post->exchange);
}

/* A client that leaves now has its upload decoded all the same: it will most likely come back with
 * it. */
void resource_post_submit(struct resource_post *post,
                          bool (*fill)(void *post, struct upload *upload,
                                       char id[DIGEST_TEXT_BYTES], struct error *err))
{
    struct error problem = {0};
    const struct decode_job_desc job = {.id = fill ? NULL : post->id,
                                        .request_id = http_request_id(post->exchange),
                                        .upload = post->upload,
                                        .context = post,
                                        .fill = fill,
                                        .done = decoded};
    http_wait(post->exchange, NULL, NULL, 0);
    post->upload = NULL;
    if (decode_pool_submit(post->service->decoders, &job, &problem))
        return;
    post->upload = job.upload;
    http_reply_error(post->exchange, &problem);
    http_resume(post->exchange);
}

/* ---- descriptions ---- */

void resource_reply_list(struct service *service, struct http_exchange *exchange,
                         enum resource_kind kind)
{
    json_t *list = resource_store_list(resources_store(&service->resources, kind));
    reply_json(exchange, 200, list ? json_pack("{s:o}", resource_info(kind)->folder, list) : NULL);
}

/* The name can change, all else that is said of an id stays as it is. */
void resource_reply(struct http_exchange *exchange, const char *id, json_t *json,
                    const struct error *problem)
{
    if (!json) {
        http_reply_error(exchange, problem);
        return;
    }
    const char *name = json_string_value(json_object_get(json, "name"));
    char name_digest[DIGEST_TEXT_BYTES] = "", tag[DIGEST_TEXT_BYTES + 16];
    struct error ignored = {0};
    if (name && !digest_of(name, strlen(name), name_digest, &ignored))
        name_digest[0] = '\0';
    snprintf(tag, sizeof tag, "\"%.64s%s%.8s\"", id, *name_digest ? "-" : "", name_digest);
    http_reply_header(exchange, "Cache-Control", "private, no-cache");
    if (reply_if_unchanged(exchange, tag))
        json_decref(json);
    else
        reply_json(exchange, 200, json);
}

void resource_reply_summary(struct service *service, struct http_exchange *exchange,
                            enum resource_kind kind, const char *id)
{
    struct error problem = {0};
    json_t *summary =
        resource_store_get_summary(resources_store(&service->resources, kind), id, &problem);
    resource_reply(exchange, id, summary, &problem);
}

bool resource_delete(struct service *service, struct http_exchange *exchange,
                     enum resource_kind kind, const char *id)
{
    struct error problem = {0};
    bool is_forced = false;
    if (query_flag(exchange, "force", &is_forced, &problem) &&
        jobs_remove_resource(service->jobs, kind, id, is_forced, &problem))
        return true;
    http_reply_error(exchange, &problem);
    return false;
}

/* {"name": TEXT or null} */
static bool patch(struct resource_store *store, const char *id, const struct text_body *body,
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
        is_good = resource_store_rename(store, id, text, err);
    json_decref(json);
    return is_good;
}

void resource_reply_patched(struct service *service, struct http_exchange *exchange,
                            enum resource_kind kind, const char *id)
{
    struct error problem = {0};
    if (patch(resources_store(&service->resources, kind), id, route_attached(exchange), &problem))
        resource_reply_summary(service, exchange, kind, id);
    else
        http_reply_error(exchange, &problem);
}
