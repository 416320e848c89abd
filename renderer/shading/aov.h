/* SPDX-License-Identifier: MIT */
/* Auxiliary outputs of a window: depth, position, normal, ids, transmittance, list lengths.
 * Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADING_AOV_H
#define VITRAIL_RENDERER_SHADING_AOV_H

#include "renderer/image/image.h"
#include "renderer/shading/shade.h"

struct aov {
    struct gl_buffer words; /* those of the outputs asked for, pixel by pixel */
};

/* The shape of an output's image: channels, and F32 or U32 components. */
void aov_shape(enum view_output output, int *channels, enum image_component *component);

/* Writes the requested auxiliary outputs of the window into `outputs` (whole images, indexed by
 * view_output). desc->lists must be prepared where VIEW_OUTPUT_LIGHTS is among them; desc->shadows
 * is not used. */
MUST_CHECK bool aov_read(struct aov *aov, const struct shade_desc *desc, struct image *outputs,
                         struct error *err);
/* The program that such a window takes; as shade_list_programs. */
void aov_list_programs(const struct window_frame *frame, const struct shade_facts *facts,
                       bool is_conditional, struct program_list *list);
/* Bytes of the device per pixel of a window. */
uint64_t aov_pixel_bytes(const struct view *view);
void aov_finish(struct aov *aov);

#endif
