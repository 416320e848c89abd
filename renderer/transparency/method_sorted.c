/* SPDX-License-Identifier: MIT */
/* `sorted`: what most rasterisers do, as Lexolights (Pečiva) in its transparent bins: objects are
 * drawn from back to front, each blended as a whole over what is there, with the depth test of
 * opaque surfaces and no depth of their own. An object is a drawable, ordered by the distance of
 * the middle of its bounding sphere along the view; within it triangles are in the order of their
 * indices. So it is exact where objects do not overlap in depth, and wrong where they interlock or
 * cover themselves.
 * The surfaces are kept in lists whose keys are that order in place of the depth, so that all of
 * them are lit as by `lists`, and a layer lit by several lights filters once. */
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/transparency/pixel_lists.h"

static const struct geometry_layer_pass scattering = {.pass = pixel_lists_scattering_pass,
                                                      .fragment = "sorted_scatter.frag.glsl",
                                                      .evaluates = true,
                                                      .is_conditional = true};

struct object {
    double distance; /* along the view */
    uint32_t item;   /* of the state */
    size_t place;    /* among the transparent items */
};

static int compare_objects(const void *a, const void *b)
{
    const struct object *x = a, *y = b;
    if (x->distance != y->distance)
        return x->distance > y->distance ? -1 : 1;
    return x->item < y->item ? -1 : x->item > y->item;
}

/* From back to front: the same order in every window, which may draw a part of them. */
static struct object *sort_objects(const struct window_frame *frame,
                                   const struct geometry_items *items, struct error *err)
{
    struct object *objects = malloc((items->transparent_count + 1) * sizeof *objects);
    if (!objects) {
        error_set(err, ERROR_NO_MEMORY, "%zu transparent objects", items->transparent_count);
        return NULL;
    }
    for (size_t i = 0; i < items->transparent_count; i++) {
        double from_eye[3];
        uint32_t item = items->transparent[i];
        vec3_sub(frame->state->items[item].center, frame->camera->eye, from_eye);
        objects[i] = (struct object){
            .distance = -vec3_dot(frame->camera->back, from_eye), .item = item, .place = i};
    }
    qsort(objects, items->transparent_count, sizeof *objects, compare_objects);
    return objects;
}

static bool scatter(const struct window_frame *frame, const struct geometry_items *items,
                    struct error *err)
{
    struct object *objects = sort_objects(frame, items, err);
    bool ok = objects != NULL;
    struct window_frame ranked = *frame;
    for (size_t i = 0; i < items->transparent_count && ok; i++) {
        ranked.object_rank = (uint32_t)i;
        ok = geometry_draw_transparent_item(&ranked, items, objects[i].place, scattering.fragment,
                                            scattering.evaluates, err);
    }
    free(objects);
    return ok;
}

static enum layers_outcome find(struct layers *layers, const struct window_frame *frame,
                                const struct geometry_items *items, const struct list_sizes *room,
                                struct error *err)
{
    static const struct pixel_lists_order by_object = {.scatter = scatter};
    return pixel_lists_find_by(&by_object, layers, frame, items, room, err);
}

static void list_programs(const struct window_frame *frame, const struct geometry_items *items,
                          struct program_list *list)
{
    pixel_lists_list_counting(frame, items, list);
    geometry_list_transparent(frame, items, &scattering, list);
    pixel_lists_list_sorting(frame, list);
}

const struct transparency_method transparency_method_sorted = {
    .id = TRANSPARENCY_SORTED,
    PIXEL_LISTS_LIGHTING,
    .list_programs = list_programs,
    .find = find,
    .compositing = "lists_composite.glsl",
    .approximates = "blends objects as wholes from back to front, also those that interlock",
};
