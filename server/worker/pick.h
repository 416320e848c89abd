/* SPDX-License-Identifier: MIT */
/* The worker's side of a pick: rays, and what they meet as JSON. Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_PICK_H
#define VITRAIL_SERVER_WORKER_PICK_H

#include <jansson.h>
#include <stdbool.h>

#include "protocol/error.h"
#include "protocol/render_request.h"
#include "renderer/renderer.h"

/* A step says {"step": "pick", "x", "y", "width", "height", "through"}; width 0 is a point. */
MUST_CHECK json_t *pick_make_step(const struct pick_desc *desc); /* new reference; NULL: no memory
                                                                  */
bool pick_is_step(const json_t *step);

struct pick_step_desc {
    struct renderer *renderer;            /* required */
    const struct render_request *request; /* required */
    const json_t *step;                   /* required */
};

/* An empty object, a new reference; the members `hit`, `hits` or `nodes` of the reply are the JSON
 * text in *file_fd, a memory file, since they may be long. */
MUST_CHECK json_t *pick_step(const struct pick_step_desc *desc, int *file_fd, struct error *err);

#endif
