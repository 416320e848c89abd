/* SPDX-License-Identifier: MIT */
/* Decides which shadow structure each light of a frame needs, and what is drawn into it. The plan
 * and the builders use the one decision. CPU only. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_NEEDS_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_NEEDS_H

#include "renderer/shadows/shadow_map.h"

struct shadow_method;

struct shadow_need {    /* of one light */
    bool is_unseen;     /* it brightens nothing in view; all else is empty */
    bool has_structure; /* else it shines without one */
    bool is_traced;     /* its shadow is found by rays; has_structure is false then */
    const struct shadow_method *method; /* of its shadow; NULL without one */
    struct shadow_frame frame;          /* how it looks at the scene */
    struct shadow_casters casters;
};

/* Deep lists that a quality may approximate: none of their casters needs single events. */
bool shadow_need_may_compress(const struct shadow_need *need);

/* Zeroed = empty. Indices are those of the state that it was made from. */
struct shadow_needs {
    struct shadow_need *lights; /* per light of the state */
    size_t light_count;
};

struct shadow_needs_desc {
    const struct scene_state *state;    /* required */
    const struct view_quality *quality; /* required */
    const bool *is_in_view;             /* per light: false is unseen; NULL: all may be seen */
    int resolution;                     /* required; texels per side of a map face */
};

/* Zeroed or finished before. ERROR_NO_MEMORY. */
MUST_CHECK bool shadow_needs_init(struct shadow_needs *needs, const struct shadow_needs_desc *desc,
                                  struct error *err);
/* The least memory of a light's structure, known before it is built: depths and heads of lists. 0
 * without a structure. */
uint64_t shadow_need_least_bytes(const struct shadow_need *need, int resolution);
/* Batches of neighbouring lights into which the structures must be divided at least to stay within
 * budget_bytes; 0 without any. */
size_t shadow_needs_least_batches(const struct shadow_needs *needs, int resolution,
                                  uint64_t budget_bytes);
void shadow_needs_finish(struct shadow_needs *needs);
uint64_t shadow_needs_size_bytes(const struct shadow_needs *needs);

#endif
