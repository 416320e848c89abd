/* SPDX-License-Identifier: MIT */
/* What the front asks the worker beside images, as JSON, for both of them. Thread: any. */
#ifndef VITRAIL_SERVER_MAPPING_QUESTIONS_H
#define VITRAIL_SERVER_MAPPING_QUESTIONS_H

#include <jansson.h>
#include <stdbool.h>

#include "renderer/raytrace/pick.h"

/* A step says {"step": "pick", "x", "y", "width", "height", "through"}; width 0 is a point. */
json_t *pick_make_step(const struct pick_desc *desc); /* new reference; NULL: no memory */
bool pick_is_step(const json_t *step);
void pick_read_step(const json_t *step, struct pick_desc *desc);

/* Whether the question is a warm-up: {"warm_up": "all", or where less is to be done "structures",
 * which draws nothing, or "programs"}. */
bool warm_up_is_step(const json_t *question);
/* Which of them; "" where it is none. */
const char *warm_up_asked(const json_t *question);

#endif
