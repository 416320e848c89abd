/* SPDX-License-Identifier: MIT */
/* Kept depths of density grids towards lights: against the exact sums along the ways, and in
 * pictures against those of frames without room for them. They stand while the camera moves, and
 * nothing is left of what moved. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "renderer/base/matrix.h"
#include "renderer/frame/renderer_internal.h"
#include "renderer/scene/smoke_lattice.h"
#include "tests/support/boxes.h"
#include "tests/support/image_checks.h"
#include "tests/support/light_scene.h"

enum { WIDTH = 128, HEIGHT = 72, LIGHTS = 4, GRIDS = 2 };
static const uint32_t sizes[GRIDS][3] = {{20, 14, 10}, {6, 8, 5}};

struct stage {
    uint64_t seed;
    bool is_coloured; /* the grids dim colours differently */
};

static void add_grid(struct glb_builder *builder, const struct stage *stage, int i, uint64_t *seed)
{
    static const double lows[GRIDS][3] = {{-1, -0.7, -0.5}, {-0.6, -0.5, -0.2}};
    size_t count = (size_t)sizes[i][0] * sizes[i][1] * sizes[i][2];
    float *values = malloc(count * sizeof *values);
    assert_non_null(values);
    for (size_t k = 0; k < count; k++)
        values[k] = (float)fmax(random_uniform(seed, -0.3, 1), 0);
    struct glb_grid_desc desc = {.name = i ? "Small" : "Large",
                                 .size = {sizes[i][0], sizes[i][1], sizes[i][2]},
                                 .values = values,
                                 .density = 1.5,
                                 .extinction = {1, 0.8, 0.5},
                                 .color = {0.9, 0.8, 0.7},
                                 .anisotropy = i ? -0.2 : 0.4};
    for (int k = 0; k < 3; k++) {
        desc.low[k] = lows[i][k];
        desc.high[k] = -lows[i][k];
        if (stage->is_coloured && i)
            desc.extinction[k] = 0.4 + 0.5 * k;
    }
    struct glb_node_desc node = {.name = desc.name,
                                 .grid = glb_builder_add_grid(builder, &desc),
                                 .translation = {0.3 * i, 0.2 * i, -2.6 - 0.2 * i},
                                 .scale = {1, 1 + 0.3 * i, 1}};
    glb_node_rotate(&node, (const double[]){0.6, 0, 0.8}, random_uniform(seed, 10, 40));
    glb_builder_add_node(builder, &node);
    free(values);
}

static void open_stage(struct rig_scene *rig, struct renderer *renderer, const struct stage *stage)
{
    static const struct glb_material_desc dull = {
        .name = "Wall", .base_color = {0.5f, 0.5f, 0.5f, 1}, .roughness = 1};
    struct error err = {0};
    uint64_t seed = stage->seed;
    struct glb_builder *builder = glb_builder_create("Smoke", &err);
    assert_non_null(builder);
    builder_add_box(builder, &dull, (const double[]){-4, -4, -5}, (const double[]){4, 4, -4.8});
    for (int i = 0; i < GRIDS; i++)
        add_grid(builder, stage, i, &seed);
    if (!rig_scene_from_builder(rig, renderer, "smoke", builder, &err))
        fail_msg("%s", err.message);
}

/* A spot, a lamp with an end, one in the smoke, and a sun. */
static void place_lights(struct view_light lights[LIGHTS], uint64_t seed)
{
    for (int i = 0; i < LIGHTS; i++)
        lights[i] = (struct view_light){
            .type = SCENE_LIGHT_POINT,
            .position = {random_uniform(&seed, -2, 2), 1.5, random_uniform(&seed, -3, -1)},
            .direction = {0.2, -1, -0.3},
            .color = {1, 0.8f, 0.6f},
            .intensity = 8};
    lights[0].type = SCENE_LIGHT_SPOT;
    lights[0].inner_cone_deg = 20;
    lights[0].outer_cone_deg = 30;
    lights[1].range = 3;
    memcpy(lights[2].position, (const double[]){0.1, 0.05, -2.5}, sizeof lights[2].position);
    lights[2].intensity = 1;
    lights[3].type = SCENE_LIGHT_DIRECTIONAL;
    lights[3].intensity = 3;
}

