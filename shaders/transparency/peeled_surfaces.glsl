// SPDX-License-Identifier: MIT
// The layer that is being peeled as a set of surfaces: an entry for each pixel, unlit where the
// pixel has no more layers.
// Needs: those of entry_surfaces.glsl. Provides: surface_count, surface_load, surface_store.
uniform uint u_pixels;

uint surface_count() { return u_pixels; }

#include "transparency/entry_surfaces.glsl"
