/* SPDX-License-Identifier: MIT */
/* What a window gives to a deep image: of each pixel its transparent layers, media between them,
 * and the opaque surface. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADING_DEEP_H
#define VITRAIL_RENDERER_SHADING_DEEP_H

#include "renderer/image/deep_image.h"
#include "renderer/shading/shade.h"

/* Reads the samples of the window, which must be shaded, into the image. *overflows: they have no
 * room in one buffer, and smaller windows are needed. Waits for the device. */
MUST_CHECK bool deep_read(const struct shade_desc *desc, struct deep_image *image, bool *overflows,
                          struct error *err);
/* The program that such a window takes; as shade_list_programs. */
void deep_list_programs(const struct window_frame *frame, const struct shade_facts *facts,
                        bool is_conditional, struct program_list *list);
/* Bytes of the device per pixel of a window, without those of its layers. */
enum { DEEP_PIXEL_BYTES = 16 + 8 + 2 * 32 };

#endif
