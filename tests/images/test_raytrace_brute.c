/* SPDX-License-Identifier: MIT */
/* A hundredth of the camera and shadow rays of real pictures against all triangles one by one, in
 * f64: the reference (one ray at a time) and production (packets of every width) alike. Exact
 * means: the same triangles at distances equal to 1e-9. A ray that passes the border of a triangle
 * nearer than f32 tells vertices apart (rt_scene.nudge_m) may count that triangle or not; nothing
 * else about it is left open. Rays are counted whole: none is dropped. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/demo_scene.h"
#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_light.h"
#include "renderer/raytrace/rt_packet.h"
#include "renderer/raytrace/rt_surface.h"
#include "tests/support/accuracy_log.h"
#include "tests/support/import_support.h"
#include "tests/support/light_scene.h"

struct meeting {        /* of a ray and a triangle */
    double t, border_m; /* how far inside the triangle the ray passes, across it; < 0: outside */
    uint32_t mesh, triangle;
    bool is_end;
};

struct meetings {
    struct meeting *items;
    size_t count, capacity;
};

struct tally {
    int rays, hits, doubtful; /* the last: rays with a triangle that may be either */
    int wrong;                /* rays that miss a triangle, or have one too many */
    double worst;             /* relative error of a distance */
};

/* Möller and Trumbore 1997, with edge tests; the weights as lengths across the ray. */
static bool meet(const double *v0, const double *v1, const double *v2, const struct rt_ray *ray,
                 double reach_m, struct meeting *m, bool *is_front)
{
    double e1[3], e2[3], e3[3], p[3], s[3], q[3], n[3];
    vec3_sub(v1, v0, e1);
    vec3_sub(v2, v0, e2);
    vec3_cross(ray->direction, e2, p);
    double det = vec3_dot(e1, p);
    if (det == 0)
        return false;
    vec3_sub(ray->origin, v0, s);
    double u = vec3_dot(s, p) / det;
    if (u < -1 || u > 2) /* far outside, but of slivers, which the exact test below sees */
        return false;
    vec3_cross(s, e1, q);
    double w = vec3_dot(ray->direction, q) / det;
    if (w < -1 || w > 2)
        return false;
    vec3_sub(v2, v1, e3);
    vec3_cross(e1, e2, n);
    double area = vec3_length(n), cosine = fabs(det) / (area * vec3_length(ray->direction));
    double across[3] = {(1 - u - w) * area / vec3_length(e3), u * area / vec3_length(e2),
                        w * area / vec3_length(e1)};
    m->border_m = fmin(fmin(across[0], across[1]), across[2]) * cosine;
    m->t = vec3_dot(e2, q) / det;
    *is_front = det > 0;
    return m->border_m >= -reach_m;
}

static bool reaches_cutoff(const struct rt_scene *scene, const struct rt_ray *ray,
                           const struct meeting *m)
{
    const struct state_item *item = scene->meshes[m->mesh].item;
    const struct scene_primitive *p = &scene->state->scene->primitives[item->primitive];
    const struct scene_material *material = &scene->state->materials[item->material].base;
    uint32_t index[3];
    double e1[3], e2[3], at[3], n[3], q[3], base[4];
    rt_mesh_triangle(&scene->meshes[m->mesh], m->triangle, index);
    const double(*v)[3] = (const double(*)[3])scene->meshes[m->mesh].positions;
    const double *v0 = v[index[0] - p->first_vertex];
    vec3_sub(v[index[1] - p->first_vertex], v0, e1);
    vec3_sub(v[index[2] - p->first_vertex], v0, e2);
    for (int k = 0; k < 3; k++)
        at[k] = ray->origin[k] + ray->direction[k] * m->t - v0[k];
    struct rt_hit hit = {.mesh = m->mesh, .triangle = m->triangle};
    vec3_cross(e1, e2, n);
    vec3_cross(at, e2, q);
    hit.u = vec3_dot(q, n) / vec3_dot(n, n);
    vec3_cross(e1, at, q);
    hit.v = vec3_dot(q, n) / vec3_dot(n, n);
    rt_surface_base(scene, &hit, NULL, base);
    return base[3] >= (double)material->alpha_cutoff;
}

static bool is_solid(const struct rt_scene *scene, const struct rt_ray *ray,
                     const struct meeting *m)
{
    const struct state_item *item = scene->meshes[m->mesh].item;
    if (item->class_ != STATE_MASKED)
        return item->class_ == STATE_OPAQUE;
    return reaches_cutoff(scene, ray, m);
}

