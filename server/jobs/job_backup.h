/* SPDX-License-Identifier: MIT */
/* A copy of the database of jobs, taken while a daemon may be using it. Thread: main. */
#ifndef VITRAIL_SERVER_JOBS_JOB_BACKUP_H
#define VITRAIL_SERVER_JOBS_JOB_BACKUP_H

#include <stdint.h>

#include "protocol/error.h"

struct job_backup {
    int64_t jobs, size_bytes; /* of the copy */
};

/* Copies the database of the state directory to the file, which is there whole and checked or as it
 * was before. ERROR_NOT_FOUND: there is no database; ERROR_CONFLICT: the file is that database;
 * ERROR_IO. */
MUST_CHECK bool job_backup_write(const char *state_dir, const char *file, struct job_backup *backup,
                                 struct error *err);

#endif
