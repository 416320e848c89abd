/* SPDX-License-Identifier: MIT */
/* Sixteen surfaces side by side have the bits of the scalar form, lane by lane, and what one lane
 * holds, be it infinite, no number or without any size, changes nothing in the other fifteen. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/raytrace/rt_terminator.h"
#include "renderer/raytrace/rt_wide.h"
#include "tests/support/light_scene.h"

enum { VERTICES = 3 * RT_WIDE, ROUNDS = 200 };

static const double EYE[3] = {0.3, 2.5, 6}, BACK[3] = {0, 0.6, 0.8};

/* A mesh of sixteen triangles, each with a surface in its lane, and a lamp. */
struct subject {
    double positions[VERTICES][3];
    float normals[VERTICES][3];
    uint32_t triangles[VERTICES];
    struct scene_material material;
    struct scene_primitive primitive;
    struct scene streams;
    struct rt_mesh mesh;
    struct rt_scene scene;
    struct rt_light_record record;
    double u[RT_WIDE], v[RT_WIDE], point[RT_WIDE][3], direction[RT_WIDE][3];
    int count[RT_WIDE];
    bool is_front[RT_WIDE];
    bool differ; /* surfaces have what follows in place of the material's, as textures do it */
    double base[RT_WIDE][3], roughness[RT_WIDE], metallic[RT_WIDE], lean[RT_WIDE][3];
};

struct shaded { /* one surface, by whichever form */
    double normal[3], view[3], middle[3], view_z, start[3], offset[3];
    float direction[3], distance_m, gain, weight[3];
    bool reflects; /* else there is no weight */
};

static void make_material(struct scene_material *material, uint64_t *seed, int round)
{
    static const float roughnesses[] = {0, 1e-3f, 0.3f, 1}, metallics[] = {0, 0.5f, 1};
    *material = (struct scene_material){.base_color = {0.8f, 0.4f, 0, 1},
                                        .ior = round % 5 ? 1.5f : 0,
                                        .roughness = roughnesses[round % 4],
                                        .metallic = metallics[round % 3]};
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        material->textures[slot].texture = -1;
    material->base_color[2] = (float)random_uniform(seed, 0, 1);
}

static void make_record(struct rt_light_record *record, uint64_t *seed, int round)
{
    static const enum scene_light_type types[] = {SCENE_LIGHT_SPOT, SCENE_LIGHT_POINT,
                                                  SCENE_LIGHT_DIRECTIONAL};
    static const float intensities[] = {1, 1e30f, 1e-30f};
    double d[3] = {random_uniform(seed, -0.4, 0.4), -1, random_uniform(seed, -0.4, 0.4)};
    vec3_normalize(d);
    double outer = cos(random_uniform(seed, 0.3, 2.5)), scale = 1 / (1 - outer);
    *record = (struct rt_light_record){.type = types[round % 3],
                                       .inverse_range = round % 2 ? 0.2f : 0,
                                       .cone_scale = (float)scale,
                                       .cone_offset = (float)(-outer * scale),
                                       .least_cosine = (float)outer};
    for (int k = 0; k < 3; k++) {
        record->position[k] = (float)random_uniform(seed, k == 1 ? 1 : -2, k == 1 ? 4 : 2);
        record->direction[k] = (float)d[k];
        record->color[k] = intensities[round % 7 % 3] * (float)(k + 1);
    }
}

static void make_lane(struct subject *s, uint64_t *seed, int lane)
{
    bool is_flat = lane % 4 == 0;
    s->count[lane] = 1 + lane % 4;
    s->is_front[lane] = lane % 5 != 2;
    s->u[lane] = random_uniform(seed, 0, 0.5) * s->count[lane];
    s->v[lane] = random_uniform(seed, 0, 0.5) * s->count[lane];
    for (int c = 0; c < 3; c++) {
        int vertex = 3 * lane + c;
        for (int k = 0; k < 3; k++) {
            s->positions[vertex][k] = random_uniform(seed, -1, 1) * (k == 1 ? 0.2 : 1);
            float lean = is_flat && c ? s->normals[vertex - c][k]
                                      : (float)random_uniform(seed, -0.4, 0.4) + (k == 1);
            s->normals[vertex][k] = lean;
        }
    }
    for (int k = 0; k < 3; k++) {
        s->point[lane][k] = random_uniform(seed, -1, 1) * (k == 1 ? 0.2 : 1) * s->count[lane];
        s->direction[lane][k] = (s->point[lane][k] - EYE[k]) * s->count[lane];
    }
}