/* Masks that transmit have nothing in their holes. */
static bool is_nothing(const struct rt_scene *scene, const struct rt_ray *ray,
                       const struct meeting *m)
{
    const struct state_item *item = scene->meshes[m->mesh].item;
    return item->class_ == STATE_TRANSPARENT && !item->is_medium &&
           scene->state->materials[item->material].base.alpha_mode == SCENE_MASK &&
           !reaches_cutoff(scene, ray, m);
}

static void keep(struct meetings *all, const struct meeting *m)
{
    if (all->count == all->capacity) {
        all->capacity = 2 * all->capacity + 64;
        all->items = realloc(all->items, all->capacity * sizeof *all->items);
        assert_non_null(all->items);
    }
    all->items[all->count++] = *m;
}

/* All triangles that the ray meets or nearly meets, whatever is before them. */
static void meet_all(const struct rt_scene *scene, const struct rt_ray *ray, struct meetings *all)
{
    all->count = 0;
    for (uint32_t mesh = 0; mesh < scene->mesh_count; mesh++) {
        const struct state_item *item = scene->meshes[mesh].item;
        const struct scene_primitive *p = &scene->state->scene->primitives[item->primitive];
        const uint32_t *index = scene->state->scene->indices + p->first_index;
        const double(*v)[3] = (const double(*)[3])scene->meshes[mesh].positions;
        bool is_double_sided =
            scene->state->materials[item->material].base.flags & SCENE_MATERIAL_DOUBLE_SIDED;
        for (uint32_t i = 0; i < p->index_count / 3; i++) {
            struct meeting m = {.mesh = mesh, .triangle = i};
            bool is_front;
            if (!meet(v[index[3 * i]], v[index[3 * i + 1]], v[index[3 * i + 2]], ray,
                      scene->nudge_m, &m, &is_front))
                continue;
            bool is_seen = !ray->culls_back_faces || is_double_sided || item->is_medium ||
                           is_front != item->is_mirrored;
            if (m.t <= ray->t_min || m.t >= ray->t_max || !is_seen ||
                (mesh == ray->skip_mesh && i == ray->skip_triangle) || is_nothing(scene, ray, &m))
                continue;
            m.is_end = is_solid(scene, ray, &m);
            keep(all, &m);
        }
    }
}

static const struct meeting *find(const struct meetings *all, const struct rt_hit *hit)
{
    for (size_t i = 0; i < all->count; i++)
        if (all->items[i].mesh == hit->mesh && all->items[i].triangle == hit->triangle)
            return &all->items[i];
    return NULL;
}

static bool contains(const struct rt_hits *hits, const struct meeting *m)
{
    for (size_t i = 0; i < hits->count; i++)
        if (hits->hits[i].mesh == m->mesh && hits->hits[i].triangle == m->triangle)
            return true;
    return false;
}

/* Whether the hits are the triangles met before the first end. spread: of t, within which the order
 * of two may be either. */
static bool agrees(const struct rt_scene *scene, const struct meetings *all,
                   const struct rt_hits *hits, double spread, double *worst, bool *is_doubtful)
{
    double end = INFINITY;
    for (size_t i = 0; i < hits->count; i++) {
        const struct meeting *m = find(all, &hits->hits[i]);
        if (!m || (i && hits->hits[i].t < hits->hits[i - 1].t))
            return false;
        *worst = fmax(*worst, fabs(m->t - hits->hits[i].t) / (1 + m->t));
        if (hits->hits[i].is_opaque != m->is_end)
            return false;
        if (m->is_end)
            end = m->t;
    }
    for (size_t i = 0; i < all->count; i++) {
        const struct meeting *m = &all->items[i];
        if (m->t >= end - spread || contains(hits, m))
            continue;
        if (m->border_m > scene->nudge_m)
            return false;
        *is_doubtful = true;
    }
    return true;
}

static void count_ray(struct tally *tally, bool is_right, size_t hits, bool is_doubtful)
{
    tally->rays++;
    tally->hits += (int)hits;
    tally->wrong += !is_right;
    tally->doubtful += is_doubtful;
}

enum {
    WIDTHS = 3,
    LANE = 10
}; /* packets of 16, twice 8, and rays one by one; that one is judged */

struct brute {
    const struct rt_scene *scene;
    struct meetings all;
    struct rt_hits hits;
    struct rt_scene by_width[WIDTHS]; /* the scene, but for its lanes */
    struct rt_packet packets[WIDTHS];
    struct tally camera, shadow, camera_packet, shadow_packet;
};

