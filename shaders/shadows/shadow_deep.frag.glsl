// SPDX-License-Identifier: MIT
// Deep shadow maps, capture: counts the transmittance events of a texel, and in a second pass
// writes them to their places. Both passes must decide alike which surfaces make an event, so they
// are one program where that depends on data: the face says which pass it is.
//   CERTAIN  every fragment makes an event; two programs then: PASS=0 counts without looking at the
//            material, PASS=1 scatters
//   IDS      keep the object of each event
//   MEDIA    keep the medium that each event enters or leaves: twice the number of its material
//            record from 1 on, plus 1 where it enters; 0 for a surface without one
//   SUBTEXELS=k   texels of the light are k * k of these: shadow_subtexel.glsl
//   CUT_PLANES=n   clip planes. What they cut away of a medium acts on no light: its events there
//            move, without their filter, to where the texel's ray enters what is kept, or leaves it
//   AROUND   no caster: a medium around the light begins where the ray enters what is kept
//   MEDIUM   the caster bounds a medium (CERTAIN, too: parity counts, even where the filter is 1)
// Events behind the nearest opaque caster fail the depth test (Lindbeck 2015, future work: "opaque
// pre-pass").
#include "shadows/shadow_caster.glsl"

layout(early_fragment_tests) in;

// Counted in the first pass; in the second, what is left to be written of each list.
layout(std430, binding = BIND_SHADOW_COUNTS) buffer count_buffer { uint counts[]; };
layout(binding = UNIT_SHADOW_HEADS) uniform usamplerBuffer u_heads;
#include "shadows/shadow_events.glsl"

#ifdef AROUND
uniform uvec2 u_around; // its words of events_medium and events_id
#endif

#if defined(CUT_PLANES) && defined(MEDIUM)
// Where the way of the light through the event is inside all planes, as depths.
vec2 kept_range()
{
    vec3 origin = vec3(0.0), way = caster_ray();
    if (!face_is_perspective()) {
        origin = way - FACE.axis_z.xyz * dot(FACE.axis_z.xyz, way);
        way = FACE.axis_z.xyz;
    }
    vec2 range = vec2(-3e38, 3e38);
    for (int k = 0; k < CUT_PLANES; k++) {
        float height = dot(FACE.cut_planes[k].xyz, origin) + FACE.cut_planes[k].w;
        float climb = dot(FACE.cut_planes[k].xyz, way);
        float at = climb != 0.0 ? -height / climb : (height < 0.0 ? 3e38 : -3e38);
        if (climb < 0.0)
            range.y = min(range.y, at);
        else
            range.x = max(range.x, at);
    }
    return min(vec2(range.x, max(range.x, range.y)), FACE.axis_y.w);
}
#endif

// Of an event in the texel's list; false where the list has all that were counted, so that none is
// written beyond it however the two passes differ.
bool take_place(uint texel, out uint place)
{
    int left = int(atomicAdd(counts[FACE.first_count + texel], 0xffffffffu));
    place = 0u;
    if (left <= 0)
        return false;
    place = texelFetch(u_heads, int(FACE.first_end + texel)).r - uint(left);
    bool has_room = place < FACE.event_count;
    place += FACE.event_base;
    return has_room;
}

#ifdef AROUND
void store_event(uint texel, float depth)
{
    uint place;
    if (!take_place(texel, place))
        return;
    events[place] = vec4(depth, vec3(1.0));
    events_medium[place].x = u_around.x;
#ifdef IDS
    events_id[place] = u_around.y;
#endif
}

void main()
{
    uvec2 at = uvec2(gl_FragCoord.xy);
    uint texel = at.y * FACE.resolution + at.x;
    vec2 range = kept_range();
    if (!(range.x > 0.0 && range.x < range.y))
        return;
    if (FACE.scatters != 0u)
        store_event(texel, range.x);
    else
        atomicAdd(counts[FACE.first_count + texel], 1u);
}
#else
void store_event(uint texel, vec3 t)
{
    uint place;
    if (!take_place(texel, place))
        return;
    float depth = caster_depth();
#if defined(CUT_PLANES) && defined(MEDIUM)
    vec2 range = kept_range();
    if (depth < range.x || depth > range.y)
        t = vec3(1.0);
    depth = clamp(depth, range.x, range.y);
#endif
    events[place] = vec4(depth, t);
#ifdef MEDIUM
    events_medium[place].x = 2u * v_draw.x + (gl_FrontFacing ? 3u : 2u);
#elif defined(MEDIA)
    events_medium[place].x = 0u;
#endif
#ifdef IDS
    uint cast_once = materials[v_draw.x].flags & MATERIAL_CAST_ONCE;
    events_id[place] = v_draw.y | (cast_once != 0u ? 0x80000000u : 0u);
#endif
}

void main()
{
    uvec2 at = uvec2(gl_FragCoord.xy);
    uint texel = at.y * FACE.resolution + at.x;
#ifndef CERTAIN
    vec3 t = caster_transmittance();
    if (t == vec3(1.0))
        return;
    if (FACE.scatters != 0u)
        store_event(texel, t);
    else
        atomicAdd(counts[FACE.first_count + texel], 1u);
#elif PASS == 1
    store_event(texel, caster_transmittance());
#else
    atomicAdd(counts[FACE.first_count + texel], 1u);
#endif
}
#endif
