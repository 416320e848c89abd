/* SPDX-License-Identifier: MIT */
/* A hilly field under a spot light, rasterised at two sizes and ray traced. */
#include "renderer/frame/calibrate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/processors.h"
#include "renderer/base/wall_clock.h"
#include "renderer/cost/workload.h"
#include "renderer/frame/renderer_internal.h"
#include "renderer/scene/blob_writer.h"

enum { FIELD_SIDE = 48, FIELD_CORNERS = FIELD_SIDE + 1 };
enum { ROUNDS_LEAST = 3 };
static const double TIMED_MS = 200, TIMED_MS_MAX = 600;
static const char KEY[] = "calibration";
/* The field has one plain material, and its programs are composed for no more: pictures of the
 * shared scenes took so many times longer than it says (medians of vitrail-bench forecast). */
static const double SHADE_OF_SCENES = 2.13, TRACE_OF_SCENES = 1.32;
/* What is measured of the same processors differs by their speed, and by its own error: over ten
 * starts of one machine the speeds went from 0.76 to 1.26 of their mean, those of maps from 0.63 to
 * 1.24. So the ratio of two of them counts for its root. */
static const double OWN_SHARE = 0.5;

/* ---- the scene ---- */

static void set_corner(int row, int column, float position[3], float normal[3])
{
    double x = 8. * column / FIELD_SIDE - 4, z = 8. * row / FIELD_SIDE - 4;
    double slope_x = 0.6 * cos(2 * x) * cos(2 * z), slope_z = -0.6 * sin(2 * x) * sin(2 * z);
    double length = sqrt(1 + slope_x * slope_x + slope_z * slope_z);
    position[0] = (float)x;
    position[1] = (float)(0.3 * sin(2 * x) * cos(2 * z));
    position[2] = (float)z;
    normal[0] = (float)(-slope_x / length);
    normal[1] = (float)(1 / length);
    normal[2] = (float)(-slope_z / length);
}

static void set_square(int row, int column, uint32_t index[6])
{
    uint32_t first = (uint32_t)(row * FIELD_CORNERS + column);
    uint32_t corners[4] = {first, first + FIELD_CORNERS, first + 1, first + FIELD_CORNERS + 1};
    memcpy(index, (uint32_t[]){corners[0], corners[1], corners[2]}, 3 * sizeof *index);
    memcpy(index + 3, (uint32_t[]){corners[2], corners[1], corners[3]}, 3 * sizeof *index);
}

static bool add_field(struct blob_writer *writer, struct error *err)
{
    enum { CORNERS = FIELD_CORNERS * FIELD_CORNERS, INDICES = FIELD_SIDE * FIELD_SIDE * 6 };
    float *positions = blob_writer_append(writer, SCENE_POSITIONS, CORNERS, err);
    float *normals = blob_writer_append(writer, SCENE_NORMALS, CORNERS, err);
    uint32_t *indices = blob_writer_append(writer, SCENE_INDICES, INDICES, err);
    if (!positions || !normals || !indices)
        return false;
    for (int i = 0; i < CORNERS; i++)
        set_corner(i / FIELD_CORNERS, i % FIELD_CORNERS, positions + 3 * (size_t)i,
                   normals + 3 * (size_t)i);
    for (int i = 0; i < FIELD_SIDE * FIELD_SIDE; i++)
        set_square(i / FIELD_SIDE, i % FIELD_SIDE, indices + 6 * (size_t)i);
    return true;
}

static void set_identity(double matrix[16])
{
    for (int i = 0; i < 16; i++)
        matrix[i] = i % 5 == 0;
}

