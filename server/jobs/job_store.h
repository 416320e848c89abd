/* SPDX-License-Identifier: MIT */
/* The jobs on disk: one SQLite database, in which a commit survives a loss of power (WAL with
 * synchronous=FULL). Results are files beside it (server/jobs/job_results.h). Thread: any, one at a
 * time; its owner locks. */
#ifndef VITRAIL_SERVER_JOBS_JOB_STORE_H
#define VITRAIL_SERVER_JOBS_JOB_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/job_request.h"
#include "server/base/digest.h"
#include "server/base/log.h"

enum { JOB_KEY_BYTES = 256 };

enum farm_job_state {
    FARM_JOB_QUEUED,
    FARM_JOB_RUNNING,
    FARM_JOB_DONE,
    FARM_JOB_FAILED,
    FARM_JOB_CANCELLED,
    FARM_JOB_STATE_COUNT
};
enum farm_frame_state {
    FARM_FRAME_QUEUED,
    FARM_FRAME_RUNNING, /* never in the database */
    FARM_FRAME_DONE,
    FARM_FRAME_FAILED,
    FARM_FRAME_STATE_COUNT
};

struct job_record {
    int64_t number; /* of the database, from 1, never twice: the order of jobs; 0: not there yet */
    char id[JOB_ID_BYTES];
    int64_t created_s, started_s, ended_s; /* since 1970; 0: not yet */
    int64_t ended_ms; /* when it ended, in time that servers ran (job_clock.c); 0: not yet */
    enum farm_job_state state;
    bool is_paused;
    int priority;
    uint32_t sequence; /* number of the last change, from 1 */
    struct error problem;
    const char *chosen;  /* JSON, borrowed; what the server chose for all frames, NULL: not yet */
    const char *request; /* canonical JSON, borrowed; only read when it is added */
};

/* What is known of a frame; one that nothing is known of is queued. */
struct frame_record {
    int position; /* in the list of frames */
    enum farm_frame_state state;
    int attempts;
    uint32_t sequence;
    double ms;
    enum error_code code; /* of the last failure; ERROR_NONE: none */
    const char *problem;  /* borrowed; NULL: none */
};

struct file_record {
    int position, output;
    uint64_t size_bytes;
    char digest[DIGEST_TEXT_BYTES];
};

struct job_store;

/* Opens or makes DIRECTORY/jobs.db. A damaged one is set aside, with a line in the log; one of a
 * newer version is ERROR_CONFLICT, since its jobs would be lost. */
struct job_store *job_store_create(const char *directory, const struct log *log, struct error *err);
void job_store_destroy(struct job_store *store); /* accepts NULL */

/* Calls the visitors in the order of jobs; frames and files come after their job. The visitors keep
 * nothing that is borrowed. */
struct job_visitor {
    void *context;
    bool (*job)(void *context, const struct job_record *job, struct error *err);
    void (*frame)(void *context, int64_t job, const struct frame_record *frame);
    void (*file)(void *context, int64_t job, const struct file_record *file);
};
MUST_CHECK bool job_store_load(struct job_store *store, const struct job_visitor *visitor,
                               struct error *err);

/* Adds a job and sets its number. It is on the disk when this returns. key: "" or what the client
 * calls this request, which no other job has; body: the digest of what the client sent. */
MUST_CHECK bool job_store_add(struct job_store *store, struct job_record *job, const char *key,
                              const char *body, struct error *err);

/* The job of a key and the digest of its body. False with err empty: none has that key. */
MUST_CHECK bool job_store_find_key(struct job_store *store, const char *key, char id[JOB_ID_BYTES],
                                   char body[DIGEST_TEXT_BYTES], struct error *err);

/* Each is one transaction. update: all but number, id, created_s and request; retries: failed
 * frames are queued again. */
MUST_CHECK bool job_store_update(struct job_store *store, const struct job_record *job,
                                 bool retries, struct error *err);
/* file: NULL, or a file of the frame; job: with its new state, or NULL. */
MUST_CHECK bool job_store_put_frame(struct job_store *store, int64_t number,
                                    const struct frame_record *frame,
                                    const struct file_record *file, const struct job_record *job,
                                    struct error *err);
/* The time that servers with this database ran, as far as it is known. */
MUST_CHECK bool job_store_get_ran_ms(struct job_store *store, int64_t *ran_ms, struct error *err);
MUST_CHECK bool job_store_set_ran_ms(struct job_store *store, int64_t ran_ms, struct error *err);
MUST_CHECK bool job_store_remove(struct job_store *store, int64_t number, struct error *err);

#endif
