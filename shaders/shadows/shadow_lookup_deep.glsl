// SPDX-License-Identifier: MIT
// Lookups in deep shadow maps: the product of the events of one contiguous, sorted list before a
// depth (renderer/shadows/shadow_deep.h). What the programs compile of it:
//   SHADOW_HAS_LONG    some lists are so long that keys find the event
//   SHADOW_HAS_IDS     some keep raw transmittances and objects
//   SHADOW_HAS_MEDIA   some know which extinction acts behind each event
//   SHADOW_HAS_NODES   some are compressed
// Provides: shadow_run_deep, shadow_list_deep (shadow_lists.glsl)
#include "shadows/shadow_run.glsl"
#include "shadows/shadow_key.glsl"
layout(binding = UNIT_SHADOW_EVENTS) uniform samplerBuffer u_shadow_events; // depth, transmittance
layout(binding = UNIT_SHADOW_KEYS) uniform usamplerBuffer u_shadow_keys;    // SHADOW_KEYS_AT

#ifdef SHADOW_HAS_LONG
const uint KEY_GUARDS = 0x80008000u; // of the two keys in a word

// Which of a texel's keys are not above the query's: bit i for word i's first key, bit 16 + i for
// its second. A guard bit survives the subtraction of a smaller or equal key.
uint shadow_keys_reached(uint query, int texel)
{
    uvec4 guards = (query - texelFetch(u_shadow_keys, texel)) & KEY_GUARDS;
    return guards.x >> 15 | guards.y >> 14 | guards.z >> 13 | guards.w >> 12;
}

// How many events from the list's second one on have at most this key: all that lie before the
// depth of the key, and perhaps some with an equal key that do not.
int shadow_count_keys(int begin, int end, uint key)
{
    uint query = key * 0x10001u | KEY_GUARDS;
    int word = SHADOW_KEYS_AT(begin), words = (end - begin) >> 1;
    int low = word >> 2, high = (word + words - 1) >> 2; // texels, of which three are looked at
    // In a long list the last three first: an opaque receiver has all events before it, as those
    // behind it were culled.
    for (int probe = high - 2; high - low > 2; probe = (low + high + 1) >> 1) {
        bool is_reached = (shadow_keys_reached(query, probe) & 1u) != 0u;
        low = is_reached ? probe : low;
        high = is_reached ? high : probe - 1;
    }
    uint reached = shadow_keys_reached(query, low) | shadow_keys_reached(query, low + 1) << 4 |
                   shadow_keys_reached(query, low + 2) << 8;
    int first = max(word - 4 * low, 0), last = min(word + words - 4 * low, 12);
    uint own = (1u << uint(last)) - (1u << uint(first)); // words of this list among the twelve
    return 2 * max(4 * low - word, 0) + bitCount(reached & own * 0x10001u);
}

// The last event of a list before the depth, or -1; events are sorted by depth. Keys tell which one
// it is, up to events with the key of the depth itself, so that a search touches one or two
// cache lines of keys and one of events, and a list of at most 17 events needs no dependent reads
// but these.
int shadow_last_event(shadow_run run, float depth, float keys_per_m, out vec4 last)
{
    int count = 1 + shadow_count_keys(run.begin, run.end, shadow_key(depth, keys_per_m));
    int low = run.begin - 1, high = min(run.begin + count, run.end) - 1; // between, both included
    last = vec4(0.0, vec3(1.0));
    for (int back = 0; low < high;) { // nearly always once; leaps back among many of one key
        int probe = max(high - back, low + 1);
        vec4 event = texelFetch(u_shadow_events, probe);
        bool is_before = event.x < depth;
        last = is_before ? event : last;
        low = is_before ? probe : low;
        high = is_before ? high : probe - 1;
        back = is_before ? (high - low) >> 1 : 2 * back + 1;
    }
    return low >= run.begin ? low : -1;
}
#else
// The same by halves: of few events, one or two reads find it, and the keys would be more.
int shadow_last_event(shadow_run run, float depth, float keys_per_m, out vec4 last)
{
    int low = run.begin - 1, high = run.end - 1; // what it is between, both included
    last = vec4(0.0, vec3(1.0));
    do {
        if (low < high) { // what leaves the loop is assigned in here: shadow_query.glsl
            int probe = (low + high + 1) >> 1;
            vec4 event = texelFetch(u_shadow_events, probe);
            bool is_before = event.x < depth;
            last = is_before ? event : last;
            low = is_before ? probe : low;
            high = is_before ? high : probe - 1;
        }
    } while (low < high);
    return low >= run.begin ? low : -1;
}
#endif