static void make_paint(struct subject *s, uint64_t *seed, int lane)
{
    s->roughness[lane] = lane % 5 ? random_uniform(seed, 0, 1) : 0;
    s->metallic[lane] = lane % 3 ? random_uniform(seed, 0, 1) : 1;
    for (int k = 0; k < 3; k++) {
        s->base[lane][k] = random_uniform(seed, 0, 1);
        s->lean[lane][k] = lane % 4 ? random_uniform(seed, -0.4, 0.4) : 0;
    }
}

static void make_subject(struct subject *s, int round, bool differ)
{
    uint64_t seed = 1000 + (uint64_t)round;
    *s = (struct subject){.mesh = {.class_ = STATE_OPAQUE, .is_mirrored = round % 7 == 3},
                          .differ = differ};
    make_material(&s->material, &seed, round);
    make_record(&s->record, &seed, round);
    for (uint32_t i = 0; i < VERTICES; i++)
        s->triangles[i] = i;
    for (int lane = 0; lane < RT_WIDE; lane++)
        make_lane(s, &seed, lane);
    for (int lane = 0; lane < RT_WIDE; lane++)
        make_paint(s, &seed, lane);
    s->mesh.positions = s->positions;
    s->mesh.triangles = s->triangles;
    s->mesh.normals = s->normals[0];
    s->mesh.material = &s->material;
    s->mesh.primitive = &s->primitive;
    s->mesh.streams = &s->streams;
    for (int i = 0; i < 9; i++)
        s->mesh.normal_matrix[i / 3][i % 3] = (i % 4 == 0) + random_uniform(&seed, -0.2, 0.2);
    s->scene.meshes = &s->mesh;
    s->scene.mesh_count = 1;
    s->scene.nudge_m = 1e-5;
    s->scene.origin[1] = 0.25;
}

static void evaluate(const struct subject *s, const struct rt_hit *hit, struct rt_surface *surface)
{
    const uint32_t lane = hit->triangle;
    rt_surface_evaluate(&s->scene, hit, NULL, surface);
    if (!s->differ)
        return;
    surface->roughness = s->roughness[lane];
    surface->metallic = s->metallic[lane];
    for (int k = 0; k < 3; k++) {
        surface->base[k] = s->base[lane][k];
        surface->normal[k] += s->lean[lane][k];
    }
    (void)!vec3_normalize(surface->normal);
}

static struct rt_hit hit_of(const struct subject *s, int lane)
{
    return (struct rt_hit){.triangle = (uint32_t)lane,
                           .u = s->u[lane] / s->count[lane],
                           .v = s->v[lane] / s->count[lane],
                           .is_front = s->is_front[lane],
                           .is_opaque = true};
}

