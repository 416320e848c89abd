// SPDX-License-Identifier: MIT
// Points over the boxes of density grids, from face to face (renderer/scene/smoke_lattice.h).
// Needs: GRID_COUNT.
uniform uvec3 u_smoke_steps[GRID_COUNT]; // along each axis
uniform uint u_smoke_points;             // of all grids

int smoke_lattice_points(ivec3 steps)
{
    return (steps.x + 1) * (steps.y + 1) * (steps.z + 1);
}
