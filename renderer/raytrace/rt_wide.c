/* SPDX-License-Identifier: MIT */
/* Plain loops over lanes that the compiler vectorises, once for each kind of processor. Nothing
 * branches: what holds for one lane only is chosen afterwards. */
#include "renderer/raytrace/rt_wide.h"

#include <float.h>

#include "renderer/base/processor_forms.h"
#include "renderer/raytrace/rt_math.h"

static const double pi = 3.14159265358979323846;

INSIDE_FORMS double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* As vec3_normalize. */
INSIDE_FORMS bool normalize(double a[3])
{
    double length = sqrt(dot(a, a));
    bool is_normal = (length > 0) & (length < INFINITY);
    for (int k = 0; k < 3; k++) {
        double unit = a[k] / length;
        a[k] = is_normal ? unit : a[k];
    }
    return is_normal;
}

INSIDE_FORMS void transform(const double m[3][3], const double a[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = m[k][0] * a[0] + m[k][1] * a[1] + m[k][2] * a[2];
}

INSIDE_FORMS void load(const double lanes[3][RT_WIDE], int i, double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = lanes[k][i];
}

/* As rt_scene_normal. */
INSIDE_FORMS void find_geometric(const double v[3][3], double turn, double normal[3])
{
    double e1[3], e2[3];
    for (int k = 0; k < 3; k++) {
        e1[k] = v[1][k] - v[0][k];
        e2[k] = v[2][k] - v[0][k];
    }
    for (int k = 0; k < 3; k++) {
        int a = (k + 1) % 3, b = (k + 2) % 3;
        normal[k] = e1[a] * e2[b] - e1[b] * e2[a];
    }
    double length = sqrt(dot(normal, normal));
    double inverse = turn / length, scale = length > 0 ? inverse : 0;
    for (int k = 0; k < 3; k++)
        normal[k] *= scale;
}

/* As a surface without a normal map has it. */
INSIDE_FORMS void find_normal(const struct rt_wide_mesh *mesh, const double vertices[3][3],
                              const double weights[3], double side, const double geometric[3],
                              double normal[3])
{
    double local[3];
    for (int k = 0; k < 3; k++) {
        local[k] = 0;
        for (int c = 0; c < 3; c++)
            local[k] += weights[c] * vertices[c][k];
    }
    transform(mesh->normal_matrix, local, normal);
    bool is_normal = normalize(normal);
    for (int k = 0; k < 3; k++)
        normal[k] = (is_normal ? normal[k] : geometric[k]) * side;
}

/* As rt_terminator_find: moves start and, of unit length yet, offset. */
INSIDE_FORMS void smooth_start(const struct rt_wide_mesh *mesh, const double corners[3][3],
                               const double vertices[3][3], const double weights[3], double side,
                               double start[3], double offset[3])
{
    double moved[3] = {0}, sum[3] = {0}, point[3] = {start[0], start[1], start[2]};
    bool is_flat = true, is_normal = true;
#pragma GCC unroll 3 /* else the loop over lanes is not vectorised */
    for (int c = 0; c < 3; c++) {
        double normal[3], away[3];
        for (int k = 0; k < 3; k++)
            is_flat &= vertices[0][k] == vertices[c][k];
        transform(mesh->normal_matrix, vertices[c], normal);
        for (int k = 0; k < 3; k++) {
            normal[k] *= side;
            away[k] = point[k] - corners[c][k];
        }
        is_normal &= normalize(normal);
        double below = rt_min(dot(away, normal), 0);
        for (int k = 0; k < 3; k++) {
            moved[k] -= weights[c] * below * normal[k];
            sum[k] += weights[c] * normal[k];
        }
    }
    is_normal &= normalize(sum);
    bool is_smooth = is_normal & !is_flat;
    for (int k = 0; k < 3; k++) {
        double there = point[k] + moved[k];
        start[k] = is_smooth ? there : point[k];
        offset[k] = is_smooth ? sum[k] : offset[k];
    }
}

INSIDE_FORMS void store(const double from[3], int i, double lanes[3][RT_WIDE])
{
    for (int k = 0; k < 3; k++)
        lanes[k][i] = from[k];
}

/* is_one: all counts are 1, which divide nothing. */
INSIDE_FORMS void place_lane(const struct rt_wide_mesh *mesh, struct rt_wide *wide, int i,
                             bool is_smoothed, bool is_one)
{
    double corners[3][3], vertices[3][3], middle[3], view[3], relative[3];
    double geometric[3], normal[3], start[3], offset[3];
    const double count = is_one ? 1 : wide->count[i], side = wide->side[i];
    const double u = wide->u[i] / count, v = wide->v[i] / count, weights[3] = {1 - u - v, u, v};
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++) {
            corners[c][k] = wide->corners[c][k][i];
            vertices[c][k] = (double)wide->normals[c][k][i];
        }
    for (int k = 0; k < 3; k++) {
        middle[k] = wide->point[k][i] / count;
        view[k] = -wide->direction[k][i];
        relative[k] = middle[k] + mesh->origin[k] - mesh->eye[k];
    }
    normalize(view);
    find_geometric(corners, mesh->is_mirrored ? -1 : 1, geometric);
    find_normal(mesh, vertices, weights, side, geometric, normal);
    for (int k = 0; k < 3; k++) {
        start[k] = middle[k];
        offset[k] = geometric[k];
    }
    if (is_smoothed)
        smooth_start(mesh, corners, vertices, weights, side, start, offset);
    for (int k = 0; k < 3; k++)
        offset[k] *= mesh->nudge_m;
    wide->view_z[i] = -dot(relative, mesh->back);
    store(middle, i, wide->middle);
    store(view, i, wide->view);
    store(normal, i, wide->normal);
    store(start, i, wide->start);
    store(offset, i, wide->offset);
}

