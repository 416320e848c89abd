// SPDX-License-Identifier: MIT
// Which samples of a pixel show one surface: those of one signature and nearly one depth. Every
// program that includes it finds the same groups in the same order.
// Needs: SAMPLES (nothing where it is 1), u_depth_map, u_signature, u_sample_positions.
// Provides: group_next, group_place. Samples apart are groups of their own. A group's middle is the
// pixel's middle when it has all samples; any single sample would shift shadows and textures by up
// to half a pixel. Depth is linear over a plane on the screen, so its mean lies on the surface.
#if SAMPLES > 1
struct sample_group {
    int first;    // a sample of it
    uint members; // bit set
    float depth;  // stored depth of `first`; 0 where nothing is
    vec3 middle;  // position in the pixel, stored depth
};

// Of the samples in `remaining`, which must not be empty; apart: bit set, likewise.
sample_group group_next(ivec2 pixel, uint remaining, uint apart)
{
    sample_group g;
    g.first = findLSB(remaining);
    g.members = 0u;
    g.depth = texelFetch(u_depth_map, pixel, g.first).x;
    uint signature = texelFetch(u_signature, pixel, g.first).x;
    uint others = (apart & 1u << g.first) != 0u ? 0u : remaining & ~apart;
    vec3 sum = vec3(0.0); // of positions in the pixel, and of depths
    for (int j = 0; j < SAMPLES; j++) {
        float other = texelFetch(u_depth_map, pixel, j).x;
        precise float most = 0.02 * max(other, g.depth);
        bool is_same =
            texelFetch(u_signature, pixel, j).x == signature && abs(other - g.depth) <= most;
        if (j == g.first || ((others & 1u << j) != 0u && is_same)) {
            g.members |= 1u << j;
            sum += vec3(u_sample_positions[j], other);
        }
    }
    g.middle = sum / float(bitCount(g.members));
    return g;
}

// The place of its middle in the pixel again.
vec2 group_place(uint members)
{
    vec2 sum = vec2(0.0);
    for (int j = 0; j < SAMPLES; j++)
        sum += (members & 1u << j) != 0u ? u_sample_positions[j] : vec2(0.0);
    return sum / float(bitCount(members));
}
#endif
