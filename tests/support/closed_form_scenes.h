/* SPDX-License-Identifier: MIT */
/* Scenes whose image can be computed by hand, as GLB bytes with the geometry to compute it from.
 * Thread: any.
 *
 * World: +Y up, metres. Receivers are opaque, ior 1 and rough: a renderer without a Fresnel term at
 * f0 = 0 shows albedo / pi * E exactly; others show a factor that the same scene without panes has
 * too. Panes are flat, thin, double-sided, ior 1, roughness 0. Cameras are perspective, so that
 * nothing behind the eye is in the picture, and their nodes carry the names given here.
 * All builders assert on memory: they are for tests. */
#ifndef VITRAIL_TESTS_SUPPORT_CLOSED_FORM_SCENES_H
#define VITRAIL_TESTS_SUPPORT_CLOSED_FORM_SCENES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "glb/glb_builder.h"

struct closed_form_pane {
    double corner[3], u[3], v[3]; /* the points corner + s u + t v, s and t in [0,1] */
    double color[4];              /* base colour, linear; alpha 1 for glass */
    bool is_blend;                /* otherwise glass: transmission 1 */
};

struct closed_form_light {
    enum glb_light_type type;
    double position[3], direction[3]; /* direction of travel, unit */
    double color[3], intensity;       /* cd; lx for directional */
    double inner_deg, outer_deg;      /* spots: every receiver lies inside the inner cone */
};

struct closed_form_scene {
    void *glb; /* owned */
    size_t size_bytes;
    struct closed_form_pane *panes; /* owned */
    int pane_count;
    struct closed_form_light light;
    double albedo; /* of floors, walls and probes, each channel */
};

void closed_form_scene_finish(struct closed_form_scene *scene);

/* What one crossing of the pane leaves: glass its colour; BLEND (1 - alpha)(1 - alpha(1 - colour)),
 * the default "tint" rule. */
void closed_form_filter(const struct closed_form_pane *pane, double filter[3]);

/* Product of the filters between the light and a world point. Returns the distance in metres, in
 * the plane of a pane, from the ray to the nearest border of any pane: points closer than the
 * footprint of a shadow texel are not comparable. INFINITY when the ray meets no pane's plane. */
double closed_form_transmittance(const struct closed_form_scene *scene, const double point[3],
                                 double transmittance[3]);

/* Diffuse radiance at a point with a unit normal: albedo / pi * E, without and with panes. */
void closed_form_unshadowed(const struct closed_form_scene *scene, const double point[3],
                            const double normal[3], double radiance[3]);
void closed_form_radiance(const struct closed_form_scene *scene, const double point[3],
                          const double normal[3], double radiance[3]);

/* -- (a) Parallel panes above a floor --
 * The floor is y = 0. Pane k (0 = top) is the square |x|, |z| <= pane_half at
 * y = 1 + (pane_count - 1 - k) * spacing. The light stands at (0, top pane + 4, 0), or shines
 * straight down. Cameras: "Floor" below all panes, the middle of the picture is (0, 0, 0). With
 * probes, probe k for k in [0, pane_count] is an opaque square tile that lies under exactly k panes
 * and in no other probe's shadow; camera "Probe k" looks straight down on it and sees only it. */
struct panes_scene_desc {
    int pane_count;            /* [0, 1024] */
    const double (*colors)[4]; /* required when pane_count > 0; borrowed; one per pane */
    bool is_blend;
    double spacing;   /* m; 0 means 0.1 */
    double pane_half; /* m; 0 means 1 */
    enum glb_light_type light;
    double intensity; /* 0 means 100 cd or 4 lx */
    bool has_probes;  /* needs 0.13 * (pane_count + 1) <= 17 * pane_half */
};
void panes_scene_build(const struct panes_scene_desc *desc, struct closed_form_scene *scene);
/* Centre of probe k; its normal is +Y. */
void panes_scene_probe(const struct panes_scene_desc *desc, int k, double point[3]);

