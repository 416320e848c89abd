/* SPDX-License-Identifier: MIT */
/* Thousands of thin translucent leaves and strands over a floor: casters that no shadow map
 * resolves. As GLB bytes, the same for the same numbers. Asserts on memory. Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_FOLIAGE_SCENE_H
#define VITRAIL_TESTS_SUPPORT_FOLIAGE_SCENE_H

#include "renderer/view.h"
#include "tests/support/closed_form_scenes.h"

struct foliage_scene_desc {
    int leaves;  /* 2 to 4 cm long, glass of light green, any direction; 0 means none */
    int strands; /* 30 cm long, 2 to 4 mm wide, of five pieces that hang down and sideways */
};

/* World: the floor is y = 0, 6 m wide; all that casts lies within |x|, |z| <= 0.8 and 1 <= y
 * <= 1.6. There is no light of its own. */
void foliage_scene_build(const struct foliage_scene_desc *desc, struct closed_form_scene *scene);

/* A camera below the leaves that sees the floor alone, 0.9 m of it upward. */
struct view_camera foliage_camera(void);
/* A spot 4 m above the middle of the leaves; its cone holds all of them. */
struct view_light foliage_spot(void);

#endif
