// SPDX-License-Identifier: MIT
// How far each pixel is peeled: the key of its last layer, and that of the nearest one behind it.
// DUAL: from behind, too: the key of the last layer of those, and that of the farthest before it.
// Keys order as those of lists_sort.comp.glsl: greater depths are nearer, then lesser ties, then
// lesser coverage, in the last bits of the tie here: where a triangle is clipped, its pieces share
// pixels and the rest of the key.
// Needs: PEELED_ACCESS, how the buffer is read and written; of fragments tie_key.glsl, HAS_COVERAGE
// and COVERAGE_BY_DEPTH as entry_scatter.glsl. Provides: is_left, and peeled_tie; ENTRIES, of a
// pixel, and PEELED_ENTRY, the first of them, of the nearest layer.
layout(std430, binding = BIND_PEELED) PEELED_ACCESS buffer peeled_buffer { uint peeled[]; };
#ifdef DUAL
#define PEELED_WORDS 8u // of a pixel
#define ENTRIES 2u
#else
#define PEELED_WORDS 4u
#define ENTRIES 1u
#endif
#define PEELED_ENTRY(pixel) (ENTRIES * (pixel))
#define LAST_DEPTH(pixel) peeled[PEELED_WORDS * (pixel)]
#define LAST_TIE(pixel) peeled[PEELED_WORDS * (pixel) + 1u]
#define NEAREST_DEPTH(pixel) peeled[PEELED_WORDS * (pixel) + 2u]
#define NEAREST_TIE(pixel) peeled[PEELED_WORDS * (pixel) + 3u]
#ifdef DUAL
#define BACK_DEPTH(pixel) peeled[PEELED_WORDS * (pixel) + 4u]
#define BACK_TIE(pixel) peeled[PEELED_WORDS * (pixel) + 5u]
#define FARTHEST_DEPTH(pixel) peeled[PEELED_WORDS * (pixel) + 6u]
#define FARTHEST_TIE(pixel) peeled[PEELED_WORDS * (pixel) + 7u]
#endif
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

// Whether the layer is not yet peeled.
bool is_left(uint pixel, uint depth, uint tie)
{
    uint last = LAST_DEPTH(pixel);
    bool is_behind = depth < last || (depth == last && tie > LAST_TIE(pixel));
#ifdef DUAL
    uint back = BACK_DEPTH(pixel);
    return is_behind && (depth > back || (depth == back && tie < BACK_TIE(pixel)));
#else
    return is_behind;
#endif
}
