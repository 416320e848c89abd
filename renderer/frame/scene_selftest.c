/* SPDX-License-Identifier: MIT */
/* A scene whose pictures are known, through the ordinary renderer. */
#include "renderer/frame/scene_selftest.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "protocol/quality_defaults.h"
#include "renderer/base/matrix.h"
#include "renderer/scene/blob_writer.h"
#include "renderer/shadows/technique.h"

enum {
    SIDE_PX = 16,
    FEW = 10,
    MANY = 150, /* more than storages grow by when they are filled a little beyond their size */
    FEWER = 20,
    SUBSAMPLES = 16, /* of a pixel's side, by which the share that an edge leaves is known */
    SHEETS = 6,
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

/* The wall stands between the odd lights and what is in view; light and sight pass both panes. The
 * visor and the lid hang above all lights, before a part of what is in view: no light falls on
 * their upper sides, and their slanted edges leave pixels covered by every share. Colours of glass
 * have 8 bits at most, so that no form of a filter rounds them. */
enum { FLOOR, LOWER_PANE, UPPER_PANE, WALL, VISOR, LID };
static const struct sheet sheets[SHEETS] = {
    [FLOOR] = {{-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, {0.8f, 0.8f, 0.8f}, 0},
    [LOWER_PANE] = {{-5, 1, 5}, {10, 0, 0}, {0, 0, -10}, {1, 0.6f, 0.4f}, 1},
    [UPPER_PANE] = {{-5, 1.5f, 5}, {10, 0, 0}, {0, 0, -10}, {0.6f, 0.8f, 1}, 1},
    [WALL] = {{1.5f, 0, -4}, {0, 0, 8}, {0, 2.75f, 0}, {0.8f, 0.8f, 0.8f}, 0},
    [VISOR] = {{-6, 5, 5}, {5.6f, 0, 0}, {1, 0, -10}, {0.4f, 0.4f, 0.4f}, 1},
    [LID] = {{-5, 5.25f, 5}, {10, 0, 1}, {0, 0, -5.2f}, {0.8f, 0.8f, 0.8f}, 0},
};

/* ---- trials ---- */

enum { TRIALS_MAX = 32 }; /* bits of a set */

struct trial {
    struct shadow_trial is;
    const struct shadow_structure *structure; /* NULL: of all */
};

struct trials { /* their indices are the bits */
    struct trial items[TRIALS_MAX];
    int count, linked_lights, one_sample;
};

static int add(struct trials *trials, const struct shadow_trial *is,
               const struct shadow_structure *structure)
{
    assert(trials->count < TRIALS_MAX);
    trials->items[trials->count] = (struct trial){*is, structure};
    return trials->count++;
}

static void add_structure(struct trials *trials, const struct shadow_structure *structure)
{
    for (const struct shadow_trial *is = structure->trials; is->name; is++)
        add(trials, is, structure);
}

/* Lists what each trial asks of the device, every one with the lists and samples of others. */
static struct trials list_trials(void)
{
    const struct shadow_structure *first = shadow_method_of(SHADOWS_RASTER_DEFAULT)->structure;
    const struct shadow_structure *structure;
    struct trials trials = {.count = 0};
    add_structure(&trials, first);
    for (size_t i = 0; (structure = shadow_structure_at(i)); i++)
        if (structure != first)
            add_structure(&trials, structure);
    trials.linked_lights = add(&trials,
                               &(struct shadow_trial){"linked light lists",
                                                      {.shadows = SHADOWS_RASTER_DEFAULT,
                                                       .light_lists = VIEW_LIGHT_LISTS_LINKED}},
                               NULL);
    trials.one_sample =
        add(&trials,
            &(struct shadow_trial){"one sample", {.shadows = SHADOWS_RASTER_DEFAULT, .samples = 1}},
            NULL);
    return trials;
}

uint32_t scene_selftest_all(void)
{
    return (uint32_t)((UINT64_C(1) << list_trials().count) - 1);
}

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
        primitive->bounds_min[k] = sheet->corner[k] + fminf(sheet->u[k], 0) + fminf(sheet->v[k], 0);
        primitive->bounds_max[k] = sheet->corner[k] + fmaxf(sheet->u[k], 0) + fmaxf(sheet->v[k], 0);
    }
    *mesh = (struct scene_mesh){.first_primitive = index, .primitive_count = 1};
    return true;
}

static bool add_sheet(struct blob_writer *writer, uint32_t index, struct error *err)
{
    struct scene_node *node = blob_writer_append(writer, SCENE_NODES, 1, err);
    if (!node)
        return false;
    *node = (struct scene_node){.parent = -1,
                                .mesh = (int32_t)index,
                                .camera = -1,
                                .light = -1,
                                .source_index = index,
                                .grid = -1};
    for (int i = 0; i < 4; i++)
        node->local_matrix[5 * i] = node->world_matrix[5 * i] = 1;
    return add_material(writer, &sheets[index], err) && add_corners(writer, &sheets[index], err) &&
           add_primitive(writer, index, err);
}