/* As rt_batch_light has it. */
static void shade_scalar(const struct subject *s, int lane, struct shaded *out)
{
    double count = s->count[lane], normal[3], relative[3], reflected[3];
    const struct rt_hit hit = hit_of(s, lane);
    struct rt_light_record record = s->record;
    const struct rt_light_set lights = {.records = &record};
    struct rt_surface surface;
    struct rt_reflector reflector;
    struct rt_smooth_start smooth;
    float point[3];
    *out = (struct shaded){.gain = 0};
    for (int k = 0; k < 3; k++) {
        out->middle[k] = s->point[lane][k] / count;
        out->view[k] = -s->direction[lane][k];
        relative[k] = out->middle[k] + s->scene.origin[k] - EYE[k];
        point[k] = (float)out->middle[k];
    }
    (void)!vec3_normalize(out->view);
    out->view_z = -vec3_dot(relative, BACK);
    rt_scene_normal(&s->scene, &hit, normal);
    bool is_smooth = rt_terminator_find(&s->scene, &hit, out->middle, &smooth);
    for (int k = 0; k < 3; k++) {
        out->start[k] = out->middle[k] + (is_smooth ? smooth.offset[k] : 0);
        out->offset[k] = (is_smooth ? smooth.normal[k] : normal[k]) * s->scene.nudge_m;
    }
    evaluate(s, &hit, &surface);
    memcpy(out->normal, surface.normal, sizeof out->normal);
    rt_reflector_init(&reflector, &surface, out->view);
    out->gain = rt_light_set_arrive(&lights, 0, point, out->direction, &out->distance_m);
    const double l[3] = {(double)out->direction[0], (double)out->direction[1],
                         (double)out->direction[2]};
    out->reflects = out->gain > 0 && rt_reflect(&reflector, l, reflected);
    for (int k = 0; k < 3 && out->reflects; k++)
        out->weight[k] = (float)(reflected[k] * (double)out->gain * (double)s->record.color[k]);
}

static void gather(const struct subject *s, struct rt_wide *wide)
{
    for (int i = 0; i < RT_WIDE; i++) {
        wide->u[i] = s->u[i];
        wide->v[i] = s->v[i];
        wide->count[i] = s->count[i];
        wide->side[i] = s->is_front[i] ? 1 : -1;
        for (int k = 0; k < 3; k++) {
            wide->point[k][i] = s->point[i][k];
            wide->direction[k][i] = s->direction[i][k];
            for (int c = 0; c < 3; c++) {
                wide->corners[c][k][i] = s->positions[3 * i + c][k];
                wide->normals[c][k][i] = s->normals[3 * i + c][k];
            }
        }
    }
}

/* The reflector of whichever surface: its colours are those of all. */
static void make_reflector(const struct subject *s, struct rt_reflector *reflector)
{
    struct rt_surface surface;
    const struct rt_hit hit = {.is_front = true, .u = 0.2, .v = 0.2};
    rt_surface_evaluate(&s->scene, &hit, NULL, &surface);
    rt_reflector_init(reflector, &surface, (const double[3]){0, 1, 0});
}

/* Each lane has a reflector of its own. */
static void paint(const struct subject *s, struct rt_wide *wide)
{
    for (int lane = 0; lane < RT_WIDE; lane++) {
        const double view[3] = {wide->view[0][lane], wide->view[1][lane], wide->view[2][lane]};
        const struct rt_hit hit = hit_of(s, lane);
        struct rt_surface surface;
        struct rt_reflector reflector;
        evaluate(s, &hit, &surface);
        rt_reflector_init(&reflector, &surface, view);
        rt_wide_paint(&reflector, lane, wide);
    }
}

static void shade_wide(const struct subject *s, struct shaded out[RT_WIDE])
{
    static struct rt_wide wide; /* zeroed, and then what the call before left */
    static struct rt_wide_light light;
    struct rt_wide_mesh alike = {
        .is_mirrored = s->mesh.is_mirrored, .is_smoothed = true, .nudge_m = s->scene.nudge_m};
    struct rt_reflector reflector;
    memcpy(alike.normal_matrix, s->mesh.normal_matrix, sizeof alike.normal_matrix);
    memcpy(alike.origin, s->scene.origin, sizeof alike.origin);
    memcpy(alike.eye, EYE, sizeof alike.eye);
    memcpy(alike.back, BACK, sizeof alike.back);
    gather(s, &wide);
    rt_wide_place(&alike, &wide);
    make_reflector(s, &reflector);
    if (s->differ)
        paint(s, &wide);
    else
        rt_wide_look(&reflector, &wide);
    rt_wide_arrive(&s->record, &wide, &light);
    rt_wide_reflect(s->differ ? NULL : &reflector, &s->record, &wide, &light);
    for (int i = 0; i < RT_WIDE; i++) {
        if (light.arrives[i] != (light.gain[i] > 0))
            fail_msg("lane %d: a gain of %g, but arrives is %u", i, light.gain[i],
                     light.arrives[i]);
        out[i] = (struct shaded){.view_z = wide.view_z[i],
                                 .distance_m = light.distance_m[i],
                                 .gain = (float)light.gain[i],
                                 .reflects = light.reflects[i]};
        for (int k = 0; k < 3; k++) {
            out[i].normal[k] = wide.normal[k][i];
            out[i].view[k] = wide.view[k][i];
            out[i].middle[k] = wide.middle[k][i];
            out[i].start[k] = wide.start[k][i];
            out[i].offset[k] = wide.offset[k][i];
            out[i].direction[k] = light.direction[k][i];
            out[i].weight[k] = out[i].reflects ? light.weight[k][i] : 0;
        }
    }
}

