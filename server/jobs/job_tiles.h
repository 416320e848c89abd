/* SPDX-License-Identifier: MIT */
/* Pictures of jobs in tiles: each tile is rendered, tried again and kept by itself, as a file in
 * the job's own folder that is there whole or not at all; once all of an output are there, they are
 * joined into its file and removed. What is there is what is done: the database knows nothing of
 * tiles, and a server that is started again finds them. All under the jobs' mutex, unless said
 * otherwise. */
#ifndef VITRAIL_SERVER_JOBS_JOB_TILES_H
#define VITRAIL_SERVER_JOBS_JOB_TILES_H

#include <stdbool.h>

#include "protocol/error.h"
#include "protocol/render_request.h"

struct farm_job;
struct farm_frame;
struct job_piece;
struct jobs;

enum { TILE_NONE = -1, TILE_ASSEMBLY = -2 }; /* of a piece: the whole picture, or its joining */

enum { TILE_NAME_BYTES = 64 };

bool farm_job_has_tiles(const struct farm_job *job);

/* The next tile, or joining where `may_assemble`, of a frame that is neither there nor in the
 * making. */
bool farm_tiles_find(const struct farm_job *job, const struct farm_frame *frame, bool may_assemble,
                     int *output, int *tile);

/* A piece of tiles begins, and ends, whatever became of it; with the tile there, and with a failed
 * attempt, whose number is answered. begin: false without memory. */
bool farm_tiles_begin(struct farm_job *job, int position, int output, int tile);
void farm_tiles_end(const struct job_piece *piece);
void farm_tiles_note_done(const struct job_piece *piece);
int farm_tiles_note_failure(const struct job_piece *piece);

/* A failed frame is tried again: attempts of its tiles count anew. */
void farm_tiles_forget_attempts(const struct farm_job *job, struct farm_frame *frame);

/* Tiles of the job that are done, and all. */
void farm_tiles_count(const struct farm_job *job, double *done, double *all);

/* The request of a tile from that of its picture. */
void farm_tiles_request(const struct farm_job *job, int tile, struct render_request *render);

/* Not under the mutex. The tile of the piece to its place; the file of the picture to its name. */
MUST_CHECK bool farm_tiles_keep(struct jobs *jobs, const struct job_piece *piece,
                                struct error *err);
/* Not under the mutex. Removes the files of an output's tiles. */
void farm_tiles_remove(struct jobs *jobs, const struct job_piece *piece);
void farm_tiles_lose(const struct job_piece *piece); /* they are to be rendered again */

/* Not under the mutex, but with the disk locked. The draft of a picture that was not adopted. */
void farm_tiles_drop_draft(struct jobs *jobs, const struct job_piece *piece);
/* Likewise. What a job that has ended leaves of tiles. */
void farm_tiles_clean(struct jobs *jobs, struct farm_job *job);

/* Before the jobs' thread begins: what is there of the tiles of a job. */
void farm_tiles_load(struct jobs *jobs, struct farm_job *job);

/* Joins the tiles of the piece on a thread of its own, after which `ended` is called there. One at
 * a time. Not under the mutex. */
void job_assembly_start(struct jobs *jobs, struct job_piece *piece,
                        void (*ended)(struct job_piece *piece));
/* Ends the joining in progress, and waits for its thread. Not under the mutex. */
void job_assembly_stop(struct jobs *jobs);

#endif
