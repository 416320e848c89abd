/* SPDX-License-Identifier: MIT */
/* Haze in rasterised and in ray-traced pictures against closed forms: what it scatters of suns and
 * lamps, what it lets through, between layers and through shadows, and that nothing else of a frame
 * changes. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "renderer/base/matrix.h"
#include "renderer/frame/renderer_internal.h"
#include "renderer/scene/atmosphere.h"
#include "tests/support/boxes.h"
#include "tests/support/image_checks.h"

enum { WIDTH = 160, HEIGHT = 90 };

static const double wall_z = -8; /* the camera stands at 0 and looks along -z */
static const double pane_z = -3;
static const double stain[3] = {0.9, 0.4, 0.1};

/* A wall that fills the view and sends `glow` whatever lights it; before it, where asked for, a
 * stained sheet over the left half, and a black block that keeps a sun from above off what is
 * behind x > 0.5. */
struct stage {
    double wall_glow;
    bool has_pane, has_block;
};

static void open_stage(struct rig_scene *rig, struct renderer *renderer, const struct stage *stage)
{
    const double level = stage->wall_glow / 4;
    const struct glb_material_desc wall = {.name = "Wall",
                                           .base_color = {0, 0, 0, 1},
                                           .roughness = 1,
                                           .metallic = 1,
                                           .emissive = {level, level, level},
                                           .emissive_strength = 4};
    const struct glb_material_desc pane = {.name = "Pane",
                                           .base_color = {stain[0], stain[1], stain[2], 1},
                                           .roughness = 1,
                                           .transmission = 1,
                                           .is_double_sided = true,
                                           .has_ior = true,
                                           .ior = 1};
    const struct glb_material_desc block = {
        .name = "Block", .base_color = {0, 0, 0, 1}, .roughness = 1, .metallic = 1};
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Haze", &err);
    void *glb;
    size_t size_bytes;
    assert_non_null(builder);
    builder_add_box(builder, &wall, (const double[]){-20, -20, wall_z - 1},
                    (const double[]){20, 20, wall_z});
    if (stage->has_pane) {
        struct shape sheet = {0};
        shape_add_quad(&sheet, (const double[]){-10, -10, pane_z}, (const double[]){10, 0, 0},
                       (const double[]){0, 20, 0});
        int mesh =
            shape_give_mesh(&sheet, builder, "Pane", glb_builder_add_material(builder, &pane));
        glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Pane", .mesh = mesh});
    }
    if (stage->has_block)
        builder_add_box(builder, &block, (const double[]){0.5, 10, -19},
                        (const double[]){20, 11, 19});
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, "haze", glb, size_bytes);
    free(glb);
}

static const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                      .direction = {0, -1, 0},
                                      .color = {1, 0.8f, 0.5f},
                                      .intensity = 30};
static const struct view_light lamp = {.type = SCENE_LIGHT_POINT,
                                       .position = {0.7, 0.4, -2.5},
                                       .color = {1, 0.6f, 0.3f},
                                       .intensity = 10,
                                       .casts_no_shadow = true};

static struct view look(const struct view_light *lights, size_t count)
{
    return (struct view){
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .target = {0, 0, -1}, .fov_y_deg = 50},
        .lights = lights,
        .light_count = count,
        .atmosphere = {.density_per_m = 0.15, .color = {0.9f, 0.7f, 0.5f}, .anisotropy = 0.4},
        .quality = {.samples = 1, .shadows = SHADOWS_DEEP},
    };
}

static const struct view_material_override white_wall[1] = {
    {.material = "Wall", .has_base_color = true, .base_color = {1, 1, 1, 1}, .has_metallic = true}};

static double phase(double g, double cosine)
{
    double d = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (4 * M_PI * d * sqrt(d));
}

static double depth(const struct view_atmosphere *air, const double p[3], const double q[3])
{
    double way[3], length;
    vec3_sub(q, p, way);
    length = vec3_length(way);
    return atmosphere_depth(air, p[1], length > 0 ? way[1] / length : 0, length);
}

/* Lit share [from, to] of the way to the wall, by the sun; whatever is beside it is dark. */
static double sun_scattered(const struct view *view, const double way[3], double from, double to,
                            int k)
{
    double s = view->atmosphere.density_per_m;
    double cosine = way[1]; /* of the light's way, down, and that to the eye */
    return (double)view->atmosphere.color[k] * (double)sun.color[k] * (double)sun.intensity *
           phase(view->atmosphere.anisotropy, cosine) * (exp(-s * from) - exp(-s * to));
}

