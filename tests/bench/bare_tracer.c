/* SPDX-License-Identifier: MIT */
/* Coloured shadows by Embree and little else. */
#include "tests/bench/bare_tracer.h"

#include <float.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/base/sample_pattern.h"
#include "renderer/raytrace/embree.h"
#include "renderer/raytrace/rt_packet.h"
#include "renderer/scene/scene.h"

enum { LANES = 8, LAYERS_MAX = 64, COLUMNS = 4, ROWS = LANES / COLUMNS };

struct paint {
    float color[3];  /* of Lambert's lobe, times coverage and over pi */
    float filter[3]; /* of light that passes */
    bool is_opaque;
};

struct bare_tracer {
    RTCDevice device;
    RTCScene scene;
    struct paint *paints; /* by geometry */
    size_t count;
    atomic_llong embree_bytes;
};

/* Eight rays on their way, side by side. */
struct lanes {
    float through[3][LANES], radiance[3][LANES];
    int is_active[LANES];
};

struct shadow_context { /* Embree hands its first member to filters */
    struct embree_context embree;
    const struct paint *paints;
    float passed[3][LANES];
};

/* Opaque surfaces end shadow rays; others filter them. */
static void pass_filter(const struct RTCFilterFunctionNArguments *args)
{
    struct shadow_context *context = (struct shadow_context *)embree_context_of(args);
    const unsigned *rays = (const unsigned *)args->ray, *hits = (const unsigned *)args->hit;
    for (unsigned i = 0; i < args->N; i++) { /* parts of a packet, too */
        if (!args->valid[i])
            continue;
        const unsigned id = rays[RT_RAY_ID * args->N + i], mesh = hits[RT_HIT_MESH * args->N + i];
        const struct paint *paint = &context->paints[mesh];
        if (paint->is_opaque)
            continue;
        for (int k = 0; k < 3; k++)
            context->passed[k][id] *= paint->filter[k];
        args->valid[i] = 0;
    }
}

static void fill_paint(struct paint *paint, const struct scene_material *material)
{
    float alpha = material->alpha_mode == SCENE_BLEND ? material->base_color[3] : 1;
    float passes = material->alpha_mode == SCENE_BLEND ? 1 - alpha : material->transmission;
    paint->is_opaque = passes <= 0;
    for (int k = 0; k < 3; k++) {
        float color = material->base_color[k];
        paint->color[k] = color * (paint->is_opaque ? 1 : 1 - passes) / 3.14159265f;
        paint->filter[k] = passes * (material->alpha_mode == SCENE_BLEND ? 1 : color);
    }
}

static bool add_item(struct bare_tracer *tracer, const struct scene_state *state,
                     const struct state_item *item)
{
    const struct scene *scene = state->scene;
    const struct scene_primitive *primitive = &scene->primitives[item->primitive];
    RTCGeometry geometry = rtcNewGeometry(tracer->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *vertices =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof *vertices, primitive->vertex_count);
    uint32_t *indices =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof *indices, primitive->index_count / 3);
    if (!vertices || !indices)
        return false;
    for (size_t i = 0; i < primitive->vertex_count; i++) {
        const float *p = scene->positions + 3 * (primitive->first_vertex + i);
        double world[3];
        mat4_transform_point(state->world[item->node],
                             (const double[3]){(double)p[0], (double)p[1], (double)p[2]}, world);
        for (size_t k = 0; k < 3; k++)
            vertices[3 * i + k] = (float)world[k];
    }
    memcpy(indices, scene->indices + primitive->first_index,
           primitive->index_count * sizeof *indices);
    fill_paint(&tracer->paints[tracer->count++], &state->materials[item->material].base);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(tracer->scene, geometry);
    rtcReleaseGeometry(geometry);
    return true;
}

static bool count_memory(void *tracer, ssize_t bytes, bool is_after)
{
    (void)is_after;
    atomic_fetch_add(&((struct bare_tracer *)tracer)->embree_bytes, bytes);
    return true;
}

struct bare_tracer *bare_tracer_create(const struct scene_state *state, struct error *err)
{
    struct bare_tracer *tracer = calloc(1, sizeof *tracer);
    bool ok = tracer && (tracer->paints = calloc(state->item_count + 1, sizeof *tracer->paints)) &&
              (tracer->device = rtcNewDevice("threads=1"));
    if (ok) {
        rtcSetDeviceMemoryMonitorFunction(tracer->device, count_memory, tracer);
        tracer->scene = rtcNewScene(tracer->device);
        rtcSetSceneFlags(tracer->scene, RTC_SCENE_FLAG_ROBUST | EMBREE_SCENE_FILTERS);
        for (size_t i = 0; ok && i < state->item_count; i++)
            ok = add_item(tracer, state, &state->items[i]);
        rtcCommitScene(tracer->scene);
        ok = ok && rtcGetDeviceError(tracer->device) == RTC_ERROR_NONE;
    }
    if (ok)
        return tracer;
    bare_tracer_destroy(tracer);
    error_set(err, ERROR_NO_MEMORY, "the bare ray tracer");
    return NULL;
}

