/* SPDX-License-Identifier: MIT */
/* Boxes of one material each, of which tests of images build their scenes. Thread: one per builder.
 */
#ifndef VITRAIL_TESTS_SUPPORT_BOXES_H
#define VITRAIL_TESTS_SUPPORT_BOXES_H

#include "glb/glb_builder.h"

/* Adds a box as a mesh and a node, both called as the material is. A builder without memory says so
 * when it is finished. */
void builder_add_box(struct glb_builder *builder, const struct glb_material_desc *material,
                     const double low[3], const double high[3]);

#endif