static bool is_same_f64(const double *a, const double *b, int count)
{
    for (int i = 0; i < count; i++)
        if (a[i] != b[i] && !(isnan(a[i]) && isnan(b[i])))
            return false;
    return true;
}

static bool is_same_f32(const float *a, const float *b, int count)
{
    for (int i = 0; i < count; i++)
        if (a[i] != b[i] && !(isnan(a[i]) && isnan(b[i])))
            return false;
    return true;
}

/* Zeros of either sign and all that is no number are alike. Of light that does not arrive only that
 * is compared. */
static const char *difference(const struct shaded *a, const struct shaded *b)
{
    if (!is_same_f64(a->middle, b->middle, 3))
        return "point";
    if (!is_same_f64(a->view, b->view, 3) || !is_same_f64(&a->view_z, &b->view_z, 1))
        return "view";
    if (!is_same_f64(a->normal, b->normal, 3))
        return "normal";
    if (!is_same_f64(a->start, b->start, 3) || !is_same_f64(a->offset, b->offset, 3))
        return "start of rays";
    if (!is_same_f32(&a->gain, &b->gain, 1))
        return "gain";
    if (a->gain > 0 && (!is_same_f32(a->direction, b->direction, 3) ||
                        !is_same_f32(&a->distance_m, &b->distance_m, 1)))
        return "direction";
    if (a->reflects != b->reflects)
        return "whether it reflects";
    return is_same_f32(a->weight, b->weight, 3) ? NULL : "weight";
}

static int compare_with_scalar(const struct subject *s, const struct shaded *wide, const char *what,
                               int round)
{
    int reflecting = 0;
    for (int lane = 0; lane < RT_WIDE; lane++) {
        struct shaded scalar;
        shade_scalar(s, lane, &scalar);
        const char *wrong = difference(&scalar, &wide[lane]);
        if (wrong)
            fail_msg("%s, round %d, lane %d: another %s", what, round, lane, wrong);
        reflecting += scalar.reflects;
    }
    return reflecting;
}

static void sixteen_surfaces_have_the_bits_of_one_after_the_other(void **state)
{
    (void)state;
    struct subject s;
    struct shaded wide[RT_WIDE];
    int reflecting = 0;
    for (int i = 0; i < 2 * ROUNDS; i++) {
        const int round = i % ROUNDS;
        make_subject(&s, round, i >= ROUNDS);
        shade_wide(&s, wide);
        reflecting += compare_with_scalar(&s, wide, s.differ ? "different" : "alike", round);
    }
    print_message("%d of %d surfaces reflect\n", reflecting, 2 * ROUNDS * RT_WIDE);
    assert_true(reflecting > 2 * ROUNDS * RT_WIDE / 10);
}

enum extreme {
    NO_NUMBER_CORNER,
    INFINITE_CORNER,
    NO_AREA,
    HUGE_TRIANGLE,
    ZERO_NORMALS,
    NO_NUMBER_NORMAL,
    INFINITE_NORMAL,
    NO_SAMPLES,
    NO_DIRECTION,
    NO_NUMBER_DIRECTION,
    INFINITE_POINT,
    NO_NUMBER_POINT,
    AT_THE_LAMP,
    TINY_WEIGHTS,
    NO_NUMBER_COLOR, /* this and what follows: of surfaces whose materials differ */
    INFINITE_COLOR,
    NO_NUMBER_ROUGHNESS,
    NEGATIVE_ROUGHNESS,
    INFINITE_METALLIC,
    NO_LEAN,
    NO_NUMBER_LEAN,
    EXTREMES
};

