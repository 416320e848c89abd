// SPDX-License-Identifier: MIT
// lists_scatter.frag.glsl for objects in an order: what is drawn later lies over what is drawn
// earlier, object by object and triangle by triangle, whatever the depths. Needs: those of
// entry_scatter.glsl.
uniform uint u_object_rank; // of the object that is drawn, from back to front
#define KEY_DEPTH u_object_rank
#define KEY_TIE ~uint(gl_PrimitiveID)
#include "transparency/lists_scatter.glsl"
