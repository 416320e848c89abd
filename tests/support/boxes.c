/* SPDX-License-Identifier: MIT */
/* A box is a shape, a mesh, a material and a node. */
#include "tests/support/boxes.h"
/* A shape, a mesh, a material and a node. */

#include "glb/shapes.h"

void builder_add_box(struct glb_builder *builder, const struct glb_material_desc *material,
                     const double low[3], const double high[3])
{
    struct shape shape = {0};
    shape_add_box(&shape, low, high);
    int mesh = shape_give_mesh(&shape, builder, material->name,
                               glb_builder_add_material(builder, material));
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = material->name, .mesh = mesh});
}
