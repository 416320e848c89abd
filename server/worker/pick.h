/* SPDX-License-Identifier: MIT */
/* The worker's side of a pick: rays, and what they meet as JSON. Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_PICK_H
#define VITRAIL_SERVER_WORKER_PICK_H

#include <jansson.h>
#include <stdbool.h>

#include "protocol/error.h"
#include "protocol/render_request.h"
#include "renderer/renderer.h"

struct pick_step_desc {
    struct renderer *renderer;            /* required */
    const struct render_request *request; /* required */
    const json_t *step;                   /* required */
};

/* An empty object, a new reference; the members `hit`, `hits` or `nodes` of the reply are the JSON
 * text in *file_fd, a memory file, since they may be long. */
MUST_CHECK json_t *pick_step(const struct pick_step_desc *desc, int *file_fd, struct error *err);

#endif
