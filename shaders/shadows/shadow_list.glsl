// SPDX-License-Identifier: MIT
// The end of every sort of a texel's events: the order, and what is written once it stands.
// Without IDS the transmittance of each event becomes the product of all up to and including it,
// accumulated as a wide number and rounded once: a query is then one search and one fetch, and in
// practice the order of factors does not show. With IDS raw transmittances stay, for queries that
// leave objects out; neighbours of one cast-once object count once (Lindbeck 2015, 3.2).
// With MEDIA the way between two events takes exp(-sigma * length) of the light, sigma the sum of
// the media entered and not yet left. Each event gets the product up to and including it, and the
// sigma that acts behind it: transmittance at depth z is P_i * exp(-sigma_i * (z - z_i)). Optical
// depth and sigma are wide; a sum that only rounding keeps from zero is zero. With IDS, too, each
// event gets its own sigma, negative where it leaves.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "base/wide.glsl"

layout(local_size_x = 64) in;
#ifdef MEDIA
#include "material/material.glsl"
#endif
#include "shadows/shadow_events.glsl"
#ifndef IDS
#include "shadows/shadow_key.glsl"
layout(std430, binding = BIND_SHADOW_KEYS) writeonly buffer key_buffer { uint keys[]; };
#endif
layout(std430, binding = BIND_SCAN) readonly buffer texel_buffer { uint class_texels[]; };
layout(std430, binding = BIND_DEEP_LISTS) readonly buffer table_buffer { uint list_first[]; };
layout(std430, binding = BIND_DEEP_LIGHTS) readonly buffer light_buffer { deep_light lights[]; };
#ifdef SCRATCH
layout(std430, binding = BIND_LIST_NODES) buffer scratch_buffer { vec4 scratch[]; }; // z, T
#ifdef IDS
layout(std430, binding = BIND_STATISTICS) buffer scratch_id_buffer { uint scratch_id[]; };
#endif
#ifdef MEDIA
layout(std430, binding = BIND_SHADOW_SCRATCH_MEDIA) buffer scratch_media_buffer {
    uint scratch_medium[];
};
#endif
#endif

layout(binding = UNIT_SHADOW_HEADS) uniform usamplerBuffer u_heads;

// A place of class_texels that no list took is 0xffffffff, which is beyond all texels.

uniform uint u_row;    // in list_first: of the class, and of the first light
uniform uint u_lights; // whose lists of the class are sorted, the first of them ...
uniform uint u_first_light; // ... this one
uniform uvec2 u_lists;  // of theirs: how many are passed over, and how many are sorted ...
uniform uvec2 u_texels; // ... where they are of these texels: the first, and how many
uniform uint u_event_window; // the first event that is bound; places are counted from it
#ifdef SCRATCH
uniform uint u_room;       // of a list in scratch memory
uniform uint u_from, u_to; // where these lists lie there
#endif

// Of the thread's list.
uint list_light = 0u;  // index of its light
uint list_number = 0u; // among those that are sorted

struct event {
    vec4 z_t;
#ifdef IDS
    uint id;
#endif
#ifdef MEDIA
    uint medium; // shadow_deep.frag.glsl
#endif
};

// A total order without object ids: equal keys are equal events.
bool is_after(vec4 a, vec4 b)
{
    if (a.x != b.x)
        return a.x > b.x;
    if (a.y != b.y)
        return a.y > b.y;
    return a.z != b.z ? a.z > b.z : a.w > b.w;
}

bool event_is_after(event a, event b)
{
#ifdef MEDIA
    if (a.z_t == b.z_t && a.medium != b.medium)
        return a.medium > b.medium;
#endif
#ifdef IDS
    if (a.z_t == b.z_t)
        return a.id > b.id;
#endif
    return is_after(a.z_t, b.z_t);
}

struct list_end {
    wide3 share;
    uint last_id;
    uint key; // of the event before
    float keys_per_m;
#ifdef MEDIA
    wide3 tau;
    wide_balance sigma;
    float z;
#endif
};

