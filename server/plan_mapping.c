/* SPDX-License-Identifier: MIT */
/* Copies a plan into its document, field by field. */
#include "server/plan_mapping.h"

#include <assert.h>
#include <stdio.h>

static_assert((int)PLAN_NEED_COUNT <= (int)PLAN_DOCUMENT_REQUIREMENTS_MAX, "requirements fit");
static_assert((int)PLAN_PASSES_MAX <= (int)PLAN_DOCUMENT_PASSES_MAX, "passes fit");
static_assert((int)REPORT_TEXT_BYTES <= (int)PLAN_DOCUMENT_TEXT_BYTES, "reasons fit");
static_assert((int)REPORT_NAME_BYTES <= (int)PLAN_DOCUMENT_NAME_BYTES, "names fit");

void plan_document_from_plan(const struct render_request *request, const struct plan *plan,
                             const char *device, struct plan_document *document)
{
    *document = (struct plan_document){
        .width = request->width,
        .height = request->height,
        .samples = plan->samples,
        .requirement_count = PLAN_NEED_COUNT,
        .pass_count = plan->pass_count,
        .counts = {.opaque_items = plan->opaque_items,
                   .transparent_items = plan->transparent_items,
                   .map_lights = plan->map_lights,
                   .deep_lights = plan->deep_lights,
                   .linked_lights = plan->linked_lights,
                   .unshadowed_lights = plan->unshadowed_lights,
                   .unseen_lights = plan->unseen_lights,
                   .shadow_texels = plan->shadow_texels,
                   .light_batches = plan->least_batches},
    };
    snprintf(document->scene, sizeof document->scene, "%s", request->scene);
    snprintf(document->device, sizeof document->device, "%s", device);
    for (int i = 0; i < PLAN_NEED_COUNT; i++) {
        struct plan_document_requirement *r = &document->requirements[i];
        snprintf(r->name, sizeof r->name, "%s", plan_need_name(i));
        snprintf(r->because, sizeof r->because, "%s", plan->requirements[i].because);
        r->is_met = plan->requirements[i].is_met;
    }
    for (int i = 0; i < plan->pass_count; i++) {
        const struct plan_pass *from = &plan->passes[i];
        struct plan_document_pass *to = &document->passes[i];
        snprintf(to->pass, sizeof to->pass, "%s", from->pass);
        snprintf(to->technique, sizeof to->technique, "%s", from->technique);
        to->requirement = (int)from->need;
        to->is_conditional = from->is_conditional;
        to->bytes = from->bytes;
    }
}