static void brute_packets_init(struct brute *brute, const struct rt_scene *scene)
{
    static const int lanes[WIDTHS] = {16, 8, 1};
    struct error err = {0};
    for (int i = 0; i < WIDTHS; i++) {
        brute->by_width[i] = *scene;
        brute->by_width[i].lanes = lanes[i] < scene->lanes ? lanes[i] : scene->lanes;
        assert_true(rt_packet_init(&brute->packets[i], &brute->by_width[i], &err));
    }
}

static void fill_lanes(struct rt_packet *packet, const struct rt_ray *ray)
{
    packet->count = LANE + 1;
    for (int i = 0; i <= LANE; i++)
        packet->rays[i] = *ray;
}

/* Whether the packet says of its last ray what all triangles say. Opaque surfaces are ordered in
 * f32 there. */
static bool sees_right(struct brute *brute, struct rt_packet *packet, const struct rt_ray *ray,
                       struct tally *tally, bool *is_doubtful)
{
    fill_lanes(packet, ray);
    rt_packet_collect(packet);
    return agrees(brute->scene, &brute->all, &packet->hits[LANE], 4 * brute->scene->nudge_m,
                  &tally->worst, is_doubtful);
}

static bool shades_right(struct brute *brute, struct rt_packet *packet, const struct rt_ray *ray,
                         struct tally *tally, bool *is_doubtful)
{
    double spread = 4 * brute->scene->nudge_m;
    bool is_blocked = false, may_be = false;
    fill_lanes(packet, ray);
    rt_packet_occlude(packet);
    for (size_t i = 0; i < brute->all.count; i++) {
        const struct meeting *m = &brute->all.items[i];
        bool is_sure = m->border_m > brute->scene->nudge_m && m->t > ray->t_min + spread &&
                       m->t < ray->t_max - spread;
        is_blocked |= m->is_end && is_sure;
        may_be |= m->is_end;
    }
    *is_doubtful |= may_be && !is_blocked;
    if (packet->is_occluded[LANE])
        return may_be;
    return !is_blocked && agrees(brute->scene, &brute->all, &packet->hits[LANE], spread,
                                 &tally->worst, is_doubtful);
}

/* After meet_all of the ray. */
static void check_packet(struct brute *brute, const struct rt_ray *ray, bool is_shadow)
{
    struct tally *tally = is_shadow ? &brute->shadow_packet : &brute->camera_packet;
    bool is_doubtful = false, is_right = true;
    for (int i = 0; i < WIDTHS; i++)
        is_right &= (is_shadow ? shades_right : sees_right)(brute, &brute->packets[i], ray, tally,
                                                            &is_doubtful);
    const struct rt_packet *packet = &brute->packets[0];
    bool is_dark = is_shadow && packet->is_occluded[LANE];
    count_ray(tally, is_right, is_dark ? 0 : packet->hits[LANE].count, is_doubtful);
}

static void check_reference(struct brute *brute, const struct rt_ray *ray, bool is_shadow)
{
    struct tally *tally = is_shadow ? &brute->shadow : &brute->camera;
    bool is_doubtful = false;
    meet_all(brute->scene, ray, &brute->all);
    rt_scene_collect(brute->scene, ray, &brute->hits);
    bool is_right = agrees(brute->scene, &brute->all, &brute->hits, 1e-9 * (1 + ray->t_min),
                           &tally->worst, &is_doubtful);
    count_ray(tally, is_right, brute->hits.count, is_doubtful);
}

/* Production's rays keep clear of the receiver and the light by what f32 may misplace them. */
static void check_clear_ray(struct brute *brute, const struct rt_ray *ray, const struct rt_hit *on)
{
    double normal[3], nudge = brute->scene->nudge_m;
    struct rt_ray clear = *ray;
    rt_scene_normal(brute->scene, on, normal);
    clear.t_max = fmax(ray->t_max - 8 * nudge, ray->t_min);
    for (int k = 0; k < 3; k++)
        clear.origin[k] += normal[k] * (vec3_dot(normal, ray->direction) < 0 ? -nudge : nudge);
    meet_all(brute->scene, &clear, &brute->all);
    check_packet(brute, &clear, true);
}