static double cone_passes(const struct view_light *light, double cosine)
{
    double outer = cos(light->outer_cone_deg * M_PI / 180);
    double inner = cos(light->inner_cone_deg * M_PI / 180);
    double part = fmin(fmax((cosine - outer) / (inner - outer), 0), 1);
    return light->type == SCENE_LIGHT_SPOT ? part * part : 1;
}

/* Of the view's first light, which looks down where it is a spot. */
static double lamp_scattered(const struct view *view, const double way[3], double end, int k)
{
    enum { STEPS = 20000 };
    const struct view_atmosphere *air = &view->atmosphere;
    const struct view_light *light = view->lights;
    const double eye[3] = {0, 0, 0};
    double sum = 0;
    for (int i = 0; i < STEPS; i++) {
        double t = end * (i + 0.5) / STEPS, p[3], d2 = 0, cosine = 0;
        for (int j = 0; j < 3; j++) {
            p[j] = t * way[j];
            d2 += (p[j] - light->position[j]) * (p[j] - light->position[j]);
            cosine += (p[j] - light->position[j]) * -way[j];
        }
        double tau = depth(air, eye, p) + depth(air, p, light->position);
        sum += atmosphere_extinction(air, p[1]) * phase(air->anisotropy, cosine / sqrt(d2)) / d2 *
               cone_passes(light, (light->position[1] - p[1]) / sqrt(d2)) * exp(-tau);
    }
    return sum * end / STEPS * (double)air->color[k] * (double)light->color[k] *
           (double)light->intensity;
}

/* The unit way of a pixel's ray, and how long it is to a plane across the view. */
static double way_of(const struct view *view, int x, int y, double z, double way[3])
{
    double origin[3], length = 0;
    view_ray(view, x, y, origin, way);
    for (int k = 0; k < 3; k++)
        length += way[k] * way[k];
    length = sqrt(length);
    for (int k = 0; k < 3; k++)
        way[k] /= length;
    return z / way[2];
}

static void expect(const struct image *image, int x, int y, int k, double expected,
                   double tolerance, const char *what)
{
    double found = (double)image_pixel_f32(image, x, y)[k];
    if (!(fabs(found - expected) <= tolerance * (expected + 1e-3)))
        fail_msg("%s, pixel (%d, %d), channel %d: %.6f instead of %.6f", what, x, y, k, found,
                 expected);
}

/* All find the light of haze in a grid: by shadow maps, by rays. */
static const enum shadow_technique forms[] = {SHADOWS_DEEP, SHADOWS_RAYTRACED,
                                              SHADOWS_RAYTRACED_SHADOWS};
enum { FORMS = sizeof forms / sizeof *forms };

