/* SPDX-License-Identifier: MIT */
/* What faces of maps have in a target, into the pools that queries read. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_PACK_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_PACK_H

#include "renderer/shadows/shadow_map.h"

struct shadow_pack_desc { /* all required */
    const struct gl_texture *from;
    uint32_t format; /* GL_DEPTH_COMPONENT or GL_RGBA, whose texels are floats */
    uint32_t texel_bytes;
    enum shadow_pool_kind pool;
    /* Where in the pool the map's texels go. */
    const struct shadow_range *(*range)(const struct shadow_map *map);
    struct shadow_build *const *builds; /* of one resolution */
    size_t build_count;
};

/* A query finds it there in a third of the time that it takes in a texture (llvmpipe). */
MUST_CHECK bool shadow_pack(struct shadow_store *store, const struct shadow_pack_desc *desc,
                            struct error *err);

#endif