INSIDE_FORMS bool are_one(const double counts[RT_WIDE])
{
    uint32_t others = 0;
    for (int i = 0; i < RT_WIDE; i++)
        others |= counts[i] != 1;
    return !others;
}

PROCESSOR_FORMS void rt_wide_place(const struct rt_wide_mesh *mesh, struct rt_wide *wide)
{
    const struct rt_wide_mesh own = *mesh; /* nothing stored below is of it */
    const bool is_one = are_one(wide->count);
    if (own.is_smoothed && is_one)
        for (int i = 0; i < RT_WIDE; i++)
            place_lane(&own, wide, i, true, true);
    else if (own.is_smoothed)
        for (int i = 0; i < RT_WIDE; i++)
            place_lane(&own, wide, i, true, false);
    else if (is_one)
        for (int i = 0; i < RT_WIDE; i++)
            place_lane(&own, wide, i, false, true);
    else
        for (int i = 0; i < RT_WIDE; i++)
            place_lane(&own, wide, i, false, false);
}

PROCESSOR_FORMS bool rt_wide_is_flat(const struct rt_wide *wide, int count)
{
    uint32_t differs[RT_WIDE] = {0}, any = 0;
    for (int c = 1; c < 3; c++)
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < RT_WIDE; i++)
                differs[i] |= wide->normals[c][k][i] != wide->normals[0][k][i];
    for (int i = 0; i < RT_WIDE; i++)
        any |= i < count ? differs[i] : 0;
    return !any;
}

PROCESSOR_FORMS void rt_wide_look(const struct rt_reflector *reflector, struct rt_wide *wide)
{
    const double a2 = reflector->alpha_square;
    for (int i = 0; i < RT_WIDE; i++) {
        double normal[3], view[3];
        load((const double(*)[RT_WIDE])wide->normal, i, normal);
        load((const double(*)[RT_WIDE])wide->view, i, view);
        double n_dot_v = rt_max(dot(normal, view), 1e-4);
        wide->n_dot_v[i] = n_dot_v;
        wide->seen[i] = sqrt(n_dot_v * n_dot_v * (1 - a2) + a2);
    }
}

void rt_wide_paint(const struct rt_reflector *reflector, int lane, struct rt_wide *wide)
{
    for (int k = 0; k < 3; k++) {
        wide->normal[k][lane] = reflector->normal[k];
        wide->diffuse[k][lane] = reflector->diffuse[k];
        wide->diffuse_edge[k][lane] = reflector->diffuse_edge[k];
        wide->specular[k][lane] = reflector->specular[k];
        wide->specular_edge[k][lane] = reflector->specular_edge[k];
    }
    wide->n_dot_v[lane] = reflector->n_dot_v;
    wide->seen[lane] = reflector->seen;
    wide->alpha_square[lane] = reflector->alpha_square;
}

