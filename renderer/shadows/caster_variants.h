/* SPDX-License-Identifier: MIT */
/* Chooses the program that a caster is drawn with, by its material, the light's map and the pass.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_CASTER_VARIANTS_H
#define VITRAIL_RENDERER_SHADOWS_CASTER_VARIANTS_H

#include "renderer/shadows/shadow_casters.h"

enum caster_pass {
    CASTER_DEPTH,         /* opaque casters into the depth layer */
    CASTER_COUNT,         /* events of transparent casters, counted ... */
    CASTER_SCATTER,       /* ... and written to their places */
    CASTER_LINK,          /* transparent casters into linked lists */
    CASTER_LINK_FAITHFUL, /* all casters into linked lists */
    CASTER_PRODUCT,       /* transparent casters into texels: shadow_texel.frag.glsl; and ... */
    CASTER_CHANCE,        /* ... each with the chance of its opacity, ... */
    CASTER_COLOR_CHANCE,  /* ... or of that in each colour; */
    CASTER_BLEND,         /* blended over each other from the light on, as published */
    CASTER_ONE_CHANCE,    /* as CASTER_CHANCE, with one depth, as published */
    CASTER_WAVELENGTH,    /* as CASTER_COLOR_CHANCE, one colour after the other, as published; */
    CASTER_MOMENTS,       /* sums of absorbance times powers of depths, part by part */
};

struct caster_view { /* a light's map as a pass draws into it; all required */
    enum caster_pass pass;
    bool is_layered;  /* all faces in one pass: the vertex stage chooses the layer */
    bool is_unlocked; /* CASTER_LINK_FAITHFUL: without the lists' locks */
    const struct shadow_map *map;
    const struct shadow_scene *scene; /* of it gpu, state and blend_filter */
};

/* Whether the pass draws into store->colors. */
bool caster_pass_has_colors(enum caster_pass pass);
/* Whether it draws casters in the order in which the build has them, one face after the other. */
bool caster_pass_is_ordered(enum caster_pass pass);
/* How many times it draws all casters into the same texels, each time a part of them. */
uint32_t caster_pass_rounds(enum caster_pass pass);

/* Whether the pass draws this item of the state. */
bool caster_is_drawn(const struct caster_view *view, uint32_t item);

/* A key names a program; equal needs have equal keys. The media around a light have another key. */
uint32_t caster_key(const struct caster_view *view, const struct state_item *item);
uint32_t caster_around_key(const struct caster_view *view);
bool caster_key_samples_textures(uint32_t key);

enum { CASTER_DEFINES_BYTES = 192 };
struct program_desc caster_program(uint32_t key, char defines[CASTER_DEFINES_BYTES]);

/* The programs that drawing these casters takes. */
void caster_list_programs(const struct caster_view *view, const struct shadow_casters *casters,
                          const char *pass, bool is_conditional, struct program_list *list);

#endif
