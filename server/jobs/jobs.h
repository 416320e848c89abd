/* SPDX-License-Identifier: MIT */
/* The jobs of render farms: lists of frames that are rendered one after the other, whatever ends
 * meanwhile. A job is accepted once it is on the disk; a frame is done once its files are there and
 * that is on the disk, too, so a daemon that is killed loses frames in flight and nothing else, and
 * renders them when it is started again. Thread: any; owns one thread, which submits frames, writes
 * results and answers those who wait.
 *
 * Frames are renders of the lowest priority, so pictures that somebody waits for go first. Jobs
 * share what is left by weight: ten steps of priority double it. A failed frame is tried again, as
 * often as its job says, and then left out; failures that no frame is to blame for, such as a
 * device that is lost or a full disk, cost no attempt. */
#ifndef VITRAIL_SERVER_JOBS_JOBS_H
#define VITRAIL_SERVER_JOBS_JOBS_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"
#include "server/base/config.h"
#include "server/base/digest.h"
#include "server/base/log.h"
#include "server/front/resources.h"
#include "server/front/supervisor.h"
#include "protocol/frame_list.h"
#include "server/jobs/job_store.h"
#include "server/tradeoffs/tradeoffs.h"

struct jobs;

struct jobs_desc { /* all required; borrowed until jobs_stop */
    const struct config *config;
    const struct log *log;
    struct supervisor *supervisor;
    const struct resources *resources;
    struct tradeoffs *tradeoffs;
};

/* Reads the jobs that are kept; those that had not ended go on. */
struct jobs *jobs_create(const struct jobs_desc *desc, struct error *err);

/* Ends the thread, and answers who waits. Call it before the supervisor is stopped, and destroy
 * after that. Both accept NULL. */
void jobs_stop(struct jobs *jobs);
void jobs_destroy(struct jobs *jobs);

/* Accepts a job, which is on the disk when this returns. key: what the client calls this request
 * (Idempotency-Key), or NULL: a second request with that key and the same text gets the job of the
 * first, is_new false; with another text ERROR_UNSUPPORTED. */
MUST_CHECK bool jobs_submit(struct jobs *jobs, const char *text, size_t size_bytes, const char *key,
                            char id[JOB_ID_BYTES], bool *is_new, struct error *err);

/* What clients may change of a job. */
struct job_change {
    bool has_paused, is_paused;
    bool has_priority;
    int priority;
    bool retries; /* failed frames are queued again, with new attempts */
};
MUST_CHECK bool jobs_change(struct jobs *jobs, const char *id, const struct job_change *change,
                            struct error *err);

/* Cancel: no more frames; what is done stays, and a job that has ended stays as it is. Forget: a
 * job that has ended (else ERROR_CONFLICT) is removed, with the results in the state directory. */
MUST_CHECK bool jobs_cancel(struct jobs *jobs, const char *id, struct error *err);
MUST_CHECK bool jobs_forget(struct jobs *jobs, const char *id, struct error *err);

/* New references; NULL with ERROR_NOT_FOUND or ERROR_NO_MEMORY. */
MUST_CHECK json_t *jobs_get(struct jobs *jobs, const char *id, struct error *err);
MUST_CHECK json_t *jobs_list(struct jobs *jobs, struct error *err); /* newest first */
/* The frames from `first` on, at most max_count. */
MUST_CHECK json_t *jobs_get_frames(struct jobs *jobs, const char *id, int first, int max_count,
                                   struct error *err);

/* A file of a frame, for reading. */
struct job_file {
    int fd; /* the caller closes it */
    uint64_t size_bytes;
    char digest[DIGEST_TEXT_BYTES];
    char name[256];
    const char *media_type; /* static */
};
/* ERROR_NOT_FOUND names what is not there, or not yet. */
MUST_CHECK bool jobs_open_file(struct jobs *jobs, const char *id, int frame, const char *output,
                               struct job_file *file, struct error *err);
/* The file at or after a position of all files of a job, in the order of its frames; *at becomes
 * the position after it. False with err empty: there is none. */
MUST_CHECK bool jobs_next_file(struct jobs *jobs, const char *id, uint64_t *at,
                               struct job_file *file, struct error *err);

/* Calls done once, on the jobs' thread, when the job has ended, or, where `sequence` is not 0, has
 * changed since then; or after wait_ms, or when waiting is stopped. Returns the ticket to stop it
 * by. It may be called before this returns. */
struct job_wait {
    const char *id;
    uint32_t sequence;
    int64_t wait_ms;
    void *context;
    void (*done)(void *context);
};
MUST_CHECK uint64_t jobs_new_ticket(struct jobs *jobs);
MUST_CHECK bool jobs_wait(struct jobs *jobs, const struct job_wait *wait, uint64_t ticket,
                          struct error *err);
void jobs_stop_waiting(void *jobs, uint64_t ticket); /* as http_wait calls it */

/* Told of changes of a job: notify is called on any thread with a lock held; it must not call back
 * and not wait. */
struct job_watch;
struct job_watch *jobs_watch(struct jobs *jobs, const char *id, void *context,
                             void (*notify)(void *context), struct error *err);
void jobs_unwatch(struct job_watch *watch); /* afterwards notify is not called; accepts NULL */
/* What changed after `sequence`: {"sequence", "frames": [...], "job": {...}}; the frames in the
 * order of their changes, each in its newest state. NULL: the job is gone, the server stops, or for
 * want of memory. */
MUST_CHECK json_t *jobs_changes(struct jobs *jobs, const char *id, uint32_t sequence);

/* Removes a scene or an environment map. Unless is_forced, ERROR_CONFLICT names a job that needs it
 * and has not ended. */
MUST_CHECK bool jobs_remove_resource(struct jobs *jobs, enum resource_kind kind, const char *id,
                                     bool is_forced, struct error *err);

enum forget_reason { FORGET_ASKED, FORGET_AGE, FORGET_BYTES, FORGET_REASON_COUNT };

struct jobs_totals {
    uint64_t by_state[FARM_JOB_STATE_COUNT]; /* queued: those that wait for no other */
    uint64_t waiting;
    uint64_t frames_done, frames_failed, frames_retried; /* since the daemon began */
    uint64_t forgotten[FORGET_REASON_COUNT];             /* likewise */
    uint64_t frames_waiting, result_bytes;
    uint64_t kept_bytes; /* of result_bytes, those in the state directory */
};
struct jobs_totals jobs_get_totals(struct jobs *jobs);

#endif
