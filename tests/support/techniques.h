/* SPDX-License-Identifier: MIT */
/* The shadow techniques that tests go through, by their rows: one that is added is tested, too. */
#ifndef VITRAIL_TESTS_SUPPORT_TECHNIQUES_H
#define VITRAIL_TESTS_SUPPORT_TECHNIQUES_H

#include <stddef.h>

#include "protocol/shadow_technique.h"

/* Those of rasterised pictures that can all of this, `none` among them; returns how many. */
static inline size_t raster_techniques(unsigned can, enum shadow_technique found[SHADOWS_COUNT])
{
    size_t count = 0;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        enum shadow_technique technique = (enum shadow_technique)i;
        if (technique != SHADOWS_AUTO && shadow_technique_family(technique) != SHADOW_FAMILY_RAYS &&
            shadow_technique_can(technique, can))
            found[count++] = technique;
    }
    return count;
}

#endif