static void arrive_from_afar(const struct rt_light_record *record, struct rt_wide_light *light)
{
    for (int i = 0; i < RT_WIDE; i++) {
        for (int k = 0; k < 3; k++)
            light->direction[k][i] = -record->direction[k];
        light->distance_m[i] = INFINITY;
        light->gain[i] = 1;
        light->arrives[i] = true;
    }
}

INSIDE_FORMS void arrive_lane(const struct rt_light_record *record, const struct rt_wide *wide,
                              struct rt_wide_light *light, int i, bool is_spot)
{
    static const float clearly = 1 + 1e-5f; /* rt_light_set.c */
    const float *d = record->direction, c = record->least_cosine;
    const float inverse_range = record->inverse_range;
    float l[3];
    for (int k = 0; k < 3; k++)
        l[k] = record->position[k] - (float)wide->middle[k][i];
    float square = l[0] * l[0] + l[1] * l[1] + l[2] * l[2];
    float along = -(d[0] * l[0] + d[1] * l[1] + d[2] * l[2]), is = along * fabsf(along);
    float least = c * fabsf(c) * square, inner = least / clearly, outer = least * clearly;
    bool is_out = square * inverse_range * inverse_range >= 1;
    is_out |= is_spot & (is < (least > 0 ? inner : outer));
    float distance = sqrtf(square), gain = 1 / rt_max_f32(square, 1e-24f);
    float q = distance * inverse_range;
    gain *= rt_max_f32(1 - q * q * q * q, 0);
    float inverse = 1 / rt_max_f32(distance, 1e-30f);
    for (int k = 0; k < 3; k++)
        l[k] *= inverse;
    if (is_spot) {
        float cosine = -(d[0] * l[0] + d[1] * l[1] + d[2] * l[2]);
        float cone =
            rt_min_f32(rt_max_f32(cosine * record->cone_scale + record->cone_offset, 0), 1);
        gain *= cone * cone;
    }
    for (int k = 0; k < 3; k++)
        light->direction[k][i] = l[k];
    light->distance_m[i] = distance;
    light->gain[i] = (double)(is_out ? 0 : gain);
    light->arrives[i] = !is_out & (gain > 0);
}

PROCESSOR_FORMS void rt_wide_arrive(const struct rt_light_record *record,
                                    const struct rt_wide *restrict wide,
                                    struct rt_wide_light *restrict light)
{
    const struct rt_light_record own = *record;
    if (own.type == SCENE_LIGHT_DIRECTIONAL)
        arrive_from_afar(&own, light);
    else if (own.type == SCENE_LIGHT_SPOT)
        for (int i = 0; i < RT_WIDE; i++)
            arrive_lane(&own, wide, light, i, true);
    else
        for (int i = 0; i < RT_WIDE; i++)
            arrive_lane(&own, wide, light, i, false);
}

/* The colours of a reflector, and its roughness. */
struct paint {
    double a2, diffuse[3], diffuse_edge[3], specular[3], specular_edge[3];
};

INSIDE_FORMS void load_paint(const struct rt_wide *wide, int i, struct paint *paint)
{
    paint->a2 = wide->alpha_square[i];
    load(wide->diffuse, i, paint->diffuse);
    load(wide->diffuse_edge, i, paint->diffuse_edge);
    load(wide->specular, i, paint->specular);
    load(wide->specular_edge, i, paint->specular_edge);
}

