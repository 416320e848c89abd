/* SPDX-License-Identifier: MIT */
/* Warming up scenes that were just stored, and those last used before a start: while the worker
 * idles, it draws each once, small, with the settings of a request that names nothing but the
 * scene, and compiles what pictures at rest and in motion need from anywhere else. Its programs are
 * compiled and its shadows built by the time someone asks. Not locked: its owner locks. */
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
/* The scene is gone; NULL: all. */
void warm_ups_drop(struct warm_ups *warm_ups, const char *scene);
/* The scene is drawn by someone's request: only the programs of other pictures are left to do. */
void warm_ups_note_drawn(struct warm_ups *warm_ups, const char *scene);

/* In the front: whether the answer to one says that it stopped for what came in between; then the
 * task goes on with its programs when it is sent again. */
bool warm_up_continue(struct render_task *task);

/* In the worker: whether that is asked, and the answer, {"is_complete": bool}: false where it
 * stopped because shall_stop said so. Thread: GL. */
bool warm_up_is_step(const json_t *question);
struct warm_up_step_desc { /* all required */
    struct renderer *renderer;
    const struct render_request *request;
    const json_t *question; /* {"warm_up": "all" | "programs"}; the latter draws nothing */
    bool (*shall_stop)(void *context);
    void *context;
};
json_t *warm_up_step(const struct warm_up_step_desc *desc, struct error *err);

#endif