static void spoil(struct subject *s, int lane, enum extreme extreme)
{
    double(*corners)[3] = &s->positions[3 * lane];
    float(*normals)[3] = &s->normals[3 * lane];
    switch (extreme) {
    case NO_NUMBER_CORNER:
        corners[1][2] = (double)NAN;
        break;
    case INFINITE_CORNER:
        corners[2][0] = INFINITY;
        break;
    case NO_AREA:
        memcpy(corners[1], corners[0], sizeof corners[1]);
        break;
    case HUGE_TRIANGLE:
        for (int i = 0; i < 9; i++)
            corners[i / 3][i % 3] *= 1e200;
        break;
    case ZERO_NORMALS:
        memset(normals, 0, 3 * sizeof *normals);
        break;
    case NO_NUMBER_NORMAL:
        normals[1][1] = NAN;
        break;
    case INFINITE_NORMAL:
        normals[2][0] = -INFINITY;
        break;
    case NO_SAMPLES:
        s->count[lane] = 0;
        break;
    case NO_DIRECTION:
        memset(s->direction[lane], 0, sizeof s->direction[lane]);
        break;
    case NO_NUMBER_DIRECTION:
        s->direction[lane][0] = (double)NAN;
        break;
    case INFINITE_POINT:
        s->point[lane][1] = -INFINITY;
        break;
    case NO_NUMBER_POINT:
        s->point[lane][2] = (double)NAN;
        break;
    case AT_THE_LAMP:
        for (int k = 0; k < 3; k++)
            s->point[lane][k] = (double)s->record.position[k] * s->count[lane];
        break;
    case TINY_WEIGHTS:
        s->u[lane] = 1e-310;
        break;
    case NO_NUMBER_COLOR:
        s->base[lane][1] = (double)NAN;
        break;
    case INFINITE_COLOR:
        s->base[lane][2] = INFINITY;
        break;
    case NO_NUMBER_ROUGHNESS:
        s->roughness[lane] = (double)NAN;
        break;
    case NEGATIVE_ROUGHNESS:
        s->roughness[lane] = -1e30;
        break;
    case INFINITE_METALLIC:
        s->metallic[lane] = INFINITY;
        break;
    case NO_LEAN:
        memset(s->lean[lane], 0, sizeof s->lean[lane]);
        break;
    case NO_NUMBER_LEAN:
        s->lean[lane][0] = (double)NAN;
        break;
    case EXTREMES:
        break;
    }
}

static void an_extreme_in_one_lane_changes_no_other(void **state)
{
    (void)state;
    struct subject s;
    struct shaded before[RT_WIDE], after[RT_WIDE];
    for (int round = 0; round < 12; round++)
        for (enum extreme extreme = 0; extreme < EXTREMES; extreme++)
            for (int lane = 0; lane < RT_WIDE; lane++) {
                char what[32];
                make_subject(&s, round, (round + lane) % 2);
                shade_wide(&s, before);
                spoil(&s, lane, extreme);
                shade_wide(&s, after);
                for (int i = 0; i < RT_WIDE; i++)
                    if (i != lane && difference(&before[i], &after[i]))
                        fail_msg("extreme %d in lane %d changes lane %d", extreme, lane, i);
                snprintf(what, sizeof what, "extreme %d in %d", extreme, lane);
                compare_with_scalar(&s, after, what, round);
            }
}

