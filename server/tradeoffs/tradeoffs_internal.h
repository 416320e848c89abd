/* SPDX-License-Identifier: MIT */
/* The parts of struct tradeoffs, shared by server/tradeoffs/tradeoffs.c, tradeoff_run.c and
 * tradeoff_offer.c only. */
#ifndef VITRAIL_SERVER_TRADEOFFS_TRADEOFFS_INTERNAL_H
#define VITRAIL_SERVER_TRADEOFFS_TRADEOFFS_INTERNAL_H

#include <pthread.h>

#include "protocol/limits.h"
#include "server/tradeoffs/tradeoff_store.h"
#include "server/tradeoffs/tradeoffs.h"

struct tradeoff_entry {
    struct tradeoff document;
    struct tradeoff_request request; /* zeroed once it has ended */
    double started_s;                /* of the monotonic clock; while it runs */
    bool is_used;     /* by the thread, which measures it: it is not removed meanwhile */
    bool is_unwanted; /* its scene was deleted: the thread removes it */
};

struct tradeoffs {
    struct tradeoffs_desc desc;
    struct tradeoff_store *store;
    pthread_t thread;
    bool has_thread;
    pthread_mutex_t mutex; /* guards all below, and the documents; never held while waiting for the
                              disk or the worker */
    pthread_cond_t changed;
    bool is_stopping;
    struct tradeoff_entry *entries[LIMIT_TRADEOFFS_KEPT]; /* oldest first */
    int count;
};

bool tradeoff_has_ended(const struct tradeoff *tradeoff);

double tradeoffs_clock_s(void); /* monotonic */

/* Measures one entry, from RUNNING to an end, on the thread of the trade-offs. */
void tradeoff_run(struct tradeoffs *tradeoffs, struct tradeoff_entry *entry);

/* The name of the device in results: results of another name are not used for promises. False
 * while no device is known. */
bool tradeoffs_device_name(struct tradeoffs *tradeoffs, char name[TRADEOFF_DEVICE_BYTES]);

/* Whether the scene, or one of those of its parts, has density grids. */
bool tradeoffs_has_grids(struct tradeoffs *tradeoffs, const char *scene,
                         const struct request_resources *resources);

/* Digest of what decides the reference and is not varied. text: of request_reference_text; NULL: no
 * memory. */
MUST_CHECK bool tradeoff_view_key(const char *text, char key[65], struct error *err);

#endif
