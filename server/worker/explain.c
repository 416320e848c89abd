/* SPDX-License-Identifier: MIT */
/* A plan from the renderer, written in the form that was asked for. */
#include "server/worker/explain.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/program_source.h"
#include "renderer/plan/plan_warnings.h"
#include "server/base/ipc.h"
#include "server/mapping/format_mapping.h"
#include "server/mapping/plan_mapping.h"
#include "server/mapping/view_mapping.h"
#include "server/worker/chooser.h"

struct explanation {
    struct auto_choice choice;
    struct plan plan;
    struct frame_report report;             /* its warnings alone */
    struct program_list list;               /* finished by explain_frame */
    struct plan_document_program *programs; /* owned */
    size_t program_count;
};

static bool make_plan(const struct explain_desc *desc, struct explanation *made, struct error *err)
{
    struct view view;
    struct view_storage storage = {0};
    const char *scene = desc->request->scene;
    if (!view_from_request(desc->request, &storage, &view, err))
        return false;
    view.screen = view_screen_from_request(desc->request, image_format_from_request(desc->request));
    bool is_good = chooser_choose_technique(desc->renderer, scene, &view, &made->choice, err) &&
                   renderer_explain(desc->renderer, scene, &view, &made->plan, err) &&
                   renderer_list_programs(desc->renderer, scene, &view, &made->list, err);
    if (is_good)
        plan_warn(&made->plan, (int)view.quality.transparency, &made->report);
    view_storage_finish(&storage);
    if (is_good)
        made->programs =
            plan_programs_from_list(&made->plan, &made->list, &made->program_count, err);
    return made->programs;
}

/* ---- sources ---- */

static bool write_program(const struct listed_program *program, const char *device_defines,
                          FILE *out, struct error *err)
{
    const struct program_desc desc = program_list_desc(program);
    struct program_source source;
    if (!program_source_init(&source, &desc, device_defines, err))
        return false;
    for (int i = 0; i < PROGRAM_STAGES; i++) {
        char name[PROGRAM_FILE_NAME_BYTES];
        if (!source.files[i])
            continue;
        program_source_file_name(&source, i, name);
        fprintf(out, "// ==== %s ====\n%s\n", name, source.stages[i].text);
    }
    program_source_finish(&source);
    return true;
}

/* Writes the sources of every program once, as --dump-shaders does, each stage under its name. */
static char *write_sources(const struct explanation *made, size_t *length, struct error *err)
{
    char *text = NULL;
    FILE *out = open_memstream(&text, length);
    bool is_good = out;
    if (out && !made->list.count)
        fputs("// such a frame needs no shader program\n", out);
    for (size_t i = 0; is_good && i < made->list.count; i++) {
        const struct listed_program *program = &made->list.items[i];
        bool is_first = true;
        for (size_t k = 0; k < i; k++)
            is_first = is_first && !program_list_is_same(&made->list.items[k], program);
        is_good = !is_first || write_program(program, made->list.device_defines, out, err);
    }
    is_good = is_good && !ferror(out);
    if (out && fclose(out) == 0 && is_good)
        return text;
    free(text);
    return NULL;
}

static char *write(const struct explain_desc *desc, const struct explanation *made,
                   enum plan_format format, size_t *length, struct error *err)
{
    struct plan_document document;
    if (format == PLAN_FORMAT_GLSL)
        return write_sources(made, length, err);
    plan_document_from_plan(desc->request, &made->plan, desc->device, &document);
    plan_document_put_warnings(&made->report, &document);
    document.programs = made->programs;
    document.program_count = made->program_count;
    return plan_document_write(&document, format, length);
}

json_t *explain_frame(const struct explain_desc *desc, int *text_fd, struct error *err)
{
    const char *form = json_string_value(json_object_get(desc->question, "explain"));
    int format = 0;
    struct explanation made = {0};
    size_t length = 0;
    char *text = NULL;
    *text_fd = -1;
    while (plan_format_name(format) && (!form || strcmp(form, plan_format_name(format)) != 0))
        format++;
    if (!plan_format_name(format))
        error_set(err, ERROR_INTERNAL, "worker: no form '%s' of a plan", form ? form : "");
    else if (make_plan(desc, &made, err)) {
        text = write(desc, &made, (enum plan_format)format, &length, err);
        if (text)
            *text_fd = ipc_memfd_create("vitrail-plan", text, length, err);
        else
            error_set(err, ERROR_NO_MEMORY, "plan of the frame");
    }
    free(text);
    free(made.programs);
    program_list_finish(&made.list);
    return *text_fd >= 0 ? json_object() : NULL;
}
