/* SPDX-License-Identifier: MIT */
/* The features that the shaders of a scene need: its kinds of materials and lights. All others are
 * left out of its programs (Lexolights: Peciva 2012, 3.2). They are those of the whole
 * scene, not of what is in view, so that a camera that moves compiles nothing. Thread: any. */
#ifndef VITRAIL_RENDERER_DRAW_SHADER_NEEDS_H
#define VITRAIL_RENDERER_DRAW_SHADER_NEEDS_H

#include "renderer/scene/scene_state.h"

enum { SHADER_NEEDS_TEXT_BYTES = 96 };

struct shader_needs {
    uint32_t surface_kinds; /* MATERIAL_* of opaque and masked drawables, and MATERIAL_KIND_METAL */
    uint32_t layer_kinds;   /* likewise of transparent ones and of media */
    uint32_t light_kinds;   /* bit 1 << LIGHT_* */
    bool has_ranges;        /* some light ends at its range */
    bool has_smooth; /* opaque or masked drawables whose triangles stand for curved surfaces */
    bool has_normal_offset; /* shadow maps are looked up above smooth surfaces; set by the plan */
    bool refracts;          /* some drawable bends what is behind it; set by the plan */
    /* shader_needs_of leaves these to the plan */
    uint32_t area_samples; /* points taken of each area light; 1: its centre stands for it; 0: there
                              is none, or has_area_form */
    bool has_area_form;    /* area lights are integrated over */
    uint32_t visibility_lobes; /* rays find what is left of a map's light over so many lobes of a
                                  surface, enum VISIBILITY_*; 0: it passes all; set by the plan */
};

/* Whether programs read where the areas of lights lie. */
static inline bool shader_needs_areas(const struct shader_needs *needs)
{
    return needs->area_samples > 1 || needs->has_area_form;
}

struct shader_needs shader_needs_of(const struct scene_state *state);

/* How many words of four of shaders/draw/lobes.glsl a surface has, with such kinds: 0 to 2. */
uint32_t shader_needs_lobes(uint32_t kinds);

/* #define items of the programs that evaluate such materials, with a blank before each. */
void shader_needs_material_defines(uint32_t kinds, char text[SHADER_NEEDS_TEXT_BYTES]);
/* Likewise of lights; empty without any. */
void shader_needs_light_defines(const struct shader_needs *needs,
                                char text[SHADER_NEEDS_TEXT_BYTES]);

#endif