void bare_tracer_destroy(struct bare_tracer *tracer)
{
    if (!tracer)
        return;
    if (tracer->scene)
        rtcReleaseScene(tracer->scene);
    if (tracer->device)
        rtcReleaseDevice(tracer->device);
    free(tracer->paints);
    free(tracer);
}

RTCScene bare_tracer_scene(const struct bare_tracer *tracer, bool *has_sixteen)
{
    *has_sixteen = rtcGetDeviceProperty(tracer->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED);
    return tracer->scene;
}

uint64_t bare_tracer_size_bytes(const struct bare_tracer *tracer)
{
    return (uint64_t)atomic_load(&tracer->embree_bytes);
}

/* Of eight points, the light that arrives over the cosine's sign is asked for at once. */
struct asked {
    _Alignas(64) int valid[LANES];
    float irradiance[LANES];
    struct RTCRay8 rays;
};

static float cone_of(const struct state_light *light, const float l[3])
{
    if (light->type != SCENE_LIGHT_SPOT)
        return 1;
    float cosine = 0, outer = cosf(light->outer_cone_rad);
    for (int k = 0; k < 3; k++)
        cosine -= (float)light->direction[k] * l[k];
    float cone = (cosine - outer) / fmaxf(cosf(light->inner_cone_rad) - outer, 1e-3f);
    cone = cone < 0 ? 0 : cone > 1 ? 1 : cone;
    return cone * cone;
}

/* Returns how many rays there are. */
static int ask(const struct state_light *light, const struct RTCRayHit8 *seen,
               const struct lanes *lanes, struct asked *asked)
{
    int count = 0;
    for (int i = 0; i < LANES; i++) {
        asked->valid[i] = 0;
        asked->irradiance[i] = 0;
        if (!lanes->is_active[i])
            continue;
        const float t = seen->ray.tfar[i];
        const float d[3] = {seen->ray.dir_x[i], seen->ray.dir_y[i], seen->ray.dir_z[i]};
        const float n[3] = {seen->hit.Ng_x[i], seen->hit.Ng_y[i], seen->hit.Ng_z[i]};
        const float p[3] = {seen->ray.org_x[i] + t * d[0], seen->ray.org_y[i] + t * d[1],
                            seen->ray.org_z[i] + t * d[2]};
        float l[3], square = 0, facing = 0, cosine = 0, size = 0;
        for (int k = 0; k < 3; k++) {
            l[k] = (float)light->position[k] - p[k];
            square += l[k] * l[k];
            facing += n[k] * d[k];
            size += n[k] * n[k];
        }
        float distance = sqrtf(square), inverse = 1 / distance, q = distance;
        for (int k = 0; k < 3; k++) {
            l[k] *= inverse;
            cosine += n[k] * l[k];
        }
        cosine = (facing > 0 ? -cosine : cosine) / sqrtf(size);
        q = light->range > 0 ? q / light->range : 0;
        float gain = cosine * cone_of(light, l) * fmaxf(1 - q * q * q * q, 0) / square;
        if (!(gain > 0))
            continue;
        asked->valid[i] = -1;
        asked->irradiance[i] = gain;
        asked->rays.org_x[i] = p[0];
        asked->rays.org_y[i] = p[1];
        asked->rays.org_z[i] = p[2];
        asked->rays.dir_x[i] = l[0];
        asked->rays.dir_y[i] = l[1];
        asked->rays.dir_z[i] = l[2];
        asked->rays.tnear[i] = 1e-3f;
        asked->rays.tfar[i] = distance - 1e-3f;
        asked->rays.mask[i] = UINT32_MAX;
        asked->rays.id[i] = (unsigned)i;
        asked->rays.flags[i] = 0;
        asked->rays.time[i] = 0;
        count++;
    }
    return count;
}

static void add_light(const struct bare_tracer *tracer, const struct state_light *light,
                      const struct RTCRayHit8 *seen, struct lanes *lanes, uint64_t *rays)
{
    struct asked asked = {.valid = {0}};
    struct shadow_context context = {.paints = tracer->paints};
    int count = ask(light, seen, lanes, &asked);
    if (!count)
        return;
    *rays += (uint64_t)count;
    embree_context_init(&context.embree);
    context.embree.is_coherent = false; /* coherent packets may tell of one hit twice */
    context.embree.filter = pass_filter;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < LANES; i++)
            context.passed[k][i] = 1;
    embree_occluded8(asked.valid, tracer->scene, &context.embree, &asked.rays);
    for (int i = 0; i < LANES; i++) {
        if (!asked.valid[i] || asked.rays.tfar[i] < 0)
            continue;
        const struct paint *paint = &tracer->paints[seen->hit.geomID[i]];
        for (int k = 0; k < 3; k++)
            lanes->radiance[k][i] += lanes->through[k][i] * paint->color[k] * light->color[k] *
                                     asked.irradiance[i] * context.passed[k][i];
    }
}

