/* SPDX-License-Identifier: MIT */
/* An environment map in the decoder. Thread: main of its own process. */
#ifndef VITRAIL_SERVER_DECODER_ENVIRONMENT_JOB_H
#define VITRAIL_SERVER_DECODER_ENVIRONMENT_JOB_H

#include "protocol/error.h"
#include "renderer/import/import.h"

/* Decodes the file, writes its blob (renderer/environment/environment_blob.h) and its summary.
 * Errors: those of environment_import, ERROR_IO. */
MUST_CHECK bool environment_job_run(const struct scene_file *file, int blob_fd, int summary_fd,
                                    struct error *err);

#endif