/* The camera ray, and from all it shows the rays to all lights. */
static void check_pixel(struct brute *brute, const struct rt_ray *ray)
{
    enum { LAYERS_MAX = 64 };
    const struct scene_state *state = brute->scene->state;
    struct rt_hit layers[LAYERS_MAX];
    check_reference(brute, ray, false);
    check_packet(brute, ray, false);
    size_t count = brute->hits.count < LAYERS_MAX ? brute->hits.count : LAYERS_MAX;
    memcpy(layers, brute->hits.hits, count * sizeof *layers);
    for (size_t i = 0; i < count; i++) {
        double point[3];
        for (int k = 0; k < 3; k++)
            point[k] = ray->origin[k] + ray->direction[k] * layers[i].t;
        for (size_t l = 0; l < state->light_count; l++) {
            struct rt_light_sample sample = {.count = 1};
            struct rt_arrival arrival;
            struct rt_ray shadow;
            rt_light_arrive(&state->lights[l], &sample, brute->scene->origin, point, &arrival);
            rt_shadow_ray(brute->scene, &arrival, point, &layers[i], &shadow);
            if (arrival.gain <= 0)
                continue;
            check_reference(brute, &shadow, true);
            check_clear_ray(brute, &shadow, &layers[i]);
        }
    }
}

/* Masks decide by bounds what their texels say, at random places of all masked triangles. */
static void check_masks(const struct rt_scene *scene, int *solid, int *holes)
{
    enum { PLACES = 40000 };
    uint64_t seed = 77;
    for (uint32_t mesh = 0; mesh < scene->mesh_count; mesh++) {
        const struct state_item *item = scene->meshes[mesh].item;
        uint32_t triangles = scene->state->scene->primitives[item->primitive].index_count / 3;
        double cutoff = (double)scene->state->materials[item->material].base.alpha_cutoff;
        for (int i = 0; item->class_ == STATE_MASKED && i < PLACES; i++) {
            struct rt_hit hit = {.mesh = mesh,
                                 .triangle = (uint32_t)random_uniform(&seed, 0, triangles)};
            double base[4];
            hit.u = random_uniform(&seed, 0, 1);
            hit.v = random_uniform(&seed, 0, 1 - hit.u);
            rt_surface_base(scene, &hit, NULL, base);
            assert_int_equal(rt_surface_is_solid(scene, &hit), base[3] >= cutoff);
            ++*(base[3] >= cutoff ? solid : holes);
        }
    }
}

/* One pixel in a hundred, anywhere. */
static bool is_chosen(int x, int y)
{
    return rt_job_seed(x, y, 0) * 2654435761u >> 8 < (1u << 24) / 100;
}

static void judge(const char *scene, const char *technique, const char *rays,
                  const struct tally *tally)
{
    char metric[96];
    snprintf(metric, sizeof metric, "%s rays that differ from all triangles", rays);
    printf("%s, %s: %d %s rays, %d surfaces, %d differ, %d at a border, t to %.2g\n", scene,
           technique, tally->rays, rays, tally->hits, tally->wrong, tally->doubtful, tally->worst);
    bool is_pass = tally->rays > 0 && tally->wrong == 0 && tally->worst <= 1e-9;
    accuracy_log(&(struct accuracy_result){.suite = "brute_force",
                                           .scene = scene,
                                           .technique = technique,
                                           .metric = metric,
                                           .error = tally->wrong,
                                           .tolerance = 0,
                                           .is_pass = is_pass});
    assert_int_equal(tally->wrong, 0);
    assert_true(is_pass);
}

static void check_picture(const char *name, const struct imported_scene *imported,
                          const struct view *view, bool has_masks)
{
    int solid = 0, holes = 0;
    struct scene_state state;
    struct camera camera;
    struct rt_scene scene;
    struct error err = {0};
    assert_true(scene_state_init(&state, &imported->scene, view, &err));
    assert_true(camera_resolve(&camera, view, &state, &err));
    assert_true(rt_scene_init(&scene, &state, view, &err));
    struct image image = {.width_px = view->width_px, .height_px = view->height_px};
    struct raytrace_desc desc = {.view = view, .camera = &camera};
    struct rt_job job = {.desc = &desc, .scene = &scene, .image = &image};
    struct brute brute = {.scene = &scene};
    assert_true(rt_hits_init(&brute.hits, &err));
    brute_packets_init(&brute, &scene);
    for (int y = 0; y < view->height_px; y++) {
        for (int x = 0; x < view->width_px; x++) {
            struct rt_ray ray;
            if (!is_chosen(x, y))
                continue;
            rt_job_camera_ray(&job, x + 0.5, y + 0.5, &ray);
            check_pixel(&brute, &ray);
        }
    }
    judge(name, "reference", "camera", &brute.camera);
    judge(name, "reference", "shadow", &brute.shadow);
    judge(name, "raytraced", "camera", &brute.camera_packet);
    judge(name, "raytraced", "shadow", &brute.shadow_packet);
    check_masks(&scene, &solid, &holes);
    assert_true(!has_masks || (solid > 1000 && holes > 1000));
    free(brute.all.items);
    for (int i = 0; i < WIDTHS; i++)
        rt_packet_finish(&brute.packets[i]);
    rt_hits_finish(&brute.hits);
    rt_scene_finish(&scene);
    scene_state_finish(&state);
}

