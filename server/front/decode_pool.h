/* SPDX-License-Identifier: MIT */
/* Turns uploads into stored scenes, a few at a time, each in a decoder process of its own. Thread:
 * any; owns threads. */
#ifndef VITRAIL_SERVER_FRONT_DECODE_POOL_H
#define VITRAIL_SERVER_FRONT_DECODE_POOL_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"
#include "server/base/config.h"
#include "server/base/log.h"
#include "server/front/resources.h"
#include "server/front/upload.h"

enum {
    DECODE_THREADS = 2,
    DECODE_QUEUE_MAX = 64, /* uploads waiting for a decoder; each holds a file of the state
                              directory */
};

struct decode_pool;

struct decode_pool_desc {
    const struct config *config;       /* required, borrowed */
    const struct log *log;             /* required, borrowed */
    const struct resources *resources; /* required, borrowed */
};
struct decode_pool *decode_pool_create(const struct decode_pool_desc *desc, struct error *err);

/* Refuses what waits and what comes later with ERROR_OVERLOADED, as what still runs; threads end.
 * Destroy does so, too, where it was not done before. Both accept NULL. */
void decode_pool_stop(struct decode_pool *pool);
void decode_pool_destroy(struct decode_pool *pool);

struct decode_job_desc {
    const char *id;         /* of the upload, copied; required unless it is still to be filled */
    const char *request_id; /* copied; who may ask how far it is; NULL: nobody */
    struct upload *upload;  /* required; taken if decode_pool_submit succeeds */
    void *context;
    /* Optional: called first, on a thread of the pool, writes and ends the upload. What is stored
     * already is not decoded. */
    bool (*fill)(void *context, struct upload *upload, char id[DIGEST_TEXT_BYTES],
                 struct error *err);
    /* Called once, on a thread of the pool. problem->code is ERROR_NONE if the scene is stored. */
    void (*done)(void *context, bool is_new, const struct error *problem);
};
/* ERROR_OVERLOADED when the queue is full or the pool has stopped. */
MUST_CHECK bool decode_pool_submit(struct decode_pool *pool, const struct decode_job_desc *desc,
                                   struct error *err);

struct decode_status {
    bool is_decoding; /* else it waits for others */
    double elapsed_s; /* since it was submitted */
    char stage[16];   /* as in the OpenAPI document; "": the decoder has sent none yet */
    double share;     /* of the stage that is done, [0, 1] */
};
/* Of several uploads with this id the newest is meant. False: none is in work. */
bool decode_pool_find(struct decode_pool *pool, const char *request_id,
                      struct decode_status *status);

struct decode_totals {
    uint64_t decoded, refused, crashes, timeouts;
};
struct decode_totals decode_pool_get_totals(struct decode_pool *pool);

#endif