static bool add_records(struct blob_writer *writer, struct error *err)
{
    struct scene_node *node = blob_writer_append(writer, SCENE_NODES, 1, err);
    struct scene_mesh *mesh = blob_writer_append(writer, SCENE_MESHES, 1, err);
    struct scene_primitive *primitive = blob_writer_append(writer, SCENE_PRIMITIVES, 1, err);
    struct scene_material *material = blob_writer_append(writer, SCENE_MATERIALS, 1, err);
    if (!node || !mesh || !primitive || !material)
        return false;
    *node = (struct scene_node){.parent = -1, .camera = -1, .light = -1, .grid = -1};
    set_identity(node->local_matrix);
    set_identity(node->world_matrix);
    *mesh = (struct scene_mesh){.primitive_count = 1};
    *primitive = (struct scene_primitive){.topology = SCENE_TRIANGLES,
                                          .index_count = FIELD_SIDE * FIELD_SIDE * 6,
                                          .vertex_count = FIELD_CORNERS * FIELD_CORNERS,
                                          .flags = SCENE_PRIMITIVE_HAS_NORMALS,
                                          .bounds_min = {-4, -0.3f, -4},
                                          .bounds_max = {4, 0.3f, 4}};
    *material = (struct scene_material){.base_color = {0.8f, 0.8f, 0.8f, 1},
                                        .roughness = 0.7f,
                                        .normal_scale = 1,
                                        .occlusion_strength = 1,
                                        .alpha_cutoff = 0.5f,
                                        .ior = 1.5f,
                                        .attenuation_color = {1, 1, 1},
                                        .edge_exponent = 1,
                                        .edge_color = {1, 1, 1},
                                        .flags = SCENE_MATERIAL_DOUBLE_SIDED};
    for (int i = 0; i < SCENE_TEXTURE_SLOT_COUNT; i++)
        material->textures[i] =
            (struct scene_texture_ref){.texture = -1, .uv_transform = {1, 0, 0, 0, 1, 0}};
    return true;
}

static bool make_scene(void **blob, struct scene *scene, struct error *err)
{
    struct blob_writer writer = {0};
    const struct scene_header header = {.bounds_min = {-4, -0.3, -4},
                                        .bounds_max = {4, 0.3, 4},
                                        .triangle_count = FIELD_SIDE * FIELD_SIDE * 2,
                                        .default_camera_node = -1};
    size_t size = 0;
    bool ok = blob_writer_init(&writer, 16 << 20, err) && add_records(&writer, err) &&
              add_field(&writer, err) &&
              blob_writer_write(&writer, &header, false, blob, &size, err) &&
              scene_open(scene, *blob, size, err);
    blob_writer_finish(&writer);
    return ok;
}

/* ---- frames ---- */

enum kind { SMALL, LARGE, TRACED, KINDS };

struct clocks { /* ms of one frame */
    double wall, processor;
};

struct timing { /* the least so far */
    struct clocks cold[KINDS], warm[KINDS];
};

/* The processor time of the whole process, with the device's work on a software rasteriser. */
static double processor_now_ms(void)
{
    return clock_now_ms(CLOCK_PROCESS_CPUTIME_ID);
}

static struct view make_view(enum kind kind, const struct view_light *light)
{
    return (struct view){
        .width_px = kind == SMALL ? 32 : 256,
        .height_px = kind == SMALL ? 18 : 144,
        .outputs = 1u << VIEW_OUTPUT_COLOR,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 4, 3}, .fov_y_deg = 50},
        .lights = light,
        .light_count = 1,
        .quality = {.shadows = kind == TRACED ? SHADOWS_RAYTRACED : SHADOWS_RASTER_DEFAULT,
                    .samples = 1,
                    .shadow_resolution = 512},
    };
}

static void keep_least(double *least, double ms)
{
    if (*least <= 0 || ms < *least)
        *least = ms;
}

/* A cold and a warm frame of each kind. */
static bool time_round(struct renderer *renderer, const struct view_light *light,
                       struct timing *timing, struct error *err)
{
    for (int kind = 0; kind < KINDS; kind++) {
        struct view view = make_view((enum kind)kind, light);
        renderer_drop_structures(renderer, KEY);
        for (int warm = 0; warm < 2; warm++) {
            struct frame frame;
            view.camera.eye[0] += 0.02 * warm; /* only shadows are kept where the camera moves */
            struct clocks *least = warm ? &timing->warm[kind] : &timing->cold[kind];
            double wall_before = wall_ms(), processor_before = processor_now_ms();
            if (!renderer_render(renderer, KEY, &view, &frame, err))
                return false;
            keep_least(&least->wall, wall_ms() - wall_before);
            keep_least(&least->processor, processor_now_ms() - processor_before);
            frame_finish(&frame);
        }
    }
    return true;
}

static bool count_work(const struct scene *scene, enum kind kind, const struct view_light *light,
                       struct workload *workload, struct error *err)
{
    struct view view = make_view(kind, light);
    struct scene_state state = {0};
    struct camera camera;
    bool ok = scene_state_init(&state, scene, &view, err) &&
              camera_resolve(&camera, &view, &state, err) &&
              workload_measure(
                  workload,
                  &(struct workload_desc){.view = &view, .state = &state, .camera = &camera}, err);
    scene_state_finish(&state);
    return ok;
}

/* Threads never share all of the work. The power is chosen: 1.7 times as fast on 2 processors, 8
 * times on 16. */
