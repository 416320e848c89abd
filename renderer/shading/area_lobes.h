/* SPDX-License-Identifier: MIT */
/* Lobes of the BRDF as linearly transformed cosines: data that `build/bin/unit_area_lobes --write
 * renderer/shading/area_lobes.c` made. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADING_AREA_LOBES_H
#define VITRAIL_RENDERER_SHADING_AREA_LOBES_H

#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

enum { AREA_LOBES_BYTES = AREA_LOBE_SIDE * AREA_LOBE_SIDE * sizeof(struct area_lobe_record) };

/* Rows by roughness, columns by view: 8 floats each, as struct area_lobe_record has them. */
extern const float area_lobes[AREA_LOBE_SIDE * AREA_LOBE_SIDE * 8];

#endif
