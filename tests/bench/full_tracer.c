/* SPDX-License-Identifier: MIT */
/* What a picture costs on Embree at least. */
#include "tests/bench/full_tracer.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/base/processor_forms.h"
#include "renderer/raytrace/embree.h"
#include "renderer/raytrace/rt_packet.h"
#include "renderer/scene/blend_law.h"
#include "renderer/scene/scene.h"

enum { LANES = 16, HALF = 8, LAYERS_MAX = 64, COLUMNS = 4, ROWS = LANES / COLUMNS };

/* Of a surface: lobes, and what Schlick's power adds to them; the filter for light, and how much is
 * seen of what lies behind. */
enum { DIFFUSE, DIFFUSE_EDGE, SPECULAR, SPECULAR_EDGE, FILTER, BEHIND, COLORS };

struct paint { /* of a mesh */
    float colors[COLORS][3], coverage, alpha_square;
    bool is_opaque;
    float *normals; /* of vertices, in world space; owned */
    const uint32_t *indices;
};

struct full_tracer {
    RTCScene scene;
    bool has_sixteen; /* the processor's packets */
    struct paint *paints;
    size_t count;
};

/* Sixteen rays of the camera, and the surface that each of them has met. */
struct lanes {
    _Alignas(64) struct RTCRayHit16 query;
    int active[LANES];
    float through[3][LANES], radiance[3][LANES];
    float colors[COLORS][3][LANES], coverage[LANES], alpha_square[LANES];
    float corners[3][3][LANES]; /* normals of the triangle's vertices */
    float point[3][LANES], normal[3][LANES], view[3][LANES], n_dot_v[LANES], seen[LANES];
};

/* Of one light: what arrives and is reflected, and the rays that ask for it. */
struct asked {
    _Alignas(64) struct RTCRay16 rays;
    int valid[LANES];
    float weight[3][LANES], passed[3][LANES];
};

struct lamp {
    float position[3], direction[3], color[3], inverse_range, cone_scale, cone_offset;
};

struct shadow_context { /* Embree hands its first member to filters */
    struct embree_context embree;
    const struct paint *paints;
    struct asked *asked;
};

/* Opaque surfaces end shadow rays; others filter them. */
static void pass_filter(const struct RTCFilterFunctionNArguments *args)
{
    struct shadow_context *context = (struct shadow_context *)embree_context_of(args);
    const unsigned *rays = (const unsigned *)args->ray, *hits = (const unsigned *)args->hit;
    for (unsigned i = 0; i < args->N; i++) {
        if (!args->valid[i])
            continue;
        const unsigned id = rays[RT_RAY_ID * args->N + i], mesh = hits[RT_HIT_MESH * args->N + i];
        const struct paint *paint = &context->paints[mesh];
        if (paint->is_opaque)
            continue;
        for (int k = 0; k < 3; k++)
            context->asked->passed[k][id] *= paint->colors[FILTER][k];
        args->valid[i] = 0;
    }
}

static void fill_paint(struct paint *paint, const struct scene_material *material)
{
    const bool blends = material->alpha_mode == SCENE_BLEND;
    const float coverage = blends ? material->base_color[3] : 1;
    const float passes = blends ? 1 - coverage : material->transmission;
    const float bend = (material->ior - 1) / (material->ior + 1), f0 = bend * bend;
    const float dielectric = 1 - material->metallic, pi = 3.14159265f;
    const float alpha = fmaxf(material->roughness * material->roughness, 1e-3f);
    paint->is_opaque = passes <= 0; /* and its filter is 0 */
    paint->coverage = coverage;
    paint->alpha_square = alpha * alpha;
    for (int k = 0; k < 3; k++) {
        const float base = material->base_color[k];
        const float diffuse = base * dielectric * (blends ? 1 : 1 - passes) / pi;
        paint->colors[DIFFUSE][k] = diffuse * (1 - f0);
        paint->colors[DIFFUSE_EDGE][k] = diffuse * (1 - f0);
        paint->colors[SPECULAR][k] = dielectric * f0 + material->metallic * base;
        paint->colors[SPECULAR_EDGE][k] = dielectric * (1 - f0) + material->metallic * (1 - base);
        paint->colors[FILTER][k] =
            blends ? (float)blend_law_filter(VIEW_BLEND_TINT, (double)coverage, (double)base)
                   : passes * base;
        paint->colors[BEHIND][k] = passes * (blends ? 1 : base);
    }
}

