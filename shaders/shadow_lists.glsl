// SPDX-License-Identifier: MIT
// The product of the transmittance events of one texel before a depth, from whichever structure
// holds them.
layout(binding = UNIT_SHADOW_HEADS) uniform usamplerBuffer u_shadow_heads;

#ifdef SHADOW_HAS_DEEP
layout(binding = UNIT_SHADOW_EVENTS) uniform samplerBuffer u_shadow_events; // depth, transmittance
layout(binding = UNIT_SHADOW_INDEX) uniform samplerBuffer u_shadow_index; // SHADOW_INDEX_AT

// The last event of a list before the depth, or -1; events are sorted by depth. The index tells
// which four to look at, so that a search in a long list touches two or three cache lines.
int shadow_last_event(uint head, uint event_base, float depth, out vec4 last)
{
    int begin = int(event_base + texelFetch(u_shadow_heads, int(head)).r);
    int end = int(event_base + texelFetch(u_shadow_heads, int(head) + 1).r);
    int first = SHADOW_INDEX_AT(begin), four = first, n = SHADOW_INDEX_COUNT(end - begin);
    // The last entry first: an opaque receiver has all events before it, as those behind it were
    // culled.
    for (int probe = n; n > 0; probe = (n + 1) >> 1) {
        bool is_before = texelFetch(u_shadow_index, four + probe - 1).r < depth;
        four += is_before ? probe : 0;
        n = is_before ? n - probe : probe - 1;
    }
    int low = begin + 4 * (four - first);
    int found = -1;
    last = vec4(0.0, vec3(1.0));
    for (int i = min(low + 4, end) - 1; i >= low; i--) {
        vec4 event = texelFetch(u_shadow_events, i);
        bool is_before = event.x < depth;
        last = is_before ? event : last;
        found = is_before ? i : found;
        low = is_before ? end : low;
    }
    return found;
}

// With each event the product of all up to and including it.
vec3 shadow_deep(uint head, uint event_base, float depth)
{
    vec4 last;
    shadow_last_event(head, event_base, depth, last);
    return last.yzw;
}
#endif

#ifdef SHADOW_HAS_MEDIA
layout(binding = UNIT_SHADOW_MEDIA) uniform usamplerBuffer u_shadow_media; // sigma behind events

// As above; the last stretch takes light, too, up to the receiver itself at `reach`.
// sigma: where the light stands.
vec3 shadow_deep_media(uint head, uint event_base, float depth, float reach, vec3 sigma)
{
    vec4 last;
    int at = shadow_last_event(head, event_base, depth, last);
    if (at >= 0)
        sigma = uintBitsToFloat(texelFetch(u_shadow_media, at).xyz);
    return last.yzw * exp(-max(sigma, vec3(0.0)) * max(reach - last.x, 0.0));
}
#endif

#ifdef SHADOW_HAS_IDS
layout(binding = UNIT_SHADOW_ID) uniform usamplerBuffer u_shadow_id;

// With each event its own transmittance alone; those of `object` are left out.
vec3 shadow_deep_without(uint head, uint event_base, float depth, uint object)
{
    uint at = event_base + texelFetch(u_shadow_heads, int(head)).r;
    uint end = event_base + texelFetch(u_shadow_heads, int(head) + 1).r;
    vec3 t = vec3(1.0);
    for (; at < end; at++) {
        vec4 event = texelFetch(u_shadow_events, int(at));
        if (event.x >= depth)
            break;
        if ((texelFetch(u_shadow_id, int(at)).r & 0x7fffffffu) != object)
            t *= event.yzw;
    }
    return t;
}
#endif

#if defined(SHADOW_HAS_IDS) && defined(SHADOW_HAS_MEDIA)
// Both: `object` neither filters nor contains. With each event its own sigma, negative where it
// leaves.
vec3 shadow_deep_media_without(uint head, uint event_base, float depth, float reach, vec3 sigma,
                               uint object)
{
    int at = int(event_base + texelFetch(u_shadow_heads, int(head)).r);
    int end = int(event_base + texelFetch(u_shadow_heads, int(head) + 1).r);
    dvec3 inside = dvec3(sigma), size = inside, tau = dvec3(0.0);
    vec3 t = vec3(1.0);
    float z = 0.0;
    for (; at < end; at++) {
        vec4 event = texelFetch(u_shadow_events, at);
        if (event.x >= depth)
            break;
        if ((texelFetch(u_shadow_id, at).r & 0x7fffffffu) == object)
            continue;
        dvec3 change = dvec3(uintBitsToFloat(texelFetch(u_shadow_media, at).xyz));
        t *= event.yzw;
        tau += max(inside, dvec3(0.0)) * double(event.x - z);
        z = event.x;
        inside += change;
        size += abs(change);
        inside *= dvec3(greaterThan(abs(inside), size * 1.5e-11)); // 2^-36
    }
    tau += max(inside, dvec3(0.0)) * double(max(reach - z, 0.0));
    return t * exp(-vec3(tau));
}
#endif

#ifdef SHADOW_HAS_NODES
#include "shadow_nodes.glsl"
#endif

#ifdef SHADOW_HAS_LINKED
#include "shadow_element.glsl"
layout(binding = UNIT_SHADOW_NODES) uniform usamplerBuffer u_shadow_nodes;

vec3 shadow_linked(uint head, uint node_base, float depth, uint object)
{
    vec3 t = vec3(1.0);
    uint next = texelFetch(u_shadow_heads, int(head)).r;
    while (next < ELEMENT_LOCKED) {
        uvec4 node = texelFetch(u_shadow_nodes, int(node_base + next));
        float before = depth - uintBitsToFloat(node.x);
        if (!(before > 0.0))
            break;
        if (!element_is_of(node, object))
            t *= element_transmittance(node, before);
        next = node.w;
    }
    return t;
}
#endif

// depth: what is nearer shadows; reach: of the receiver itself; sigma: extinction at the light
vec3 shadow_list(uint kind, uint flags, uint head, uint event_base, float depth, float reach,
                 vec3 sigma, uint object)
{
#ifdef SHADOW_HAS_LINKED
    if (kind == SHADOW_LINKED)
        return shadow_linked(head, event_base, depth, object);
#endif
#if defined(SHADOW_HAS_IDS) && defined(SHADOW_HAS_MEDIA)
    if (kind == SHADOW_DEEP && flags == (SHADOW_FLAG_RAW | SHADOW_FLAG_MEDIA))
        return shadow_deep_media_without(head, event_base, depth, reach, sigma, object);
#endif
#ifdef SHADOW_HAS_IDS
    if (kind == SHADOW_DEEP && (flags & SHADOW_FLAG_RAW) != 0u)
        return shadow_deep_without(head, event_base, depth, object);
#endif
#ifdef SHADOW_HAS_MEDIA
    if (kind == SHADOW_DEEP && (flags & SHADOW_FLAG_MEDIA) != 0u)
        return shadow_deep_media(head, event_base, depth, reach, sigma);
#endif
#ifdef SHADOW_HAS_NODES
    if (kind == SHADOW_DEEP && (flags & SHADOW_FLAG_NODES) != 0u)
        return shadow_nodes(head, event_base, depth, reach);
#endif
#ifdef SHADOW_HAS_DEEP
    if (kind == SHADOW_DEEP)
        return shadow_deep(head, event_base, depth);
#endif
    return vec3(1.0);
}
