/* SPDX-License-Identifier: MIT */
/* The list of closed-form scenes, and their answers. */
#include "tests/support/closed_form_catalog.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/support/closed_form_internal.h"

static const double pi = 3.14159265358979323846;

void closed_form_random_bodies(uint64_t *seed, bool has_filters, struct closed_form_body *bodies)
{
    for (int i = 0; i < RANDOM_BODIES; i++) {
        struct closed_form_body *b = &bodies[i];
        *b = (struct closed_form_body){.distance = 0.5f,
                                       .shape = i % 3 == 2 ? BODY_WEDGE : BODY_BOX,
                                       .is_mirrored = i % 3 == 1,
                                       .is_double_sided = i % 4 == 1};
        for (int k = 0; k < 3; k++) {
            b->low[k] = (double)(float)closed_form_random(seed, -1, 0.4);
            b->high[k] = b->low[k] + 0.25 + (int)closed_form_random(seed, 0, 4) / 4.0;
            b->remains[k] = (float)closed_form_random(seed, 0.5, 1);
            if (has_filters && i % 2) /* as 16 bits hold them, which is what lists of layers keep */
                b->filter[k] = roundf((float)closed_form_random(seed, 45000, 65535)) / 65535;
        }
    }
    bodies[5] = bodies[0];
    bodies[6].low[0] = bodies[0].high[0];
    bodies[6].high[0] = bodies[0].high[0] + 0.5;
    for (int k = 0; k < 3; k++) {
        bodies[4].low[k] = bodies[0].low[k] + 0.0625;
        bodies[4].high[k] = bodies[0].high[k] - 0.0625;
    }
}

static void look_at(struct closed_form_case *c, const double eye[3], const double target[3],
                    double fov_y_deg)
{
    c->view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT, .fov_y_deg = fov_y_deg};
    memcpy(c->view.camera.eye, eye, sizeof c->view.camera.eye);
    memcpy(c->view.camera.target, target, sizeof c->view.camera.target);
    if (eye[0] == target[0] && eye[2] == target[2])
        c->view.camera.up[2] = -1;
}

/* The receiver y = 0 from below every caster. */
static void look_at_floor(struct closed_form_case *c)
{
    c->normal[1] = 1;
    look_at(c, (double[]){0, 0.45, 0.3}, (double[]){0, 0, 0}, 60);
}

static struct closed_form_light sun(double angle_deg)
{
    double a = angle_deg * pi / 180;
    return (struct closed_form_light){.type = GLB_LIGHT_DIRECTIONAL,
                                      .position = {-sin(a), cos(a), 0},
                                      .direction = {sin(a), -cos(a), 0},
                                      .intensity = 4};
}

static struct closed_form_light lamp(enum glb_light_type type)
{
    return (struct closed_form_light){
        .type = type, .position = {0.1, 4, 0.2}, .direction = {0, -1, 0}, .intensity = 100};
}

static void build_media(struct closed_form_case *c, struct closed_form_light light)
{
    media_scene_build(
        &(struct media_scene_desc){
            .bodies = c->bodies, .count = c->body_count, .has_floor = true, .light = light},
        &c->scene);
    look_at_floor(c);
}

/* -- A1 -- */

static void init_panes(struct closed_form_case *c, int count)
{
    static const double colors[64][4] = {
        {0.9, 0.5, 0.3, 1}, {0.4, 0.8, 0.9, 1}, {0.95, 0.9, 0.6, 1}, {1, 0.97, 0.99, 1}};
    double panes[64][4];
    enum glb_light_type lights[] = {GLB_LIGHT_POINT, GLB_LIGHT_SPOT, GLB_LIGHT_DIRECTIONAL};
    for (int i = 0; i < count; i++)
        memcpy(panes[i], colors[count > 4 ? 3 : i % 4], sizeof panes[i]);
    snprintf(c->name, sizeof c->name, "A1 %d filters", count);
    c->is_even = true;
    panes_scene_build(&(struct panes_scene_desc){.pane_count = count,
                                                 .colors = panes,
                                                 .spacing = count > 4 ? 0.02 : 0.1,
                                                 .light = lights[count % 3]},
                      &c->scene);
    look_at_floor(c);
}

/* -- A2 -- */

