// SPDX-License-Identifier: MIT
// The window's surfaces and depth, as renderer/window/window.c binds them.
// Needs: shared/bindings.h, SAMPLES.
#if SAMPLES > 1
#ifdef HAS_LOBES
layout(binding = UNIT_GBUFFER_LOBES) uniform usampler2DMS u_lobes;
#endif
#ifdef HAS_MORE_LOBES
layout(binding = UNIT_GBUFFER_MORE_LOBES) uniform usampler2DMS u_more_lobes;
#endif
layout(binding = UNIT_GBUFFER_0) uniform usampler2DMS u_surface_0;
layout(binding = UNIT_GBUFFER_1) uniform usampler2DMS u_surface_1;
layout(binding = UNIT_GBUFFER_DEPTH) uniform sampler2DMS u_depth_map;
layout(binding = UNIT_GBUFFER_SIGNATURE) uniform usampler2DMS u_signature;
#else
#ifdef HAS_LOBES
layout(binding = UNIT_GBUFFER_LOBES) uniform usampler2D u_lobes;
#endif
#ifdef HAS_MORE_LOBES
layout(binding = UNIT_GBUFFER_MORE_LOBES) uniform usampler2D u_more_lobes;
#endif
layout(binding = UNIT_GBUFFER_0) uniform usampler2D u_surface_0;
layout(binding = UNIT_GBUFFER_1) uniform usampler2D u_surface_1;
layout(binding = UNIT_GBUFFER_DEPTH) uniform sampler2D u_depth_map;
#endif
