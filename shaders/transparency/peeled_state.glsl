// SPDX-License-Identifier: MIT
// How far each pixel is peeled: the key of its last layer, and that of the nearest one behind it.
// Keys order as those of lists_sort.comp.glsl: greater depths are nearer, then lesser ties, then
// lesser coverage, in the last bits of the tie here: where a triangle is clipped, its pieces share
// pixels and the rest of the key.
// Needs: PEELED_ACCESS, how the buffer is read and written; of fragments tie_key.glsl, HAS_COVERAGE
// and COVERAGE_BY_DEPTH as entry_scatter.glsl. Provides: is_behind_peeled, and peeled_tie.
layout(std430, binding = BIND_PEELED) PEELED_ACCESS buffer peeled_buffer { uint peeled[]; };
#define PEELED_WORDS 4u // of a pixel
#define LAST_DEPTH(pixel) peeled[PEELED_WORDS * (pixel)]
#define LAST_TIE(pixel) peeled[PEELED_WORDS * (pixel) + 1u]
#define NEAREST_DEPTH(pixel) peeled[PEELED_WORDS * (pixel) + 2u]
#define NEAREST_TIE(pixel) peeled[PEELED_WORDS * (pixel) + 3u]
#define NO_TIE 0xffffffffu // of a pixel without a layer behind the last

#ifdef PEELS_FRAGMENTS
#if defined HAS_COVERAGE && !defined COVERAGE_BY_DEPTH
layout(post_depth_coverage) in; // in all passes alike
#endif
uint peeled_tie(uint tie)
{
#ifdef HAS_COVERAGE
    return (tie & ~15u) | (uint(gl_SampleMaskIn[0]) & 15u);
#else
    return tie & ~15u;
#endif
}
#endif

bool is_behind_peeled(uint pixel, uint depth, uint tie)
{
    uint last = LAST_DEPTH(pixel);
    return depth < last || (depth == last && tie > LAST_TIE(pixel));
}
