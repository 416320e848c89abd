/* SPDX-License-Identifier: MIT */
/* Drawing the casters of lights into the faces of their maps. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_CASTER_PAINTER_H
#define VITRAIL_RENDERER_SHADOWS_CASTER_PAINTER_H

#include "renderer/gl/stream.h"
#include "renderer/shadows/caster_variants.h"

struct caster_variant {
    uint32_t key;
    const struct gl_program *program;
};

enum { CASTER_VARIANTS_MAX = 1024 };

struct paint_list { /* a caster as one face sees it, each */
    uint32_t *items, *records;
    uint32_t *faces;  /* numbers of face records */
    uint32_t *builds; /* whose face it is */
    size_t count, capacity;
};

struct paint_face; /* of a face that is drawn by itself */

struct caster_painter { /* zeroed, then given its programs and its way */
    struct program_cache *programs;
    /* All faces of all lights are drawn in one pass, whose vertex stage chooses the layer; the
     * device must be able to. Else one after the other. */
    bool is_layered;
    struct caster_variant variants[CASTER_VARIANTS_MAX];
    uint32_t variant_count;
    struct paint_list list;
    struct face_record *records; /* of the faces being painted ... */
    struct paint_face *faces;    /* ... and where they are */
    size_t face_capacity;
    struct gl_stream face_stream;
    struct gl_vertex_array corners; /* without vertex attributes; created when first needed */
};

void caster_painter_finish(struct caster_painter *painter);

struct caster_paint_desc { /* all required */
    enum caster_pass pass;
    bool is_unlocked;                   /* CASTER_LINK_FAITHFUL: without the locks of lists */
    bool keeps_texels;                  /* passes into texels add to what stands there */
    uint32_t part;                      /* of what the pass draws part by part */
    struct shadow_build *const *builds; /* of one resolution; their placements are kept up */
    size_t build_count;
    const struct shadow_scene *scene;
    struct shadow_store *store;
    /* Of the pools: element 0 of what is bound, counts of deep lists, heads of linked ones; 0: all
     * is. */
    uint64_t first_count, first_event;
};

/* Draws casters into all faces of the maps, or into their windows. Sets all GL state that it needs;
 * the caller binds storage buffers. */
MUST_CHECK bool caster_painter_paint(struct caster_painter *painter,
                                     const struct caster_paint_desc *desc, struct error *err);

#endif
