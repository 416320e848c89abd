/* SPDX-License-Identifier: MIT */
/* The results of a job as one tar archive, made piece by piece while it is sent. Thread: any, one
 * at a time. */
#ifndef VITRAIL_SERVER_ROUTES_JOB_ARCHIVE_H
#define VITRAIL_SERVER_ROUTES_JOB_ARCHIVE_H

#include <sys/types.h>

#include "server/jobs/jobs.h"

struct job_archive;

/* Of the files that are there while it is read. ERROR_NOT_FOUND: no such job. */
struct job_archive *job_archive_create(struct jobs *jobs, const char *id, struct error *err);
void job_archive_destroy(struct job_archive *archive); /* accepts NULL */

/* The next bytes, at most `capacity`; -1: the end, or a file that cannot be read, which leaves the
 * archive cut. */
ssize_t job_archive_read(struct job_archive *archive, char *bytes, size_t capacity);

#endif