static bool add_item(struct full_tracer *tracer, const struct scene_state *state,
                     const struct state_item *item)
{
    const struct scene *scene = state->scene;
    const struct scene_primitive *primitive = &scene->primitives[item->primitive];
    const double *world = state->world[item->node];
    struct paint *paint = &tracer->paints[tracer->count++];
    fill_paint(paint, &state->materials[item->material].base);
    paint->indices = scene->indices + primitive->first_index;
    paint->normals = calloc(3 * (size_t)primitive->vertex_count + 1, sizeof *paint->normals);
    if (!paint->normals)
        return false;
    for (size_t i = 0; i < primitive->vertex_count; i++) { /* nodes here turn and shift */
        const float *n = scene->normals + 3 * (primitive->first_vertex + i);
        for (size_t k = 0; k < 3; k++)
            for (size_t c = 0; c < 3; c++)
                paint->normals[3 * i + k] += (float)world[4 * c + k] * n[c];
    }
    return true;
}

struct full_tracer *full_tracer_create(const struct bare_tracer *bare,
                                       const struct scene_state *state, struct error *err)
{
    struct full_tracer *tracer = calloc(1, sizeof *tracer);
    bool ok = tracer && (tracer->paints = calloc(state->item_count + 1, sizeof *tracer->paints));
    for (size_t i = 0; ok && i < state->item_count; i++)
        ok = add_item(tracer, state, &state->items[i]);
    if (!ok) {
        full_tracer_destroy(tracer);
        error_set(err, ERROR_NO_MEMORY, "the full ray tracer");
        return NULL;
    }
    tracer->scene = bare_tracer_scene(bare, &tracer->has_sixteen);
    return tracer;
}

void full_tracer_destroy(struct full_tracer *tracer)
{
    for (size_t i = 0; tracer && i < tracer->count; i++)
        free(tracer->paints[i].normals);
    if (tracer)
        free(tracer->paints);
    free(tracer);
}

/* Halves of a packet's arrays, for processors with eight lanes. */
static void copy_halves(float *to, size_t to_width, const float *from, size_t from_width,
                        size_t members)
{
    for (size_t m = 0; m < members; m++)
        memcpy(to + m * to_width, from + m * from_width, HALF * sizeof *to);
}

static void intersect(const struct full_tracer *tracer, struct lanes *lanes)
{
    struct embree_context context;
    embree_context_init(&context);
    context.is_coherent = true;
    if (tracer->has_sixteen) {
        embree_intersect16(lanes->active, tracer->scene, &context, &lanes->query);
        return;
    }
    for (size_t first = 0; first < LANES; first += HALF) {
        const size_t members = sizeof lanes->query / (LANES * sizeof(float));
        struct RTCRayHit8 half;
        float *all = (float *)&lanes->query + first;
        copy_halves((float *)&half, HALF, all, LANES, members);
        embree_intersect8(lanes->active + first, tracer->scene, &context, &half);
        copy_halves(all, LANES, (const float *)&half, HALF, members);
    }
}

static void occlude(const struct full_tracer *tracer, struct asked *asked)
{
    struct shadow_context context = {.paints = tracer->paints, .asked = asked};
    embree_context_init(&context.embree);
    context.embree.is_coherent = false; /* coherent packets may tell of one hit twice */
    context.embree.filter = pass_filter;
    if (tracer->has_sixteen) {
        embree_occluded16(asked->valid, tracer->scene, &context.embree, &asked->rays);
        return;
    }
    for (size_t first = 0; first < LANES; first += HALF) {
        const size_t members = sizeof asked->rays / (LANES * sizeof(float));
        struct RTCRay8 half;
        float *all = (float *)&asked->rays + first;
        copy_halves((float *)&half, HALF, all, LANES, members);
        embree_occluded8(asked->valid + first, tracer->scene, &context.embree, &half);
        copy_halves(all, LANES, (const float *)&half, HALF, members);
    }
}