static void init_slab(struct closed_form_case *c, int angle_mdeg)
{
    double angle_deg = angle_mdeg / 1000.0, t = tan(angle_deg * pi / 180), reach = 0.5 * t;
    struct closed_form_body *slab = &c->bodies[c->body_count++];
    *slab = (struct closed_form_body){.low = {floor(-reach) - 8, 0.5, -4},
                                      .high = {8, 0.5 + (angle_deg > 85 ? 0x1p-11 : 0x1p-3), 4},
                                      .remains = {0.5f, 0.25f, 0.75f},
                                      .distance = 0.25f};
    snprintf(c->name, sizeof c->name, "A2 slab at %g degrees", angle_deg);
    build_media(c, sun(angle_deg));
    look_at(c, (double[]){0, 0.4, 0.3}, (double[]){0, 0, 0}, 60);
}

/* -- A3, A4, A11 -- */

static void init_wedge(struct closed_form_case *c, int unused)
{
    (void)unused;
    c->bodies[c->body_count++] = (struct closed_form_body){.shape = BODY_WEDGE,
                                                           .low = {-1, 1, -1},
                                                           .high = {1, 1.5, 1},
                                                           .remains = {0.5f, 0.25f, 0.125f},
                                                           .distance = 0.25f};
    snprintf(c->name, sizeof c->name, "A3 wedge");
    build_media(c, sun(0));
}

static void init_sphere(struct closed_form_case *c, int unused)
{
    (void)unused;
    c->bodies[c->body_count++] = (struct closed_form_body){.shape = BODY_SPHERE,
                                                           .low = {-0.5, 1, -0.5},
                                                           .high = {0.5, 2, 0.5},
                                                           .remains = {0.5f, 0.25f, 0.125f},
                                                           .distance = 0.5f};
    snprintf(c->name, sizeof c->name, "A4 sphere");
    build_media(c, sun(0));
    c->facet_m = 0.5 * 2 * (1 - cos(pi / 128)); /* flat both ways: across and along */
}

static void init_staircase(struct closed_form_case *c, int unused)
{
    (void)unused;
    for (int i = 0; i < 3; i++)
        c->bodies[c->body_count++] =
            (struct closed_form_body){.low = {-0.75 + 0.5 * i, 1, -1},
                                      .high = {-0.25 + 0.5 * i, 1 + 0.25 * (i + 1), 1},
                                      .remains = {0.5f, 0.25f, 0.75f},
                                      .distance = 0.25f};
    snprintf(c->name, sizeof c->name, "A11 staircase 1:2:3");
    build_media(c, sun(0));
}

/* -- A5 -- */

static void init_overlap(struct closed_form_case *c, int seed)
{
    uint64_t state = (uint64_t)seed;
    closed_form_random_bodies(&state, seed % 2 == 0, c->bodies);
    c->body_count = RANDOM_BODIES;
    snprintf(c->name, sizeof c->name, "A5 overlapping bodies %d", seed);
    build_media(c,
                seed % 3 == 0 ? sun(20) : lamp(seed % 3 == 1 ? GLB_LIGHT_POINT : GLB_LIGHT_SPOT));
    look_at(c, (double[]){0, 2.5, 0.3}, (double[]){0, 0, 0}, 45);
}

/* -- A6 --
 * sigma(y) = sigma0 exp(-y / H) as FOG_SLABS slabs of the extinction in their middles: by the
 * midpoint rule short of the integral by at most h^2 / (24 H^2) of it. */
enum { FOG_SLABS = 32 };

static void init_fog(struct closed_form_case *c, int angle_deg)
{
    const double low = 0.0625, step = 0.0625;
    c->fog_sigma0 = 2;
    c->fog_scale_m = 0.5;
    c->fog_top_m = low + FOG_SLABS * step;
    for (int i = 0; i < FOG_SLABS; i++) {
        double y = low + i * step;
        struct closed_form_body *slab = &c->bodies[c->body_count++];
        *slab =
            (struct closed_form_body){.low = {-8, y, -4}, .high = {8, y + step, 4}, .distance = 1};
        for (int k = 0; k < 3; k++)
            slab->remains[k] = (float)exp(-(k + 1) / 2.0 * c->fog_sigma0 *
                                          exp(-(y + 0.5 * step) / c->fog_scale_m));
    }
    snprintf(c->name, sizeof c->name, "A6 fog at %d degrees", angle_deg);
    c->is_even = true;
    build_media(c, sun(angle_deg));
    look_at(c, (double[]){0, 0.05, 0.05}, (double[]){0, 0, 0}, 60);
    c->step_error = step * step / (24 * c->fog_scale_m * c->fog_scale_m);
}

/* -- A9, A10 -- */

