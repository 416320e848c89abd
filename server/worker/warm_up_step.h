/* SPDX-License-Identifier: MIT */
/* What a worker does to warm up a scene (server/front/warm_up.h). Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_WARM_UP_STEP_H
#define VITRAIL_SERVER_WORKER_WARM_UP_STEP_H

#include <jansson.h>
#include <stdbool.h>

#include "protocol/error.h"
#include "protocol/render_request.h"

struct renderer;

/* The answer: {"left": what is to be asked again, or
 * absent; "pictures", "shadow_maps_built", "ray_structures_built", "programs_built": numbers}.
 * Thread: GL. */
struct warm_up_step_desc { /* all required */
    struct renderer *renderer;
    const struct render_request *request;
    const json_t *question;            /* {"warm_up": "all", or where less is to be done
                                          "structures", which draws nothing, or "programs"} */
    bool (*shall_stop)(void *context); /* any thread, often */
    void *context;
};
json_t *warm_up_step(const struct warm_up_step_desc *desc, struct error *err);

#endif