/* From layer to layer, until all rays have ended. */
static void trace(const struct bare_tracer *tracer, const struct scene_state *state, bool is_lit,
                  struct RTCRayHit8 *query, struct lanes *lanes, uint64_t *rays)
{
    _Alignas(64) int valid[LANES];
    for (int layer = 0, left = 1; left && layer < LAYERS_MAX; layer++) {
        struct embree_context context;
        embree_context_init(&context);
        context.is_coherent = true;
        for (int i = 0; i < LANES; i++) {
            valid[i] = lanes->is_active[i] ? -1 : 0;
            query->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
            *rays += (uint64_t)lanes->is_active[i];
        }
        embree_intersect8(valid, tracer->scene, &context, query);
        left = 0;
        for (int i = 0; i < LANES; i++)
            lanes->is_active[i] &= query->hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
        for (size_t light = 0; is_lit && light < state->light_count; light++)
            add_light(tracer, &state->lights[light], query, lanes, rays);
        for (int i = 0; i < LANES; i++) {
            if (!lanes->is_active[i])
                continue;
            const struct paint *paint = &tracer->paints[query->hit.geomID[i]];
            for (int k = 0; k < 3; k++)
                lanes->through[k][i] *= paint->filter[k];
            lanes->is_active[i] = !paint->is_opaque;
            left |= lanes->is_active[i];
            query->ray.tnear[i] = query->ray.tfar[i] * (1 + 1e-5f);
            query->ray.tfar[i] = FLT_MAX;
        }
    }
}

/* place: in each pixel, y up. */
static void begin(const struct camera *camera, const struct image *image, int x, int y,
                  const double place[2], struct RTCRayHit8 *query, struct lanes *lanes)
{
    for (int i = 0; i < LANES; i++) {
        double right = x + i % COLUMNS + place[0], down = y + i / COLUMNS + 1 - place[1];
        double px = (2 * right / image->width_px - 1) * camera->half_width;
        double py = (1 - 2 * down / image->height_px) * camera->half_height;
        float d[3];
        for (int k = 0; k < 3; k++) {
            d[k] = (float)(camera->right[k] * px + camera->up[k] * py - camera->back[k]);
            lanes->through[k][i] = 1;
            lanes->radiance[k][i] = 0;
        }
        query->ray.org_x[i] = (float)camera->eye[0];
        query->ray.org_y[i] = (float)camera->eye[1];
        query->ray.org_z[i] = (float)camera->eye[2];
        query->ray.dir_x[i] = d[0];
        query->ray.dir_y[i] = d[1];
        query->ray.dir_z[i] = d[2];
        query->ray.tnear[i] = (float)camera->z_near;
        query->ray.tfar[i] = FLT_MAX;
        query->ray.mask[i] = UINT32_MAX;
        query->ray.time[i] = 0;
        query->ray.id[i] = (unsigned)i;
        query->ray.flags[i] = 0;
        lanes->is_active[i] =
            x + i % COLUMNS < image->width_px && y + i / COLUMNS < image->height_px;
    }
}

bool bare_tracer_render(const struct bare_tracer *tracer, const struct camera *camera,
                        const struct scene_state *state, int samples, struct image *image,
                        uint64_t *rays, struct error *err)
{
    const int width = image->width_px, height = image->height_px;
    double places[8][2] = {{0.5, 0.5}};
    for (int s = 0; samples > 1 && s < samples; s++)
        sample_pattern_place(samples, s, places[s]);
    *rays = 0;
    if (camera->is_orthographic)
        return error_set(err, ERROR_UNSUPPORTED, "the bare ray tracer has a perspective camera");
    for (int y = 0; y < height; y += ROWS)
        for (int x = 0; x < width; x += COLUMNS) {
            struct RTCRayHit8 query;
            struct lanes lanes;
            for (int s = samples - 1; s >= 0; s--) { /* the first one's radiance is left */
                begin(camera, image, x, y, places[s], &query, &lanes);
                trace(tracer, state, s == 0, &query, &lanes, rays);
            }
            for (int i = 0; i < LANES; i++) {
                int column = x + i % COLUMNS, row = y + i / COLUMNS;
                if (column >= width || row >= height)
                    continue;
                float *pixel =
                    (float *)image->pixels + 4 * ((size_t)row * (size_t)width + (size_t)column);
                for (int k = 0; k < 3; k++)
                    pixel[k] = lanes.radiance[k][i];
                pixel[3] = 1;
            }
        }
    return true;
}