static void init_picture(struct closed_form_case *c, int cells)
{
    c->picture = (struct projector_scene_desc){.cells = cells, .is_bars = cells > 4};
    snprintf(c->name, sizeof c->name, "A9 picture of %d %s", cells, cells > 4 ? "bars" : "cells");
    projector_scene_build(&c->picture, &c->scene);
    c->normal[2] = 1;
    look_at(c, (double[]){0, 0, 0.9}, (double[]){0, 0, 0}, 90);
}

static void init_tilted(struct closed_form_case *c, int tilt_deg)
{
    c->tilted = (struct tilted_scene_desc){
        .tilt_deg = tilt_deg, .color = {0.9, 0.6, 0.3}, .pass_through = GLB_PASS_SLAB};
    snprintf(c->name, sizeof c->name, "A10 pane at %d degrees", tilt_deg);
    tilted_scene_build(&c->tilted, &c->scene);
    c->normal[1] = 1;
    look_at(c, (double[]){0, 0.1, 0.05}, (double[]){0, 0, 0}, 45);
}

static const struct {
    const char *id;
    void (*init)(struct closed_form_case *c, int parameter);
    int parameter;
} cases[] = {
    {"A1", init_panes, 1},      {"A1", init_panes, 3},    {"A1", init_panes, 64},
    {"A2", init_slab, 0},       {"A2", init_slab, 30000}, {"A2", init_slab, 60000},
    {"A2", init_slab, 80000},   {"A2", init_slab, 89000}, {"A2", init_slab, 89900},
    {"A3", init_wedge, 0},      {"A4", init_sphere, 0},   {"A5", init_overlap, 1},
    {"A5", init_overlap, 2},    {"A5", init_overlap, 3},  {"A5", init_overlap, 4},
    {"A6", init_fog, 0},        {"A6", init_fog, 60},     {"A9", init_picture, 4},
    {"A9", init_picture, 7},    {"A10", init_tilted, 0},  {"A10", init_tilted, 60},
    {"A11", init_staircase, 0},
};

int closed_form_case_count(void)
{
    return sizeof cases / sizeof *cases;
}

void closed_form_case_init(struct closed_form_case *c, int index)
{
    assert(index >= 0 && index < closed_form_case_count());
    *c = (struct closed_form_case){.id = cases[index].id};
    cases[index].init(c, cases[index].parameter);
}

void closed_form_case_finish(struct closed_form_case *c)
{
    closed_form_scene_finish(&c->scene);
}

static void fog_answer(const struct closed_form_case *c, double t[3], double doubt[3])
{
    double low = c->bodies[0].low[1], h = c->fog_scale_m;
    double depth = h * (exp(-low / h) - exp(-c->fog_top_m / h)) / -c->scene.light.direction[1];
    for (int k = 0; k < 3; k++) {
        double tau = (k + 1) / 2.0 * c->fog_sigma0 * depth;
        t[k] = exp(-tau);
        doubt[k] = t[k] * expm1(tau * c->step_error);
    }
}

static void bodies_answer(const struct closed_form_case *c, const double point[3], double t[3],
                          double doubt[3])
{
    const struct closed_form_light *light = &c->scene.light;
    bool is_sun = light->type == GLB_LIGHT_DIRECTIONAL;
    double from[3], inner_t[3];
    for (int k = 0; k < 3; k++)
        from[k] = is_sun ? point[k] - 1000 * light->direction[k] : light->position[k];
    closed_form_through(c->bodies, c->body_count, from, point, t);
    if (c->facet_m <= 0)
        return;
    struct closed_form_body inner = c->bodies[0];
    for (int k = 0; k < 3; k++) {
        inner.low[k] += c->facet_m;
        inner.high[k] -= c->facet_m;
    }
    closed_form_through(&inner, 1, from, point, inner_t);
    for (int k = 0; k < 3; k++)
        doubt[k] = inner_t[k] - t[k];
}

void closed_form_case_answer(const struct closed_form_case *c, const double point[3], double t[3],
                             double doubt[3])
{
    doubt[0] = doubt[1] = doubt[2] = 0;
    if (c->fog_top_m > 0)
        fog_answer(c, t, doubt);
    else if (c->picture.cells)
        projector_scene_transmittance(&c->picture, point[0], point[1], t);
    else if (c->tilted.color[0] > 0)
        tilted_scene_transmittance(&c->tilted, t);
    else if (c->body_count)
        bodies_answer(c, point, t, doubt);
    else
        closed_form_transmittance(&c->scene, point, t);
}
