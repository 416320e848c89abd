// SPDX-License-Identifier: MIT
// Second pass of the per-pixel lists, which are sorted by depth. Needs: those of
// entry_scatter.glsl.
#include "transparency/lists_scatter.glsl"
