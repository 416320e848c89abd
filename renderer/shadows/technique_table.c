/* SPDX-License-Identifier: MIT */
/* The shadow techniques by their rows and by the kinds of their structures. */
#include "renderer/shadows/technique.h"

#include <assert.h>

static void list_depth(const struct shadow_pass *pass, const struct shadow_listing *listing,
                       struct program_list *list)
{
    struct caster_view view = listing->view;
    view.pass = CASTER_DEPTH;
    caster_list_programs(&view, listing->casters, pass->name, false, list);
}

const struct shadow_pass shadow_depth_pass = {.name = "shadow.depth", .list_programs = list_depth};

const struct shadow_method *shadow_method_of(enum shadow_technique technique)
{
    static const struct shadow_method *const methods[SHADOWS_COUNT] = {
        [SHADOWS_AUTO] = &shadow_method_deep, /* unless the plan has another */
        [SHADOWS_MAP] = &shadow_method_map,
        [SHADOWS_DEEP] = &shadow_method_deep,
        [SHADOWS_DEEP_LINKED] = &shadow_method_linked,
        [SHADOWS_RAYTRACED] = &shadow_method_deep, /* of frames that are rasterised after all */
        [SHADOWS_RAYTRACED_SHADOWS] = &shadow_method_rays,
    };
    assert((int)technique >= 0 && technique < SHADOWS_COUNT);
    return methods[technique];
}

const struct shadow_method *shadow_method_of_kind(uint32_t kind)
{
    static const struct shadow_method *const methods[SHADOW_KINDS] = {
        &shadow_method_map, &shadow_method_deep, &shadow_method_linked};
    assert(kind < SHADOW_KINDS && methods[kind]->kind == kind);
    return methods[kind];
}

const struct shadow_method *shadow_method_choose(const struct shadow_casters *casters,
                                                 const struct view_quality *quality)
{
    const struct shadow_method *method = shadow_method_of(quality->shadows);
    while (method && !method->wants(casters, quality))
        method = method->otherwise;
    return method;
}

bool shadow_is_per_window(enum shadow_technique technique)
{
    const struct shadow_method *method = shadow_method_of(technique);
    return method && method->scope == SHADOW_PER_WINDOW;
}
