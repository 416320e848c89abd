/* SPDX-License-Identifier: MIT */
/* Warming up scenes that were just stored, and those last used before a start: while the worker
 * (server/worker/warm_up_step.h) idles, it finds out what pictures that name nothing but the scene
 * take by default (once, and as a view at rest and in motion), draws each kind once, small, and
 * compiles what such pictures need from anywhere else. Its programs are compiled, its shadows or
 * the ray tracer's scene built by the time someone asks. Who asks meanwhile goes first: a picture
 * that is under way ends. Not locked: its owner locks. */
#ifndef VITRAIL_SERVER_FRONT_WARM_UP_H
#define VITRAIL_SERVER_FRONT_WARM_UP_H

#include "protocol/render_request.h"
#include "server/base/config.h"
#include "server/front/render_queue.h"
#include "server/front/resources.h"

enum {
    WARM_UP_IDLE_MS = 300, /* the worker has had nothing to do for so long */
    WARM_UP_TRIES = 4,     /* one that gave way so often only compiles */
};

/* Zeroed = empty. */
struct warm_ups {
    struct render_task *tasks[WARM_UPS_MAX + 1]; /* oldest first; one more while one is added */
    int count;
    uint64_t dropped;
};

/* The work of warm-ups since the start. */
struct warm_up_totals {
    uint64_t done, dropped, interrupted; /* scenes; interrupted: times that one gave way */
    uint64_t pictures;                   /* drawn */
    uint64_t shadow_maps_built, ray_structures_built;
    uint64_t programs_built; /* compiled, or taken from the program folder */
};

struct warm_up_desc {
    const char *scene; /* required */
    bool is_at_start;  /* nobody posted it since */
};
/* Makes a question (server/worker/worker.h) about the scene, whose answer nobody waits for. NULL
 * with err. */
struct render_task *warm_up_task(const struct resources *resources, uint64_t ticket,
                                 const struct warm_up_desc *desc, struct error *err);

/* Takes the task. */
void warm_ups_add(struct warm_ups *warm_ups, struct render_task *task);
/* NULL when there is none. */
struct render_task *warm_ups_take(struct warm_ups *warm_ups);
/* The scene is gone; NULL: all. */
void warm_ups_drop(struct warm_ups *warm_ups, const char *scene);
/* Someone has an image of the scene: no more is drawn of it, but what other pictures keep is built,
 * and their programs compiled. */
void warm_ups_note_drawn(struct warm_ups *warm_ups, const char *scene);

/* Whether a warm-up was preempted, by its answer. The task then does the rest when it is sent
 * again. Called in the front. */
bool warm_up_continue(struct render_task *task);
/* Adds what an answer says that it did. */
void warm_up_count(struct warm_up_totals *totals, const json_t *answer);

#endif