static struct view look(const struct view_light lights[LIGHTS])
{
    return (struct view){
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .target = {0, 0, -1}, .fov_y_deg = 40},
        .studio = VIEW_STUDIO_OFF,
        .lights = lights,
        .light_count = LIGHTS,
        .quality = {.samples = 1, .shadows = SHADOWS_DEEP, .shadow_resolution = 256},
    };
}

/* A picture; whether it found depths anew. */
static struct image draw(struct renderer *renderer, const struct rig_scene *rig,
                         const struct view *view, bool *finds)
{
    struct frame frame;
    shoot(renderer, rig, view, &frame);
    *finds = report_has_pass(&frame.report, "smoke.depths", "lattice");
    struct image image = frame.outputs[VIEW_OUTPUT_COLOR];
    frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){.pixels = NULL};
    frame_finish(&frame);
    return image;
}

/* ---- against the sums ---- */

static double depth_of(const struct scene_state *state, const struct state_light *light,
                       const double point[3], int channel)
{
    double way[3], depth = 0;
    bool is_sun = light->type == SCENE_LIGHT_DIRECTIONAL;
    for (int k = 0; k < 3; k++)
        way[k] = is_sun ? -10 * light->direction[k] : light->position[k] - point[k];
    for (size_t i = 0; i < state->grid_count; i++) {
        const struct state_grid *grid = &state->grids[i];
        double from[3], step[3], sum = 0;
        struct density_walk walk;
        struct density_piece piece;
        mat4_transform_point(grid->voxel_from_world, point, from);
        mat4_transform_direction(grid->voxel_from_world, way, step);
        if (!density_walk_begin(&walk, &grid->values, from, step, 0, 1))
            continue;
        while (density_walk_next(&walk, &piece))
            sum += density_walk_integrate(&walk, piece.from, piece.to);
        depth += grid->sigma[channel] * sum * vec3_length(way);
    }
    return depth;
}

static bool shines(const struct state_light *light, const double point[3])
{
    double from[3];
    vec3_sub(point, light->position, from);
    double away = vec3_length(from);
    return light->type == SCENE_LIGHT_DIRECTIONAL ||
           ((light->type != SCENE_LIGHT_SPOT ||
             vec3_dot(from, light->direction) > away * cos((double)light->outer_cone_rad)) &&
            (!(light->range > 0) || away < (double)light->range));
}

struct kept { /* on the device */
    uint16_t (*pairs)[2];
    struct smoke_lattice lattice;
};

/* Of a half that is finite and not negative (IEEE 754 binary16). */
static double half_value(uint16_t half)
{
    int exponent = half >> 10, fraction = half & 1023;
    return exponent ? ldexp(1024 + fraction, exponent - 25) : ldexp(fraction, -24);
}

/* place: in steps of the lattice of a grid. */
static double look_up(const struct kept *kept, const struct scene_state *state, size_t grid,
                      size_t light, int channel, const double place[3])
{
    size_t first =
        (light * (size_t)kept->lattice.channels + (size_t)channel) * (size_t)kept->lattice.points;
    uint32_t steps[3];
    double sum = 0;
    for (size_t i = 0; i < grid; i++) {
        smoke_lattice_steps(&state->grids[i], steps);
        first += ((size_t)steps[0] + 1) * (steps[1] + 1) * (steps[2] + 1);
    }
    smoke_lattice_steps(&state->grids[grid], steps);
    for (int corner = 0; corner < 8; corner++) {
        size_t at[3];
        double weight = 1;
        for (int k = 0; k < 3; k++) {
            double low = fmin(floor(place[k]), steps[k] - 1.0), share = place[k] - low;
            at[k] = (size_t)low + (corner >> k & 1);
            weight *= corner >> k & 1 ? share : 1 - share;
        }
        size_t x = at[0] < steps[0] ? at[0] : at[0] - 1; /* the last is beside the one before */
        size_t index = x + (steps[0] + 1) * (at[1] + (size_t)(steps[1] + 1) * at[2]);
        if (weight > 0)
            sum += weight * half_value(kept->pairs[first + index][at[0] - x]);
    }
    return sum;
}

/* At points of the lattice, and between them: sums of the differences of transmittance. */
struct differences {
    double at_points, between, squares, most;
    int count;
};