static void *make_scene(struct scene *scene, struct error *err)
{
    struct blob_writer writer = {0};
    struct scene_header header = {.bounds_min = {-6, 0, -5},
                                  .bounds_max = {5, 5.25, 6},
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

struct picture {
    const struct shadow_trial *trial;
    const struct view_light *lights;
    int count, samples;
};

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

static double noise_of(const struct picture *picture)
{
    const struct shadow_method *method = shadow_method_of(picture->trial->quality.shadows);
    return method ? method->structure->noise : 0;
}

static double filter_of(int sheet, int channel)
{
    return (double)sheets[sheet].color[channel];
}

/* Of a technique without colours: Rec. 709. */
static double gray_of(int sheet)
{
    return 0.2126 * filter_of(sheet, 0) + 0.7152 * filter_of(sheet, 1) +
           0.0722 * filter_of(sheet, 2);
}

/* Of the floor at a point, without what hangs above the lights: Lambert 1760, under two panes that
 * sight passes, and light, too, where its shadows have colours. */
static double seen_of_floor(const struct picture *picture, const double floor[3], int channel)
{
    enum shadow_technique shadows = picture->trial->quality.shadows;
    double panes = filter_of(LOWER_PANE, channel) * filter_of(UPPER_PANE, channel), light_panes = 1;
    if (shadow_technique_can(shadows, SHADOW_CAN_COLOR))
        light_panes = panes;
    else if (shadow_technique_can(shadows, SHADOW_CAN_FILTER))
        light_panes = gray_of(LOWER_PANE) * gray_of(UPPER_PANE);
    double sum = 0;
    for (int i = 0; i < picture->count; i += 2) {
        const struct view_light *light = &picture->lights[i];
        double to_light[3];
        vec3_sub(light->position, floor, to_light);
        double distance = vec3_length(to_light);
        sum += (double)light->intensity * (double)light->color[channel] * to_light[1] /
               (distance * distance * distance);
    }
    return albedo / M_PI * sum * panes * light_panes;
}

/* Seen from above. */
static bool is_below(const struct sheet *sheet, double x, double z)
{
    const float *c = sheet->corner, *u = sheet->u, *v = sheet->v;
    double dx = x - (double)c[0], dz = z - (double)c[2];
    double area = (double)u[0] * (double)v[2] - (double)u[2] * (double)v[0];
    double s = (dx * (double)v[2] - dz * (double)v[0]) / area;
    double t = ((double)u[0] * dz - (double)u[2] * dx) / area;
    return s >= 0 && s <= 1 && t >= 0 && t <= 1;
}

static double place_of(double pixel)
{
    return half_view_m * (2 * pixel / SIDE_PX - 1);
}

/* The share of a pixel's area that the sheet covers. */
static double share_of(const struct sheet *sheet, int x, int y)
{
    int covered = 0;
    for (int row = 0; row < SUBSAMPLES; row++)
        for (int column = 0; column < SUBSAMPLES; column++)
            covered += is_below(sheet, place_of(x + (column + 0.5) / SUBSAMPLES),
                                place_of(y + (row + 0.5) / SUBSAMPLES));
    return (double)covered / (SUBSAMPLES * SUBSAMPLES);
}

/* Where one edge passes, the device may take any samples that lie well in the pixel: their share is
 * a multiple of its quarter, and not far from that of the area. The floor is shaded in the middle
 * of the samples that show it, and a little brighter or darker than in the pixel's. */
static bool is_right_at_edge(double found, double full, double cut, double share)
{
    double taken = (1 - found / full) / (1 - cut), steps = 4 * taken;
    return fabs(steps - round(steps)) <= 0.2 && fabs(taken - share) <= 0.3;
}

static bool is_right(const struct picture *picture, int x, int y, int channel, double found,
                     double *value)
{
    const double floor[3] = {place_of(x + 0.5), 0, place_of(y + 0.5)};
    const double glass = (double)sheets[VISOR].color[channel];
    double visor = share_of(&sheets[VISOR], x, y), lid = share_of(&sheets[LID], x, y);
    bool is_at_visor = fabs(visor - 0.5) < 0.5;
    bool is_at_lid = fabs(lid - 0.5) < 0.5;
    double full = seen_of_floor(picture, floor, channel);
    *value = full * (1 - visor * (1 - glass)) * (1 - lid);
    if (!is_at_visor && !is_at_lid)
        return fabs(found - *value) <= fmax(1e-3, noise_of(picture)) * *value;
    if ((is_at_visor && is_at_lid) || picture->samples == 1 || noise_of(picture) > 0)
        return isfinite(found) && found >= 0 && found <= fmax(1.05, 1 + noise_of(picture)) * full;
    if (is_at_visor)
        return lid == 1 ? found == 0 : is_right_at_edge(found, full, glass, visor);
    full *= 1 - visor * (1 - glass);
    return is_right_at_edge(found, full, 0, lid);
}

static bool check_picture(const struct picture *picture, const struct image *image,
                          struct error *err)
{
    for (int y = 0; y < SIDE_PX; y++) {
        for (int x = 0; x < SIDE_PX; x++) {
            const float *found = (const float *)image->pixels + (size_t)4 * (y * SIDE_PX + x);
            for (int k = 0; k < 3; k++) {
                double value;
                if (!is_right(picture, x, y, k, (double)found[k], &value))
                    return error_set(err, ERROR_NO_DEVICE,
                                     "self-test '%s under %d lights': expected %.6g at pixel "
                                     "(%d, %d), channel %d, found %.6g",
                                     picture->trial->name, picture->count, value, x, y, k,
                                     (double)found[k]);
            }
        }
    }
    return true;
}

/* The samples per pixel that the device has at once, as far as the trial wants them. */
static int samples_of(const struct renderer *renderer, const struct shadow_trial *trial)
{
    struct renderer_info info;
    renderer_get_info(renderer, &info);
    return info.max_samples >= 4 ? quality_or(trial->quality.samples, SAMPLES_DEFAULT) : 1;
}

static bool check_lights(struct renderer *renderer, const struct shadow_trial *trial, int count,
                         struct error *err)
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
        .quality = trial->quality,
    };
    view.quality.shadow_resolution = 32;
    view.quality.samples = samples_of(renderer, trial);
    for (int i = 0; i < count; i++)
        lights[i] = light_of(i, count);
    bool ok = renderer_render(renderer, key, &view, &frame, err);
    const struct picture picture = {
        .trial = trial, .lights = lights, .count = count, .samples = samples_of(renderer, trial)};
    ok = ok && check_picture(&picture, &frame.outputs[VIEW_OUTPUT_COLOR], err);
    frame_finish(&frame);
    return ok;
}

