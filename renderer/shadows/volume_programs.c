/* SPDX-License-Identifier: MIT */
/* A table of programs, by their files and words. */
#include "renderer/shadows/volume_programs.h"

#include <stdio.h>

#include "renderer/lights/light_lists.h"
#include "renderer/shadows/volume_drawing.h"

enum { DEFINES_BYTES = 64 };

enum volume_form volume_form_of(bool is_silhouette, const struct view *view)
{
    return is_silhouette              ? VOLUME_COUNTS
           : !view->quality.faithful  ? VOLUME_SUMS
           : view->quality.volume_map ? VOLUME_PRODUCTS
                                      : VOLUME_LOGS;
}

static const enum volume_program drawing_programs[VIEW_SILHOUETTE_FORMS][2] = {
    [VIEW_SILHOUETTE_COMPUTE] = {VOLUME_PROGRAMS, VOLUME_PROGRAMS},
    [VIEW_SILHOUETTE_GEOMETRY] = {PROGRAM_QUADS_OF_EDGES, PROGRAM_QUADS_OF_CAPS},
    [VIEW_SILHOUETTE_TESSELLATION] = {PROGRAM_PATCHES_OF_EDGES, PROGRAM_QUADS_OF_CAPS},
    [VIEW_SILHOUETTE_TRIANGLES_TWO_PASS] = {PROGRAM_PATCHES_OF_SIDES, PROGRAM_QUADS_OF_CAPS},
    [VIEW_SILHOUETTE_TRIANGLES_ONE_PASS] = {PROGRAM_PATCHES_OF_ALL, VOLUME_PROGRAMS},
    [VIEW_SILHOUETTE_TRIANGLES_GEOMETRY] = {PROGRAM_QUADS_OF_ALL, VOLUME_PROGRAMS},
    [VIEW_SILHOUETTE_STENCIL] = {PROGRAM_STENCIL_OF_EDGES, PROGRAM_STENCIL_OF_CAPS},
};

#define COUNTED                                                                                 \
    .file = "volume_counted.frag.glsl", .vertex = "volume_patch.vert.glsl", .is_in_view = true, \
    .counts = true
#define STENCILLED                                                          \
    .file = "volume_stencil.frag.glsl", .vertex = "volume_patch.vert.glsl", \
    .geometry = "volume_quads.geom.glsl", .is_in_view = true, .counts = true
#define TESSELLATED .tessellation = {"volume_quads.tesc.glsl", "volume_quads.tese.glsl"}

static struct program_desc program_of(bool is_orthographic, enum volume_form form,
                                      enum volume_program program, char defines[DEFINES_BYTES])
{
    static const struct {
        const char *file, *vertex, *geometry, *tessellation[2], *defines;
        bool walks_lists, is_in_view, counts, knows_form;
    } programs[VOLUME_PROGRAMS] = {
        [PROGRAM_PLACE] = {.file = "volume_place.comp.glsl", .walks_lists = true},
        [PROGRAM_SIGNS_OF_LIGHT] = {.file = "volume_signs.comp.glsl",
                                    .is_in_view = true,
                                    .counts = true},
        [PROGRAM_EDGES_OF_LIGHT] = {.file = "volume_edges.comp.glsl",
                                    .counts = true,
                                    .knows_form = true},
        [PROGRAM_STARTS_OF_LIGHT] = {.file = "volume_starts.comp.glsl",
                                     .walks_lists = true,
                                     .is_in_view = true},
        [PROGRAM_FACES_OF_LIGHT] = {.file = "volume_faces.comp.glsl",
                                    .is_in_view = true,
                                    .counts = true,
                                    .knows_form = true},
        [PROGRAM_COVER] = {.file = "volume_cover.comp.glsl", .is_in_view = true},
        [PROGRAM_COVER_SMALL] = {.file = "volume_cover.comp.glsl",
                                 .is_in_view = true,
                                 .defines = "IS_SMALL"},
        [PROGRAM_DRAW] = {.file = "volume_drawn.frag.glsl",
                          .vertex = "volume_drawn.vert.glsl",
                          .is_in_view = true,
                          .knows_form = true},
        [PROGRAM_FILTERS] = {.file = "volume_filters.comp.glsl",
                             .walks_lists = true,
                             .counts = true,
                             .knows_form = true},
        [PROGRAM_QUADS_OF_EDGES] = {COUNTED, .geometry = "volume_quads.geom.glsl"},
        [PROGRAM_QUADS_OF_CAPS] = {COUNTED, .geometry = "volume_quads.geom.glsl",
                                   .defines = "IS_CAP"},
        [PROGRAM_QUADS_OF_ALL] = {COUNTED, .geometry = "volume_quads.geom.glsl",
                                  .defines = "IS_TRIANGLE"},
        [PROGRAM_PATCHES_OF_EDGES] = {COUNTED, TESSELLATED},
        [PROGRAM_PATCHES_OF_SIDES] = {COUNTED, TESSELLATED, .defines = "IS_TRIANGLE"},
        [PROGRAM_PATCHES_OF_ALL] = {COUNTED, TESSELLATED, .defines = "IS_TRIANGLE HAS_CAP"},
        [PROGRAM_STENCIL_OF_EDGES] = {STENCILLED, .defines = "IS_STENCIL"},
        [PROGRAM_STENCIL_OF_CAPS] = {STENCILLED, .defines = "IS_CAP IS_STENCIL"},
        [PROGRAM_TALLY] = {.file = "volume_tally.comp.glsl"},
    };
    bool is_drawn = programs[program].knows_form && volume_form_is_drawn(form);
    const char *const words[] = {
        programs[program].walks_lists ? light_lists_technique_defines(VIEW_LIGHT_LISTS_CLUSTERED)
                                      : NULL,
        programs[program].is_in_view && is_orthographic ? "IS_ORTHOGRAPHIC" : NULL,
        programs[program].counts && form == VOLUME_COUNTS ? "HAS_GROUPS" : NULL,
        programs[program].defines,
        is_drawn && program != PROGRAM_DRAW ? "IS_DRAWN" : NULL,
        is_drawn && form == VOLUME_PRODUCTS &&
                (program == PROGRAM_DRAW || program == PROGRAM_FILTERS)
            ? "IS_PRODUCT"
            : NULL,
    };
    size_t used = 0;
    defines[0] = '\0';
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (words[i])
            used += (size_t)snprintf(defines + used, DEFINES_BYTES - used, "%s%s", used ? " " : "",
                                     words[i]);
    struct program_desc desc = {
        .label = programs[program].file,
        .vertex = programs[program].vertex,
        .tessellation = {programs[program].tessellation[0], programs[program].tessellation[1]},
        .geometry = programs[program].geometry,
        .defines = defines[0] ? defines : NULL};
    *(desc.vertex ? &desc.fragment : &desc.compute) = programs[program].file;
    return desc;
}

