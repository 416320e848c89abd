/* SPDX-License-Identifier: MIT */
/* The place of one worker: the process in it, how it starts, the jobs that it has, the device that
 * it took, the scenes that it was sent. A process that ends leaves the slot to the next one. Not
 * locked: its owner locks. */
#ifndef VITRAIL_SERVER_FRONT_WORKER_SLOT_H
#define VITRAIL_SERVER_FRONT_WORKER_SLOT_H

#include <jansson.h>

#include "protocol/capabilities.h"
#include "server/base/child.h"
#include "server/base/config.h"
#include "server/front/device_trials.h"
#include "server/front/worker_jobs.h"

enum {
    WORKER_SCENES_MAX = 256, /* remembered; beyond it the one not sent for longest is forgotten */
    WORKER_NAME_BYTES = 24,
    WORKER_LESSONS_MAX = 64,
};

enum worker_state { WORKER_NONE, WORKER_STARTING, WORKER_READY };

/* What a worker counted; those of the process that runs are 0 again when it ends. */
struct worker_totals {
    uint64_t starts, crashes, timeouts;
    uint64_t rendered, answered;                 /* that succeeded */
    uint64_t programs_built, programs_reused;    /* of shaders, by the process that runs */
    uint64_t programs_loaded;                    /* likewise: from the state directory */
    uint64_t programs_kept, programs_kept_bytes; /* there */
    uint64_t timed, timings_stopped;             /* runners-up of `auto`, by that process */
    uint64_t learned;      /* print of what `auto` goes by beside the device's speed; 0: nothing */
    uint64_t learned_kept; /* likewise, of what is in the file */
    uint64_t gpu_used_bytes, cache_bytes, cache_scenes, cache_hits, cache_misses, cache_evictions;
    int pid; /* 0 = none */
};

struct sent_scene {
    char id[DIGEST_TEXT_BYTES];
    uint64_t when; /* order of the last time it was sent; 0 = free */
};

struct worker_slot {                /* zeroed = empty */
    int number;                     /* 1 for the first */
    char name[WORKER_NAME_BYTES];   /* in the log: "the worker", or of several "worker 2" */
    char device[CONFIG_TEXT_BYTES]; /* what it is asked to open */
    struct child process;           /* touched by the supervisor's thread only, but for its pid */
    enum worker_state state;
    int64_t state_ms, next_start_ms, last_event_ms;
    int backoff_ms;
    bool is_keeper;        /* this process measures the device, learns, and keeps what is learned */
    uint64_t told_learned; /* print of what this process was told that the keeper has learned */
    json_t *lessons;       /* owned: of other workers, to be sent to this keeper; or NULL */
    json_t *times;         /* likewise, to be sent to this process, keeper or not */
    bool is_deaf;          /* it no longer takes messages */
    bool is_resting;       /* since nobody asked for --rest-s */
    bool has_rendered;     /* since this process is ready */
    struct worker_jobs jobs;
    json_t *forgotten;        /* owned; ids of deleted scenes that are still to be sent to it */
    struct error start_error; /* set while it cannot be started */
    struct device_trials trials;
    bool is_hopeless; /* none is started any more */
    char *hopeless;   /* owned: why, set with the former; or NULL */
    struct device_capabilities capabilities;
    struct worker_totals totals;
    struct sent_scene sent[WORKER_SCENES_MAX];
    int sent_count;
    uint64_t sent_clock;
};

/* False: no memory. */
MUST_CHECK bool worker_slot_init(struct worker_slot *slot, int number, bool is_alone);
void worker_slot_finish(struct worker_slot *slot); /* accepts zeroed */

/* The process has ended: what it had is gone. */
void worker_slot_note_end(struct worker_slot *slot);

/* The scenes that its process was sent and not told to forget. It may have let some go for others
 * since: loading those again costs it no more than it would cost another. */
void worker_slot_note_sent(struct worker_slot *slot, const char *scene);
bool worker_slot_has_scene(const struct worker_slot *slot, const char *scene);
/* An id of a scene or a map that was deleted: no-op where no process runs. */
void worker_slot_forget(struct worker_slot *slot, const char *id);

#endif
