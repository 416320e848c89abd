/* SPDX-License-Identifier: MIT */
/* Finds the handler of a path and a method. Thread: those of the HTTP server. */
#ifndef VITRAIL_SERVER_ROUTES_ROUTER_H
#define VITRAIL_SERVER_ROUTES_ROUTER_H

#include <jansson.h>

#include "server/http/http.h"
#include "server/routes/service.h"

/* One method of one route. Both callbacks run on the HTTP server's threads and never block; id is
 * what stands for the braces of the path, with '/' between, or "". */
struct route_handler {
    enum http_method method;
    /* Optional. */
    void (*open)(struct service *service, struct http_exchange *exchange, const char *id);
    void (*run)(struct service *service, struct http_exchange *exchange, const char *id);
};

enum { ROUTE_HANDLERS_MAX = 4 };

struct route {
    const char *path; /* "/v1/scenes/{id}"; braces stand for one segment that is not empty */
    struct route_handler handlers[ROUTE_HANDLERS_MAX];
};

/* Tables of the route files, each ended by a zeroed entry. */
extern const struct route routes_scenes[], routes_environments[], routes_renders[],
    routes_service[], routes_page[], routes_tradeoffs[], routes_views[], routes_view_images[],
    routes_view_streams[], routes_view_socket[], routes_view_pick[], routes_jobs[],
    routes_job_results[];

struct http_service router_service(struct service *service);

/* Attaches data of a route to its exchange, freed with the exchange. */
void route_attach(struct http_exchange *exchange, void *data, void (*destroy)(void *data));
void *route_attached(struct http_exchange *exchange);

/* Leaves the exchange open until the task is done, whose `done` replies and resumes it. Takes the
 * task. When the client leaves, the task is cancelled. */
struct render_task;
void reply_by_worker(struct service *service, struct http_exchange *exchange,
                     struct render_task *task);

/* Replies as JSON; takes the reference, and answers ERROR_NO_MEMORY when it is NULL. */
void reply_json(struct http_exchange *exchange, int status, json_t *json);

/* True, with the 304 sent, when If-None-Match names this tag. Sets ETag otherwise. */
bool reply_if_unchanged(struct http_exchange *exchange, const char *tag);

#endif
