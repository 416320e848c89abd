// SPDX-License-Identifier: MIT
// Lights the surfaces of a set, an invocation each. Opaque samples have a program of their own,
// shade_pixels.comp.glsl, which says why. Needs: those of lighting.glsl; IS_ORTHOGRAPHIC; SURFACES,
// the source of the set (renderer/window/surface_set.h), which provides
//   uint surface_count(): how many there are, as the device knows it,
//   bool surface_load(uint i, out lit_surface at): the i-th; false: nobody sees it,
//   void surface_store(uint i, vec3 radiance): keeps its light for compositing and later parts,
// and may use what stands before its inclusion.
#include "shading/lighting.glsl"
#include "window/view_ray.glsl"
layout(local_size_x = 64) in;
uniform uint u_first; // surface of the dispatch
uniform uint u_end;   // behind its last
#each SURFACES #include "$1"

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x + u_first;
    if (i >= min(u_end, surface_count()))
        return;
    lit_surface at;
    vec3 radiance = vec3(0.0);
    if (surface_load(i, at))
        radiance = lighting_evaluate(at);
    surface_store(i, radiance);
}
