/* SPDX-License-Identifier: MIT */
/* Builds the front role bottom up, and takes it down in the order that loses nothing. */
#include "server/routes/service.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "protocol/limits.h"
#include "server/base/sd_notify.h"
#include "server/front/warm_up.h"
#include "server/routes/router.h"

enum { DRAIN_SLICE_MS = 50, LAST_REPLIES_MS = 2000 };

/* On the supervisor's thread, each time a worker is ready. */
static void worker_ready(void *context)
{
    struct service *service = context;
    if (!atomic_exchange(&service->has_reported_ready, true))
        sd_notify_state("READY=1");
}

/* Called at most once, on the supervisor's thread: has the main thread end the service. */
static void worker_hopeless(void *context, const char *why)
{
    struct service *service = context;
    log_write(service->log, LOG_ERROR, "%s", why);
    atomic_store(&service->hopeless, strdup(why));
    kill(getpid(), SIGTERM);
}

struct service *service_create(const struct config *config, const struct log *log,
                               struct error *err)
{
    struct service *service = calloc(1, sizeof *service);
    if (!service) {
        error_set(err, ERROR_NO_MEMORY, "service");
        return NULL;
    }
    service->config = config;
    service->log = log;
    clock_gettime(CLOCK_MONOTONIC, &service->started);
    build_id_get(service->build_id);
    if (!resources_init(&service->resources, config->state_dir, log, err))
        goto fail;
    service->frames = frames_create(LIMIT_FRAMES_KEPT, err);
    service->metrics = metrics_create(err);
    if (!service->frames || !service->metrics)
        goto fail;
    service->decoders = decode_pool_create(
        &(struct decode_pool_desc){.config = config, .log = log, .resources = &service->resources},
        err);
    if (!service->decoders)
        goto fail;
    service->supervisor =
        supervisor_create(&(struct supervisor_desc){.config = config,
                                                    .log = log,
                                                    .context = service,
                                                    .on_ready = worker_ready,
                                                    .on_hopeless = worker_hopeless},
                          err);
    if (!service->supervisor)
        goto fail;
    service->tradeoffs =
        tradeoffs_create(&(struct tradeoffs_desc){.state_dir = config->state_dir,
                                                  .log = log,
                                                  .processors = config_threads(config),
                                                  .supervisor = service->supervisor,
                                                  .resources = &service->resources},
                         err);
    if (!service->tradeoffs)
        goto fail;
    service->jobs = jobs_create(&(struct jobs_desc){.config = config,
                                                    .log = log,
                                                    .supervisor = service->supervisor,
                                                    .resources = &service->resources,
                                                    .tradeoffs = service->tradeoffs},
                                err);
    if (!service->jobs)
        goto fail;
    service->targets = target_digests_create(err);
    if (!service->targets)
        goto fail;
    service->view_images =
        view_images_create(&(struct view_images_desc){.supervisor = service->supervisor,
                                                      .resources = &service->resources,
                                                      .frames = service->frames,
                                                      .metrics = service->metrics},
                           err);
    if (!service->view_images)
        goto fail;
    service->views = views_create(&(struct views_desc){.config = config,
                                                       .resources = &service->resources,
                                                       .supervisor = service->supervisor,
                                                       .images = service->view_images,
                                                       .tradeoffs = service->tradeoffs,
                                                       .build_id = service->build_id},
                                  err);
    if (!service->views)
        goto fail;
    service->sockets = websocket_loop_create(
        &(struct websocket_desc){.max_text_bytes = LIMIT_SOCKET_MESSAGE_BYTES}, err);
    if (!service->sockets)
        goto fail;
    service->http = http_server_create(
        &(struct http_server_desc){
            .config = config, .log = log, .service = router_service(service)},
        err);
    if (!service->http || !http_server_start(service->http, err))
        goto fail;
    return service;

fail:
    service_destroy(service, NULL);
    return NULL;
}

static void drain(struct service *service, bool (*must_hurry)(void))
{
    atomic_store(&service->is_draining, true);
    sd_notify_state("STOPPING=1");
    supervisor_drain(service->supervisor);
    http_server_quiesce(service->http);
    views_stop(service->views); /* streams and sockets end instead of being waited for */
    jobs_stop(service->jobs);   /* so do those who wait for jobs */
    for (int waited = 0; waited < 1000 * service->config->drain_timeout_s; waited += DRAIN_SLICE_MS)
        if (http_server_wait_idle(service->http, DRAIN_SLICE_MS) || (must_hurry && must_hurry()))
            return;
}

void service_destroy(struct service *service, bool (*must_hurry)(void))
{
    if (!service)
        return;
    if (service->http)
        drain(service, must_hurry);
    /* From here on nothing waits: both complete every exchange that they hold, and refuse those of
     * connections that are still served. */
    tradeoffs_stop(service->tradeoffs);
    jobs_stop(service->jobs);
    decode_pool_stop(service->decoders);
    supervisor_stop(service->supervisor);
    websocket_loop_stop(service->sockets);
    if (service->http)
        http_server_wait_idle(service->http, LAST_REPLIES_MS);
    http_server_destroy(service->http);
    websocket_loop_destroy(service->sockets);
    views_destroy(service->views);
    view_images_destroy(service->view_images);
    target_digests_destroy(service->targets);
    jobs_destroy(service->jobs);
    tradeoffs_destroy(service->tradeoffs);
    supervisor_destroy(service->supervisor);
    decode_pool_destroy(service->decoders);
    metrics_destroy(service->metrics);
    frames_destroy(service->frames);
    resources_finish(&service->resources);
    free(atomic_load(&service->hopeless));
    free(service);
}

void service_warm_up(struct service *service)
{
    char ids[WARM_UPS_MAX][DIGEST_TEXT_BYTES];
    struct error ignored = {0};
    size_t most = service->config->no_warm_up ? 0 : (size_t)service->config->warm_at_start;
    size_t count = most ? resource_store_recent(service->resources.scenes, ids, most) : 0;
    for (size_t i = 0; i < count; i++) {
        struct render_task *task =
            warm_up_task(&service->resources, supervisor_next_ticket(service->supervisor),
                         &(struct warm_up_desc){.scene = ids[i], .is_at_start = true}, &ignored);
        if (task)
            supervisor_warm_up(service->supervisor, task);
    }
}

static bool make_tag(struct service *service, const struct made_image *image,
                     char tag[IMAGE_TAG_BYTES])
{
    const struct image_tag_desc desc = {.supervisor = service->supervisor,
                                        .build_id = service->build_id,
                                        .request_digest =
                                            *image->drawn ? image->drawn : image->digest,
                                        .worker = image->worker};
    return image_tag_make(&desc, tag);
}

bool service_tag_image(struct service *service, const struct made_image *image,
                       char tag[IMAGE_TAG_BYTES])
{
    target_digests_note(service->targets, image->digest, image->drawn);
    return make_tag(service, image, tag);
}

bool service_find_tag(struct service *service, const char *digest, bool has_target,
                      char tag[IMAGE_TAG_BYTES])
{
    char drawn[DIGEST_TEXT_BYTES] = "";
    return (!has_target || target_digests_find(service->targets, digest, drawn)) &&
           make_tag(service, &(struct made_image){.digest = digest, .drawn = drawn}, tag);
}

int service_port(const struct service *service)
{
    return http_server_port(service->http);
}

const char *service_hopeless(const struct service *service)
{
    return atomic_load(&service->hopeless);
}
