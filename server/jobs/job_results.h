/* SPDX-License-Identifier: MIT */
/* The files that jobs make: each is written under another name, on the disk before it is renamed to
 * its own, and so there whole or not at all. Thread: any, one per job at a time. */
#ifndef VITRAIL_SERVER_JOBS_JOB_RESULTS_H
#define VITRAIL_SERVER_JOBS_JOB_RESULTS_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"
#include "server/base/digest.h"

struct job_results;

/* jobs: a folder for a folder of each job; allowed: the directory that jobs may name folders of, ""
 * for none. */
struct job_results *job_results_create(const char *jobs, const char *allowed, struct error *err);
void job_results_destroy(struct job_results *results); /* accepts NULL */

/* Where a job's files go: its own folder, or, where directory is not "", that one of the allowed
 * directory. */
struct job_place {
    const char *id, *directory; /* borrowed */
    bool makes_directory;       /* writing makes that one where it is not there; the own it does */
};

/* Whether the job's folder can be made. ERROR_UNSUPPORTED: no directory is allowed; ERROR_IO. */
MUST_CHECK bool job_results_prepare(struct job_results *results, const struct job_place *place,
                                    struct error *err);

/* Copies a file to the name, durably, in place of one that is there. */
MUST_CHECK bool job_results_put(struct job_results *results, const struct job_place *place,
                                const char *name, int from_fd, uint64_t *size_bytes,
                                char digest[DIGEST_TEXT_BYTES], struct error *err);

/* A large file in steps: an empty draft beside the name, for writing; once it is written, its bytes
 * are brought to the disk and hashed; then it takes the place of the name. The caller closes it. */
MUST_CHECK int job_results_draft(struct job_results *results, const struct job_place *place,
                                 const char *name, struct error *err);
MUST_CHECK bool job_results_hash(int draft_fd, uint64_t *size_bytes, char digest[DIGEST_TEXT_BYTES],
                                 struct error *err);
void job_results_drop(struct job_results *results, const struct job_place *place, const char *name);
MUST_CHECK bool job_results_adopt(struct job_results *results, const struct job_place *place,
                                  const char *name, struct error *err);

/* The job's folder; -1: it is not there. The caller closes it. */
MUST_CHECK int job_results_folder(struct job_results *results, const struct job_place *place,
                                  struct error *err);

/* For reading; ERROR_NOT_FOUND where it is gone. The caller closes it. */
MUST_CHECK int job_results_open(struct job_results *results, const struct job_place *place,
                                const char *name, struct error *err);
/* Whether a file of that size is there. */
bool job_results_have(struct job_results *results, const struct job_place *place, const char *name,
                      uint64_t size_bytes);

/* Removes the job's own folder; files in the allowed directory stay. */
void job_results_remove(struct job_results *results, const char *id);

#endif
