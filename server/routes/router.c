/* SPDX-License-Identifier: MIT */
/* Finds the route, answers for paths and methods that there are none for, and counts. */
#include "server/routes/router.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/negotiate.h"

enum { ID_BYTES = 192 /* longer ones name nothing here */ };

struct routed {
    const struct route *route;           /* NULL: no such path */
    const struct route_handler *handler; /* NULL: no such method */
    char id[ID_BYTES];
    void *data;
    void (*destroy)(void *data);
};

/* Compares a path with a template; copies what stands for its braces, with '/' between. */
static bool path_matches(const char *template, const char *path, char id[ID_BYTES])
{
    size_t used = 0;
    id[0] = '\0';
    while (*template || *path) {
        if (*template != '{') {
            if (*template ++ != *path++)
                return false;
            continue;
        }
        size_t length = strcspn(path, "/");
        if (length == 0 || used + length + 2 > ID_BYTES)
            return false;
        if (used > 0)
            id[used++] = '/';
        memcpy(id + used, path, length);
        used += length;
        id[used] = '\0';
        template = strchr(template, '}') + 1;
        path += length;
    }
    return true;
}

static void find_route(struct routed *routed, const char *path)
{
    const struct route *const tables[] = {
        routes_scenes,   routes_environments, routes_renders,      routes_service,
        routes_page,     routes_tradeoffs,    routes_jobs,         routes_job_results,
        routes_views,    routes_view_images,  routes_view_streams, routes_view_socket,
        routes_view_pick};
    for (size_t t = 0; t < sizeof tables / sizeof tables[0]; t++)
        for (const struct route *route = tables[t]; route->path; route++)
            if (path_matches(route->path, path, routed->id)) {
                routed->route = route;
                return;
            }
    routed->id[0] = '\0';
}

static const struct route_handler *find_handler(const struct route *route, enum http_method method)
{
    /* The body is left out below us. */
    enum http_method wanted = method == HTTP_HEAD ? HTTP_GET : method;
    for (int i = 0; i < ROUTE_HANDLERS_MAX && route->handlers[i].run; i++)
        if (route->handlers[i].method == wanted)
            return &route->handlers[i];
    return NULL;
}

static void add_allow(struct http_exchange *exchange, const struct route *route)
{
    char allow[96] = "OPTIONS";
    for (int i = 0; i < ROUTE_HANDLERS_MAX && route->handlers[i].run; i++) {
        size_t used = strlen(allow);
        bool is_get = route->handlers[i].method == HTTP_GET;
        snprintf(allow + used, sizeof allow - used, ", %s%s",
                 http_method_name(route->handlers[i].method), is_get ? ", HEAD" : "");
    }
    http_reply_header(exchange, "Allow", "%s", allow);
}

/* A page of a listed origin asks what it may send: what any client may. */
static void add_preflight(struct http_exchange *exchange)
{
    if (!http_request_is_shared(exchange) ||
        !http_request_header(exchange, "Access-Control-Request-Method"))
        return;
    http_reply_header(exchange, "Access-Control-Allow-Methods", "GET, HEAD, POST, PATCH, DELETE");
    http_reply_header(exchange, "Access-Control-Allow-Headers",
                      "Accept, Content-Type, If-Match, If-None-Match, If-Range, Idempotency-Key, "
                      "Last-Event-ID, Prefer, Range, X-Request-Id");
    http_reply_header(exchange, "Access-Control-Max-Age", "600");
}

static void open_exchange(void *context, struct http_exchange *exchange)
{
    struct service *service = context;
    struct error problem = {0};
    enum http_method method = http_request_method(exchange);
    struct routed *routed = calloc(1, sizeof *routed);
    http_exchange_set_data(exchange, routed);
    if (!routed) {
        error_set(&problem, ERROR_NO_MEMORY, "request");
        http_reply_error(exchange, &problem);
        return;
    }
    find_route(routed, http_request_path(exchange));
    if (!routed->route) {
        error_set(&problem, ERROR_NOT_FOUND,
                  "there is no '%.200s' here; /openapi.json lists what there is",
                  http_request_path(exchange));
        http_reply_error(exchange, &problem);
        return;
    }
    routed->handler = find_handler(routed->route, method);
    if (routed->handler) {
        if (routed->handler->open)
            routed->handler->open(service, exchange, routed->id);
        return;
    }
    add_allow(exchange, routed->route);
    if (method == HTTP_OPTIONS) {
        add_preflight(exchange);
        http_reply_empty(exchange, 204);
        return;
    }
    error_set(&problem, ERROR_METHOD_NOT_ALLOWED, "%s cannot be done to '%.200s'",
              http_request_method_name(exchange), http_request_path(exchange));
    http_reply_error(exchange, &problem);
}

static void run_exchange(void *context, struct http_exchange *exchange)
{
    struct routed *routed = http_exchange_data(exchange);
    routed->handler->run(context, exchange, routed->id);
}

static void close_exchange(void *context, struct http_exchange *exchange)
{
    struct service *service = context;
    struct routed *routed = http_exchange_data(exchange);
    const char *route = routed && routed->route ? routed->route->path : "none";
    double seconds = http_exchange_seconds(exchange);
    metrics_count_request(service->metrics, route, http_request_method(exchange),
                          http_reply_status(exchange), seconds);
    log_write(service->log, LOG_INFO, "%s %s %s %d %.1f ms", http_request_id(exchange),
              http_request_method_name(exchange), http_request_path(exchange),
              http_reply_status(exchange), 1e3 * seconds);
    if (routed && routed->destroy)
        routed->destroy(routed->data);
    free(routed);
}

struct http_service router_service(struct service *service)
{
    return (struct http_service){
        .context = service, .open = open_exchange, .run = run_exchange, .close = close_exchange};
}

void route_attach(struct http_exchange *exchange, void *data, void (*destroy)(void *data))
{
    struct routed *routed = http_exchange_data(exchange);
    routed->data = data;
    routed->destroy = destroy;
}

void *route_attached(struct http_exchange *exchange)
{
    const struct routed *routed = http_exchange_data(exchange);
    return routed->data;
}

static void client_left(void *context, uint64_t ticket)
{
    supervisor_cancel(context, ticket);
}

void reply_by_worker(struct service *service, struct http_exchange *exchange,
                     struct render_task *task)
{
    struct error problem = {0};
    http_wait(exchange, client_left, service->supervisor, task->ticket);
    if (supervisor_submit(service->supervisor, task, &problem))
        return;
    render_task_destroy(task);
    http_reply_error(exchange, &problem);
    http_resume(exchange);
}

void reply_json(struct http_exchange *exchange, int status, json_t *json)
{
    char *text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    json_decref(json);
    if (text) {
        http_reply_bytes(exchange, status, "application/json", text, strlen(text));
    } else {
        struct error problem = {0};
        error_set(&problem, ERROR_NO_MEMORY, "reply");
        http_reply_error(exchange, &problem);
    }
    free(text);
}

bool reply_if_unchanged(struct http_exchange *exchange, const char *tag)
{
    http_reply_header(exchange, "ETag", "%s", tag);
    if (!negotiate_tag_matches(http_request_header(exchange, "If-None-Match"), tag))
        return false;
    http_reply_empty(exchange, 304);
    return true;
}