/* Side by side what belongs to each lane's triangle. */
static void gather(const struct full_tracer *tracer, struct lanes *lanes)
{
    for (int i = 0; i < LANES; i++) {
        if (!lanes->active[i])
            continue;
        const struct paint *paint = &tracer->paints[lanes->query.hit.geomID[i]];
        const uint32_t *vertices = paint->indices + 3 * (size_t)lanes->query.hit.primID[i];
        for (int c = 0; c < COLORS; c++)
            for (int k = 0; k < 3; k++)
                lanes->colors[c][k][i] = paint->colors[c][k];
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                lanes->corners[c][k][i] = paint->normals[3 * (size_t)vertices[c] + (size_t)k];
        lanes->coverage[i] = paint->coverage;
        lanes->alpha_square[i] = paint->alpha_square;
    }
}

PROCESSOR_FORMS static void find_surfaces(struct lanes *lanes)
{
    const struct RTCRayHit16 *query = &lanes->query;
    for (int i = 0; i < LANES; i++) {
        const float t = query->ray.tfar[i], u = query->hit.u[i], v = query->hit.v[i];
        const float d[3] = {query->ray.dir_x[i], query->ray.dir_y[i], query->ray.dir_z[i]};
        const float o[3] = {query->ray.org_x[i], query->ray.org_y[i], query->ray.org_z[i]};
        const float g[3] = {query->hit.Ng_x[i], query->hit.Ng_y[i], query->hit.Ng_z[i]};
        float n[3], square = 0, away = 0, facing = 0, cosine = 0;
        for (int k = 0; k < 3; k++) {
            n[k] = (1 - u - v) * lanes->corners[0][k][i] + u * lanes->corners[1][k][i] +
                   v * lanes->corners[2][k][i];
            square += n[k] * n[k];
            away += d[k] * d[k];
            facing += g[k] * d[k];
        }
        const float turn = (facing > 0 ? -1.f : 1.f) / sqrtf(square), unit = -1 / sqrtf(away);
        for (int k = 0; k < 3; k++) {
            lanes->point[k][i] = o[k] + t * d[k];
            lanes->normal[k][i] = n[k] *= turn;
            lanes->view[k][i] = d[k] * unit;
            cosine += n[k] * d[k] * unit;
        }
        const float a2 = lanes->alpha_square[i], n_dot_v = fmaxf(cosine, 1e-4f);
        lanes->n_dot_v[i] = n_dot_v;
        lanes->seen[i] = sqrtf(n_dot_v * n_dot_v * (1 - a2) + a2);
    }
}