static void each_extreme_beside_each_changes_no_other(void **state)
{
    (void)state;
    struct subject s;
    struct shaded before[RT_WIDE], after[RT_WIDE];
    for (enum extreme first = 0; first < EXTREMES; first++)
        for (enum extreme second = 0; second < EXTREMES; second++) {
            const int round = (int)(first + second), one = (int)(3 * first + second) % RT_WIDE;
            const int other = (one + 1 + round % (RT_WIDE - 1)) % RT_WIDE;
            char what[32];
            make_subject(&s, round, true);
            shade_wide(&s, before);
            spoil(&s, one, first);
            spoil(&s, other, second);
            shade_wide(&s, after);
            for (int i = 0; i < RT_WIDE; i++)
                if (i != one && i != other && difference(&before[i], &after[i]))
                    fail_msg("extremes %d in lane %d and %d in %d change lane %d", first, one,
                             second, other, i);
            snprintf(what, sizeof what, "extremes %d and %d", first, second);
            compare_with_scalar(&s, after, what, round);
        }
}

/* Of the lamp, which all lanes share, and of materials, beside each extreme of a lane. */
static void extreme_lamps_and_materials_have_the_bits_of_the_scalar_form(void **state)
{
    (void)state;
    const float extremes[] = {0, -0.f, NAN, INFINITY, -1, 1e38f, 1e-42f};
    struct subject s;
    struct shaded wide[RT_WIDE];
    for (enum extreme beside = 0; beside <= EXTREMES; beside++)
        for (size_t i = 0; i < sizeof extremes / sizeof *extremes; i++)
            for (int k = 0; k < 12; k++) {
                const int what = k % 6, round = (int)beside % 12;
                make_subject(&s, round, k >= 6);
                spoil(&s, (round + k) % RT_WIDE, beside);
                float *at[] = {&s.record.color[1],      &s.record.position[0],
                               &s.record.inverse_range, &s.record.least_cosine,
                               &s.material.roughness,   &s.material.ior};
                *at[what] = extremes[i];
                shade_wide(&s, wide);
                compare_with_scalar(&s, wide, "extreme lamp or material", 100 * what + (int)i);
            }
}

/* Rays of all lengths from the eye to about the middle of each triangle, some past it. */
static void aim_rays(const struct subject *s, uint64_t *seed, struct rt_wide_rays *rays,
                     struct rt_wide_hits *hits)
{
    for (int i = 0; i < RT_WIDE; i++) {
        for (int k = 0; k < 3; k++) {
            double middle = 0;
            for (int c = 0; c < 3; c++) {
                hits->corners[c][k][i] = s->positions[3 * i + c][k];
                middle += s->positions[3 * i + c][k] / 3;
            }
            rays->origin[k][i] = EYE[k];
            rays->direction[k][i] = middle - EYE[k] + random_uniform(seed, -0.2, 0.2);
        }
        rays->t_min[i] = random_uniform(seed, 0, 1.2);
        rays->t_max[i] = i % 3 ? INFINITY : random_uniform(seed, 0.5, 1.5);
        hits->turn[i] = s->mesh.is_mirrored ? -1 : 1;
    }
}

static int compare_hits(const struct subject *s, const struct rt_wide_rays *rays,
                        const struct rt_wide_hits *wide, const char *what)
{
    int met = 0;
    for (int i = 0; i < RT_WIDE; i++) {
        struct rt_hit hit = {.mesh = 0};
        struct rt_hits hits = {.hits = &hit};
        struct rt_ray ray = {.t_min = rays->t_min[i],
                             .t_max = rays->t_max[i],
                             .skip_mesh = UINT32_MAX,
                             .skip_triangle = UINT32_MAX};
        double normal[3], point[3];
        for (int k = 0; k < 3; k++) {
            ray.origin[k] = rays->origin[k][i];
            ray.direction[k] = rays->direction[k][i];
        }
        bool is_met = rt_scene_add_hit(&s->scene, &ray, 0, (uint32_t)i, &hits);
        if (is_met != wide->is_met[i])
            fail_msg("%s, lane %d: met is %u, not %d", what, i, wide->is_met[i], is_met);
        met += is_met;
        for (int k = 0; k < 3; k++)
            point[k] = ray.origin[k] + ray.direction[k] * hit.t;
        rt_scene_normal(&s->scene, &hit, normal);
        for (int k = 0; k < 3 && is_met; k++)
            if (!is_same_f64(&point[k], &wide->point[k][i], 1) ||
                !is_same_f64(&normal[k], &wide->normal[k][i], 1))
                fail_msg("%s, lane %d: another point or normal", what, i);
        if (is_met &&
            (!is_same_f64(&hit.t, &wide->t[i], 1) || !is_same_f64(&hit.u, &wide->u[i], 1) ||
             !is_same_f64(&hit.v, &wide->v[i], 1) || hit.is_front != wide->is_front[i]))
            fail_msg("%s, lane %d: another place", what, i);
    }
    return met;
}