/* An even haze before a black wall under a sun, which nothing hides: color p E (1 - exp(-s d)). */
static void even_haze_under_a_sun_is_exact(void **state)
{
    struct rig_scene rig;
    struct view_light open_sun = sun;
    open_sun.casts_no_shadow = true;
    open_stage(&rig, *state, &(struct stage){.wall_glow = 0});
    for (int form = 0; form < 2 * FORMS; form++) {
        const bool ortho = form % 2;
        struct view view = look(&open_sun, 1);
        view.quality.shadows = forms[form / 2];
        view.camera.ortho_height = ortho ? 6 : 0;
        struct image image = shoot_color(*state, &rig, &view);
        for (int i = 0; i < 9; i++) {
            int x = 4 + i % 3 * 70, y = 4 + i / 3 * 38;
            double way[3] = {0, 0, -1};
            double end = ortho ? -wall_z : way_of(&view, x, y, wall_z, way);
            for (int k = 0; k < 3; k++)
                expect(&image, x, y, k, sun_scattered(&view, way, 0, end, k), 2e-3, "sun");
        }
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

static void lamps_agree_with_quadrature(void **state)
{
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.wall_glow = 0});
    for (int form = 0; form < 2 * FORMS; form++) {
        const bool fog = form % 2;
        struct view view = look(&lamp, 1);
        view.quality.shadows = forms[form / 2];
        view.quality.atmosphere_samples = 256;
        if (fog)
            view.atmosphere.falloff_m = 0.8, view.atmosphere.base_m = -0.5;
        struct image image = shoot_color(*state, &rig, &view);
        for (int i = 0; i < 9; i++) {
            int x = 4 + i % 3 * 70, y = 4 + i / 3 * 38;
            double way[3], end = way_of(&view, x, y, wall_z, way);
            for (int k = 0; k < 3; k += fog ? 2 : 1)
                expect(&image, x, y, k, lamp_scattered(&view, way, end, k), 0.02, "lamp");
        }
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

static const double lamp_px[2] = {107.02, 29.56}; /* where the lamp is seen */

/* Slices are thick against the distance of these columns from the lamp, so that the phase function
 * differs widely between the points of one. */
static void columns_beside_a_lamp_have_its_light(void **state)
{
    enum { NEAREST = 3, RINGS = 7 };
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.wall_glow = 0});
    for (int form = 0; form < FORMS; form++) {
        double found[RINGS] = {0}, expected[RINGS] = {0};
        struct view view = look(&lamp, 1);
        view.quality.shadows = forms[form];
        struct image image = shoot_color(*state, &rig, &view);
        for (int i = 0; i < 21 * 21; i += 2) {
            int x = 97 + i % 21, y = 19 + i / 21;
            double way[3], end = way_of(&view, x, y, wall_z, way);
            int ring = (int)hypot(x + 0.5 - lamp_px[0], y + 0.5 - lamp_px[1]) - NEAREST;
            if (ring < 0 || ring >= RINGS)
                continue;
            found[ring] += (double)image_pixel_f32(&image, x, y)[1];
            expected[ring] += lamp_scattered(&view, way, end, 1);
        }
        for (int ring = 0; ring < RINGS; ring++)
            if (!(fabs(found[ring] / expected[ring] - 1) < 0.02))
                fail_msg("%s, %d pixels from the lamp: %.3f of the light",
                         shadow_technique_name((int)forms[form]), ring + NEAREST,
                         found[ring] / expected[ring]);
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

/* Around a lamp in the picture the haze glows like one over the distance from it, which rays find
 * sharper than the columns of the grid are: one pixel wide, and two with few slices. */
static void a_lamp_in_the_haze_glows_sharply(void **state)
{
    static const int slices[] = {64, 16};
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.wall_glow = 0});
    for (int form = 0; form < 2; form++) {
        struct view view = look(&lamp, 1);
        view.quality.shadows = SHADOWS_RAYTRACED;
        view.quality.atmosphere_samples = slices[form];
        struct image image = shoot_color(*state, &rig, &view);
        int count = 0;
        for (int i = 0; i < 9 * 9; i++) {
            int x = 103 + i % 9, y = 25 + i / 9;
            double way[3], end = way_of(&view, x, y, wall_z, way);
            double away_px = hypot(x + 0.5 - lamp_px[0], y + 0.5 - lamp_px[1]);
            if (away_px > 1.2 * (form + 1))
                continue;
            for (int k = 0; k < 3; k++)
                expect(&image, x, y, k, lamp_scattered(&view, way, end, k), 0.01, "glow");
            count++;
        }
        assert_true(count >= 5);
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

/* Light of a spot that looks down, over what is expected, in the pixels around it: by the integral
 * of each ray, 4 x 4 in a pixel. */
static double find_cone_share(struct renderer *renderer, const struct rig_scene *rig,
                              const struct view *view, const double spot_px[2])
{
    enum { REACH = 3, PARTS = 4 };
    const int left = (int)spot_px[0] - REACH, top = (int)spot_px[1] - REACH;
    struct view fine = *view;
    struct image image = shoot_color(renderer, rig, view);
    double found = 0, expected = 0;
    fine.width_px *= PARTS;
    fine.height_px *= PARTS;
    for (int y = top; y <= top + 2 * REACH; y++)
        for (int x = left; x <= left + 2 * REACH; x++)
            found += (double)image_pixel_f32(&image, x, y)[0];
    for (int y = PARTS * top; y < PARTS * (top + 2 * REACH + 1); y++)
        for (int x = PARTS * left; x < PARTS * (left + 2 * REACH + 1); x++) {
            double way[3], end = way_of(&fine, x, y, wall_z, way);
            expected += lamp_scattered(&fine, way, end, 0) / (PARTS * PARTS);
        }
    image_finish(&image);
    return found / expected;
}

/* The cone of a spot in the picture begins within a column. The ray in its middle misses the thin
 * end of the cone in the first place, and meets it in the second. */
static void the_cone_of_a_spot_has_its_light(void **state)
{
    static const double moves_px[2][2] = {{0, 0}, {-0.3, -0.47}};
    static const int slices[] = {64, 256};
    const double pixel_m = -2 * lamp.position[2] * tan(25 * M_PI / 180) / (HEIGHT * 2 / 5);
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.wall_glow = 0});
    for (int i = 0; i < 8; i++) {
        const double *move = moves_px[i / 2 % 2];
        const double px[2] = {lamp_px[0] * 2 / 5 + move[0], lamp_px[1] * 2 / 5 + move[1]};
        struct view_light spot = lamp;
        spot.type = SCENE_LIGHT_SPOT;
        spot.direction[0] = spot.direction[2] = 0;
        spot.direction[1] = -1;
        spot.inner_cone_deg = 20;
        spot.outer_cone_deg = 30;
        spot.position[0] += move[0] * pixel_m;
        spot.position[1] -= move[1] * pixel_m;
        struct view view = look(&spot, 1);
        view.quality.shadows = forms[i / 4];
        view.quality.atmosphere_samples = slices[i % 2];
        view.quality.samples = i / 4 ? 16 : 1;
        view.width_px = WIDTH * 2 / 5;
        view.height_px = HEIGHT * 2 / 5;
        double share = find_cone_share(*state, &rig, &view, px);
        if (!(fabs(share - 1) < (i / 4 ? 0.05 : 0.15)))
            fail_msg("%s, %d slices: %.3f of the light of a spot",
                     shadow_technique_name((int)forms[i / 4]), slices[i % 2], share);
    }
    rig_scene_finish(&rig, *state);
}

