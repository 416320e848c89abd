/* SPDX-License-Identifier: MIT */
/* The camera's geometry passes: opaque surfaces into the G-buffer, and drawing transparent ones
 * with a given shader. */
#ifndef VITRAIL_RENDERER_WINDOW_GEOMETRY_H
#define VITRAIL_RENDERER_WINDOW_GEOMETRY_H

#include "renderer/gl/program_list.h"
#include "renderer/window/window.h"

/* Items in view, near to far by the near side of their bounding spheres, then by their number:
 * where opaque surfaces lie at one depth, the item drawn last is seen. Owned by the caller of
 * geometry_cull. */
struct geometry_items {
    uint32_t *drawn;             /* the three lists one after the other */
    const uint32_t *opaque;      /* and masked */
    const uint32_t *transparent; /* without media */
    const uint32_t *media;
    size_t culled_count; /* items out of view */
    size_t opaque_count, transparent_count, medium_count;
    bool may_surround; /* some medium reaches the eye, or the near plane of an orthographic one */
};

/* Sorts state->items that touch the window's frustum into the three lists; that of the whole image
 * where frame->window is zeroed. */
MUST_CHECK bool geometry_cull(const struct window_frame *frame, struct geometry_items *items,
                              struct error *err);
/* The same of all items, in view or not. */
MUST_CHECK bool geometry_take_all(const struct window_frame *frame, struct geometry_items *items,
                                  struct error *err);
void geometry_items_finish(struct geometry_items *items);

/* Clears the G-buffer and draws opaque and masked items. */
MUST_CHECK bool geometry_draw_opaque(const struct window_frame *frame,
                                     const struct geometry_items *items, struct error *err);

/* Draws the transparent items and the media against the opaque depth with `fragment`, within the
 * frame's layer_bounds; textures only
 * if it evaluates materials. Media are drawn whole: both sides, what clip planes cut away too, and
 * in a draw of its own what lies behind the opaque depth, where some medium may surround the eye.
 */
MUST_CHECK bool geometry_draw_transparent(const struct window_frame *frame,
                                          const struct geometry_items *items, const char *fragment,
                                          bool evaluates, struct error *err);

/* The same of one transparent item alone, by its place among them. */
MUST_CHECK bool geometry_draw_transparent_item(const struct window_frame *frame,
                                               const struct geometry_items *items, size_t place,
                                               const char *fragment, bool evaluates,
                                               struct error *err);

/* The programs with which the items would be drawn, without drawing; of frame only view, state,
 * camera, needs and the samples of targets count. Thread: any. */
void geometry_list_opaque(const struct window_frame *frame, const struct geometry_items *items,
                          struct program_list *list);
struct geometry_layer_pass {
    const char *pass;     /* of the plan */
    const char *fragment; /* and evaluates: as for geometry_draw_transparent */
    bool evaluates;
    bool is_conditional; /* it is left out where there is nothing to draw */
};
void geometry_list_transparent(const struct window_frame *frame, const struct geometry_items *items,
                               const struct geometry_layer_pass *layers, struct program_list *list);

#endif
