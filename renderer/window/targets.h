/* SPDX-License-Identifier: MIT */
/* The render targets of one window: G-buffer, depth, and the linear image. Thread: GL. */
#ifndef VITRAIL_RENDERER_WINDOW_TARGETS_H
#define VITRAIL_RENDERER_WINDOW_TARGETS_H

#include "renderer/gl/object.h"

struct targets {
    int width, height, samples;             /* of what is allocated */
    struct gl_texture surface_0, surface_1; /* RGBA32UI: shaders/draw/surface.glsl */
    /* RGBA32UI: shaders/draw/lobes.glsl; only where materials have any. */
    struct gl_texture lobes[2];
    struct gl_texture signature; /* R32UI: tells surfaces apart; only when multisampled */
    struct gl_texture depth;     /* D32F, reversed: 0 is infinitely far */
    struct gl_texture image;     /* RGBA32F, linear, associated alpha */
    /* RGBA32F, a layer per sample: opaque light so far, where the lights take several dispatches */
    struct gl_texture parts;
    struct gl_texture light; /* R32UI, a layer per sample: light of opaque surfaces */
    /* Where samples come in rounds (renderer/shading/accumulation.h), RGBA32F: pictures of the
     * rounds before; and what a round sees behind the picture, where that is mapped over a colour
     * of the screen. */
    struct gl_texture sum, behind, behind_sum;
    struct gl_texture opaque; /* RGBA32F, of deep images: surfaces or background behind all layers
                               */
    struct gl_buffer apart;   /* pixels whose samples are shaded apart (renderer/window/apart.h) */
    /* Where haze is lit (renderer/shading/atmosphere_light.h): the light in the slices of its
     * columns, how far each is seen, and the light from the eye to the slices of their corners. */
    struct gl_buffer atmosphere, atmosphere_reach, atmosphere_sums;
    struct gl_texture atmosphere_view; /* of the last, RGBA32F */
    /* Around lamps in haze (renderer/shading/atmosphere_glow.h): the same of their columns, and
     * their light along the ways of pixels. */
    struct gl_buffer glow_slices, glow_sums, glow_ways;
    struct gl_texture glow_view;  /* of the sums, RGBA32F */
    struct gl_buffer smoke;       /* where density grids are lit (renderer/shading/smoke.h) */
    struct gl_texture smoke_view; /* of that buffer, RGBA32F */
    /* Where layers refract (renderer/shading/refraction.h); RGBA32F. */
    struct gl_texture levels;     /* the picture without those: each level has half the pixels of
                                     the one before a side */
    struct gl_texture bent_parts; /* of pixels with one: two layers: what it lets through, and share
                                     of samples; of the others what struct tone_map_over has */
    struct gl_texture bent;       /* R32UI: 1 + entry of its surface; 0: none */
    struct gl_framebuffer gbuffer; /* surfaces, signature and depth */
    /* Depth alone: list passes must have no colour attachment (llvmpipe). */
    struct gl_framebuffer depth_only;
};

struct targets_desc {
    int width, height, samples;
    uint32_t lobes; /* words of four per surface: shader_needs_lobes */
};

/* Re-creates the targets when they differ. */
MUST_CHECK bool targets_prepare(struct targets *targets, const struct targets_desc *desc,
                                struct error *err);
/* Makes targets->parts where it is absent. */
MUST_CHECK bool targets_prepare_parts(struct targets *targets, struct error *err);
/* Of targets.apart: two lists, each of a head and what all pixels take. */
enum { TARGETS_APART_HEAD_BYTES = GL_BUFFER_ALIGNMENT };
uint64_t targets_apart_list_bytes(const struct targets *targets);
/* Makes targets->light and targets->apart where they are absent. */
MUST_CHECK bool targets_prepare_apart(struct targets *targets, struct error *err);
/* Makes those three as large, at least. */
MUST_CHECK bool targets_prepare_atmosphere(struct targets *targets, uint64_t slices_bytes,
                                           uint64_t columns_bytes, uint64_t sums_bytes,
                                           struct error *err);
/* Makes those of lamps in haze as large, at least. */
MUST_CHECK bool targets_prepare_glow(struct targets *targets, uint64_t slices_bytes,
                                     uint64_t sums_bytes, uint64_t ways_bytes, struct error *err);
/* Makes targets->smoke and its view as large, at least. */
MUST_CHECK bool targets_prepare_smoke(struct targets *targets, uint64_t bytes, struct error *err);
/* Makes targets->levels, bent_parts and bent where they are absent. */
MUST_CHECK bool targets_prepare_refraction(struct targets *targets, struct error *err);
enum { TARGETS_REFRACTION_PIXEL_BYTES = 58 }; /* of these */
/* Makes targets->sum and the textures of what is behind where they are absent, and deletes those
 * that are not asked for. */
MUST_CHECK bool targets_prepare_sum(struct targets *targets, bool has_sum, bool has_behind,
                                    struct error *err);
/* Makes targets->opaque where it is absent, or deletes it where it is not asked for. */
MUST_CHECK bool targets_prepare_opaque(struct targets *targets, bool is_asked, struct error *err);
/* What targets with so many samples take for a pixel, and their parts and sums beside them. */
uint64_t targets_pixel_bytes(int samples, uint32_t lobes);
uint64_t targets_parts_pixel_bytes(int samples);
uint64_t targets_sum_pixel_bytes(bool has_behind);
void targets_finish(struct targets *targets);
uint64_t targets_size_bytes(const struct targets *targets);

#endif
