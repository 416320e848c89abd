/* SPDX-License-Identifier: MIT */
/* Pictures that are larger than the server renders in one piece: a job makes one in tiles, and is
 * forgotten when its file is here. */
#ifndef VITRAIL_CLIENTS_VITRAIL_PICTURE_BY_TILES_H
#define VITRAIL_CLIENTS_VITRAIL_PICTURE_BY_TILES_H

#include <jansson.h>

#include "clients/vitrail/session.h"

/* Whether the request, a body of POST /v1/renders, asks for such a picture. */
bool picture_is_by_tiles(const json_t *request);

/* Makes it, into `image`. tiles: their size as a job takes it; NULL: the client's own. Where the
 * call is interrupted, so is the job. */
bool picture_make_by_tiles(struct session *session, const json_t *request, json_t *tiles,
                           struct output_file *image, struct failure *failure);

#endif
