/* SPDX-License-Identifier: MIT */
/* The parts of struct jobs, shared by the files of server/jobs only. */
#ifndef VITRAIL_SERVER_JOBS_JOBS_INTERNAL_H
#define VITRAIL_SERVER_JOBS_JOBS_INTERNAL_H

#include <pthread.h>

#include "protocol/job_request.h"
#include "protocol/turntable.h"
#include "renderer/image/image.h"
#include "server/jobs/job_results.h"
#include "server/jobs/job_tiles.h"
#include "server/jobs/jobs.h"

enum {
    PIECES_PER_WORKER = 2, /* one is drawn while the other is encoded */
    JOB_PIECES_MAX = PIECES_PER_WORKER * CONFIG_WORKERS_MAX,
};

struct farm_file {
    uint64_t size_bytes; /* 0: not there */
    char digest[DIGEST_TEXT_BYTES];
};

enum farm_tile_state { FARM_TILE_TO_DO, FARM_TILE_IN_FLIGHT, FARM_TILE_DONE };
struct farm_tile {
    uint8_t state, attempts;
};

struct farm_frame {
    enum farm_frame_state state;
    int attempts;
    uint32_t sequence;  /* of its last change; 0: none */
    uint32_t in_flight; /* bit set of 1u << output */
    float ms;
    enum error_code code;
    char *problem;           /* owned; of the last failure, or NULL */
    struct farm_file *files; /* owned; one per output, or NULL */
    struct farm_tile *tiles; /* owned; of each output one after the other; NULL: none has begun */
    int tiles_in_flight;
};

struct farm_job {
    struct job_record record;   /* its request is NULL, its chosen that below */
    char *chosen;               /* owned; once it is set it stays */
    json_t *chosen_json;        /* likewise; NULL where nothing was left open */
    struct job_request request; /* its files are named */
    struct farm_frame *frames;  /* request.frames.count */
    int done_count, failed_count;
    int crashes;    /* frames that failed by ending workers since one was done */
    int next;       /* every frame before this position has ended */
    double pass;    /* milliseconds of its frames over its weight: the least goes first */
    double busy_ms; /* of all frames that are done */
    struct picture_tiles tiles; /* of each picture; zeroed: it is in one piece */
    int64_t tiles_done;         /* since the server began, or found then */
    double tiles_ms;            /* of those that were rendered since */
    uint64_t result_bytes;
    struct turntable turntable; /* has_bounds */
    bool has_bounds, is_animated;
    bool is_decided; /* a frame is done: what it chose, or that there was nothing, holds for all */
    bool makes_directory;           /* somebody resumed it, and no frame has been done since */
    bool is_gone;                   /* forgotten; freed when no piece refers to it */
    int pieces;                     /* in flight */
    int64_t after[LIMIT_JOB_AFTER]; /* numbers of the jobs that it waits for; 0: not there */
    /* Bit sets of 1u << index of those: that have not ended well yet; and of these, that have ended
     * badly or are not there. Kept by job_order_update. */
    uint32_t unmet, broken;
    bool is_awaited;         /* a job that has not begun is to come after it, or was lately */
    struct error broken_why; /* of the first that is broken */
};

/* A file in the making: one render. */
struct job_piece {
    struct job_piece *next; /* of those that have ended */
    struct jobs *jobs;
    struct farm_job *job;
    int position, output, attempt;
    int tile; /* or TILE_NONE, TILE_ASSEMBLY */
    uint64_t ticket;
    double charged_ms; /* to the job's pass when it began */
    /* set when it has ended */
    struct error problem;
    int image_fd; /* owned; -1: none */
    double ms;
    char *chosen; /* owned; what was chosen for the frame, as JSON; NULL: nothing, or not asked */
    uint64_t size_bytes;            /* of a picture that was joined, in its draft */
    char digest[DIGEST_TEXT_BYTES]; /* likewise */
    bool is_unwritable;             /* the picture could not be written */
};

struct waiting {
    struct waiting *next;
    char id[JOB_ID_BYTES];
    uint32_t sequence;
    int64_t due_ms;
    uint64_t ticket;
    void *context;
    void (*done)(void *context);
};

struct job_watch {
    struct job_watch *next;
    struct jobs *jobs;
    char id[JOB_ID_BYTES];
    void *context;
    void (*notify)(void *context);
};

struct jobs {
    struct jobs_desc desc;
    struct job_store *store;
    struct job_results *results;
    pthread_t thread;
    bool has_thread;
    pthread_mutex_t disk;  /* guards the store; taken before the other one, held while writing */
    pthread_mutex_t mutex; /* guards all below; never held while waiting for disk or worker */
    pthread_cond_t changed;
    bool is_stopping;
    struct farm_job **list; /* owned, in the order of their numbers */
    int count, capacity;
    uint64_t frames_kept;
    struct job_piece *in_flight[JOB_PIECES_MAX]; /* NULL: room */
    struct job_piece *ended;
    bool is_assembling;  /* one picture is joined at a time */
    pid_t assembler_pid; /* 0: none */
    pthread_t assembler; /* of the jobs' thread, and of who stops it after that */
    bool has_assembler;
    int64_t resume_ms;               /* nothing is submitted before: the worker cannot take more */
    int64_t ran_before_ms, began_ms; /* time that servers ran before; when this one began */
    int64_t look_ms;     /* when jobs that are kept long enough are looked for again; 0: now */
    bool order_is_stale; /* a job has ended or begun anew, so that others may go on */
    uint64_t next_ticket;
    struct waiting *waiting;
    struct job_watch *watches;
    struct jobs_totals totals; /* its counters of frames */
};

