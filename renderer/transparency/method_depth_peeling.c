/* SPDX-License-Identifier: MIT */
/* `depth-peeling`: Everitt 2001, "Interactive Order-Independent Transparency". Layers are peeled
 * from front to back. */
#include "renderer/transparency/peeling.h"

static const struct peeling peeling = {
    .sides = 1,
    .draws =
        {
            {.pass = peeling_pass, .fragment = "peeled_nearest.frag.glsl", .is_conditional = true},
            {.pass = peeling_pass, .fragment = "peeled_tie.frag.glsl", .is_conditional = true},
            {.pass = peeling_pass,
             .fragment = "peeled_scatter.frag.glsl",
             .evaluates = true,
             .is_conditional = true},
        },
    .adding = "peeled_add.comp.glsl",
};

static void list_programs(const struct window_frame *frame, const struct geometry_items *items,
                          struct program_list *list)
{
    peeling_list_programs(&peeling, frame, items, list);
}

static enum layers_outcome find(struct layers *layers, const struct window_frame *frame,
                                const struct geometry_items *items, const struct list_sizes *room,
                                struct error *err)
{
    (void)room;
    return peeling_find(&peeling, layers, frame, items, err);
}

static bool light(struct layers *layers, const struct window_frame *frame,
                  const struct geometry_items *items, const struct surface_lighter *lighter,
                  struct error *err)
{
    return peeling_light(&peeling, layers, frame, items, lighter, err);
}

static int count_sets(const struct layers *layers)
{
    return peeling_count_sets(&peeling, layers);
}

const struct transparency_method transparency_method_depth_peeling = {
    .id = TRANSPARENCY_DEPTH_PEELING,
    PEELING_MEMBERS,
    .compositing = "depth_peeling_composite.glsl",
    .list_programs = list_programs,
    .find = find,
    .light = light,
    .count_sets = count_sets,
};
