// SPDX-License-Identifier: MIT
// What is being peeled as a set of surfaces: one entry for each pixel, or two from both sides,
// unlit where the pixel has no more layers.
// Needs: those of entry_surfaces.glsl. Provides: surface_count, surface_load, surface_store.
uniform uint u_entries;

uint surface_count() { return u_entries; }

#include "transparency/entry_surfaces.glsl"
