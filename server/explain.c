/* SPDX-License-Identifier: MIT */
/* A plan from the renderer, written in the form that was asked for. */
#include "server/explain.h"

#include <stdlib.h>
#include <string.h>

#include "server/ipc.h"
#include "server/plan_mapping.h"
#include "server/view_mapping.h"

static bool make_plan(const struct explain_desc *desc, struct plan *plan, struct error *err)
{
    struct view view;
    struct view_storage storage = {0};
    bool is_good = view_from_request(desc->request, &storage, &view, err) &&
                   renderer_explain(desc->renderer, desc->request->scene, &view, plan, err);
    view_storage_finish(&storage);
    return is_good;
}

json_t *explain_frame(const struct explain_desc *desc, int *text_fd, struct error *err)
{
    const char *form = json_string_value(json_object_get(desc->question, "explain"));
    int format = 0;
    struct plan plan;
    struct plan_document document;
    size_t length = 0;
    *text_fd = -1;
    while (plan_format_name(format) && (!form || strcmp(form, plan_format_name(format)) != 0))
        format++;
    if (!plan_format_name(format)) {
        error_set(err, ERROR_INTERNAL, "worker: no form '%s' of a plan", form ? form : "");
        return NULL;
    }
    if (!make_plan(desc, &plan, err))
        return NULL;
    plan_document_from_plan(desc->request, &plan, desc->device, &document);
    char *text = plan_document_write(&document, (enum plan_format)format, &length);
    if (text)
        *text_fd = ipc_memfd_create("vitrail-plan", text, length, err);
    else
        error_set(err, ERROR_NO_MEMORY, "plan of the frame");
    free(text);
    return *text_fd >= 0 ? json_object() : NULL;
}
