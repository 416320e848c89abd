/* SPDX-License-Identifier: MIT */
/* The front role put together: HTTP, scene store, decoders, worker, metrics. Thread: main; routes
 * use its members. */
#ifndef VITRAIL_SERVER_ROUTES_SERVICE_H
#define VITRAIL_SERVER_ROUTES_SERVICE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <time.h>

#include "protocol/error.h"
#include "server/base/build_id.h"
#include "server/base/config.h"
#include "server/base/log.h"
#include "server/front/decode_pool.h"
#include "server/front/frames.h"
#include "server/front/metrics.h"
#include "server/front/resources.h"
#include "server/front/supervisor.h"
#include "server/http/http.h"
#include "server/http/websocket.h"
#include "server/jobs/jobs.h"
#include "server/tradeoffs/tradeoffs.h"
#include "server/views/image_tag.h"
#include "server/views/views.h"
#include "server/views/target_digests.h"

/* Members are set once by service_create and then only read; each looks after its own threads. */
struct service {
    const struct config *config;
    const struct log *log;
    struct resources resources;
    struct decode_pool *decoders;
    struct supervisor *supervisor;
    struct tradeoffs *tradeoffs;
    struct jobs *jobs;
    struct frames *frames;
    struct metrics *metrics;
    struct http_server *http;
    struct view_images *view_images;
    struct target_digests *targets; /* what was drawn for them */
    struct views *views;
    struct websocket_loop *sockets;
    char build_id[BUILD_ID_BYTES];
    struct timespec started;
    atomic_bool is_draining, has_reported_ready;
    _Atomic(char *) hopeless; /* owned; set once, by the supervisor's thread */
};

struct service *service_create(const struct config *config, const struct log *log,
                               struct error *err);

/* Stops in the order that loses nothing: no new connections, renders and uploads in flight finish
 * until the drain deadline (or until must_hurry answers true), all waiting exchanges are completed,
 * replies leave, threads end. Accepts NULL. */
void service_destroy(struct service *service, bool (*must_hurry)(void));

/* Warms up the scenes of the last images while the server is idle (config.warm_at_start). */
void service_warm_up(struct service *service);

/* The tag of an image that is made, which is kept for its target. digest: image_digest of the
 * request; drawn: as in render_outcome, "" where nothing was chosen for a target. False while no
 * device is known. */
struct made_image {
    const char *digest, *drawn; /* required, borrowed */
    int worker;                 /* as in render_outcome */
};
bool service_tag_image(struct service *service, const struct made_image *image,
                       char tag[IMAGE_TAG_BYTES]);
/* The tag of an image that is not made yet. For a target it is that of the image that was made for
 * it before; false: there is none. */
bool service_find_tag(struct service *service, const char *digest, bool has_target,
                      char tag[IMAGE_TAG_BYTES]);

int service_port(const struct service *service);

/* Why it can never render any more: then it has sent this process SIGTERM. NULL: it can. */
const char *service_hopeless(const struct service *service);

#endif