static bool check_trial(struct renderer *renderer, const struct shadow_trial *trial,
                        struct error *err)
{
    static const int counts[] = {FEW, MANY, FEWER};
    bool ok = true;
    for (size_t i = 0; ok && i < sizeof counts / sizeof *counts; i++)
        ok = check_lights(renderer, trial, counts[i], err);
    return ok;
}

bool scene_selftest(struct renderer *renderer, uint32_t wanted, struct error *err)
{
    const struct trials trials = list_trials();
    struct scene scene;
    void *blob = make_scene(&scene, err);
    if (!blob)
        return false;
    bool ok = renderer_attach_scene(
        renderer, &(struct renderer_scene_desc){.key = key, .scene = &scene}, err);
    for (int i = 0; ok && i < trials.count; i++)
        if (wanted >> i & 1)
            ok = check_trial(renderer, &trials.items[i].is, err);
    renderer_detach_scene(renderer, key);
    free(blob);
    return ok;
}

static bool has_structure(const struct plan *plan, const struct shadow_structure *structure)
{
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (plan->lights_by_technique[i] &&
            shadow_method_of((enum shadow_technique)i)->structure == structure)
            return true;
    return false;
}

/* The bit of the structure's trial that is as faithful, or of its first; 0: it has none. */
static uint32_t bit_of(const struct trials *trials, const struct shadow_structure *structure,
                       bool faithful)
{
    int found = -1;
    for (int i = 0; i < trials->count; i++) {
        const struct trial *trial = &trials->items[i];
        if (trial->structure == structure && (found < 0 || trial->is.quality.faithful == faithful))
            found = i;
    }
    return found < 0 ? 0 : 1u << found;
}

uint32_t scene_selftest_needs(const struct plan *plan, const struct view_quality *quality)
{
    const struct plan_requirement *needs = plan->requirements;
    const struct trials trials = list_trials();
    const struct shadow_structure *structure;
    uint32_t bits = 0;
    if (!needs[PLAN_NEED_COLOR].is_met)
        return 0;
    for (size_t i = 0; (structure = shadow_structure_at(i)); i++)
        if (has_structure(plan, structure))
            bits |= bit_of(&trials, structure, quality->faithful);
    if (needs[PLAN_NEED_LIGHTS].is_met && quality->light_lists == VIEW_LIGHT_LISTS_LINKED)
        bits |= 1u << trials.linked_lights;
    if (plan->target_samples == 1)
        bits |= 1u << trials.one_sample;
    return bits;
}
