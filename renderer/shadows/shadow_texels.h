/* SPDX-License-Identifier: MIT */
/* Structures that keep four floats of each texel instead of a list, in the pool of texels: the
 * transparent casters before the opaque depth are blended into a target and packed from there, in
 * the way that the first of their passes names. What the floats are is said by
 * shadow_texel.frag.glsl and by the lookups of the technique. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_TEXELS_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_TEXELS_H

#include "renderer/shadows/technique.h"

/* Of struct shadow_pass. Thread: any. */
void shadow_texels_list_programs(const struct shadow_pass *pass,
                                 const struct shadow_listing *listing, struct program_list *list);
/* Of a point in the world, as lists have it [m]. Thread: any. */
double shadow_texels_depth(const struct shadow_frame *frame, const double point[3]);
/* Of struct shadow_structure. Thread: GL; of the first two, any. */
/* Of those that have a form as published. */
void shadow_texels_describe(struct shadow_map *map, const struct shadow_casters *casters,
                            const struct view_quality *quality, double allowed_error);
bool shadow_texels_is_exact(const struct view_quality *quality); /* of none */
MUST_CHECK bool shadow_texels_build(struct shadow_builder *builder,
                                    const struct shadow_building *building, struct error *err);
void shadow_texels_record(const struct shadow_map *map, struct shadow_record *record);
void shadow_texels_bind(const struct shadow_store *store);
MUST_CHECK bool shadow_texels_drop(struct shadow_store *store, struct shadow_map *map,
                                   struct error *err);

/* The same of those that have a table, too: words in the pool of heads, from event_base of the
 * record on, which are written before the texels are built. */
MUST_CHECK bool shadow_texels_write_table(struct shadow_store *store, struct shadow_map *map,
                                          const uint32_t *table, uint64_t words, struct error *err);
void shadow_texels_record_table(const struct shadow_map *map, struct shadow_record *record);
void shadow_texels_bind_table(const struct shadow_store *store);
MUST_CHECK bool shadow_texels_drop_table(struct shadow_store *store, struct shadow_map *map,
                                         struct error *err);

/* The members that all of these structures have in common; that those have which are a depth and a
 * texel of 20 bytes; and that those have which keep a table of their own. */
#define SHADOW_TEXELS_COMMON                                        \
    .scope = SHADOW_PER_LIGHT, .filters = true, .has_texels = true, \
    .is_exact = shadow_texels_is_exact
#define SHADOW_TEXELS_STRUCTURE                                                                 \
    SHADOW_TEXELS_COMMON, .forecast = forecast_add_maps, .forecast_error = forecast_maps_error, \
                          .texel_bytes = 20, .build = shadow_texels_build,                      \
                          .record = shadow_texels_record, .bind = shadow_texels_bind,           \
                          .drop = shadow_texels_drop
#define SHADOW_TABLE_STRUCTURE                                                                    \
    SHADOW_TEXELS_COMMON, .record = shadow_texels_record_table, .bind = shadow_texels_bind_table, \
                          .drop = shadow_texels_drop_table

#endif