const enum volume_program *volume_programs_drawing(enum view_silhouette_form drawn_by)
{
    return drawing_programs[drawn_by];
}

bool volume_program_is_tessellated(enum volume_program program)
{
    return program >= PROGRAM_PATCHES_OF_EDGES && program <= PROGRAM_PATCHES_OF_ALL;
}

bool volume_program_is_of_edges(enum volume_program program)
{
    return program == PROGRAM_QUADS_OF_EDGES || program == PROGRAM_PATCHES_OF_EDGES ||
           program == PROGRAM_STENCIL_OF_EDGES;
}

const struct gl_program *volume_program_use(const struct window_frame *frame, enum volume_form form,
                                            enum volume_program program, struct error *err)
{
    char defines[DEFINES_BYTES];
    const struct program_desc desc =
        program_of(frame->camera->is_orthographic, form, program, defines);
    const struct gl_program *found = program_cache_get(frame->programs, &desc, err);
    if (found)
        gl_program_use(found);
    return found;
}

static bool is_drawing_program(enum view_silhouette_form drawn_by, enum volume_program program)
{
    return drawing_programs[drawn_by][0] == program || drawing_programs[drawn_by][1] == program ||
           (program == PROGRAM_TALLY && drawn_by == VIEW_SILHOUETTE_STENCIL);
}

/* Whether frames of the form need a program. */
static bool needs_program(enum volume_form form, enum view_silhouette_form drawn_by,
                          enum volume_program program)
{
    if (program > PROGRAM_FILTERS)
        return form == VOLUME_COUNTS && is_drawing_program(drawn_by, program);
    if (volume_form_is_drawn(form))
        return program != PROGRAM_COVER && program != PROGRAM_COVER_SMALL;
    bool covers = program == PROGRAM_COVER || program == PROGRAM_COVER_SMALL ||
                  program == PROGRAM_EDGES_OF_LIGHT || program == PROGRAM_FACES_OF_LIGHT;
    bool is_by_compute = form != VOLUME_COUNTS || drawn_by == VIEW_SILHOUETTE_COMPUTE;
    return program != PROGRAM_DRAW && (is_by_compute || !covers);
}

void volume_programs_list(const struct window_frame *frame, bool is_silhouette,
                          struct program_list *list)
{
    enum volume_form form = volume_form_of(is_silhouette, frame->view);
    for (int i = 0; i < VOLUME_PROGRAMS; i++) {
        char defines[DEFINES_BYTES];
        if (!needs_program(form, frame->view->quality.silhouette_form, (enum volume_program)i))
            continue;
        const struct program_desc desc =
            program_of(frame->camera->is_orthographic, form, (enum volume_program)i, defines);
        program_list_add(list, "shadow.volumes", &desc, true);
    }
}