/* What the haze lets through of a wall that glows, even and thinning out above a height. */
static void what_is_behind_is_dimmed(void **state)
{
    const double glow = 2;
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.wall_glow = glow});
    for (int form = 0; form < 3 * FORMS; form++) {
        const int fog = form % 3;
        struct view view = look(NULL, 0);
        view.quality.shadows = forms[form / 3];
        view.studio = VIEW_STUDIO_OFF;
        view.atmosphere.falloff_m = fog == 1 ? 0.6 : fog == 2 ? 1e6 : 0;
        view.atmosphere.base_m = -0.4;
        struct image image = shoot_color(*state, &rig, &view);
        for (int i = 0; i < 9; i++) {
            int x = 4 + i % 3 * 70, y = 4 + i / 3 * 38;
            double way[3], eye[3] = {0, 0, 0}, end = way_of(&view, x, y, wall_z, way);
            const double wall[3] = {end * way[0], end * way[1], end * way[2]};
            expect(&image, x, y, 1, glow * exp(-depth(&view.atmosphere, eye, wall)), 2e-4, "wall");
        }
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

/* A lamp is dimmed on its way to surfaces, a sun is not. */
static void lamps_are_dimmed_on_their_way(void **state)
{
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.has_pane = true});
    struct view_light light = lamp;
    for (int form = 0; form < 2 * FORMS; form++) {
        const bool is_sun = form >= FORMS;
        struct view view = look(&light, 1), clear;
        view.quality.shadows = forms[form % FORMS];
        if (is_sun)
            light = (struct view_light){.type = SCENE_LIGHT_DIRECTIONAL,
                                        .direction = {0, 0, -1},
                                        .color = {1, 1, 1},
                                        .intensity = 3,
                                        .casts_no_shadow = true};
        view.atmosphere.color[0] = view.atmosphere.color[1] = view.atmosphere.color[2] = 0;
        view.materials = white_wall;
        view.material_override_count = 1;
        clear = view;
        clear.atmosphere.density_per_m = 0;
        struct image image = shoot_color(*state, &rig, &view);
        struct image bare = shoot_color(*state, &rig, &clear);
        for (int x = 84; x < WIDTH; x += 25) {
            double way[3], eye[3] = {0, 0, 0}, end = way_of(&view, x, 45, wall_z, way);
            const double wall[3] = {end * way[0], end * way[1], end * way[2]};
            double tau = depth(&view.atmosphere, eye, wall) +
                         (is_sun ? 0 : depth(&view.atmosphere, wall, lamp.position));
            double unlost = (double)image_pixel_f32(&bare, x, 45)[1];
            expect(&image, x, 45, 1, unlost * exp(-tau), 1e-3, is_sun ? "sun" : "lamp");
        }
        image_finish(&image);
        image_finish(&bare);
    }
    rig_scene_finish(&rig, *state);
}

