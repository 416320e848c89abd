/* SPDX-License-Identifier: MIT */
/* Describes the structure of a light before it is built, and lists the programs that build it and
 * look it up. CPU only. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_PROGRAMS_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_PROGRAMS_H

#include "renderer/shadows/shadow_map.h"
#include "renderer/shadows/shadow_needs.h"

/* Of a light that has a structure: frame, kind, clip planes, flags and how it is compressed;
 * resolution stays. allowed_error: of lists that take the place of exact ones, 0 for none. */
void shadow_map_describe(struct shadow_map *map, const struct shadow_need *need,
                         const struct scene_state *state, const struct view_quality *quality,
                         double allowed_error);

/* #define items of programs that look up shadows: only what the structures of a frame need, so that
 * an absent shape or kind leaves no code. Zeroed: none. */
/* In the order of the items. */
enum shadow_feature {
    SHADOW_FEATURE_MAPS,
    SHADOW_FEATURE_ORTHOGRAPHIC,
    SHADOW_FEATURE_PERSPECTIVE,
    SHADOW_FEATURE_CUBES,
    SHADOW_FEATURE_IDS,
    SHADOW_FEATURE_FAITHFUL,
    SHADOW_FEATURE_MEDIA,
    SHADOW_FEATURE_NODES,
    /* The second of these two follows from the first once lists are built: it may
     * be either before.
     */
    SHADOW_FEATURE_SEARCHED,
    SHADOW_FEATURE_LONG,
    SHADOW_FEATURE_PARTITIONS,
    SHADOW_FEATURES
};
enum { SHADOW_DEFINES_BYTES = 256 };
struct shadow_features {
    bool has[SHADOW_FEATURES];
    bool looks_up[SHADOWS_COUNT]; /* lists of these techniques: the item SHADOW_LISTS */
};
void shadow_features_add(struct shadow_features *features, const struct shadow_map *map);
void shadow_features_join(struct shadow_features *features, const struct shadow_features *more);
void shadow_features_write(const struct shadow_features *features, char text[SHADOW_DEFINES_BYTES]);

struct shadow_programs_desc { /* all required but ways */
    const struct shadow_needs *needs;
    const struct scene_gpu *gpu;
    const struct scene_state *state;
    const struct view_quality *quality;
    int resolution;
    struct shadow_ways ways;
};
/* The programs that build all structures of the needs. Returns the features of those that look them
 * up. Exact lists that turn out to exceed their budget, and are compressed instead, take others.
 * Thread: GL. */
struct shadow_features shadow_list_programs(const struct shadow_programs_desc *desc,
                                            struct program_list *list);

/* What the structures of frames may need, whichever of the lights they see: the features of the
 * lights that every frame sees, and those that only some add. */
enum { SHADOW_FEATURE_SETS_MAX = 4 };
struct shadow_feature_sets {
    struct shadow_features always, optional[SHADOW_FEATURE_SETS_MAX]; /* different ones */
    size_t optional_count;
    bool has_more; /* than there is room for: `always` has them */
};
struct shadow_feature_sets shadow_list_features(const struct shadow_programs_desc *desc);
/* Those of batches of these lights, any of which may be without any other: all are optional. */
struct shadow_feature_sets shadow_list_batch_features(const struct shadow_programs_desc *desc);

#endif
