/* SPDX-License-Identifier: MIT */
/* The radiance of the studio, and what generate/studio_levels.c has summed up over it. Thread: any.
 */
#ifndef VITRAIL_RENDERER_ENVIRONMENT_STUDIO_LEVELS_H
#define VITRAIL_RENDERER_ENVIRONMENT_STUDIO_LEVELS_H

#include "renderer/environment/environment_internal.h"

/* Of the size of the first specular level, which it is. */
MUST_CHECK bool studio_radiance_init(struct environment_texels *map, struct error *err);

/* One number per texel, because the studio is white: of the diffuse map, then of the specular
 * levels from the second on. */
extern const float studio_levels[];

#endif
