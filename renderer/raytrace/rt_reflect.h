/* SPDX-License-Identifier: MIT */
/* What part of the light that arrives a surface sends to the viewer: docs/shading.md, section 3. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_REFLECT_H
#define VITRAIL_RENDERER_RAYTRACE_RT_REFLECT_H

#include "renderer/raytrace/rt_surface.h"

/* f * cosine of appendix B.3, and the mirrored lobe of KHR_materials_transmission [1/sr]. v, l:
 * unit, away from the surface, to the viewer and to the light. */
void rt_reflect(const struct rt_surface *s, const double v[3], const double l[3], double out[3]);

/* Adds what the hemisphere light of the state sends to the viewer [nt]. */
void rt_reflect_hemisphere(const struct scene_state *state, const struct rt_surface *s,
                           const double v[3], double out[3]);

#endif
