/* SPDX-License-Identifier: MIT */
/* What a decoder tells of an upload, with what only the front knows. Thread: any. */
#ifndef VITRAIL_SERVER_FRONT_DECODED_SUMMARY_H
#define VITRAIL_SERVER_FRONT_DECODED_SUMMARY_H

#include <jansson.h>

#include "protocol/error.h"
#include "server/front/upload.h"

/* Reads the summary that the decoder wrote to summary_fd, and fills in the id, the name, the sizes
 * and the time. A new reference. NULL with ERROR_INVALID_SCENE or the like where the decoder left
 * no blob or nothing that can be read. */
json_t *decoded_summary_read(const struct upload *upload, const char *id, int summary_fd,
                             int blob_fd, struct error *err);

#endif
