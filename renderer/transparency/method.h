/* SPDX-License-Identifier: MIT */
/* A method of drawing transparent surfaces, as functions. Its plain data is a row of
 * protocol/transparency.h; each has a file of its own, method_NAME.c, and method_table.c lists
 * them. A method finds the transparent surfaces of a window, hands them out in sets to be lit, and
 * names the shader that composites them over the opaque picture. The planner, the executor, shading
 * and those who list programs ask the table and name no method. */
#ifndef VITRAIL_RENDERER_TRANSPARENCY_METHOD_H
#define VITRAIL_RENDERER_TRANSPARENCY_METHOD_H

#include "protocol/transparency.h"
#include "renderer/transparency/layers.h"
#include "renderer/transparency/list_sizes.h"
#include "renderer/window/geometry.h"
#include "renderer/window/surface_set.h"

/* A pass that finds surfaces, or lights them, for the plan and for explaining. */
struct transparency_pass {
    const char *name;    /* as the frame report has it; NULL ends the passes of a method */
    bool is_conditional; /* left out where the pass that counts finds nothing */
    bool is_of_light;    /* of the function `light`, not of `find` */
};

struct transparency_method {
    enum transparency id;                   /* the row */
    const struct transparency_pass *passes; /* in the order of execution, those of `find` first */
    const struct surface_kind *surfaces;    /* of all sets that it hands out */
    /* The source that composites what is lit over the opaque picture: LAYERS of
     * shaders/shading/shade_pixels.comp.glsl. */
    const char *compositing;
    const char *compositing_published; /* where quality.faithful asks for it; NULL: the same */
    bool walks_twice; /* over a pixel's surfaces, in compositing, for the bound of loop steps */
    /* What the picture approximates, for a warning; NULL: nothing. */
    const char *approximates;
    /* Adds the programs that finding these items takes, and may take; of frame what
     * geometry_list_transparent needs. Thread: any. */
    void (*list_programs)(const struct window_frame *frame, const struct geometry_items *items,
                          struct program_list *list);

    /* The rest is on the GL thread. */

    /* Counts the surfaces of a window ahead of finding them, and waits for nothing: behind the next
     * wait of any kind `find`, which is then to be called for the same window and items, reads
     * their number without another one. layers_clear forgets it. */
    bool (*count)(struct layers *layers, const struct window_frame *frame,
                  const struct geometry_items *items, struct error *err);
    /* Finds the surfaces of one window. With `room` the device is not waited for: what has found no
     * room is left out, never written beyond its storage, and only the device says so. NULL, or
     * room that there is no memory for, or surfaces that are counted already: their number is read
     * first. TOO_MANY asks the caller to split the window, for their number or, with missing_bytes,
     * for memory; err is then untouched. Nothing transparent in view: found, with no surface. */
    enum layers_outcome (*find)(struct layers *layers, const struct window_frame *frame,
                                const struct geometry_items *items, const struct list_sizes *room,
                                struct error *err);
    /* Takes the surfaces that `find` left to light: hands each set to the lighter when it is there,
     * and may draw and composite between one and the next. The lighter returns when the set is lit
     * by all lights at hand, so this is called once a window. It is called again where the lights
     * come in parts: for each batch of them, and where rays find the shadows, for each chunk. The
     * light of a surface then goes on with that of the part before. Items: those of `find`. */
    bool (*light)(struct layers *layers, const struct window_frame *frame,
                  const struct geometry_items *items, const struct surface_lighter *lighter,
                  struct error *err);
    /* How many sets that will be, for the progress: about. */
    int (*count_sets)(const struct layers *layers);
    /* For programs that read the surfaces: bindings and uniforms; NULL: none is in use. */
    void (*bind)(const struct layers *layers, const struct gl_program *program);
    /* Of methods with TRANSPARENCY_CAN_TRACED_SHADOWS, else NULL: a u32 per pixel of the window,
     * the end of its surfaces among all, which lie pixel after pixel. */
    const struct gl_buffer *(*ends)(const struct layers *layers);
    /* Adds the surfaces to the counts and their memory to the bytes. Not of guessed ones. */
    void (*report)(const struct layers *layers, struct frame_report *report);
    /* As layers_clear, layers_finish and layers_size_bytes, of what is the method's own. */
    void (*clear)(struct layers *layers);
    void (*finish)(struct layers *layers);
    uint64_t (*size_bytes)(const struct layers *layers);
};

extern const struct transparency_method transparency_method_lists;
extern const struct transparency_method transparency_method_weighted_blended;
extern const struct transparency_method transparency_method_depth_peeling;
extern const struct transparency_method transparency_method_dual_depth_peeling;
extern const struct transparency_method transparency_method_stochastic;
extern const struct transparency_method transparency_method_moment_based;
extern const struct transparency_method transparency_method_sorted;

const struct transparency_method *transparency_method_of(enum transparency transparency);
/* What of this, a set of enum transparency_can, the method cannot. */
unsigned transparency_method_lacks(const struct transparency_method *method, unsigned asked);

#endif