/* What of the lamp is reflected, where nothing is between. Returns whether any of it is. */
PROCESSOR_FORMS static bool find_light(const struct lamp *lamp, const struct lanes *restrict lanes,
                                       struct asked *restrict asked)
{
    const struct lamp own = *lamp;
    int any = 0;
    for (int i = 0; i < LANES; i++) {
        float l[3], h[3], square = 0, along = 0, n_dot_l = 0, n_h = 0, v_h = 0, h2 = 0;
        for (int k = 0; k < 3; k++) {
            l[k] = own.position[k] - lanes->point[k][i];
            square += l[k] * l[k];
        }
        const float distance = sqrtf(square), inverse = 1 / distance;
        for (int k = 0; k < 3; k++) {
            l[k] *= inverse;
            h[k] = l[k] + lanes->view[k][i];
            along -= own.direction[k] * l[k];
            n_dot_l += lanes->normal[k][i] * l[k];
            n_h += lanes->normal[k][i] * h[k];
            v_h += lanes->view[k][i] * h[k];
            h2 += h[k] * h[k];
        }
        const float q = distance * own.inverse_range, q2 = q * q;
        const float cone = fminf(fmaxf(along * own.cone_scale + own.cone_offset, 0), 1);
        const float gain = fmaxf(1 - q2 * q2, 0) * cone * cone / square;
        const float half = 1 / sqrtf(h2), n_dot_h = n_h * half, c = 1 - v_h * half, c2 = c * c;
        const float w = c2 * c2 * c, a2 = lanes->alpha_square[i];
        const float f = n_dot_h * n_dot_h * (a2 - 1) + 1;
        const float visibility =
            lanes->n_dot_v[i] * sqrtf(n_dot_l * n_dot_l * (1 - a2) + a2) + n_dot_l * lanes->seen[i];
        const float lobe = 0.5f * a2 / (3.14159265f * f * f * visibility);
        const bool is_lit = lanes->active[i] & (n_dot_l > 0) & (gain > 0);
        asked->valid[i] = is_lit ? -1 : 0;
        any |= asked->valid[i];
        for (int k = 0; k < 3; k++) {
            asked->weight[k][i] =
                (lanes->colors[DIFFUSE][k][i] - w * lanes->colors[DIFFUSE_EDGE][k][i] +
                 lobe * (lanes->colors[SPECULAR][k][i] + w * lanes->colors[SPECULAR_EDGE][k][i])) *
                n_dot_l * gain * own.color[k] * lanes->through[k][i] * lanes->coverage[i];
            asked->passed[k][i] = 1;
        }
        asked->rays.org_x[i] = lanes->point[0][i];
        asked->rays.org_y[i] = lanes->point[1][i];
        asked->rays.org_z[i] = lanes->point[2][i];
        asked->rays.dir_x[i] = l[0];
        asked->rays.dir_y[i] = l[1];
        asked->rays.dir_z[i] = l[2];
        asked->rays.tnear[i] = 1e-3f;
        asked->rays.tfar[i] = distance - 1e-3f;
        asked->rays.mask[i] = UINT32_MAX;
        asked->rays.id[i] = (unsigned)i;
        asked->rays.flags[i] = 0;
        asked->rays.time[i] = 0;
    }
    return any;
}

PROCESSOR_FORMS static void add_light(const struct asked *restrict asked,
                                      struct lanes *restrict lanes)
{
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < LANES; i++) {
            const bool reaches = asked->valid[i] & (asked->rays.tfar[i] >= 0 ? -1 : 0);
            lanes->radiance[k][i] += reaches ? asked->weight[k][i] * asked->passed[k][i] : 0;
        }
}

/* Behind what was met. Returns whether any ray goes on. */
static bool go_on(const struct full_tracer *tracer, struct lanes *lanes)
{
    bool any = false;
    for (int i = 0; i < LANES; i++) {
        if (!lanes->active[i])
            continue;
        for (int k = 0; k < 3; k++)
            lanes->through[k][i] *= lanes->colors[BEHIND][k][i];
        lanes->active[i] = tracer->paints[lanes->query.hit.geomID[i]].is_opaque ? 0 : -1;
        any |= lanes->active[i];
        lanes->query.ray.tnear[i] = lanes->query.ray.tfar[i] * (1 + 1e-5f);
        lanes->query.ray.tfar[i] = FLT_MAX;
    }
    return any;
}

/* From layer to layer, until all rays have ended. */
static void trace(const struct full_tracer *tracer, const struct lamp *lamps, size_t lamp_count,
                  struct lanes *lanes)
{
    bool goes_on = true;
    for (int layer = 0; goes_on && layer < LAYERS_MAX; layer++) {
        int any = 0;
        for (int i = 0; i < LANES; i++)
            lanes->query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        intersect(tracer, lanes);
        for (int i = 0; i < LANES; i++)
            any |= lanes->active[i] &=
                lanes->query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID ? -1 : 0;
        if (!any)
            return;
        gather(tracer, lanes);
        find_surfaces(lanes);
        for (size_t l = 0; l < lamp_count; l++) {
            struct asked asked;
            if (!find_light(&lamps[l], lanes, &asked))
                continue;
            occlude(tracer, &asked);
            add_light(&asked, lanes);
        }
        goes_on = go_on(tracer, lanes);
    }
}