/* The same of triangles that rays from one eye are known to meet, summed up over samples; every
 * other lane stays as it is. */
static void compare_found(const struct subject *s, const struct rt_wide_rays *rays,
                          const struct rt_wide_hits *hits, int samples)
{
    static struct rt_wide wide;
    static double ways[2][3][RT_WIDE];
    uint32_t sought[RT_WIDE];
    memset(&wide, 0, sizeof wide);
    memcpy(wide.corners, hits->corners, sizeof wide.corners);
    memcpy(ways[0], rays->direction, sizeof ways[0]);
    memcpy(ways[1], rays->direction, sizeof ways[1]);
    for (int i = 0; i < RT_WIDE; i++)
        sought[i] = (uint32_t)(i + samples) % 2;
    rt_wide_find(EYE, s->mesh.is_mirrored, samples, (const double(*)[3][RT_WIDE])ways, sought,
                 &wide);
    for (int i = 0; i < RT_WIDE; i++) {
        const double times = sought[i] * (double)samples;
        const double u = hits->u[i] * times, v = hits->v[i] * times;
        if (!hits->is_met[i])
            continue;
        bool is_same = is_same_f64(&wide.u[i], &u, 1) && is_same_f64(&wide.v[i], &v, 1) &&
                       wide.side[i] == (sought[i] ? hits->is_front[i] ? 1 : -1 : 0);
        for (int k = 0; k < 3; k++) {
            const double point = hits->point[k][i] * times, way = ways[0][k][i] * times;
            is_same &= is_same_f64(&wide.point[k][i], &point, 1) &&
                       is_same_f64(&wide.direction[k][i], &way, 1);
        }
        if (!is_same)
            fail_msg("lane %d: found in another place", i);
    }
}

static void hits_side_by_side_have_the_bits_of_one_after_the_other(void **state)
{
    (void)state;
    static struct rt_wide_rays rays;
    static struct rt_wide_hits hits;
    struct subject s;
    int met = 0;
    for (int round = 0; round < ROUNDS; round++) {
        uint64_t seed = 77 + (uint64_t)round;
        make_subject(&s, round, false);
        s.mesh.is_double_sided = true;
        aim_rays(&s, &seed, &rays, &hits);
        rt_wide_meet(&rays, &hits, true);
        met += compare_hits(&s, &rays, &hits, "hits");
        compare_found(&s, &rays, &hits, 1 + round % 2);
        for (enum extreme extreme = 0; extreme <= HUGE_TRIANGLE; extreme++) {
            make_subject(&s, round, false);
            spoil(&s, round % RT_WIDE, extreme);
            aim_rays(&s, &seed, &rays, &hits);
            rays.direction[1][(round + 5) % RT_WIDE] = extreme % 2 ? (double)NAN : INFINITY;
            rt_wide_meet(&rays, &hits, true);
            compare_hits(&s, &rays, &hits, "hits beside an extreme");
            compare_found(&s, &rays, &hits, 1 + round % 2);
        }
    }
    print_message("%d of %d rays end\n", met, ROUNDS * RT_WIDE);
    assert_in_range(met, ROUNDS * RT_WIDE / 4, ROUNDS * RT_WIDE * 3 / 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hits_side_by_side_have_the_bits_of_one_after_the_other),
        cmocka_unit_test(sixteen_surfaces_have_the_bits_of_one_after_the_other),
        cmocka_unit_test(an_extreme_in_one_lane_changes_no_other),
        cmocka_unit_test(each_extreme_beside_each_changes_no_other),
        cmocka_unit_test(extreme_lamps_and_materials_have_the_bits_of_the_scalar_form),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
