/* SPDX-License-Identifier: MIT */
/* What the worker knows of its device beside what the renderer tells: how fast it is at what `auto`
 * and compressed textures are decided by, and what frames taught. Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_WORKER_DEVICE_H
#define VITRAIL_SERVER_WORKER_WORKER_DEVICE_H

#include <jansson.h>

#include "protocol/capabilities.h"
#include "renderer/renderer.h"

enum { WORKER_PATH_BYTES = 4096 };

struct worker_device { /* zeroed = not begun */
    struct renderer *renderer;
    json_t *settings; /* owned */
    bool is_pending;  /* its speed is not known yet: worker_device_measure */
    bool keeps;       /* writes what is learned; else another worker does */
    struct auto_settings automatic;
    char auto_note[CAPABILITIES_TEXT_BYTES];
    struct device_blocks blocks;
    char observations_path[WORKER_PATH_BYTES]; /* "": they are not kept */
    uint64_t observations_print;               /* of those in the file */
    double looked_ms;                          /* when it was last found that they are */
};

/* From files of an earlier start, or measured; tells the renderer. In software the speed that
 * `auto` goes by is measured later: most of it is programs that the first picture would have to
 * wait for. settings: the worker's message `configure` (server/worker/worker.h). What cannot be
 * measured is no failure. */
void worker_device_init(struct worker_device *device, struct renderer *renderer,
                        const json_t *settings);

void worker_device_finish(struct worker_device *device); /* accepts zeroed */

/* Measures its speed, which is pending; with no frame under way. */
void worker_device_measure(struct worker_device *device);

void worker_device_describe(const struct worker_device *device,
                            struct device_capabilities *capabilities);

/* Reads what the worker that keeps has learned from frames. With no frame under way. */
void worker_device_follow(struct worker_device *device);

/* Of a worker that keeps nothing: what its frames teach, as JSON, each once; NULL: nothing. */
json_t *worker_device_take_lessons(struct worker_device *device);
/* Of the one that keeps: learns from frames of another worker. With no frame under way. */
void worker_device_learn(struct worker_device *device, const json_t *lessons);

/* The print of what was learned from frames. */
uint64_t worker_device_learned(const struct worker_device *device);
/* Stores it where this worker keeps; afterwards `observations_print` is that of the file. What
 * cannot be written is learned again at the next start. A view in motion waits for no file: most
 * calls of its frames store nothing, and one afterwards has to. */
void worker_device_keep_observations(struct worker_device *device, bool is_in_motion);

#endif
