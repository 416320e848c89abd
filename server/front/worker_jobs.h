/* SPDX-License-Identifier: MIT */
/* Jobs in flight: the renders and questions that the worker has, in the order they were sent. The
 * module knows the state of each job, how many more the worker takes, and by when it must be done.
 * Not locked: its owner locks. */
#ifndef VITRAIL_SERVER_FRONT_WORKER_JOBS_H
#define VITRAIL_SERVER_FRONT_WORKER_JOBS_H

#include "server/front/render_queue.h"

enum { WORKER_JOBS_DEPTH_MAX = 8 };

enum job_state {
    JOB_SENT,
    JOB_BEGUN,     /* on the GL thread */
    JOB_PAUSED,    /* urgent jobs run before the rest of it */
    JOB_ON_DEVICE, /* submitted to the GPU; the GL thread may run another job */
    JOB_ENCODING
};

/* How far a frame is in one of its stages: "shadows", "rays" or "shading". */
struct job_progress {
    char stage[16];     /* "": not known */
    double share;       /* of the stage that is finished, [0, 1] */
    double left_s;      /* of the stage, at the pace so far; below 0: not known */
    double first_share; /* of the first message of the stage ... */
    int64_t since_ms;   /* ... and when that came */
};

struct worker_job {
    struct render_task *task;
    enum job_state state;
    /* When the state began. A resumed job counts its pause out. A job on the device counts from its
     * begin, or from the end of the job before it. */
    int64_t since_ms;
    int64_t ran_ms;   /* how long a paused job ran before */
    bool is_notified; /* the worker knows that the job is cancelled */
    struct job_progress progress;
};

/* Takes in a progress message of the worker. */
void job_progress_note(struct job_progress *progress, const char *stage, double share,
                       int64_t now_ms);
/* {"stage", "share", "left_s"}: a new reference; NULL: no memory. */
json_t *job_progress_to_json(const struct job_progress *progress);

/* Zeroed = none. Urgent jobs have room of their own, so that others cannot keep them waiting. */
struct worker_jobs {
    struct worker_job list[2 * WORKER_JOBS_DEPTH_MAX];
    int count;
    int depth; /* urgent jobs that the worker takes at a time, and as many others */
};

bool worker_jobs_have_room(const struct worker_jobs *jobs, enum render_priority priority);
void worker_jobs_add(struct worker_jobs *jobs, struct render_task *task, int64_t now_ms);
void worker_jobs_remove(struct worker_jobs *jobs, int index);
/* The index of the job; of several with one request id the newest. -1: none. */
int worker_jobs_find(const struct worker_jobs *jobs, uint64_t ticket);
int worker_jobs_find_request(const struct worker_jobs *jobs, const char *request_id);
bool worker_jobs_have(const struct worker_jobs *jobs, enum job_state state);

/* Takes in what the worker says of a job: begin, paused, resumed, submitted or rendered. False for
 * any other word. */
bool worker_job_note(struct worker_job *job, const char *op, int64_t now_ms);
/* A job has left the device: the time of those that waited behind it begins. */
void worker_jobs_note_free_device(struct worker_jobs *jobs, int64_t now_ms);
/* This job lost the GL context: all others that were begun count as sent again. */
void worker_jobs_note_lost(struct worker_jobs *jobs, int index);

/* Which job a crash is charged to: the one on the GL thread, or, where the worker was late, the
 * first one that was begun; else the one on the device, else the oldest. -1: none. */
int worker_jobs_culprit(const struct worker_jobs *jobs, bool is_late);

/* By when the worker must have said something. limit_ms holds for each state of a job whose task
 * has no limit of its own. last_event_ms: when the worker last said something. INT64_MAX: never. */
int64_t worker_jobs_deadline(const struct worker_jobs *jobs, int64_t limit_ms,
                             int64_t last_event_ms);
/* How long this job may stay in its state. */
int64_t worker_job_limit_ms(const struct worker_job *job, int64_t limit_ms);

#endif
