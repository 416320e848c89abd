/* SPDX-License-Identifier: MIT */
/* The transparency methods by their rows. */
#include <assert.h>

#include "renderer/transparency/method.h"

const struct transparency_method *transparency_method_of(enum transparency transparency)
{
    static const struct transparency_method *const methods[TRANSPARENCIES_COUNT] = {
        [TRANSPARENCY_AUTO] = &transparency_method_lists,
        [TRANSPARENCY_LISTS] = &transparency_method_lists,
        [TRANSPARENCY_WEIGHTED_BLENDED] = &transparency_method_weighted_blended,
        [TRANSPARENCY_DEPTH_PEELING] = &transparency_method_depth_peeling,
        [TRANSPARENCY_DUAL_DEPTH_PEELING] = &transparency_method_dual_depth_peeling,
        [TRANSPARENCY_STOCHASTIC] = &transparency_method_stochastic,
        [TRANSPARENCY_MOMENT_BASED] = &transparency_method_moment_based,
        [TRANSPARENCY_SORTED] = &transparency_method_sorted,
    };
    assert((int)transparency >= 0 && transparency < TRANSPARENCIES_COUNT);
    return methods[transparency];
}

unsigned transparency_method_lacks(const struct transparency_method *method, unsigned asked)
{
    return asked & ~transparency_rows[method->id].can;
}