INSIDE_FORMS void reflect_lane(const struct paint *paint, const double color[3],
                               const struct rt_wide *wide, struct rt_wide_light *light, int i)
{
    double normal[3], view[3], l[3], h[3];
    const double a2 = paint->a2, gain = light->gain[i];
    load(wide->normal, i, normal);
    load(wide->view, i, view);
    for (int k = 0; k < 3; k++) {
        l[k] = (double)light->direction[k][i];
        h[k] = l[k] + view[k];
    }
    double n_dot_l = dot(normal, l), square = dot(h, h);
    double root = 1 / sqrt(square), inverse = square > 0 ? root : 0;
    double n_dot_h = rt_min(rt_max(dot(normal, h) * inverse, 0), 1);
    double c = rt_min(rt_max(1 - dot(view, h) * inverse, 0), 1), c2 = c * c, w = c2 * c2 * c;
    double f = n_dot_h * n_dot_h * (a2 - 1) + 1;
    double visibility =
        wide->n_dot_v[i] * sqrt(n_dot_l * n_dot_l * (1 - a2) + a2) + n_dot_l * wide->seen[i];
    double lobe = 0.5 * a2 / (pi * f * f * rt_max(visibility, 1e-10));
    bool is_any = false;
    for (int k = 0; k < 3; k++) {
        double reflected = (paint->diffuse[k] - w * paint->diffuse_edge[k] +
                            lobe * (paint->specular[k] + w * paint->specular_edge[k])) *
                           n_dot_l;
        is_any |= reflected > 0;
        light->weight[k][i] = (float)(reflected * gain * color[k]);
    }
    light->reflects[i] = is_any & (n_dot_l > 0) & (gain > 0);
}

PROCESSOR_FORMS void rt_wide_reflect(const struct rt_reflector *reflector,
                                     const struct rt_light_record *record,
                                     const struct rt_wide *restrict wide,
                                     struct rt_wide_light *restrict light)
{
    const double color[3] = {(double)record->color[0], (double)record->color[1],
                             (double)record->color[2]};
    struct paint paint;
    if (!reflector) {
        for (int i = 0; i < RT_WIDE; i++) {
            struct paint own;
            load_paint(wide, i, &own);
            reflect_lane(&own, color, wide, light, i);
        }
        return;
    }
    paint.a2 = reflector->alpha_square;
    for (int k = 0; k < 3; k++) {
        paint.diffuse[k] = reflector->diffuse[k];
        paint.diffuse_edge[k] = reflector->diffuse_edge[k];
        paint.specular[k] = reflector->specular[k];
        paint.specular_edge[k] = reflector->specular_edge[k];
    }
    for (int i = 0; i < RT_WIDE; i++)
        reflect_lane(&paint, color, wide, light, i);
}

INSIDE_FORMS void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* t, u, v and det of refine_hit of rt_scene.c. */
struct met {
    double t, u, v, det;
};

INSIDE_FORMS void meet(const double origin[3], const double direction[3], const double v[3][3],
                       struct met *met)
{
    double e1[3], e2[3], across[3], from[3], q[3];
    for (int k = 0; k < 3; k++) {
        e1[k] = v[1][k] - v[0][k];
        e2[k] = v[2][k] - v[0][k];
        from[k] = origin[k] - v[0][k];
    }
    cross(direction, e2, across);
    cross(from, e1, q);
    const double det = dot(e1, across), inverse = 1 / det;
    met->t = dot(e2, q) * inverse;
    met->u = dot(from, across) * inverse;
    met->v = dot(direction, q) * inverse;
    met->det = det;
}

INSIDE_FORMS void meet_lane(const struct rt_wide_rays *rays, struct rt_wide_hits *hits, int i,
                            bool has_normals)
{
    double v[3][3], origin[3], direction[3];
    struct met met;
    load(rays->origin, i, origin);
    load(rays->direction, i, direction);
    for (int c = 0; c < 3; c++)
        load((const double(*)[RT_WIDE])hits->corners[c], i, v[c]);
    meet(origin, direction, (const double(*)[3])v, &met);
    hits->t[i] = met.t;
    hits->u[i] = met.u;
    hits->v[i] = met.v;
    hits->is_front[i] = met.det * hits->turn[i] > 0;
    hits->is_met[i] = (fabs(met.det) > DBL_MIN) & !(met.t <= 0) & !(met.t >= rays->t_max[i]) &
                      !(met.t <= rays->t_min[i]);
    for (int k = 0; k < 3; k++)
        hits->point[k][i] = origin[k] + direction[k] * met.t;
    if (!has_normals)
        return;
    double normal[3];
    find_geometric((const double(*)[3])v, hits->turn[i], normal);
    store(normal, i, hits->normal);
}

