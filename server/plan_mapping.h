/* SPDX-License-Identifier: MIT */
/* The renderer's plan as the reply that tells of it. Thread: any. */
#ifndef VITRAIL_SERVER_PLAN_MAPPING_H
#define VITRAIL_SERVER_PLAN_MAPPING_H

#include "protocol/plan_document.h"
#include "protocol/render_request.h"
#include "renderer/plan/plan.h"

void plan_document_from_plan(const struct render_request *request, const struct plan *plan,
                             const char *device, struct plan_document *document);

#endif
