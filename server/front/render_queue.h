/* SPDX-License-Identifier: MIT */
/* Renders waiting for a worker: bounded, by priority, then in the order they came. Not locked:
 * its owner locks. */
#ifndef VITRAIL_SERVER_FRONT_RENDER_QUEUE_H
#define VITRAIL_SERVER_FRONT_RENDER_QUEUE_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/frame_stats.h"
#include "protocol/render_request.h"
#include "renderer/image/image.h"
#include "server/base/digest.h"

enum render_priority { RENDER_INTERACTIVE, RENDER_NORMAL, RENDER_BATCH, RENDER_PRIORITY_COUNT };

/* Exactly one of problem (a code other than ERROR_NONE) and an image. */
struct render_outcome {
    struct error problem;
    int image_fd;                  /* owned by the task; `done` may take it and put -1 here */
    struct frame_stats *stats;     /* owned by the task; NULL on failure, and of a question */
    char drawn[DIGEST_TEXT_BYTES]; /* the digest of the canonical request that was drawn, where the
                                      worker chose for a target; else "" */
    json_t *answer;                /* owned by the task; to a question, whose image is optional */
    double queue_ms;               /* from submission to the GL thread */
    int worker;                    /* the number of the one that made it; 0: none did */
};

struct render_task {
    struct render_task *next;
    uint64_t ticket; /* required, unique: supervisor_next_ticket */
    char scene[DIGEST_TEXT_BYTES];
    int request_fd, blob_fd; /* required but of a question without a scene; owned */
    const char *request_id;  /* of who waits for it, borrowed until it is done; NULL: none */
    struct request_resources resources; /* with descriptors below, owned; beside task->scene */
    int part_fds[LIMIT_PART_SCENES];    /* by resources.scenes; as many are open */
    int environment_fd;                 /* of resources.environment; -1: none, or built in */
    enum image_format format;
    enum render_priority priority;
    bool is_cancelled;  /* nobody waits for it any more */
    bool expects_reuse; /* one of many frames: renderer/view.h */
    bool may_be_coarse; /* likewise */
    bool is_of_job;     /* its owner tries again: the first death ends it and charges no scene */
    int64_t queued_us;  /* set when queued */
    int crashes;        /* workers that died on it */
    json_t *offer; /* owned; for the worker's choice (server/mapping/choice_offer.h), or NULL */
    /* Of a frame whose job has chosen before; owned, or NULL: the error that was stated then, and
     * the quality that the job was asked for and that the file tells. */
    json_t *stated_error, *asked_quality;
    /* Owned; NULL: a render. What is asked of the worker instead (server/worker/measure.h,
     * server/worker/explain.h, server/worker/pick.h): once, and its failure says nothing about the
     * scene. */
    json_t *question;
    int reference_fd; /* owned; of a measurement, -1: none */
    int limit_ms;     /* from its begin to its end; 0: that of the configuration */
    int home; /* the number of the only worker that shall have it while that serves; 0: any */
    struct render_outcome outcome;
    void *context;
    /* Called once, on the thread that ends the task. */
    void (*done)(void *context, struct render_outcome *outcome);
};
/* NULL for want of memory; the descriptors are -1. */
struct render_task *render_task_create(void);
void render_task_destroy(struct render_task *task); /* closes descriptors; accepts NULL */

/* Zeroed = empty. */
struct render_queue {
    struct render_task *first[RENDER_PRIORITY_COUNT];
    size_t count;
};

/* Takes the task, or answers false when max_count wait already. */
MUST_CHECK bool render_queue_push(struct render_queue *queue, struct render_task *task,
                                  size_t max_count);
/* Queues a retry as the first of its priority. */
void render_queue_push_back(struct render_queue *queue, struct render_task *task);
struct render_task *render_queue_pop(struct render_queue *queue); /* NULL when empty */
/* Removes the task; NULL when it does not wait. */
struct render_task *render_queue_remove(struct render_queue *queue, uint64_t ticket);
const struct render_task *render_queue_find(const struct render_queue *queue, uint64_t ticket);
/* The newest task with this request id; NULL when none waits. */
const struct render_task *render_queue_find_request(const struct render_queue *queue,
                                                    const char *request_id);
/* queued_us of the oldest task. */
int64_t render_queue_oldest_us(const struct render_queue *queue, int64_t otherwise);

#endif
