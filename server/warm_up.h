/* SPDX-License-Identifier: MIT */
/* Warming up scenes that were just stored, and those last used before a start: while the worker
 * idles, it draws each once, small, with the settings of a request that names nothing but the
 * scene. Its programs are compiled and its shadows built by the time someone asks. Not locked: its
 * owner locks. */
#ifndef VITRAIL_SERVER_WARM_UP_H
#define VITRAIL_SERVER_WARM_UP_H

#include "protocol/render_request.h"
#include "renderer/renderer.h"
#include "server/render_queue.h"
#include "server/scene_store.h"

enum {
    WARM_UPS_MAX = 4,      /* of what waits, the newest are kept */
    WARM_UP_IDLE_MS = 300, /* the worker has had nothing to do for so long */
};

/* Zeroed = empty. */
struct warm_ups {
    struct render_task *tasks[WARM_UPS_MAX]; /* oldest first */
    int count;
};

/* A question (server/worker.h) about the scene; nobody waits for its answer. NULL with err. */
struct render_task *warm_up_task(struct scene_store *store, uint64_t ticket, const char *scene,
                                 struct error *err);

/* Takes the task. */
void warm_ups_add(struct warm_ups *warm_ups, struct render_task *task);
/* NULL when there is none. */
struct render_task *warm_ups_take(struct warm_ups *warm_ups);
/* The scene is drawn by someone's request, or is gone; NULL: all. */
void warm_ups_drop(struct warm_ups *warm_ups, const char *scene);

/* In the worker: whether that is asked, and the answer, {"programs_built": N}. Thread: GL. */
bool warm_up_is_step(const json_t *question);
json_t *warm_up_step(struct renderer *renderer, const struct render_request *request,
                     struct error *err);

#endif