static void begin(const struct camera *camera, const struct image *image, int x, int y,
                  struct lanes *lanes)
{
    struct RTCRay16 *ray = &lanes->query.ray;
    for (int i = 0; i < LANES; i++) {
        const float right = (float)(x + i % COLUMNS) + 0.5f, down = (float)(y + i / COLUMNS) + 0.5f;
        const float px = (2 * right / (float)image->width_px - 1) * (float)camera->half_width;
        const float py = (1 - 2 * down / (float)image->height_px) * (float)camera->half_height;
        float d[3];
        for (int k = 0; k < 3; k++) {
            d[k] =
                (float)camera->right[k] * px + (float)camera->up[k] * py - (float)camera->back[k];
            lanes->through[k][i] = 1;
            lanes->radiance[k][i] = 0;
        }
        ray->org_x[i] = (float)camera->eye[0];
        ray->org_y[i] = (float)camera->eye[1];
        ray->org_z[i] = (float)camera->eye[2];
        ray->dir_x[i] = d[0];
        ray->dir_y[i] = d[1];
        ray->dir_z[i] = d[2];
        ray->tnear[i] = (float)camera->z_near;
        ray->tfar[i] = FLT_MAX;
        ray->mask[i] = UINT32_MAX;
        ray->time[i] = 0;
        ray->id[i] = (unsigned)i;
        ray->flags[i] = 0;
        lanes->active[i] =
            x + i % COLUMNS < image->width_px && y + i / COLUMNS < image->height_px ? -1 : 0;
    }
}

static void fill_lamp(const struct state_light *light, struct lamp *lamp)
{
    const bool is_spot = light->type == SCENE_LIGHT_SPOT;
    const float outer = cosf(light->outer_cone_rad), inner = cosf(light->inner_cone_rad);
    lamp->inverse_range = light->range > 0 ? 1 / light->range : 0;
    lamp->cone_scale = is_spot ? 1 / fmaxf(inner - outer, 1e-3f) : 0;
    lamp->cone_offset = is_spot ? -outer * lamp->cone_scale : 1;
    for (int k = 0; k < 3; k++) {
        lamp->position[k] = (float)light->position[k];
        lamp->direction[k] = (float)light->direction[k];
        lamp->color[k] = light->color[k];
    }
}

bool full_tracer_render(const struct full_tracer *tracer, const struct camera *camera,
                        const struct scene_state *state, struct image *image, struct error *err)
{
    const int width = image->width_px, height = image->height_px;
    struct lamp *lamps = calloc(state->light_count + 1, sizeof *lamps);
    struct lanes lanes = {.active = {0}};
    if (!lamps)
        return error_set(err, ERROR_NO_MEMORY, "lights of the full ray tracer");
    for (size_t i = 0; i < state->light_count; i++)
        fill_lamp(&state->lights[i], &lamps[i]);
    for (int y = 0; y < height; y += ROWS)
        for (int x = 0; x < width; x += COLUMNS) {
            begin(camera, image, x, y, &lanes);
            trace(tracer, lamps, state->light_count, &lanes);
            for (int i = 0; i < LANES; i++) {
                const int column = x + i % COLUMNS, row = y + i / COLUMNS;
                if (column >= width || row >= height)
                    continue;
                float *pixel =
                    (float *)image->pixels + 4 * ((size_t)row * (size_t)width + (size_t)column);
                for (int k = 0; k < 3; k++)
                    pixel[k] = lanes.radiance[k][i];
                pixel[3] =
                    1 - (lanes.through[0][i] + lanes.through[1][i] + lanes.through[2][i]) / 3;
            }
        }
    free(lamps);
    return true;
}
