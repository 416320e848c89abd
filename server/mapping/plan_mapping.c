/* SPDX-License-Identifier: MIT */
/* Copies a plan into its document, field by field. */
#include "server/mapping/plan_mapping.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/program_source.h"

static_assert((int)PLAN_NEED_COUNT <= (int)PLAN_DOCUMENT_REQUIREMENTS_MAX, "requirements fit");
static_assert((int)PLAN_PASSES_MAX <= (int)PLAN_DOCUMENT_PASSES_MAX, "passes fit");
static_assert((int)REPORT_WARNINGS_MAX <= (int)PLAN_DOCUMENT_WARNINGS_MAX, "warnings fit");
static_assert((int)REPORT_TEXT_BYTES <= (int)PLAN_DOCUMENT_TEXT_BYTES, "reasons fit");
static_assert((int)PROGRAM_ID_BYTES <= (int)PLAN_DOCUMENT_ID_BYTES, "names of programs fit");
static_assert((int)PROGRAM_DEFINES_BYTES <= (int)PLAN_DOCUMENT_DEFINES_BYTES, "defines fit");
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
                   .unshadowed_lights = plan->unshadowed_lights,
                   .unseen_lights = plan->unseen_lights,
                   .shadow_texels = plan->shadow_texels,
                   .light_batches = plan->least_batches},
    };
    for (int i = 0; i < SHADOWS_COUNT; i++)
        document->counts.lights_by_technique[i] = plan->lights_by_technique[i];
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

void plan_document_put_warnings(const struct frame_report *report, struct plan_document *document)
{
    document->warning_count = report->warning_count;
    for (int i = 0; i < report->warning_count; i++)
        snprintf(document->warnings[i], sizeof document->warnings[i], "%s", report->warnings[i]);
}

static bool fill_program(const struct listed_program *from, const char *device_defines, int pass,
                         struct plan_document_program *to, struct error *err)
{
    static const enum plan_document_place places[] = {[PROGRAM_ABSENT] = PLAN_DOCUMENT_ABSENT,
                                                      [PROGRAM_IN_MEMORY] = PLAN_DOCUMENT_IN_MEMORY,
                                                      [PROGRAM_ON_DISK] = PLAN_DOCUMENT_ON_DISK};
    const struct program_desc desc = program_list_desc(from);
    struct program_source source;
    int count = 0;
    if (!program_source_init(&source, &desc, device_defines, err))
        return false;
    *to = (struct plan_document_program){
        .pass = pass, .place = places[from->place], .is_conditional = from->is_conditional};
    snprintf(to->id, sizeof to->id, "%s", source.id);
    snprintf(to->defines, sizeof to->defines, "%s", from->defines);
    for (int i = 0; i < PROGRAM_STAGES; i++)
        if (source.files[i])
            snprintf(to->files[count++], sizeof to->files[0], "%s", source.files[i]);
    program_source_finish(&source);
    return true;
}

struct plan_document_program *plan_programs_from_list(const struct plan *plan,
                                                      const struct program_list *list,
                                                      size_t *count, struct error *err)
{
    struct plan_document_program *programs = calloc(list->count + 1, sizeof *programs);
    *count = 0;
    if (!programs) {
        error_set(err, ERROR_NO_MEMORY, "%zu programs", list->count);
        return NULL;
    }
    for (int pass = 0; pass < plan->pass_count; pass++)
        for (size_t i = 0; i < list->count; i++) {
            if (strcmp(plan->passes[pass].pass, list->items[i].pass) != 0)
                continue;
            if (!fill_program(&list->items[i], list->device_defines, pass, &programs[*count],
                              err)) {
                free(programs);
                return NULL;
            }
            ++*count;
        }
    return programs;
}
