/* SPDX-License-Identifier: MIT */
/* The renderer's plan as the reply that tells of it. Thread: any. */
#ifndef VITRAIL_SERVER_MAPPING_PLAN_MAPPING_H
#define VITRAIL_SERVER_MAPPING_PLAN_MAPPING_H

#include "protocol/plan_document.h"
#include "protocol/render_request.h"
#include "renderer/gl/program_list.h"
#include "renderer/plan/plan.h"

void plan_document_from_plan(const struct render_request *request, const struct plan *plan,
                             const char *device, struct plan_document *document);
/* The warnings of the report. */
void plan_document_put_warnings(const struct frame_report *report, struct plan_document *document);

/* Those of the list whose pass the plan has, in the order of the passes; composes the source of
 * each for its name. Owned by the caller; NULL with err. */
struct plan_document_program *plan_programs_from_list(const struct plan *plan,
                                                      const struct program_list *list,
                                                      size_t *count, struct error *err);

#endif
