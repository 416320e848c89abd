// SPDX-License-Identifier: MIT
// Lists of nodes from exact lists of transmittance events, one texel per thread.
//   SUBTEXELS=k  each texel has k * k lists: its visibility function is their mean (Lokovic and
//                Veach 2000, "Deep shadow maps", section 3.1, with a box filter)
//   MEDIA        exact lists say which extinction acts behind each event; its exponentials become
//                chords that leave them by u_chord at most
//   WRITE        the second pass: writes the nodes, which the first one counted
// Loop iterations: one per event of the texel's lists and one, and with MEDIA one per stretch and
// one per chord, of which there are at most 3 k sqrt(1 / (2 u_chord)), below 800; the host keeps
// the events below 60,000, with MEDIA below 30,000.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"

layout(local_size_x = 64) in;
// WRITE: heads; else the counts.
layout(std430, binding = BIND_SHADOW_COUNTS) buffer count_buffer { uint counts[]; };
#ifdef WRITE
layout(std430, binding = BIND_SHADOW_EVENTS) writeonly buffer event_buffer { vec4 events[]; };
uniform uint u_event_base;
uint node_place = 0u;
#endif
layout(binding = UNIT_SHADOW_HEADS) uniform usamplerBuffer u_heads; // of the exact lists
layout(binding = UNIT_SHADOW_EVENTS) uniform samplerBuffer u_events;
#ifdef MEDIA
layout(binding = UNIT_SHADOW_MEDIA) uniform usamplerBuffer u_media;
uniform vec4 u_sigma; // where the light stands
uniform float u_chord;
#endif

uniform uint u_first_count;  // of the first texel's counts, or heads
uniform uint u_texels;
uniform uint u_resolution;   // of the nodes' map
uniform uint u_source_head;  // of the exact lists
uniform uint u_source_base;

#include "shadows/shadow_compress.glsl"
#include "shadows/shadow_network.glsl"

void node_write(uint i, vec4 node)
{
#ifdef WRITE
    events[u_event_base + node_place + i] = node;
#endif
}

#define FAR_AWAY 3.0e38 // deeper than any event
// What several rays find of one plane was rounded for each: up to such a distance, 1 relative and
// one in metres, drops fall together. It is a twentieth of what a query allows for rounding; 0 for
// one ray.
uniform vec4 u_together;
#if SUBTEXELS == 1
#define ALL(DO) DO(0)
#elif SUBTEXELS == 2
#define ALL(DO) DO(0) DO(1) DO(2) DO(3)
#elif SUBTEXELS == 3
#define ALL(DO) EACH_8(DO, 0) DO(8)
#else
#define ALL(DO) EACH_8(DO, 0) EACH_8(DO, 8)
#endif
#define LISTS (SUBTEXELS * SUBTEXELS)

// Of each list: the next event and the end, and what is known behind the last event. Constant
// indices keep them in registers.
int next_at[LISTS], end_at[LISTS];
float next_z[LISTS];
vec3 now_t[LISTS];
#ifdef MEDIA
float now_z[LISTS];
vec3 now_sigma[LISTS];
#endif

void list_begin(int i, uint corner)
{
    int head = int(u_source_head + corner + uint(i / SUBTEXELS) * u_resolution *
                   uint(SUBTEXELS) + uint(i % SUBTEXELS));
    next_at[i] = int(u_source_base + texelFetch(u_heads, head).r);
    end_at[i] = int(u_source_base + texelFetch(u_heads, head + 1).r);
    next_z[i] = next_at[i] < end_at[i] ? texelFetch(u_events, next_at[i]).x : FAR_AWAY;
    now_t[i] = vec3(1.0);
#ifdef MEDIA
    now_z[i] = 0.0;
    now_sigma[i] = max(u_sigma.rgb, vec3(0.0));
#endif
}

vec3 list_visibility(int i, float z)
{
#ifdef MEDIA
    return now_t[i] * exp(-now_sigma[i] * max(z - now_z[i], 0.0));
#else
    return now_t[i];
#endif
}

#define BEGIN(i) list_begin(i, corner); total += uint(end_at[i] - next_at[i]);
#define NEAREST(i) nearest = min(nearest, next_z[i]);
#define PICK(i) if (which < 0 && next_z[i] == nearest) { which = i; at = next_at[i]; \
    end = end_at[i]; }
#define ADVANCE(i) if (which == i) { next_at[i] = at + 1; next_z[i] = z_next; now_t[i] = e.yzw; }
#define MEAN(i) sum += list_visibility(i, z);

vec3 mean_visibility(float z)
{
    vec3 sum = vec3(0.0);
    ALL(MEAN)
    return sum * (1.0 / float(LISTS));
}

void take_event(float nearest)
{
    int which = -1, at = 0, end = 0;
    ALL(PICK)
    vec4 e = texelFetch(u_events, at);
    float z_next = at + 1 < end ? texelFetch(u_events, at + 1).x : FAR_AWAY;
    ALL(ADVANCE)
#ifdef MEDIA
    vec3 sigma = max(uintBitsToFloat(texelFetch(u_media, at).xyz), vec3(0.0));
#define ADVANCE_MEDIUM(i) if (which == i) { now_z[i] = e.x; now_sigma[i] = sigma; }
    ALL(ADVANCE_MEDIUM)
#endif
}

#ifdef MEDIA
// The chord of an exponential of slope -v sigma leaves it by v (sigma h)^2 / 8 at most; v falls.
#define BEND(i) bend += list_visibility(i, z) * now_sigma[i] * now_sigma[i];

void fit_chords(float z, float end)
{
    for (;;) {
        vec3 bend = vec3(0.0), v = mean_visibility(z);
        ALL(BEND)
        float most = max(bend.x, max(bend.y, bend.z)) * (1.0 / float(LISTS));
        z += sqrt(8.0 * u_chord / max(most, 1e-30));
        if (most < 1e-30 || z >= end || all(lessThanEqual(v, vec3(u_chord))))
            return;
        fit_point(z, mean_visibility(z));
    }
}
#endif

void compress(uint corner)
{
    uint total = 0u;
    ALL(BEGIN)
#ifdef MEDIA
    bool is_lit = all(lessThanEqual(u_sigma.rgb, vec3(0.0)));
#else
    const bool is_lit = true;
#endif
    fit_begin(is_lit);
    if (is_lit && total == 0u)
        return;
    float drop = 0.0, together = 0.0; // where the events being taken lie
    for (uint n = 0u; n <= total; n++) {
        float nearest = FAR_AWAY;
        ALL(NEAREST)
        if (nearest > together) {
            fit_point(drop, mean_visibility(drop));
#ifdef MEDIA
            fit_chords(drop, nearest);
#endif
            if (nearest < FAR_AWAY)
                fit_point(nearest, mean_visibility(nearest));
            drop = nearest;
            together = nearest + nearest * u_together.x + u_together.y;
        }
        if (nearest < FAR_AWAY)
            take_event(nearest);
    }
    fit_finish();
}

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint texel = group * 64u + gl_LocalInvocationID.x;
    if (texel >= u_texels)
        return;
    uint row = texel / u_resolution, column = texel % u_resolution;
    uint corner = (row * u_resolution * uint(SUBTEXELS) + column) * uint(SUBTEXELS);
#ifdef WRITE
    node_place = counts[u_first_count + texel];
    compress(corner);
#else
    compress(corner);
    counts[u_first_count + texel] = node_count;
#endif
}
