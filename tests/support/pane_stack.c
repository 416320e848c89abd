/* SPDX-License-Identifier: MIT */
/* Building and rendering panes. */
#include "tests/support/pane_stack.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "glb/glb_builder.h"

static void add_quad(struct glb_builder *b, const struct glb_material_desc *material, double z)
{
    static const float positions[] = {-9, -9, 0, 9, -9, 0, 9, 9, 0, -9, 9, 0};
    static const float normals[] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    struct glb_primitive_desc quad = {.vertex_count = 4,
                                      .positions = positions,
                                      .normals = normals,
                                      .indices = indices,
                                      .index_count = 6};
    quad.material = glb_builder_add_material(b, material);
    int mesh = glb_builder_add_mesh(b, material->name, &quad, 1);
    glb_builder_add_node(
        b, &(struct glb_node_desc){.name = material->name, .mesh = mesh, .translation = {0, 0, z}});
}

static void add_pane(struct glb_builder *b, const struct pane *pane)
{
    const double *color = pane->color;
    struct glb_material_desc material = {
        .name = "pane",
        .is_double_sided = true,
        .roughness = 0.5,
        .base_color = {color[0], color[1], color[2], 1},
        .transmission = pane->transmission,
    };
    if (pane->is_clear) {
        material.transmission = material.roughness = material.ior = 1;
        material.has_ior = true;
    } else if (pane->transmission <= 0) {
        material.alpha_mode = GLB_BLEND;
        material.is_unlit = true;
        material.base_color[3] = pane->alpha;
    }
    add_quad(b, &material, pane->z);
}

static void build(const struct pane *panes, int count, void **glb, size_t *size)
{
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("panes", &err);
    add_quad(b, &(struct glb_material_desc){.name = "wall", .is_unlit = true}, -20);
    for (int i = 0; i < count; i++)
        add_pane(b, &panes[i]);
    assert_true(glb_builder_finish(b, glb, size, &err));
    glb_builder_destroy(b);
}

void pane_stack_render(struct renderer *renderer, const struct pane *panes, int count,
                       const struct pane_shot *shot, struct frame *frame)
{
    struct rig_scene scene;
    struct error err = {0};
    void *glb;
    size_t size;
    const struct view view = {
        .width_px = shot->side_px,
        .height_px = shot->side_px,
        .tile = shot->tile,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {0, 0, PANE_STACK_EYE_Z},
                   .fov_y_deg = shot->is_perspective ? 0.5 : 0,
                   .ortho_height = shot->is_perspective ? 0 : 1.5},
        .ignore_scene_lights = true,
        .studio = VIEW_STUDIO_OFF,
        .outputs = 1u << VIEW_OUTPUT_COLOR,
        .atmosphere = {.density_per_m = shot->haze, .color = {1, 1, 1}},
        .quality = {.transparency = shot->transparency,
                    .shadows = shot->shadows,
                    .samples = shot->samples,
                    .faithful = shot->faithful},
    };
    build(panes, count, &glb, &size);
    assert_true(rig_scene_from_glb(&scene, renderer, "panes", glb, size, &err));
    if (!renderer_render(renderer, scene.key, &view, frame, &err))
        fail_msg("%s", err.message);
    rig_scene_finish(&scene, renderer);
    free(glb);
}

double pane_filter(const struct pane *pane, int channel)
{
    return pane->is_clear ? pane->color[channel] : 1 - pane->alpha;
}

double pane_light(const struct pane *pane, int channel)
{
    return pane->is_clear ? 0 : pane->alpha * pane->color[channel];
}

double pane_stack_exact(const struct pane *panes, int count, int channel)
{
    double light = 0, through = 1;
    for (int i = 0; i < count; i++) {
        light += through * pane_light(&panes[i], channel);
        through *= pane_filter(&panes[i], channel);
    }
    return light + through;
}