static void compare(const struct kept *kept, const struct scene_state *state, uint64_t *seed,
                    struct differences *d)
{
    size_t grid = random_next(seed) % state->grid_count;
    size_t light = random_next(seed) % state->light_count;
    int channel = (int)(random_next(seed) % (uint64_t)kept->lattice.channels);
    double places[2][3], points[2][3];
    uint32_t steps[3];
    smoke_lattice_steps(&state->grids[grid], steps);
    for (int k = 0; k < 3; k++) {
        places[0][k] = (double)(random_next(seed) % (steps[k] + 1));
        places[1][k] = random_uniform(seed, 0, steps[k]);
    }
    for (int i = 0; i < 2; i++) {
        double voxel[3];
        for (int k = 0; k < 3; k++)
            voxel[k] = places[i][k] * state->grids[grid].values.size[k] / steps[k];
        mat4_transform_point(state->grids[grid].world_from_voxel, voxel, points[i]);
        if (!shines(&state->lights[light], points[i]))
            return;
    }
    for (int i = 0; i < 2; i++) {
        double found = look_up(kept, state, grid, light, channel, places[i]);
        double exact = depth_of(state, &state->lights[light], points[i], channel);
        double off = fabs(exp(-found) - exp(-exact));
        if (i == 0) {
            d->at_points = fmax(d->at_points, off);
            continue;
        }
        d->between += off;
        d->squares += off * off;
        d->most = fmax(d->most, off);
        d->count++;
    }
}

static void expect_sums(struct renderer *renderer, const struct stage *stage, int channels)
{
    enum { LOOKS = 20000 };
    struct rig_scene rig;
    struct view_light lights[LIGHTS];
    struct scene_state state = {0};
    struct error err = {0};
    struct differences d = {.count = 0};
    uint64_t seed = stage->seed;
    bool finds;
    open_stage(&rig, renderer, stage);
    place_lights(lights, stage->seed);
    struct view view = look(lights);
    struct image image = draw(renderer, &rig, &view, &finds);
    assert_true(finds);
    image_finish(&image);
    if (!scene_state_init(&state, &rig.imported.scene, &view, &err))
        fail_msg("%s", err.message);
    struct kept kept = {.lattice = smoke_lattice_of(&state)};
    assert_int_equal(kept.lattice.channels, channels);
    uint64_t bytes = smoke_lattice_bytes(&state);
    kept.pairs = malloc(bytes);
    assert_non_null(kept.pairs);
    gl_buffer_read(&renderer->frames.smoke.depths.depths, 0, bytes, kept.pairs);
    for (int i = 0; i < LOOKS; i++)
        compare(&kept, &state, &seed, &d);
    double mean = d.between / d.count, rms = sqrt(d.squares / d.count);
    print_message("transmittance of %d places: at points within %.1e; between them %.5f off in the "
                  "mean, %.5f root mean square, %.3f at most\n",
                  d.count, d.at_points, mean, rms, d.most);
    assert_int_in_range(d.count, LOOKS / 4, LOOKS);
    assert_true(d.at_points < 3e-4);
    assert_true(mean < 0.003 && rms < 0.008);
    free(kept.pairs);
    scene_state_finish(&state);
    rig_scene_finish(&rig, renderer);
}

static void depths_are_the_sums_along_the_ways(void **state)
{
    (void)state;
    struct renderer *renderer = render_rig_create();
    expect_sums(renderer, &(struct stage){.seed = 31}, 1);
    expect_sums(renderer, &(struct stage){.seed = 57, .is_coloured = true}, 3);
    renderer_destroy(renderer);
}

/* ---- in pictures ---- */

enum { KEPT, CROSSED, CROSSED_FINELY, FORMS };

/* A device with little memory crosses the grids at each node of each picture. */
static struct image draw_form(int form, const struct stage *stage, const struct view *from)
{
    struct renderer *renderer = render_rig_create_as(&(struct renderer_desc){
        .is_strict = true, .gpu_budget_bytes = form == KEPT ? 1 << 30 : 40 << 20});
    struct rig_scene rig;
    bool finds;
    struct view view = *from;
    if (form == CROSSED_FINELY)
        view.quality.atmosphere_samples = 256;
    open_stage(&rig, renderer, stage);
    struct image image = draw(renderer, &rig, &view, &finds);
    assert_int_equal(finds, form == KEPT);
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
    return image;
}

/* What kept depths add to the error is small beside that of the nodes, which four times as many of
 * them along each axis show. */
