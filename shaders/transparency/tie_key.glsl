// SPDX-License-Identifier: MIT
// Breaks ties of equal depth. Provides: tie_key. Needs: v_ids; fragment stage.

// Same value for the same triangle whatever the draw order; breaks ties of equal depth.
uint tie_key()
{
    uint h = v_ids.y * 0x9e3779b9u ^ v_ids.z * 0x85ebca6bu ^ uint(gl_PrimitiveID) * 0xc2b2ae35u;
    return h ^ h >> 15;
}
