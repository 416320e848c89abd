/* SPDX-License-Identifier: MIT */
/* Puts the demo scene together: shared materials, then each part in a fixed order. */
#include "glb/demo_scene.h"

#include "glb/demo_internal.h"

double demo_bay_z(int bay)
{
    return -NAVE_HALF_LENGTH + BAY / 2 + BAY * bay;
}

int demo_add(struct demo *demo, const struct demo_place *place)
{
    struct glb_node_desc node = {.name = place->name,
                                 .parent = place->parent,
                                 .mesh = place->mesh,
                                 .translation = {place->at[0], place->at[1], place->at[2]}};
    if (place->yaw_deg != 0)
        glb_node_rotate(&node, (double[]){0, 1, 0}, place->yaw_deg);
    return glb_builder_add_node(demo->builder, &node);
}

int demo_sides(const struct demo *demo, int sides)
{
    int few = sides / demo->coarseness;
    return few < 3 ? 3 : few;
}

int demo_add_group(struct demo *demo, const char *name)
{
    return demo_add(demo, &(struct demo_place){.name = name});
}

static int add_plain(struct demo *demo, const char *name, const double color[3], double roughness,
                     double metallic)
{
    return glb_builder_add_material(
        demo->builder, &(struct glb_material_desc){.name = name,
                                                   .base_color = {color[0], color[1], color[2], 1},
                                                   .roughness = roughness,
                                                   .metallic = metallic});
}

/* Stone with a picture that repeats every tile_m metres. */
static int add_stone(struct demo *demo, const char *name, int texture, double tile_m,
                     double roughness)
{
    return glb_builder_add_material(
        demo->builder,
        &(struct glb_material_desc){.name = name,
                                    .roughness = roughness,
                                    .base_color_texture = {.texture = texture,
                                                           .has_transform = true,
                                                           .scale = {1 / tile_m, 1 / tile_m}}});
}

static void add_materials(struct demo *demo)
{
    demo->stone = add_stone(demo, "Stone", demo_add_stone_texture(demo), 2, 0.9);
    demo->floor = add_stone(demo, "Floor tiles", demo_add_floor_texture(demo), 3, 0.42);
    demo->trim = add_plain(demo, "Dressed stone", (double[]){0.60, 0.56, 0.48}, 0.8, 0);
    demo->dark_wood = add_plain(demo, "Oak", (double[]){0.20, 0.105, 0.05}, 0.5, 0);
    demo->iron = add_plain(demo, "Iron", (double[]){0.06, 0.055, 0.05}, 0.5, 0.3);
    demo->gold = add_plain(demo, "Brass", (double[]){0.83, 0.58, 0.22}, 0.35, 1);
    demo->wax = add_plain(demo, "Wax", (double[]){0.85, 0.80, 0.66}, 0.6, 0);
    demo->flame = glb_builder_add_material(
        demo->builder, &(struct glb_material_desc){.name = "Flame",
                                                   .base_color = {0, 0, 0, 1},
                                                   .roughness = 1,
                                                   .emissive = {1, 0.62, 0.20},
                                                   .emissive_strength = 9 * demo->light_factor});
}

static bool check(const struct demo_scene_desc *desc, struct error *err)
{
    int side = desc->texture_size_px;
    if (side != 0 && (side < 64 || side > 4096))
        return error_set(err, ERROR_INVALID_REQUEST, "texture_size_px is %d, must be in [64, 4096]",
                         side);
    if (!(desc->light_factor >= 0 && desc->light_factor <= 1e6))
        return error_set(err, ERROR_INVALID_REQUEST, "light_factor is %g, must be in [0, 1e6]",
                         desc->light_factor);
    if (desc->coarseness < 0 || desc->coarseness > 4)
        return error_set(err, ERROR_INVALID_REQUEST, "coarseness is %d, must be in [1, 4]",
                         desc->coarseness);
    return true;
}

bool demo_scene_build(const struct demo_scene_desc *desc, void **glb, size_t *size_bytes,
                      struct error *err)
{
    *glb = NULL;
    *size_bytes = 0;
    if (!check(desc, err))
        return false;
    struct demo demo = {
        .builder = glb_builder_create("Chapel", err),
        .texture_size_px = desc->texture_size_px ? desc->texture_size_px : 1024,
        .light_factor = desc->light_factor > 0 ? desc->light_factor : 1,
        .coarseness = desc->coarseness ? desc->coarseness : 1,
    };
    if (!demo.builder)
        return false;
    add_materials(&demo);
    demo_add_cameras(&demo);
    demo_add_walls(&demo);
    demo_add_windows(&demo);
    demo_add_props(&demo);
    demo_add_candles(&demo);
    demo_add_vessel(&demo);
    if (!desc->has_no_curtains)
        demo_add_curtains(&demo);
    demo_add_lights(&demo);
    bool is_built = glb_builder_finish(demo.builder, glb, size_bytes, err);
    glb_builder_destroy(demo.builder);
    return is_built;
}