/* A sheet of glass in the haze: what scatters before it is seen as it is, what scatters behind it
 * through it. */
static void layers_lie_in_the_haze(void **state)
{
    struct rig_scene rig;
    struct view_light open_sun = sun;
    open_sun.casts_no_shadow = true;
    open_stage(&rig, *state, &(struct stage){.has_pane = true});
    static const int samples[] = {1, 4};
    for (size_t i = 0; i < 2 * FORMS; i++) {
        struct view view = look(&open_sun, 1);
        view.quality.shadows = forms[i / 2];
        view.quality.samples = samples[i % 2];
        struct image image = shoot_color(*state, &rig, &view);
        for (int x = 5; x < 70; x += 16) {
            double way[3], end = way_of(&view, x, 60, wall_z, way), pane = end * pane_z / wall_z;
            for (int k = 0; k < 3; k++)
                expect(&image, x, 60, k,
                       sun_scattered(&view, way, 0, pane, k) +
                           stain[k] * sun_scattered(&view, way, pane, end, k),
                       4e-3, "behind the pane");
        }
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

/* The shadow of a block in the haze: from where the ray enters it on there is no light. */
static void shadows_are_in_the_haze(void **state)
{
    static const enum shadow_technique techniques[] = {SHADOWS_MAP, SHADOWS_DEEP,
                                                       SHADOWS_DEEP_LINKED, SHADOWS_RAYTRACED,
                                                       SHADOWS_RAYTRACED_SHADOWS};
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.has_block = true});
    for (size_t i = 0; i < sizeof techniques / sizeof *techniques; i++) {
        struct view view = look(&sun, 1);
        view.quality.shadows = techniques[i];
        view.quality.atmosphere_samples = 256;
        struct image image = shoot_color(*state, &rig, &view);
        for (int x = 100; x < WIDTH; x += 13) {
            double way[3], end = way_of(&view, x, 45, wall_z, way), dark = fmin(0.5 / way[0], end);
            for (int k = 0; k < 3; k++)
                expect(&image, x, 45, k, sun_scattered(&view, way, 0, dark, k), 0.03,
                       shadow_technique_name((int)techniques[i]));
        }
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

/* Around is the same radiance: dense haze has it, times its colour. */
static void light_from_all_around_is_scattered(void **state)
{
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.wall_glow = 0});
    for (int form = 0; form < FORMS; form++) {
        struct view view = look(NULL, 0);
        view.quality.shadows = forms[form];
        view.has_environment = true;
        view.sky[0] = view.sky[1] = view.sky[2] = 3;
        view.ground[0] = view.ground[1] = view.ground[2] = 1;
        view.atmosphere.density_per_m = 5;
        struct image image = shoot_color(*state, &rig, &view);
        for (int k = 0; k < 3; k++)
            expect(&image, 80, 45, k, 2 * (double)view.atmosphere.color[k], 1e-4, "all around");
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

static void assert_tile_has_the_bits(struct renderer *renderer, const struct rig_scene *rig,
                                     const struct view *view, const struct image *whole)
{
    struct view tile = *view;
    tile.tile = (struct view_tile){.x_px = 53, .y_px = 22, .width_px = 61, .height_px = 47};
    struct image part = shoot_color(renderer, rig, &tile);
    for (int y = 0; y < 47; y++)
        if (memcmp(image_pixel_f32(&part, 0, y), image_pixel_f32(whole, 53, 22 + y),
                   61 * 4 * sizeof(float)) != 0)
            fail_msg("row %d of the tile has other bits", y);
    image_finish(&part);
}

/* Tiles have the bits of the whole, and lights in parts the same light. */
static void tiles_and_parts_agree(void **state)
{
    enum { MANY = 12 };
    struct rig_scene rig;
    struct renderer *renderer = *state;
    struct view_light many[MANY];
    for (int i = 0; i < MANY; i++) {
        many[i] = i % 2 ? lamp : sun;
        many[i].casts_no_shadow = false;
        many[i].intensity /= MANY / 2;
        many[i].direction[0] = 0.01 * i;
        many[i].position[0] = 0.05 * i - 1;
        many[i].range = i % 4 == 1 ? 3 : 0;
    }
    open_stage(&rig, renderer, &(struct stage){.has_pane = true, .has_block = true});
    struct view view = look(many, MANY);
    view.quality.samples = 4;
    view.quality.atmosphere_samples = 32;
    view.quality.shadow_resolution = 128;
    struct image whole = shoot_color(renderer, &rig, &view);
    assert_tile_has_the_bits(renderer, &rig, &view, &whole);
    const uint64_t most_bytes = renderer->shadow_most_bytes;
    const uint64_t loop_steps = renderer->frames.shade.loop_steps;
    for (int way = 0; way < 2; way++) {
        struct frame frame;
        renderer->shadow_most_bytes = way ? most_bytes : 2 << 20;
        renderer->frames.shade.loop_steps = way ? 8000 : loop_steps;
        renderer_drop_structures(renderer, rig.key);
        shoot(renderer, &rig, &view, &frame);
        if (way)
            assert_int_in_range(frame.report.counts.light_chunks, 2, 100);
        else
            assert_int_in_range(frame.report.counts.light_batches, 2, 100);
        assert_images_close(&frame.outputs[VIEW_OUTPUT_COLOR], &whole, 0.01, 1e-4);
        frame_finish(&frame);
    }
    renderer->shadow_most_bytes = most_bytes;
    renderer->frames.shade.loop_steps = loop_steps;
    for (int form = 1; form < FORMS; form++) {
        view.quality.shadows = forms[form];
        struct image traced = shoot_color(renderer, &rig, &view);
        struct image again = shoot_color(renderer, &rig, &view);
        assert_tile_has_the_bits(renderer, &rig, &view, &traced);
        assert_same_bits(&traced, &again);
        image_finish(&again);
        image_finish(&traced);
    }
    image_finish(&whole);
    rig_scene_finish(&rig, renderer);
}

/* Haze that comes and goes leaves surfaces, lists and shadows as they were. */
static void nothing_else_is_built_anew(void **state)
{
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.has_pane = true, .has_block = true});
    struct view view = look(&sun, 1);
    struct frame frame;
    for (int step = 0; step < 3; step++) {
        view.atmosphere.density_per_m = 0.1 * step;
        shoot(*state, &rig, &view, &frame);
        assert_int_equal(frame.report.counts.shadow_maps_built, step == 0);
        assert_int_equal(frame.report.counts.gbuffers_drawn, step == 0);
        assert_int_equal(frame.report.counts.pixel_lists_built, step == 0);
        assert_true(report_has_pass(&frame.report, "atmosphere.light", "froxels") == (step > 0));
        frame_finish(&frame);
    }
    rig_scene_finish(&rig, *state);
}

