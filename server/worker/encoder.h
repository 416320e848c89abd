/* SPDX-License-Identifier: MIT */
/* The worker's encode pool: tone mapping and encoding of finished frames beside the GL thread.
 * Thread: any; owns threads. */
#ifndef VITRAIL_SERVER_WORKER_ENCODER_H
#define VITRAIL_SERVER_WORKER_ENCODER_H

#include <stdint.h>

#include "protocol/error.h"
#include "protocol/frame_stats.h"
#include "protocol/render_request.h"
#include "renderer/renderer.h"
#include "server/base/digest.h"
#include "server/worker/metering.h"

struct encoder;

/* One frame on its way to an image. On the heap, because a frame's report and stats are 60 KiB
 * together. */
struct encode_task {
    struct encode_task *next;
    uint64_t id;
    struct render_request request;
    json_t *asked_quality; /* owned; what its file says instead of the request's; or NULL */
    struct frame frame;
    struct frame_stats stats; /* all but encode, queue, total, id */
    struct metering metering;
    struct frame_promise promise; /* what was chosen, as the stats report it */
    /* Of the canonical request with what was chosen for a target; else "". */
    char drawn[DIGEST_TEXT_BYTES];
    enum image_format format;
    void *bytes; /* the encoded image */
    size_t size_bytes;
};
void encode_task_destroy(struct encode_task *task); /* accepts NULL */

struct encoder_desc {
    int thread_count; /* required */
    void *context;
    /* Called on a thread of the pool, then the task is destroyed. */
    void (*done)(void *context, struct encode_task *task, const struct error *problem);
};
struct encoder *encoder_create(const struct encoder_desc *desc, struct error *err);
void encoder_destroy(struct encoder *encoder); /* finishes what is queued; accepts NULL */
void encoder_submit(struct encoder *encoder, struct encode_task *task); /* takes the task */

/* Has the library of EXR files loaded on a thread of its own, which lets others go first;
 * once. Thread: one. */
void encoder_warm_up(struct encoder *encoder);

#endif
