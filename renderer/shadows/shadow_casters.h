/* SPDX-License-Identifier: MIT */
/* Drawing the casters of one face of a light, with the program that each material needs. Thread:
 * GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_CASTERS_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_CASTERS_H

#include "renderer/shadows/shadow_map.h"

/* Lists the items of state that cast a shadow in the frame. casters must be zeroed or finished by
 * the caller. */
MUST_CHECK bool shadow_casters_collect(struct shadow_casters *casters,
                                       const struct shadow_frame *frame,
                                       const struct scene_state *state, struct error *err);
void shadow_casters_finish(struct shadow_casters *casters);
/* copy must be zeroed or finished by the caller. */
MUST_CHECK bool shadow_casters_copy(const struct shadow_casters *casters,
                                    struct shadow_casters *copy, struct error *err);
/* Gives the map the clip planes that run through casters which it shows. */
void shadow_casters_cut(const struct shadow_casters *casters, const struct scene_state *state,
                        struct shadow_map *map);
/* Adds, over the faces, the casters that each sees and the others of the scene. */
void shadow_casters_count(const struct shadow_casters *casters, uint32_t face_count,
                          const struct scene_state *state, uint64_t *drawn, uint64_t *culled);

/* SHADOW_MAP, SHADOW_DEEP or SHADOW_LINKED for a light with these casters. False: it needs no
 * structure. */
bool shadow_casters_kind(const struct shadow_casters *casters, const struct view_quality *quality,
                         uint32_t *kind);

enum caster_pass {
    CASTER_DEPTH,         /* opaque casters into the depth layer */
    CASTER_COUNT,         /* events of transparent casters, counted ... */
    CASTER_SCATTER,       /* ... and written to their places */
    CASTER_LINK,          /* transparent casters into linked lists */
    CASTER_LINK_FAITHFUL, /* all casters into linked lists */
};

struct caster_variant {
    uint32_t key;
    uint32_t prepared; /* number of the face whose uniforms it has */
    const struct gl_program *program;
};

enum { CASTER_VARIANTS_MAX = 1024 };

struct caster_painter { /* zeroed, then given its programs */
    struct program_cache *programs;
    struct caster_variant variants[CASTER_VARIANTS_MAX];
    uint32_t variant_count;
    uint32_t face_number; /* counts faces painted */
    uint32_t *selected;   /* items of the face being painted ... */
    uint32_t *records;    /* ... and their draw records */
    size_t selected_capacity;
    struct gl_vertex_array corners; /* without attributes; made when it is first needed */
};

void caster_painter_finish(struct caster_painter *painter);

struct caster_paint_desc {
    enum caster_pass pass;
    struct shadow_build *build; /* its placement is kept up */
    const struct shadow_scene *scene;
    const struct shadow_store *store;
    uint32_t slot; /* CASTER_LINK*: of the light in the statistics */
};

/* All faces of the map, or its window. States all GL state that it needs; storage buffers are bound
 * by the caller.
 */
MUST_CHECK bool caster_painter_paint(struct caster_painter *painter,
                                     const struct caster_paint_desc *desc, struct error *err);

/* The programs that painting takes; of desc all but store and slot, of its build map and casters,
 * of the scene gpu, state and blend_filter. Thread: GL. */
void caster_list_programs(const struct caster_paint_desc *desc, const char *pass,
                          bool is_conditional, struct program_list *list);

#endif