/* ---- the reference ---- */

static struct view look_closely(const struct view_light *lights, size_t count)
{
    struct view view = look(lights, count);
    view.width_px = WIDTH / 5;
    view.height_px = HEIGHT / 5;
    view.quality.shadows = SHADOWS_RAYTRACED;
    view.quality.reference = true;
    return view;
}

static void the_reference_keeps_closed_forms(void **state)
{
    struct rig_scene rig;
    struct view_light open_sun = sun;
    open_sun.casts_no_shadow = true;
    open_stage(&rig, *state, &(struct stage){.has_pane = true});
    for (int i = 0; i < 4; i++) {
        bool is_lamp = i > 1, is_flat = i == 1, is_foggy = i == 3;
        struct view view = look_closely(is_lamp ? &lamp : &open_sun, 1);
        view.camera.ortho_height = is_flat ? 6 : 0;
        if (is_foggy)
            view.atmosphere.falloff_m = 0.8, view.atmosphere.base_m = -0.5;
        struct image image = shoot_color(*state, &rig, &view);
        for (int x = 1; x < WIDTH / 5; x += 10) {
            double way[3] = {0, 0, -1};
            double end = is_flat ? -wall_z : way_of(&view, x, 12, wall_z, way);
            double pane = 2 * x < WIDTH / 5 ? end * pane_z / wall_z : end;
            for (int k = 0; k < 3; k++) {
                double near = is_lamp ? lamp_scattered(&view, way, pane, k)
                                      : sun_scattered(&view, way, 0, pane, k);
                double far = is_lamp ? lamp_scattered(&view, way, end, k) - near
                                     : sun_scattered(&view, way, pane, end, k);
                expect(&image, x, 12, k, near + (pane < end ? stain[k] : 1) * far, 1e-5,
                       is_lamp ? "lamp of the reference" : "sun of the reference");
            }
        }
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

static void the_reference_dims_what_is_seen_and_lit(void **state)
{
    const double glow = 2;
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.wall_glow = glow});
    struct view view = look_closely(&lamp, 1), clear;
    view.atmosphere.falloff_m = 0.6;
    memset(view.atmosphere.color, 0, sizeof view.atmosphere.color);
    view.materials = white_wall;
    view.material_override_count = 1;
    clear = view;
    clear.atmosphere.density_per_m = 0;
    struct image image = shoot_color(*state, &rig, &view);
    struct image bare = shoot_color(*state, &rig, &clear);
    for (int x = 0; x < WIDTH / 5; x += 4) {
        double way[3], eye[3] = {0, 0, 0}, end = way_of(&view, x, 3, wall_z, way);
        const double wall[3] = {end * way[0], end * way[1], end * way[2]};
        double lit = (double)image_pixel_f32(&bare, x, 3)[1] - glow;
        double arrives = exp(-depth(&view.atmosphere, wall, lamp.position));
        expect(&image, x, 3, 1, exp(-depth(&view.atmosphere, eye, wall)) * (glow + lit * arrives),
               1e-5, "wall");
    }
    image_finish(&image);
    image_finish(&bare);
    rig_scene_finish(&rig, *state);
}

