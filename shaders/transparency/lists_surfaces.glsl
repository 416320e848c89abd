// SPDX-License-Identifier: MIT
// The entries of the per-pixel lists as a set of surfaces.
// Needs: those of entry_surfaces.glsl. Provides: surface_count, surface_load, surface_store.
layout(std430, binding = BIND_PIXEL_COUNTS) readonly buffer count_buffer { uint ends[]; };
uniform uint u_pixels;

uint surface_count() { return ends[u_pixels - 1u]; }

#include "transparency/entry_surfaces.glsl"
