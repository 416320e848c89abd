/* SPDX-License-Identifier: MIT */
/* The worker's answer to "explain": the plan of a frame, nothing drawn. Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_EXPLAIN_H
#define VITRAIL_SERVER_WORKER_EXPLAIN_H

#include <jansson.h>

#include "protocol/render_request.h"
#include "renderer/renderer.h"

struct explain_desc {
    struct renderer *renderer;            /* required */
    const char *device;                   /* required; its name, for the document */
    const struct render_request *request; /* required; its scene is attached */
    const json_t *question;               /* {"explain": plan_format_name()} */
};

/* New reference to an empty object; *text_fd becomes a sealed memory file with the document. */
MUST_CHECK json_t *explain_frame(const struct explain_desc *desc, int *text_fd, struct error *err);

#endif