/* Beams through the stained pane, beside the shadow of a block, in both forms. */
static void all_forms_agree_with_the_reference(void **state)
{
    struct rig_scene rig;
    struct view_light lights[2] = {sun, lamp};
    lights[0].direction[2] = -0.8; /* from before the pane to behind it */
    lights[1].casts_no_shadow = false;
    open_stage(&rig, *state, &(struct stage){.has_pane = true, .has_block = true});
    struct view view = look(lights, 2), traced = look_closely(lights, 2);
    traced.width_px = WIDTH;
    traced.height_px = HEIGHT;
    traced.quality.atmosphere_samples = 24;
    traced.quality.samples = 1;
    view.quality.samples = 4;
    static const char *const names[2][FORMS] = {
        {"atmosphere_raster", "atmosphere_traced", "atmosphere_shadows"},
        {"atmosphere_bent_raster", "atmosphere_bent_traced", "atmosphere_bent_shadows"}};
    static const struct view_material_override bending[1] = {{.material = "Pane",
                                                              .has_roughness = true,
                                                              .has_ior = true,
                                                              .ior = 1.5f,
                                                              .has_thickness = true,
                                                              .thickness = 0.1f}};
    for (int bends = 0; bends < 2; bends++) {
        view.materials = traced.materials = bending;
        view.material_override_count = traced.material_override_count = (size_t)bends;
        struct image reference = shoot_color(*state, &rig, &traced);
        save_picture(&reference, bends ? "atmosphere_bent_reference" : "atmosphere_reference");
        for (int form = 0; form < FORMS; form++) {
            view.quality.shadows = forms[form];
            struct image image = shoot_color(*state, &rig, &view);
            save_picture(&image, names[bends][form]);
            double error = mean_error(&image, &reference);
            print_message("%s: mean error %.4f of the mean\n", names[bends][form], error);
            assert_true(error < 0.03);
            image_finish(&image);
        }
        image_finish(&reference);
    }
    rig_scene_finish(&rig, *state);
}

static double sum_of(const struct image *image)
{
    double sum = 0;
    for (int y = 0; y < image->height_px; y++)
        for (int x = 0; x < image->width_px; x++)
            for (int k = 0; k < 3; k++)
                sum += (double)image_pixel_f32(image, x, y)[k];
    return sum;
}

