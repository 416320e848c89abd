/* SPDX-License-Identifier: MIT */
/* The shadow techniques by their rows and by the kinds of their structures. */
#include "renderer/shadows/technique.h"

static void list_depth(const struct shadow_pass *pass, const struct shadow_listing *listing,
                       struct program_list *list)
{
    struct caster_view view = listing->view;
    view.pass = CASTER_DEPTH;
    caster_list_programs(&view, listing->casters, pass->name, false, list);
}

const struct shadow_pass shadow_depth_pass = {
    .name = "shadow.depth", .technique = SHADOWS_MAP, .list_programs = list_depth};

/* Each technique that has functions, by the end of their names. */
#define SHADOW_METHODS(METHOD) \
    METHOD(map)                \
    METHOD(deep)               \
    METHOD(linked)             \
    METHOD(rays)               \
    METHOD(translucent)        \
    METHOD(stochastic)         \
    METHOD(colored)            \
    METHOD(composited) METHOD(area) METHOD(volume) METHOD(moments) METHOD(silhouette)

#define DECLARE(name) extern const struct shadow_method shadow_method_##name;
SHADOW_METHODS(DECLARE)
#undef DECLARE

#define ADDRESS(name) &shadow_method_##name,
static const struct shadow_method *const methods[] = {SHADOW_METHODS(ADDRESS)};
#undef ADDRESS

const struct shadow_structure *shadow_structure_at(size_t index)
{
    static const struct shadow_structure *const structures[] = {
        &shadow_structure_map,     &shadow_structure_deep,        &shadow_structure_linked,
        &shadow_structure_rays,    &shadow_structure_translucent, &shadow_structure_stochastic,
        &shadow_structure_colored, &shadow_structure_composited,  &shadow_structure_area,
        &shadow_structure_volume,  &shadow_structure_moments,     &shadow_structure_silhouette};
    return index < sizeof structures / sizeof *structures ? structures[index] : NULL;
}

const struct shadow_method *shadow_method_of(enum shadow_technique technique)
{
    bool is_open = technique == SHADOWS_AUTO || shadow_technique_is_renderer(technique);
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++)
        if (methods[i]->id == (is_open ? SHADOWS_RASTER_DEFAULT : technique))
            return methods[i];
    return NULL;
}

const struct shadow_method *shadow_method_choose(const struct shadow_casters *casters,
                                                 const struct view_quality *quality)
{
    const struct shadow_method *method = shadow_method_of(quality->shadows);
    while (method && !method->wants(casters, quality))
        method = method->otherwise;
    return method;
}

bool shadow_quality_holds_grids(const struct view_quality *quality)
{
    const struct shadow_method *method = shadow_method_of(quality->shadows);
    return method && method->structure->holds_grids && method->structure->holds_grids(quality);
}

bool shadow_wants_transparent(const struct shadow_casters *casters,
                              const struct view_quality *quality)
{
    (void)quality;
    return casters->transparent_count > 0;
}

bool shadow_wants_any(const struct shadow_casters *casters, const struct view_quality *quality)
{
    (void)quality;
    return casters->opaque_count + casters->transparent_count > 0;
}

const struct shadow_finder *shadow_finder_of(const struct shadow_method *method)
{
    return method ? method->structure->finder : NULL;
}

size_t shadow_method_count_unfit(const struct shadow_method *method,
                                 const struct scene_state *state,
                                 const struct view_quality *quality)
{
    size_t count = 0;
    for (size_t i = 0; method && method->fits && i < state->item_count; i++)
        count += state->items[i].casts_shadow && !method->fits(state, &state->items[i], quality);
    return count;
}

bool shadow_is_per_window(enum shadow_technique technique)
{
    const struct shadow_method *method = shadow_method_of(technique);
    return method && method->structure->scope == SHADOW_PER_WINDOW;
}