/* All under the mutex, unless said otherwise. */

struct farm_job *jobs_find(struct jobs *jobs, const char *id); /* NULL: none */
bool jobs_not_found(const char *id, struct error *err);        /* false, with that said */
bool farm_job_has_ended(const struct farm_job *job);
struct job_place farm_job_place(const struct farm_job *job);

/* Notes a change of the job: numbers it and tells who watches and waits. */
void jobs_note_change(struct jobs *jobs, struct farm_job *job);
void jobs_notify_watches(struct jobs *jobs, const char *id); /* id: NULL for those of all jobs */

/* Takes those whose wait is over. */
struct waiting *jobs_take_due(struct jobs *jobs);
/* Answers and frees them. Not under the mutex. */
void jobs_answer(struct waiting *due);

/* Sets a frame's state and keeps the counts. */
void farm_job_set_frame(struct farm_job *job, int position, enum farm_frame_state state);

/* Frees a job that nothing refers to any more. */
void farm_job_destroy(struct farm_job *job); /* accepts NULL */

/* Lets a job begin where the least served of the others are. */
void jobs_join_queue(struct jobs *jobs, struct farm_job *job);

/* Whether the scenes and the map that it shows are there; ERROR_NOT_FOUND names what is missing. */
MUST_CHECK bool farm_job_has_resources(const struct jobs *jobs, const struct farm_job *job,
                                       struct error *err);

/* ---- clocks and keeping: job_retention.c ---- */

/* The time that servers with this state directory ran, by a clock that does not jump. */
int64_t jobs_ran_ms(const struct jobs *jobs);
/* The system's time for a job to state: it may jump, but no earlier than what the job states. */
int64_t farm_job_now_s(const struct farm_job *job);
/* The job has that state, in which it has ended. */
void jobs_note_end(struct jobs *jobs, struct farm_job *job, enum farm_job_state state);
/* When it is forgotten for its age, by the system's clock; 0: never, or not yet known. */
int64_t jobs_expire_s(const struct jobs *jobs, const struct farm_job *job);
/* Forgets what is kept long enough or too much, and notes when to look again. Not under the mutex.
 */
void jobs_retain(struct jobs *jobs);
/* Makes room for a result of the job, with the disk locked. ERROR_TOO_LARGE: jobs that have not
 * ended fill what may be kept. */
MUST_CHECK bool jobs_make_room_for(struct jobs *jobs, const struct farm_job *job,
                                   uint64_t size_bytes, struct error *err);
/* Forgets a job that has ended, with the disk locked. */
MUST_CHECK bool jobs_forget_ended(struct jobs *jobs, struct farm_job *job,
                                  enum forget_reason reason, struct error *err);

/* ---- the order between jobs: job_order.c ---- */

/* Whether it has not begun, and waits for others. */
bool farm_job_is_waiting(const struct farm_job *job);
/* Finds the jobs that it is to come after, and what is unmet. ERROR_UNSUPPORTED names one that is
 * not there; is_kept: that counts as one that has ended badly. */
MUST_CHECK bool job_order_resolve(struct jobs *jobs, struct farm_job *job, bool is_kept,
                                  struct error *err);
/* Finds anew what jobs wait for. Returns whether some are to be cancelled. */
MUST_CHECK bool job_order_update(struct jobs *jobs);
/* Cancels them. Not under the mutex. */
void job_order_cancel_broken(struct jobs *jobs);
/* ERROR_CONFLICT where a job that has not begun waits for this one. */
MUST_CHECK bool job_order_may_forget(const struct jobs *jobs, const struct farm_job *job,
                                     struct error *err);

/* Cancels it if it has not begun and is broken; the reason is its problem. Not under the mutex. */
MUST_CHECK bool jobs_cancel_broken(struct jobs *jobs, const char *id, struct error *err);

/* New references, NULL: no memory. */
json_t *farm_job_to_json(const struct jobs *jobs, const struct farm_job *job, bool is_whole);
json_t *farm_frame_to_json(const struct farm_job *job, int position);

/* From the text of a client, or, is_kept, of the store, where the scene may be gone. NULL with err.
 * Not under the mutex. */
struct farm_job *farm_job_create(const struct jobs *jobs, const char *text, size_t size_bytes,
                                 bool is_kept, struct error *err);

/* Whether the server is to choose, by the first frame and for all, what the request leaves open. */
bool farm_job_is_open(const struct farm_job *job);
/* What it chose: {"chosen": ..., "error": ...} of a frame's stats, malloc'ed; taken. NULL: no
 * memory or nothing, which leaves the job open. */
void farm_job_set_chosen(struct farm_job *job, char *chosen);

/* The thread. */
void *jobs_thread(void *argument);

/* What is rendered for an output of a frame: shares what the job's request owns, so it is not
 * finished. Not under the mutex: that request never changes. */
struct render_request farm_job_render(const struct farm_job *job, int position, int output);

/* What the names of the tiles of a piece's picture begin with. Not under the mutex. */
void job_tile_prefix(const struct job_piece *piece, char name[TILE_NAME_BYTES]);

#endif