/* Rays go to the points of an area light, also out of the haze: both have noise. */
static void rays_find_soft_beams(void **state)
{
    const struct view_light panel = {.type = SCENE_LIGHT_RECT,
                                     .position = {0.3, 13, -4},
                                     .direction = {0, -1, 0},
                                     .color = {1, 0.9f, 0.7f},
                                     .intensity = 400,
                                     .width_m = 2,
                                     .height_m = 2};
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.has_pane = true, .has_block = true});
    struct view view = look(&panel, 1), traced = look_closely(&panel, 1);
    view.width_px = traced.width_px = WIDTH / 2;
    view.height_px = traced.height_px = HEIGHT / 2;
    traced.quality.area_samples = 64;
    traced.quality.atmosphere_samples = 128;
    struct image reference = shoot_color(*state, &rig, &traced);
    for (int form = 1; form < FORMS; form++) {
        view.quality.shadows = forms[form];
        struct image image = shoot_color(*state, &rig, &view);
        double error = mean_error(&image, &reference), ratio = sum_of(&image) / sum_of(&reference);
        print_message("soft beams: mean error %.4f of the mean, sum %.4f\n", error, ratio);
        assert_true(error < 0.1 && fabs(ratio - 1) < 0.02);
        image_finish(&image);
    }
    image_finish(&reference);
    rig_scene_finish(&rig, *state);
}

static void refused(struct renderer *renderer, const struct rig_scene *rig, const struct view *view,
                    const char *what)
{
    struct error err = {0};
    struct frame frame;
    assert_false(renderer_render(renderer, rig->key, view, &frame, &err));
    assert_int_equal(err.code, ERROR_INVALID_REQUEST);
    if (!strstr(err.message, what))
        fail_msg("'%s' does not name %s", err.message, what);
}

static void what_cannot_be_lit_is_refused(void **state)
{
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.has_block = true});
    struct view view = look(&sun, 1);
    view.quality.light_lists = VIEW_LIGHT_LISTS_LINKED;
    refused(*state, &rig, &view, "light_lists");
    view.quality.light_lists = VIEW_LIGHT_LISTS_AUTO;
    view.atmosphere.anisotropy = 1;
    refused(*state, &rig, &view, "anisotropy");
    rig_scene_finish(&rig, *state);
}

/* Haze of any thickness, near and far, gives numbers. */
static void extremes_are_sound(void **state)
{
    static const double densities[] = {1e-9, 1e-3, 1e3, 1e6}, falloffs[] = {0, 1e-6, 1, 1e9};
    struct view_light lights[] = {sun, lamp};
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.has_pane = true, .has_block = true});
    for (size_t i = 0; i < 4 * FORMS; i++)
        for (size_t k = 0; k < 4; k++) {
            struct view view = look(lights, 2);
            view.quality.shadows = forms[i / 4];
            view.width_px = 48;
            view.height_px = 27;
            view.atmosphere.density_per_m = densities[i % 4];
            view.atmosphere.falloff_m = falloffs[k];
            view.atmosphere.base_m = k == 2 ? 1e6 : k == 3 ? -1e6 : 0;
            view.atmosphere.anisotropy = k % 2 ? 0.95 : -0.95;
            lights[1].position[2] = k == 1 ? 0 : k == 2 ? -1e-9 : -2.5; /* where the eye is */
            lights[1].position[0] = lights[1].position[1] = k == 0 ? 0.4 : 0;
            view.camera.ortho_height = i % 4 == 3 && k == 3 ? 4 : 0;
            struct image image = shoot_color(*state, &rig, &view);
            assert_image_is_sound(&image, 1e30);
            image_finish(&image);
        }
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(even_haze_under_a_sun_is_exact),
        cmocka_unit_test(lamps_agree_with_quadrature),
        cmocka_unit_test(columns_beside_a_lamp_have_its_light),
        cmocka_unit_test(a_lamp_in_the_haze_glows_sharply),
        cmocka_unit_test(the_cone_of_a_spot_has_its_light),
        cmocka_unit_test(what_is_behind_is_dimmed),
        cmocka_unit_test(lamps_are_dimmed_on_their_way),
        cmocka_unit_test(layers_lie_in_the_haze),
        cmocka_unit_test(shadows_are_in_the_haze),
        cmocka_unit_test(light_from_all_around_is_scattered),
        cmocka_unit_test(tiles_and_parts_agree),
        cmocka_unit_test(nothing_else_is_built_anew),
        cmocka_unit_test(the_reference_keeps_closed_forms),
        cmocka_unit_test(the_reference_dims_what_is_seen_and_lit),
        cmocka_unit_test(all_forms_agree_with_the_reference),
        cmocka_unit_test(rays_find_soft_beams),
        cmocka_unit_test(what_cannot_be_lit_is_refused),
        cmocka_unit_test(extremes_are_sound),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