/* -- (d) Three overlapping panes --
 * Red, green and blue squares of side 1 around (0.3 cos a, 0.3 sin a) in (x, z), a = 90, 210, 330
 * degrees, at y = 1, 1.25 and 1.5: height_order[h] is the colour (0 red, 1 green, 2 blue) of
 * height h. file_order is the order of their nodes. Floor y = 0, light straight down, 4 lx. Camera
 * "Floor": from (0, 0.8, 0) straight down; a square picture is the floor's |x|, |z| <= 1, its top
 * is z = -1, and floor points lie linearly in it. */
struct overlap_scene_desc {
    int height_order[3], file_order[3]; /* permutations of 0 1 2; all zero means 0 1 2 */
    bool is_blend;                      /* alpha 0.6 */
};
void overlap_scene_build(const struct overlap_scene_desc *desc, struct closed_form_scene *scene);

/* -- (e) Random coloured panes over a floor --
 * pane_count parallelograms, tilted by up to 50 degrees, with centres in |x|, |z| <= 1.5, y in
 * [1.6, 3.5]; half of them BLEND. Floor y = 0, |x|, |z| <= 3. The light stands at (0.4, 7, -0.3).
 * Camera "Floor": from (0, 0.9, 0) straight down; a square picture is the floor's |x|, |z| <= 2.5,
 * its top is z = -2.5. */
struct random_panes_scene_desc {
    int pane_count;
    uint64_t seed;
    enum glb_light_type light; /* a directional one shines straight down */
    bool has_smoke;            /* a ball of radius 0.8 around (0, 0.9, 0), thinner outwards */
};
void random_panes_scene_build(const struct random_panes_scene_desc *desc,
                              struct closed_form_scene *scene);

/* -- (b) Texture projector --
 * Wall z = 0 facing +Z, |x|, |y| <= 3. Pane |x|, |y| <= 0.5 at z = 1, with a picture of cells x
 * cells squares (or cells vertical bars) in two colours, nearest filter. Light at z = 2 on the
 * axis, so wall point (x, y) sees pane point (x / 2, y / 2). Camera "Wall": from
 * (0, 0, 0.9); a square picture is the wall's |x|, |y| <= 1.2. */
struct projector_scene_desc {
    int cells; /* 0 means 4 */
    bool is_bars;
    uint8_t srgb[2][3]; /* of even and odd cells; all zero means (255 64 16) and (16 128 255) */
};
void projector_scene_build(const struct projector_scene_desc *desc,
                           struct closed_form_scene *scene);
/* Transmittance at the wall point (x, y, 0). Returns the distance in m to the nearest cell border.
 */
double projector_scene_transmittance(const struct projector_scene_desc *desc, double x, double y,
                                     double transmittance[3]);

/* -- (c) Angle-dependent pane --
 * Floor y = 0. One pane of side 2 around (0, 1.5, 0), turned by tilt_deg about +X. Light straight
 * down, 4 lx. Camera "Floor": from (0, 0.45, 0.3), the middle of the picture is (0, 0, 0). */
struct tilted_scene_desc {
    double tilt_deg; /* [0, 80] */
    double color[3];
    enum glb_pass_through pass_through;
    double edge_color[3], edge_exponent;
    bool has_no_pane;
};
void tilted_scene_build(const struct tilted_scene_desc *desc, struct closed_form_scene *scene);
/* At the origin: colour^(1/c) or mix(edge * colour, colour, c^exponent), c = cos(tilt). */
void tilted_scene_transmittance(const struct tilted_scene_desc *desc, double transmittance[3]);

/* -- (f) Room with many lights --
 * Inside of a box 16 x 6 x 22 m around (0, 3, 0), 40 spheres of radius 0.3 to 0.9, light_count
 * lights: even ones point lights of range 1 to 2.5, odd ones spots of range 3 to 6 and half angle
 * 20 to 40 degrees. Camera "Room" at (0, 2.6, 10.2) looking along -Z. scene->panes is empty and
 * scene->light unused. */
struct room_scene_desc {
    int light_count;
    uint64_t seed;
    int glass_spheres; /* how many of the spheres are coloured glass, the rest are opaque */
};
void room_scene_build(const struct room_scene_desc *desc, struct closed_form_scene *scene);

#endif
