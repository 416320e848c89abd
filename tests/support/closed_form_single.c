/* SPDX-License-Identifier: MIT */
/* Closed-form scenes of one pane: the texture projector and the angle-dependent pane. */
#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "glb/shapes.h"
#include "tests/support/closed_form_internal.h"

static const double pi = 3.14159265358979323846;

enum { CELL_PX = 8 };

static int cell_count(const struct projector_scene_desc *desc)
{
    return desc->cells > 0 ? desc->cells : 4;
}

static const uint8_t *cell_color(const struct projector_scene_desc *desc, int column, int row)
{
    static const uint8_t standard[2][3] = {{255, 64, 16}, {16, 128, 255}};
    static const uint8_t unset[2][3] = {0};
    bool is_unset = memcmp(desc->srgb, unset, sizeof unset) == 0;
    int parity = (column + (desc->is_bars ? 0 : row)) % 2;
    return is_unset ? standard[parity] : desc->srgb[parity];
}

static int add_picture(struct glb_builder *builder, const struct projector_scene_desc *desc)
{
    int side = cell_count(desc) * CELL_PX;
    uint8_t *rgba = malloc((size_t)side * (size_t)side * 4);
    assert(rgba);
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++) {
            uint8_t *texel = rgba + 4 * ((size_t)y * (size_t)side + (size_t)x);
            memcpy(texel, cell_color(desc, x / CELL_PX, y / CELL_PX), 3);
            texel[3] = 255;
        }
    int image = glb_builder_add_image(builder, "Picture", rgba, side, side);
    free(rgba);
    return glb_builder_add_texture(builder, &(struct glb_texture_desc){.name = "Picture",
                                                                       .image = image,
                                                                       .filter = GLB_FILTER_NEAREST,
                                                                       .wrap_s = GLB_WRAP_CLAMP,
                                                                       .wrap_t = GLB_WRAP_CLAMP});
}

void projector_scene_build(const struct projector_scene_desc *desc, struct closed_form_scene *scene)
{
    struct glb_builder *builder = closed_form_begin(scene, "Projector", 0);
    closed_form_camera_onto(builder, "Wall", (double[]){0, 0, 0.9}, (double[]){0, 0, 0}, 1.2);
    closed_form_quad(builder, "Wall", closed_form_receiver(scene, builder), (double[]){-3, -3, 0},
                     (double[]){6, 0, 0}, (double[]){0, 6, 0});
    int glass = glb_builder_add_material(
        builder,
        &(struct glb_material_desc){.name = "Picture",
                                    .base_color_texture.texture = add_picture(builder, desc),
                                    .transmission = 1,
                                    .has_ior = true,
                                    .ior = 1,
                                    .is_double_sided = true});
    closed_form_quad(builder, "Pane", glass, (double[]){-0.5, -0.5, 1}, (double[]){1, 0, 0},
                     (double[]){0, 1, 0});
    scene->light = (struct closed_form_light){
        .type = GLB_LIGHT_SPOT, .position = {0, 0, 2}, .direction = {0, 0, -1}, .intensity = 10};
    closed_form_add_light(scene, builder);
    closed_form_end(scene, builder);
}

/* IEC 61966-2-1. */
static double linear_of(uint8_t srgb)
{
    double x = srgb / 255.0;
    return x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4);
}

double projector_scene_transmittance(const struct projector_scene_desc *desc, double x, double y,
                                     double transmittance[3])
{
    int cells = cell_count(desc);
    double u = x / 2 + 0.5, v = 0.5 - y / 2; /* of the pane's picture */
    for (int i = 0; i < 3; i++)
        transmittance[i] = 1;
    double beyond = fmax(fmax(-u, u - 1), fmax(-v, v - 1));
    if (beyond > 0)
        return 2 * beyond; /* past the pane; lengths double on the wall */
    const uint8_t *srgb =
        cell_color(desc, (int)fmin(cells - 1, u * cells), (int)fmin(cells - 1, v * cells));
    for (int i = 0; i < 3; i++)
        transmittance[i] = linear_of(srgb[i]);
    double s = u * cells, t = v * cells, edge = fabs(s - floor(s + 0.5));
    if (!desc->is_bars)
        edge = fmin(edge, fabs(t - floor(t + 0.5)));
    return fmin(2 * edge / cells, -2 * beyond);
}

void tilted_scene_build(const struct tilted_scene_desc *desc, struct closed_form_scene *scene)
{
    double angle = desc->tilt_deg * pi / 180, c = cos(angle), s = sin(angle);
    struct glb_builder *builder = closed_form_begin(scene, "Tilted pane", 0);
    closed_form_camera(builder, "Floor", (double[]){0, 0.45, 0.3}, (double[]){0, 0, 0}, 45);
    closed_form_floor(scene, builder, 4);
    struct glb_material_desc glass = {
        .name = "Pane",
        .base_color = {desc->color[0], desc->color[1], desc->color[2], 1},
        .transmission = 1,
        .has_ior = true,
        .ior = 1,
        .is_double_sided = true,
        .pass_through = desc->pass_through,
        .edge_exponent = desc->edge_exponent};
    memcpy(glass.edge_color, desc->edge_color, sizeof glass.edge_color);
    if (!desc->has_no_pane)
        closed_form_quad(builder, "Pane", glb_builder_add_material(builder, &glass),
                         (double[]){-1, 1.5 - s, c}, (double[]){2, 0, 0},
                         (double[]){0, 2 * s, -2 * c});
    scene->light = (struct closed_form_light){.type = GLB_LIGHT_DIRECTIONAL,
                                              .position = {0, 5, 0},
                                              .direction = {0, -1, 0},
                                              .intensity = 4};
    closed_form_add_light(scene, builder);
    closed_form_end(scene, builder);
}

void tilted_scene_transmittance(const struct tilted_scene_desc *desc, double transmittance[3])
{
    double c = cos(desc->tilt_deg * pi / 180);
    for (int i = 0; i < 3; i++) {
        double t = desc->color[i], weight = pow(c, desc->edge_exponent);
        if (desc->has_no_pane)
            transmittance[i] = 1;
        else if (desc->pass_through == GLB_PASS_SLAB)
            transmittance[i] = pow(t, 1 / c);
        else if (desc->pass_through == GLB_PASS_EDGE)
            transmittance[i] = desc->edge_color[i] * t * (1 - weight) + t * weight;
        else
            transmittance[i] = t;
    }
}