double calibrate_alone_ms(double wall_ms, double processor_ms, bool is_on_processors)
{
    double processors = processors_usable();
    double spread_ms = processor_ms / pow(processors, 0.75);
    return is_on_processors ? fmin(wall_ms, spread_ms) : wall_ms;
}

/* The measured time over that of the machine of the fit. A clock may say 0. */
static double over(double ms, double forecast_ms)
{
    return fmax(ms, 1e-4) / forecast_ms;
}

/* Speeds of one kind of processor: drawn to the mean of what is shaded and traced. */
static void draw_together(struct device_speed *speed)
{
    const double mean = sqrt(speed->shade * speed->trace);
    double *const own[] = {&speed->shade, &speed->maps, &speed->trace};
    for (size_t i = 0; i < sizeof own / sizeof *own; i++)
        *own[i] = mean * pow(*own[i] / mean, OWN_SHARE);
}

static bool compare(const struct scene *scene, const struct view_light *light,
                    const struct timing *timing, bool is_software, struct device_speed *speed,
                    struct error *err)
{
    struct workload small, large;
    const struct forecast_setting setting = {
        .samples = 1, .shadow_resolution = 512, .shadow_taps = 4, .has_shadows = true};
    double warm[KINDS], cold[KINDS];
    for (int kind = 0; kind < KINDS; kind++) {
        const struct clocks *first = &timing->cold[kind], *next = &timing->warm[kind];
        bool is_ours = is_software || kind == TRACED;
        cold[kind] = calibrate_alone_ms(first->wall, first->processor, is_ours);
        warm[kind] = calibrate_alone_ms(next->wall, next->processor, is_ours);
    }
    if (!count_work(scene, SMALL, light, &small, err) ||
        !count_work(scene, LARGE, light, &large, err))
        return false;
    speed->shade =
        SHADE_OF_SCENES * over(warm[LARGE] - warm[SMALL], forecast_shade_ms(&large, &setting) -
                                                              forecast_shade_ms(&small, &setting));
    speed->frame_ms = fmax(
        warm[SMALL] - speed->shade / SHADE_OF_SCENES * forecast_shade_ms(&small, &setting), 1e-3);
    speed->maps = over(cold[LARGE] - warm[LARGE], forecast_maps_ms(&large, &setting));
    speed->trace = TRACE_OF_SCENES * over(warm[TRACED], forecast_trace_ms(&large, &setting));
    speed->build = over(cold[TRACED] - warm[TRACED], forecast_build_ms(&large));
    if (is_software)
        draw_together(speed);
    return true;
}

static bool measure(struct renderer *renderer, const struct scene *scene,
                    struct calibration *calibration, struct error *err)
{
    const struct view_light light = {.type = SCENE_LIGHT_SPOT,
                                     .position = {2, 5, 1},
                                     .direction = {-0.3, -1, -0.1},
                                     .color = {1, 1, 1},
                                     .intensity = 100,
                                     .inner_cone_deg = 40,
                                     .outer_cone_deg = 45};
    struct timing timing, unused;
    struct renderer_info info;
    memset(&timing, 0, sizeof timing);
    memset(&unused, 0, sizeof unused);
    renderer_get_info(renderer, &info);
    if (!renderer_attach_scene(renderer, &(struct renderer_scene_desc){.key = KEY, .scene = scene},
                               err))
        return false;
    bool ok = time_round(renderer, &light, &unused, err); /* compiles */
    double begin_ms = wall_ms(), elapsed_ms = 0;
    while (ok && (elapsed_ms < TIMED_MS || calibration->rounds < ROUNDS_LEAST) &&
           elapsed_ms < TIMED_MS_MAX) {
        ok = time_round(renderer, &light, &timing, err);
        calibration->rounds++;
        elapsed_ms = wall_ms() - begin_ms;
    }
    renderer_detach_scene(renderer, KEY);
    return ok && compare(scene, &light, &timing, info.is_software, &calibration->speed, err);
}

bool renderer_calibrate(struct renderer *renderer, struct calibration *calibration,
                        struct error *err)
{
    double begin_ms = wall_ms();
    void *blob = NULL;
    struct scene scene;
    *calibration = (struct calibration){.rounds = 0};
    renderer->is_measuring = true;
    bool ok = make_scene(&blob, &scene, err) && measure(renderer, &scene, calibration, err);
    renderer->is_measuring = false;
    free(blob);
    calibration->elapsed_ms = wall_ms() - begin_ms;
    return ok || error_wrap(err, "measuring the device");
}