list_end list_end_begin()
{
    list_end end;
    end.share = share_all();
    end.last_id = 0xffffffffu;
    end.key = 0u;
    end.keys_per_m = lights[list_light].keys_per_m;
#ifdef MEDIA
    end.tau = wide_of(vec3(0.0));
    wide3 sigma = wide_of(lights[list_light].sigma_high.xyz);
    end.sigma = balance_of(wide_add(sigma, lights[list_light].sigma_low.xyz));
    end.z = 0.0;
#endif
    return end;
}

#ifdef MEDIA
vec3 event_sigma(event e)
{
    if (e.medium == 0u)
        return vec3(0.0);
    vec3 sigma = materials[e.medium / 2u - 1u].attenuation.rgb;
    return (e.medium & 1u) != 0u ? sigma : -sigma;
}

// Goes on to the event and crosses it.
void list_advance(inout list_end end, event e)
{
    end.tau = depth_add(end.tau, wide_positive(end.sigma.sum), e.z_t.x - end.z);
    end.z = e.z_t.x;
    balance_add(end.sigma, event_sigma(e));
}
#endif

// Event i of the list of n that starts at `first`.
void list_append(inout list_end end, uint first, uint n, uint i, event e)
{
    uint place = first + i;
    vec3 t = e.z_t.yzw;
#ifdef IDS
    if (e.id == end.last_id && (e.id & 0x80000000u) != 0u)
        t = vec3(1.0);
    end.last_id = e.id;
    events_id[place] = e.id;
#ifdef MEDIA
    events_medium[place] = uvec4(floatBitsToUint(event_sigma(e)), 0u);
#endif
#else
    end.share = share_filter(end.share, t);
    t = share_round(end.share);
#ifdef MEDIA
    list_advance(end, e);
    t *= exp(-wide_round(end.tau));
    vec3 sigma = wide_round(wide_positive(end.sigma.sum));
    events_medium[place] = uvec4(floatBitsToUint(sigma), 0u);
#endif
#endif
    events[place] = vec4(e.z_t.x, t);
#ifndef IDS
    uint key = shadow_key(e.z_t.x, end.keys_per_m);
    if (i > 0u && i % 2u == 0u)
        keys[SHADOW_KEYS_AT(first) + i / 2u - 1u] = end.key | key << 16u;
    else if (i % 2u == 1u && i + 1u == n)
        keys[SHADOW_KEYS_AT(first) + i / 2u] = key | SHADOW_KEY_NONE << 16u;
    end.key = key;
#endif
}

// Lists longer than a network are sorted in runs of 32 and merged level by level, to and fro
// between two halves of scratch memory; the last level finishes in the streams. All lists of a
// class have equally many levels, and as much room.
#ifdef SCRATCH
uint scratch_place(uint lists, uint i)
{
    return lists + list_number * u_room + i;
}

// Event i of the list.
event scratch_read(uint i)
{
    i = scratch_place(u_from, i);
    event e;
    e.z_t = scratch[i];
#ifdef IDS
    e.id = scratch_id[i];
#endif
#ifdef MEDIA
    e.medium = scratch_medium[i];
#endif
    return e;
}

void scratch_write(uint i, event e)
{
    i = scratch_place(u_to, i);
    scratch[i] = e.z_t;
#ifdef IDS
    scratch_id[i] = e.id;
#endif
#ifdef MEDIA
    scratch_medium[i] = e.medium;
#endif
}
#endif

// The list of n events whose first has this place.
void sort_list(uint first, uint n);

// The light that has the list: the last one whose lists begin at it or before.
uint find_light(uint list)
{
    uint low = 0u, high = u_lights;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (list_first[u_row + middle] <= list)
            low = middle;
        else
            high = middle;
    }
    return low + u_first_light;
}

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    list_number = group * 64u + gl_LocalInvocationID.x;
    uint list = list_first[u_row] + u_lists.x + list_number;
    if (list_number >= u_lists.y || list >= list_first[u_row + u_lights])
        return;
    list_light = find_light(list);
    uint texel = class_texels[list];
    if (texel - u_texels.x >= u_texels.y)
        return;
    int head = int(lights[list_light].first_head + texel);
    uint begin = texelFetch(u_heads, head).r, end = texelFetch(u_heads, head + 1).r;
    sort_list(lights[list_light].event_base - u_event_window + begin, end - begin);
}
