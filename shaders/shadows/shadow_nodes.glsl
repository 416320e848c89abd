// SPDX-License-Identifier: MIT
// Visibility from a list of nodes, as shadow_compress.glsl makes them. Needs shadow_run and
// u_shadow_events.
// Drops count before `depth`, a receiver's with tolerance; lines, which stand for media, are
// followed to the receiver itself at `reach`, over one node where two of them join.
vec3 shadow_nodes(shadow_run run, float depth, float reach)
{
    int next = run.begin, end = run.end; // the first node that is not before the depth
    for (int n = end - next; n > 0;) {
        int half_n = n >> 1;
        bool is_before = texelFetch(u_shadow_events, next + half_n).x < depth;
        next += is_before ? half_n + 1 : 0;
        n = is_before ? n - half_n - 1 : half_n;
    }
    if (next == run.begin)
        return vec3(1.0);
    vec4 from = texelFetch(u_shadow_events, next - 1);
    vec4 to = texelFetch(u_shadow_events, min(next, end - 1));
    bool is_line = (floatBitsToUint(from.y) & 0x80000000u) != 0u;
    bool goes_on = is_line && to.x < reach && (floatBitsToUint(to.y) & 0x80000000u) != 0u;
    vec4 after = texelFetch(u_shadow_events, min(next + 1, end - 1));
    from = goes_on ? to : from;
    to = goes_on ? after : to;
    float along = is_line ? min((reach - from.x) / (to.x - from.x), 1.0) : 0.0;
    return mix(abs(from.yzw), abs(to.yzw), along);
}
