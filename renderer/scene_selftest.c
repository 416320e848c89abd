/* SPDX-License-Identifier: MIT */
/* A scene whose pictures are known, through the ordinary renderer. */
#include "renderer/scene_selftest.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/scene/blob_writer.h"
#include "renderer/scene/matrix.h"

enum {
    SIDE_PX = 16,
    FEW = 10,
    MANY = 150, /* more than storages grow by when they are filled a little beyond their size */
    FEWER = 20,
    SHEETS = 4,
    SHEET_CORNERS = 4,
    SHEET_INDICES = 6,
    BLOB_BYTES_MAX = 1 << 20,
};

static const char key[] = "selftest000000000000000000000000"
                          "00000000000000000000000000000000";
static const double half_view_m = 0.5;
static const double albedo = 0.8;

/* Parallelograms corner + s u + t v. Of glass: what it lets pass is its colour. */
struct sheet {
    float corner[3], u[3], v[3];
    float color[3];
    float transmission;
};

/* The wall stands between the odd lights and what is in view; light and sight pass both panes. */
static const struct sheet sheets[SHEETS] = {
    {{-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, {0.8f, 0.8f, 0.8f}, 0},
    {{-5, 1, 5}, {10, 0, 0}, {0, 0, -10}, {1, 0.5f, 0.25f}, 1},
    {{-5, 1.5f, 5}, {10, 0, 0}, {0, 0, -10}, {0.5f, 0.8f, 1}, 1},
    {{1.5f, 0, -4}, {0, 0, 8}, {0, 2.75f, 0}, {0.8f, 0.8f, 0.8f}, 0},
};

/* ---- the scene ---- */

static bool add_material(struct blob_writer *writer, const struct sheet *sheet, struct error *err)
{
    struct scene_material *material = blob_writer_append(writer, SCENE_MATERIALS, 1, err);
    if (!material)
        return false;
    *material = (struct scene_material){
        .base_color = {sheet->color[0], sheet->color[1], sheet->color[2], 1},
        .roughness = sheet->transmission > 0 ? 0 : 1,
        .normal_scale = 1,
        .occlusion_strength = 1,
        .alpha_cutoff = 0.5f,
        .transmission = sheet->transmission,
        .ior = 1, /* nothing is reflected */
        .attenuation_color = {1, 1, 1},
        .edge_color = {1, 1, 1},
        .edge_exponent = 1,
        .flags = SCENE_MATERIAL_DOUBLE_SIDED,
    };
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        material->textures[slot] =
            (struct scene_texture_ref){.texture = -1, .uv_transform = {1, 0, 0, 0, 1, 0}};
    return true;
}

static bool add_corners(struct blob_writer *writer, const struct sheet *sheet, struct error *err)
{
    float(*positions)[3] = blob_writer_append(writer, SCENE_POSITIONS, SHEET_CORNERS, err);
    float(*normals)[3] = blob_writer_append(writer, SCENE_NORMALS, SHEET_CORNERS, err);
    if (!positions || !normals)
        return false;
    double u[3] = {sheet->u[0], sheet->u[1], sheet->u[2]};
    double v[3] = {sheet->v[0], sheet->v[1], sheet->v[2]}, normal[3];
    vec3_cross(u, v, normal);
    vec3_normalize(normal);
    for (int i = 0; i < SHEET_CORNERS; i++) {
        float s = (float)(i & 1), t = (float)(i >> 1);
        for (int k = 0; k < 3; k++) {
            positions[i][k] = sheet->corner[k] + s * sheet->u[k] + t * sheet->v[k];
            normals[i][k] = (float)normal[k];
        }
    }
    return true;
}

static bool add_primitive(struct blob_writer *writer, uint32_t index, struct error *err)
{
    static const uint32_t order[SHEET_INDICES] = {0, 1, 2, 2, 1, 3};
    const struct sheet *sheet = &sheets[index];
    uint32_t *indices = blob_writer_append(writer, SCENE_INDICES, SHEET_INDICES, err);
    struct scene_primitive *primitive = blob_writer_append(writer, SCENE_PRIMITIVES, 1, err);
    struct scene_mesh *mesh = blob_writer_append(writer, SCENE_MESHES, 1, err);
    if (!indices || !primitive || !mesh)
        return false;
    for (int i = 0; i < SHEET_INDICES; i++)
        indices[i] = order[i];
    *primitive = (struct scene_primitive){.material = index,
                                          .topology = SCENE_TRIANGLES,
                                          .first_index = SHEET_INDICES * index,
                                          .index_count = SHEET_INDICES,
                                          .first_vertex = SHEET_CORNERS * index,
                                          .vertex_count = SHEET_CORNERS,
                                          .flags = SCENE_PRIMITIVE_HAS_NORMALS};
    for (int k = 0; k < 3; k++) {
        float end = sheet->corner[k] + sheet->u[k] + sheet->v[k];
        primitive->bounds_min[k] = fminf(sheet->corner[k], end);
        primitive->bounds_max[k] = fmaxf(sheet->corner[k], end);
    }
    *mesh = (struct scene_mesh){.first_primitive = index, .primitive_count = 1};
    return true;
}

static bool add_sheet(struct blob_writer *writer, uint32_t index, struct error *err)
{
    struct scene_node *node = blob_writer_append(writer, SCENE_NODES, 1, err);
    if (!node)
        return false;
    *node = (struct scene_node){
        .parent = -1, .mesh = (int32_t)index, .camera = -1, .light = -1, .source_index = index};
    for (int i = 0; i < 4; i++)
        node->local_matrix[5 * i] = node->world_matrix[5 * i] = 1;
    return add_material(writer, &sheets[index], err) && add_corners(writer, &sheets[index], err) &&
           add_primitive(writer, index, err);
}

static void *make_scene(struct scene *scene, struct error *err)
{
    struct blob_writer writer = {0};
    struct scene_header header = {.bounds_min = {-5, 0, -5},
                                  .bounds_max = {5, 2.75, 5},
                                  .triangle_count = 2ull * SHEETS,
                                  .default_camera_node = -1};
    void *blob = NULL;
    size_t size_bytes = 0;
    const struct sheet plain = {.color = {1, 1, 1}};
    bool ok = blob_writer_init(&writer, BLOB_BYTES_MAX, err);
    for (uint32_t i = 0; ok && i < SHEETS; i++)
        ok = add_sheet(&writer, i, err);
    ok = ok && add_material(&writer, &plain, err) && /* the last is the default material */
         blob_writer_write(&writer, &header, false, &blob, &size_bytes, err) &&
         scene_open(scene, blob, size_bytes, err);
    blob_writer_finish(&writer);
    if (ok)
        return blob;
    free(blob);
    return NULL;
}

/* ---- light and sight ---- */

/* Even lights shine down on what is in view, odd ones stand behind the wall. */
static struct view_light light_of(int index, int count)
{
    double angle = 2.4 * index; /* spread around, no two alike */
    return (struct view_light){
        .type = SCENE_LIGHT_SPOT,
        .position = {(index % 2 ? 2.5 : 0) + 0.4 * cos(angle), 3 + 0.125 * (index % 5),
                     0.4 * sin(angle)},
        .direction = {index % 2 ? -0.5 : 0, -1, 0},
        .color = {1, 0.75f, 0.5f},
        .intensity = 50.0f * (float)(1 + index % 7) / (float)count,
        .inner_cone_deg = 50,
        .outer_cone_deg = 60,
    };
}

/* What a pixel's ray sees of the floor: Lambert 1760, under two panes that it passes, and the light
 * as well. */
static double expected(const struct view_light *lights, int count, const double floor[3],
                       int channel)
{
    double panes = (double)sheets[1].color[channel] * (double)sheets[2].color[channel], sum = 0;
    for (int i = 0; i < count; i += 2) {
        double to_light[3];
        vec3_sub(lights[i].position, floor, to_light);
        double distance = vec3_length(to_light);
        sum += (double)lights[i].intensity * (double)lights[i].color[channel] * to_light[1] /
               (distance * distance * distance);
    }
    return albedo / M_PI * sum * panes * panes;
}

static bool check_picture(const struct image *picture, const struct view_light *lights, int count,
                          struct error *err)
{
    for (int y = 0; y < SIDE_PX; y++) {
        for (int x = 0; x < SIDE_PX; x++) {
            const float *found = (const float *)picture->pixels + (size_t)4 * (y * SIDE_PX + x);
            const double floor[3] = {half_view_m * ((2 * x + 1.0) / SIDE_PX - 1), 0,
                                     half_view_m * ((2 * y + 1.0) / SIDE_PX - 1)};
            for (int k = 0; k < 3; k++) {
                double value = expected(lights, count, floor, k);
                if (!(fabs((double)found[k] - value) <= 1e-3 * value))
                    return error_set(err, ERROR_NO_DEVICE,
                                     "self-test 'scene under %d lights': expected %.6g at pixel "
                                     "(%d, %d), channel %d, found %.6g",
                                     count, value, x, y, k, (double)found[k]);
            }
        }
    }
    return true;
}

static bool check_lights(struct renderer *renderer, int count, struct error *err)
{
    struct view_light lights[MANY];
    struct frame frame = {0};
    struct view view = {
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {0, 6, 0},
                   .up = {0, 0, -1},
                   .ortho_height = 2 * half_view_m},
        .lights = lights,
        .light_count = (size_t)count,
        .quality = {.shadows = VIEW_SHADOWS_DEEP,
                    .light_lists = VIEW_LIGHT_LISTS_CLUSTERED,
                    .shadow_resolution = 32},
    };
    for (int i = 0; i < count; i++)
        lights[i] = light_of(i, count);
    bool ok = renderer_render(renderer, key, &view, &frame, err) &&
              check_picture(&frame.outputs[VIEW_OUTPUT_COLOR], lights, count, err);
    frame_finish(&frame);
    return ok;
}

bool scene_selftest(struct renderer *renderer, struct error *err)
{
    static const int counts[] = {FEW, MANY, FEWER};
    struct scene scene;
    void *blob = make_scene(&scene, err);
    if (!blob)
        return false;
    bool ok = renderer_attach_scene(
        renderer, &(struct renderer_scene_desc){.key = key, .scene = &scene}, err);
    for (size_t i = 0; ok && i < sizeof counts / sizeof *counts; i++)
        ok = check_lights(renderer, counts[i], err);
    renderer_detach_scene(renderer, key);
    free(blob);
    return ok;
}