/* is_first: nothing is there to be added to. */
INSIDE_FORMS void find_lane(const double origin[3], double turn, const double way[3][RT_WIDE],
                            const uint32_t *sought, struct rt_wide *wide, int i, bool is_first)
{
    double v[3][3], direction[3];
    struct met met;
    load(way, i, direction);
    for (int c = 0; c < 3; c++)
        load((const double(*)[RT_WIDE])wide->corners[c], i, v[c]);
    meet(origin, direction, (const double(*)[3])v, &met);
    const double u = is_first ? met.u : wide->u[i] + met.u;
    const double w = is_first ? met.v : wide->v[i] + met.v;
    const double side = met.det * turn > 0 ? 1 : -1;
    wide->u[i] = sought[i] ? u : wide->u[i];
    wide->v[i] = sought[i] ? w : wide->v[i];
    wide->side[i] = sought[i] ? side : wide->side[i];
    for (int k = 0; k < 3; k++) {
        const double point = origin[k] + direction[k] * met.t;
        const double points = is_first ? point : wide->point[k][i] + point;
        const double ways = is_first ? direction[k] : wide->direction[k][i] + direction[k];
        wide->point[k][i] = sought[i] ? points : wide->point[k][i];
        wide->direction[k][i] = sought[i] ? ways : wide->direction[k][i];
    }
}

PROCESSOR_FORMS void rt_wide_find(const double origin[3], bool is_mirrored, int samples,
                                  const double (*restrict ways)[3][RT_WIDE],
                                  const uint32_t sought[restrict RT_WIDE],
                                  struct rt_wide *restrict wide)
{
    const double from[3] = {origin[0], origin[1], origin[2]}, turn = is_mirrored ? -1 : 1;
    for (int i = 0; i < RT_WIDE; i++)
        find_lane(from, turn, ways[0], sought, wide, i, true);
    for (int s = 1; s < samples; s++)
        for (int i = 0; i < RT_WIDE; i++)
            find_lane(from, turn, ways[s], sought, wide, i, false);
}

PROCESSOR_FORMS void rt_wide_meet(const struct rt_wide_rays *restrict rays,
                                  struct rt_wide_hits *restrict hits, bool has_normals)
{
    if (has_normals)
        for (int i = 0; i < RT_WIDE; i++)
            meet_lane(rays, hits, i, true);
    else
        for (int i = 0; i < RT_WIDE; i++)
            meet_lane(rays, hits, i, false);
}

PROCESSOR_FORMS void rt_wide_leave(const struct rt_wide_way *way,
                                   const struct rt_wide *restrict wide,
                                   const struct rt_wide_light *restrict light,
                                   struct rt_wide_rays *restrict rays)
{
    const struct rt_wide_way own = *way;
    for (int i = 0; i < RT_WIDE; i++) {
        double offset[3], direction[3], distance = (double)light->distance_m[i];
        load((const double(*)[RT_WIDE])wide->offset, i, offset);
        for (int k = 0; k < 3; k++)
            rays->direction[k][i] = direction[k] = (double)light->direction[k][i];
        double side = dot(offset, direction) < 0 ? -1 : 1;
        for (int k = 0; k < 3; k++)
            rays->origin[k][i] = wide->start[k][i] + side * offset[k];
        bool is_near = distance < INFINITY;
        double t_max = is_near ? distance * (1 - 1e-9) : own.size_m;
        double t_min = own.epsilon * rt_min(t_max, own.size_m);
        double before = rt_max(t_max - 8 * own.nudge_m, t_min);
        rays->t_min[i] = t_min;
        rays->t_max[i] = is_near ? before : t_max;
    }
}

PROCESSOR_FORMS void rt_wide_add(const struct rt_wide_light *restrict light,
                                 const uint32_t reaches[restrict RT_WIDE],
                                 double (*restrict passes)[RT_WIDE],
                                 double (*restrict radiance)[RT_WIDE])
{
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < RT_WIDE; i++) {
            double sum = radiance[k][i] + (double)light->weight[k][i] * passes[k][i];
            radiance[k][i] = reaches[i] ? sum : radiance[k][i];
        }
}