static void kept_depths_are_finer_than_nodes(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        const struct stage stage = {.seed = 100 + (uint64_t)i, .is_coloured = i % 2};
        struct image images[FORMS];
        struct view_light lights[LIGHTS];
        place_lights(lights, stage.seed);
        struct view view = look(lights);
        view.atmosphere =
            (struct view_atmosphere){.density_per_m = i > 1 ? 0.05 : 0, .color = {1, 1, 1}};
        for (int k = 0; k < FORMS; k++)
            images[k] = draw_form(k, &stage, &view);
        double kept = mean_error(&images[KEPT], &images[CROSSED]);
        double nodes = mean_error(&images[CROSSED], &images[CROSSED_FINELY]);
        print_message("kept depths %.5f of the mean off, nodes %.5f\n", kept, nodes);
        if (i == 0) {
            save_picture(&images[KEPT], "smoke_depths_kept");
            save_picture(&images[CROSSED], "smoke_depths_crossed");
        }
        assert_true(kept > 0 && kept < 0.001 && kept < 0.5 * nodes);
        for (int k = 0; k < FORMS; k++)
            image_finish(&images[k]);
    }
}

/* ---- what stands ---- */

enum { STEPS = 10 };

struct scenario {
    struct view_light lights[LIGHTS];
    struct view_node_override moved;
    struct view_grid_override thin;
    double plane[1][4];
    struct view_cut spared;
    struct view view;
};

/* The view of a step, which has all changes up to it; whether depths are found in it. */
static bool take_step(struct scenario *s, int step)
{
    switch (step) {
    case 0:
        s->view = look(s->lights);
        return true;
    case 1:
        s->view.camera.eye[0] = 0.3;
        s->view.camera.eye[1] = 0.2;
        return false;
    case 2:
        s->lights[2].position[0] += 0.2;
        return true;
    case 3:
        s->lights[0].outer_cone_deg = 40;
        return true;
    case 4:
        s->lights[1].color[0] = 0.2f;
        return false;
    case 5:
        mat4_identity(s->moved.matrix);
        s->moved.matrix[12] = -0.2;
        s->moved.matrix[14] = -2.5;
        s->view.nodes = &s->moved;
        s->view.node_override_count = 1;
        return true;
    case 6:
        s->view.grids = &s->thin;
        s->view.grid_override_count = 1;
        return true;
    case 7:
        s->view.clip_planes = s->plane;
        s->view.clip_plane_count = 1;
        return true;
    case 8:
        s->view.cuts = &s->spared;
        return true;
    default: /* fewer nodes in smoke than points: they are crossed */
        s->view.camera.eye[2] = 12;
        return false;
    }
}

static void begin_scenario(struct scenario *s, const struct stage *stage)
{
    *s = (struct scenario){
        .moved = {.node = "Small", .has_matrix = true},
        .thin = {.grid = "Large", .has_density = true, .density = 0.7f},
        .plane = {{0.8, 0.6, 0, 0.1}},
        .spared = {.spares_shadows = true},
    };
    place_lights(s->lights, stage->seed);
}

/* A picture has the bits of one by a renderer that has drawn nothing before it. */
static void depths_stand_until_what_they_are_of_moves(void **state)
{
    (void)state;
    const struct stage stage = {.seed = 77};
    struct image images[STEPS];
    struct scenario s;
    struct rig_scene rig;
    bool finds;
    struct renderer *renderer = render_rig_create();
    open_stage(&rig, renderer, &stage);
    begin_scenario(&s, &stage);
    for (int i = 0; i < STEPS; i++) {
        bool is_due = take_step(&s, i);
        images[i] = draw(renderer, &rig, &s.view, &finds);
        if (finds != is_due)
            fail_msg("step %d: depths were%s found", i, finds ? "" : " not");
    }
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
    begin_scenario(&s, &stage);
    for (int i = 0; i < STEPS; i++) {
        take_step(&s, i);
        renderer = render_rig_create();
        open_stage(&rig, renderer, &stage);
        struct image anew = draw(renderer, &rig, &s.view, &finds);
        assert_int_equal(finds, i + 1 < STEPS);
        assert_same_bits(&images[i], &anew);
        image_finish(&anew);
        image_finish(&images[i]);
        rig_scene_finish(&rig, renderer);
        renderer_destroy(renderer);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(depths_are_the_sums_along_the_ways),
        cmocka_unit_test(kept_depths_are_finer_than_nodes),
        cmocka_unit_test(depths_stand_until_what_they_are_of_moves),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