#ifdef SHADOW_HAS_MEDIA
layout(binding = UNIT_SHADOW_MEDIA) uniform usamplerBuffer u_shadow_media; // sigma behind events

// The light that passes the stretch from the last event, at index `at` or -1, to the receiver
// itself at `reach`. sigma: where the light stands.
vec3 shadow_last_stretch(int at, float last_depth, float reach, vec3 sigma)
{
    if (at >= 0)
        sigma = uintBitsToFloat(texelFetch(u_shadow_media, at).xyz);
    return exp(-max(sigma, vec3(0.0)) * max(reach - last_depth, 0.0));
}
#endif

#ifdef SHADOW_HAS_IDS
layout(binding = UNIT_SHADOW_ID) uniform usamplerBuffer u_shadow_id;

// With each event its own transmittance alone; those of `object` are left out.
vec3 shadow_deep_without(shadow_run run, float depth, uint object)
{
    vec3 t = vec3(1.0);
    for (int at = run.begin; at < run.end; at++) {
        vec4 event = texelFetch(u_shadow_events, at);
        if (event.x >= depth)
            break;
        if ((texelFetch(u_shadow_id, at).r & 0x7fffffffu) != object)
            t *= event.yzw;
    }
    return t;
}
#endif

#if defined(SHADOW_HAS_IDS) && defined(SHADOW_HAS_MEDIA)
// Both: `object` neither filters nor contains. With each event its own sigma, negative where it
// leaves.
vec3 shadow_deep_media_without(shadow_run run, float depth, float reach, vec3 sigma, uint object)
{
    wide_balance inside = balance_of(wide_of(sigma));
    wide3 tau = wide_of(vec3(0.0));
    vec3 t = vec3(1.0);
    float z = 0.0;
    for (int at = run.begin; at < run.end; at++) {
        vec4 event = texelFetch(u_shadow_events, at);
        if (event.x >= depth)
            break;
        if ((texelFetch(u_shadow_id, at).r & 0x7fffffffu) == object)
            continue;
        t *= event.yzw;
        tau = depth_add(tau, wide_positive(inside.sum), event.x - z);
        z = event.x;
        balance_add(inside, uintBitsToFloat(texelFetch(u_shadow_media, at).xyz));
    }
    tau = depth_add(tau, wide_positive(inside.sum), max(reach - z, 0.0));
    return t * exp(-wide_round(tau));
}
#endif

#ifdef SHADOW_HAS_NODES
#include "shadows/shadow_nodes.glsl"
#endif

bool shadow_run_deep(uint flags, uint head, uint event_base, out shadow_run run)
{
    run.begin = int(event_base + texelFetch(u_shadow_heads, int(head)).r);
    run.end = int(event_base + texelFetch(u_shadow_heads, int(head) + 1).r);
#ifdef SHADOW_HAS_MEDIA
    if ((flags & SHADOW_FLAG_MEDIA) != 0u) // the light itself may stand in one
        return true;
#endif
    return run.end > run.begin;
}

// With each event stands the product of all up to and including it. One search serves lists with
// and without media: of two, Intel's compiler makes a program that spills.
vec3 shadow_list_deep(shadow_run run, shadow_look look)
{
#if defined(SHADOW_HAS_IDS) && defined(SHADOW_HAS_MEDIA)
    if (look.flags == (SHADOW_FLAG_RAW | SHADOW_FLAG_MEDIA))
        return shadow_deep_media_without(run, look.depth, look.reach, look.sigma, look.object);
#endif
#ifdef SHADOW_HAS_IDS
    if ((look.flags & SHADOW_FLAG_RAW) != 0u)
        return shadow_deep_without(run, look.depth, look.object);
#endif
#ifdef SHADOW_HAS_NODES
    if ((look.flags & SHADOW_FLAG_NODES) != 0u)
        return shadow_nodes(run, look.depth, look.reach);
#endif
    vec4 last;
    int at = shadow_last_event(run, look.depth, look.keys_per_m, last);
    vec3 t = last.yzw;
#ifdef SHADOW_HAS_MEDIA
    if ((look.flags & SHADOW_FLAG_MEDIA) != 0u)
        t *= shadow_last_stretch(at, last.x, look.reach, look.sigma);
#endif
    return t;
}
