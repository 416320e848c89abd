/* SPDX-License-Identifier: MIT */
/* /v1/environments: bring, list, describe, rename and forget environment maps. */
#include "server/routes/resource_routes.h"
#include "server/routes/text_body.h"

static void open_post(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct resource_post *post = resource_post_begin(
        service, exchange, &(struct resource_post_desc){.kind = RESOURCE_ENVIRONMENT});
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

static void run_list(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    resource_reply_list(service, exchange, RESOURCE_ENVIRONMENT);
}

static void run_get(struct service *service, struct http_exchange *exchange, const char *id)
{
    resource_reply_summary(service, exchange, RESOURCE_ENVIRONMENT, id);
}

static void open_patch(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service, (void)id;
    text_body_open(exchange, "a patch of an environment map", true);
}

static void run_patch(struct service *service, struct http_exchange *exchange, const char *id)
{
    resource_reply_patched(service, exchange, RESOURCE_ENVIRONMENT, id);
}

static void run_delete(struct service *service, struct http_exchange *exchange, const char *id)
{
    if (!resource_delete(service, exchange, RESOURCE_ENVIRONMENT, id))
        return;
    supervisor_forget_environment(service->supervisor, id);
    http_reply_empty(exchange, 204);
}

const struct route routes_environments[] = {
    {"/v1/environments", {{HTTP_GET, NULL, run_list}, {HTTP_POST, open_post, run_post}}},
    {"/v1/environments/{id}",
     {{HTTP_GET, NULL, run_get},
      {HTTP_PATCH, open_patch, run_patch},
      {HTTP_DELETE, NULL, run_delete}}},
    {0},
};