static void every_ray_of_the_demo_scene(void **unused)
{
    (void)unused;
    struct imported_scene imported;
    struct error err = {0};
    void *glb = NULL;
    size_t size = 0;
    assert_true(demo_scene_build(&(struct demo_scene_desc){0}, &glb, &size, &err));
    struct scene_file file = {.name = "", .bytes = glb, .size_bytes = size};
    assert_true(imported_scene_init(&imported, &file, 1, &err));
    struct view view = {.width_px = 640,
                        .height_px = 360,
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                   .eye = {1.0, 1.75, 6.6},
                                   .target = {-0.45, 2.95, -10},
                                   .fov_y_deg = 52}};
    check_picture("demo", &imported, &view, false);
    imported_scene_finish(&imported);
    free(glb);
}

static void load_asset(struct imported_scene *imported, const char *path)
{
    struct error err = {0};
    if (!imported_asset_load(imported, path, &err))
        fail_msg("%s", err.message);
}

static void every_ray_of_the_stained_glass_lamp(void **unused)
{
    (void)unused;
    struct imported_scene imported;
    if (!assets_are_present())
        skip();
    load_asset(&imported, "StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp-transmission.gltf");
    struct view_light light = {.type = SCENE_LIGHT_POINT,
                               .position = {0.09, 0.36, 0.01}, /* beside the bulbs */
                               .color = {1, 1, 1},
                               .intensity = 1};
    struct view view = {.width_px = 480,
                        .height_px = 480,
                        .camera = {.kind = VIEW_CAMERA_FIT, .fit = VIEW_FIT_ISO},
                        .lights = &light,
                        .light_count = 1,
                        /* rays that refract find the culled backs of solid glass, too */
                        .quality.refraction = VIEW_REFRACTION_OFF};
    check_picture("StainedGlassLamp", &imported, &view, true);
    imported_scene_finish(&imported);
}

/* With the fabrics as curtains, as the benchmarks have it. */
static void every_ray_of_sponza_with_curtains(void **unused)
{
    (void)unused;
    enum { CURTAINS_MAX = 16 };
    struct imported_scene imported;
    struct view_material_override curtains[CURTAINS_MAX];
    size_t count = 0;
    if (!assets_are_present())
        skip();
    load_asset(&imported, "Sponza/glTF/Sponza.gltf");
    const struct scene *s = &imported.scene;
    for (uint32_t i = 0; i < s->material_count && count < CURTAINS_MAX; i++)
        if (!strncmp(s->strings + s->materials[i].name, "fabric", 6))
            curtains[count++] =
                (struct view_material_override){.material = s->strings + s->materials[i].name,
                                                .has_base_color = true,
                                                .base_color = {1, 1, 1, 0.6f},
                                                .has_alpha_mode = true,
                                                .alpha_mode = SCENE_BLEND};
    assert_true(count > 0);
    struct view_light light = {.type = SCENE_LIGHT_SPOT,
                               .position = {6.5, 3.4, -0.8},
                               .direction = {-0.45, -0.3, 0.8},
                               .color = {1, 1, 1},
                               .intensity = 300,
                               .inner_cone_deg = 30,
                               .outer_cone_deg = 45};
    struct view view = {.width_px = 240,
                        .height_px = 136,
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                   .eye = {8.5, 2.2, -0.6},
                                   .target = {-4, 2.2, 0.4},
                                   .fov_y_deg = 60},
                        .materials = curtains,
                        .material_override_count = count,
                        .ignore_scene_lights = true,
                        .lights = &light,
                        .light_count = 1};
    check_picture("Sponza", &imported, &view, true);
    imported_scene_finish(&imported);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_ray_of_the_demo_scene),
        cmocka_unit_test(every_ray_of_the_stained_glass_lamp),
        cmocka_unit_test(every_ray_of_sponza_with_curtains),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
