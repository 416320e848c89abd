/* SPDX-License-Identifier: MIT */
/* Partitions as the colours of an interval graph: each mesh is one later than the latest that it
 * overlaps in the light's view and that is nearer. Which of two is nearer is told by a plane
 * between their boxes, and by the side on which the light is. */
#include "renderer/shadows/shadow_partitions.h"

#include <float.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

enum {
    FACES = 6,
    ROUNDS = 6,        /* over all pairs: meshes mostly come in their order */
    MARGIN_TEXELS = 5, /* between two meshes: taps of the widest tent reach so far beyond one */
};
static const double HAIR = 1e-6; /* of a distance: positions are rounded */

struct member { /* a transparent caster */
    uint32_t node, caster;
};

struct extent { /* on a face, [-1, 1]; empty where it is not seen there */
    double low[2], high[2];
};

enum { CORNERS = 8 };

/* The members of one node, in a box: its own, or along the world's axes for several. Of few
 * vertices these take the place of its corners. */
struct mesh {
    size_t first, count;
    double corners[CORNERS][3];       /* world */
    double normals[3][3];             /* of its sides, unit */
    double edges[3][3];               /* directions of its edges */
    double low[3], high[3], light[3]; /* along them: of the box, and where the light is */
    double middle;                    /* distance from the light */
    struct extent extents[FACES];
    uint32_t partition;
    bool is_crossed;
};

enum { FIRST_IS_NEARER = 1, SECOND_IS_NEARER = 2, EITHER = 3 }; /* the last: each in part */

struct partition_job {
    const struct shadow_partitions_desc *desc;
    double face_axes[FACES][3][3];
    struct member *members;
    struct mesh *meshes;
    size_t member_count, mesh_count;
    uint8_t *pairs; /* which of two is nearer, or 0: pair_of */
};

static int compare_members(const void *a, const void *b)
{
    const struct member *x = a, *y = b;
    if (x->node != y->node)
        return x->node < y->node ? -1 : 1;
    return x->caster < y->caster ? -1 : x->caster > y->caster;
}

static int compare_meshes(const void *a, const void *b)
{
    const struct mesh *x = a, *y = b;
    if (x->middle != y->middle)
        return x->middle < y->middle ? -1 : 1;
    return x->first < y->first ? -1 : x->first > y->first;
}

static bool job_init(struct partition_job *job, const struct shadow_partitions_desc *desc,
                     struct error *err)
{
    const struct shadow_frame *frame = &desc->map->frame;
    size_t most = desc->casters->transparent_count + 1;
    *job = (struct partition_job){.desc = desc};
    for (uint32_t face = 0; face < frame->face_count; face++)
        shadow_frame_face_axes(frame, face, job->face_axes[face]);
    job->members = calloc(most, sizeof *job->members);
    job->meshes = calloc(most, sizeof *job->meshes);
    return (job->members && job->meshes) ||
           error_set(err, ERROR_NO_MEMORY, "partitions of %zu shadow casters", most);
}

static void job_finish(struct partition_job *job)
{
    free(job->members);
    free(job->meshes);
    free(job->pairs);
}

/* ---- boxes ---- */

static const struct state_item *item_of(const struct partition_job *job, size_t member)
{
    const struct shadow_partitions_desc *desc = job->desc;
    return &desc->state->items[desc->casters->items[job->members[member].caster]];
}

/* A primitive of few vertices, most of them panes: they are the corners. Sides are along the plane
 * of the first three, and upright on it. */
static bool set_own_corners(const struct partition_job *job, const struct state_item *item,
                            struct mesh *mesh)
{
    const struct state_geometry geometry = state_geometry_of(job->desc->state, item);
    const struct scene_primitive *p = geometry.primitive;
    const double *world = geometry.world;
    if (p->vertex_count < 3 || p->vertex_count > CORNERS)
        return false;
    for (int corner = 0; corner < CORNERS; corner++) {
        size_t vertex = (size_t)p->first_vertex + (uint32_t)corner % p->vertex_count;
        const float *at = geometry.positions + 3 * vertex;
        for (int c = 0; c < 3; c++)
            mesh->corners[corner][c] = world[12 + c] + world[c] * (double)at[0] +
                                       world[4 + c] * (double)at[1] + world[8 + c] * (double)at[2];
    }
    vec3_sub(mesh->corners[1], mesh->corners[0], mesh->edges[0]);
    vec3_sub(mesh->corners[2], mesh->corners[0], mesh->edges[1]);
    vec3_cross(mesh->edges[0], mesh->edges[1], mesh->normals[0]);
    vec3_cross(mesh->normals[0], mesh->edges[0], mesh->normals[1]);
    vec3_cross(mesh->normals[0], mesh->edges[1], mesh->normals[2]);
    vec3_sub(mesh->edges[1], mesh->edges[0], mesh->edges[2]);
    return true;
}

static void set_edges(struct mesh *mesh)
{
    for (int k = 0; k < 3; k++)
        vec3_sub(mesh->corners[1 << k], mesh->corners[0], mesh->edges[k]);
}

/* Of what the primitive's own coordinates bound. */
static void set_own_box(const struct partition_job *job, const struct state_item *item,
                        struct mesh *mesh)
{
    const struct state_geometry geometry = state_geometry_of(job->desc->state, item);
    const struct scene_primitive *p = geometry.primitive;
    const double *world = geometry.world;
    for (int corner = 0; corner < CORNERS; corner++)
        for (int c = 0; c < 3; c++) {
            mesh->corners[corner][c] = world[12 + c];
            for (int k = 0; k < 3; k++)
                mesh->corners[corner][c] +=
                    world[4 * k + c] *
                    (double)(corner >> k & 1 ? p->bounds_max[k] : p->bounds_min[k]);
        }
    for (int k = 0; k < 3; k++)
        vec3_cross(world + 4 * ((k + 1) % 3), world + 4 * ((k + 2) % 3), mesh->normals[k]);
    set_edges(mesh);
}

static void set_world_box(const struct partition_job *job, struct mesh *mesh)
{
    double low[3] = {DBL_MAX, DBL_MAX, DBL_MAX}, high[3] = {-DBL_MAX, -DBL_MAX, -DBL_MAX};
    for (size_t i = 0; i < mesh->count; i++) {
        const struct state_item *item = item_of(job, mesh->first + i);
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], item->bounds_min[k]);
            high[k] = fmax(high[k], item->bounds_max[k]);
        }
    }
    for (int corner = 0; corner < CORNERS; corner++)
        for (int k = 0; k < 3; k++)
            mesh->corners[corner][k] = corner >> k & 1 ? high[k] : low[k];
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++)
            mesh->normals[k][c] = k == c;
    set_edges(mesh);
}

/* A parallel light is infinitely far away, on one side or, along the side, on neither. */
static double light_along(const struct shadow_frame *frame, const double normal[3])
{
    if (frame->shape != SHADOW_ORTHOGRAPHIC)
        return vec3_dot(normal, frame->origin);
    double along = vec3_dot(normal, frame->axis[2]);
    return along > HAIR ? -INFINITY : along < -HAIR ? INFINITY : NAN;
}

static void set_box(const struct partition_job *job, struct mesh *mesh)
{
    const struct shadow_frame *frame = &job->desc->map->frame;
    const struct state_item *item = item_of(job, mesh->first);
    double offset[3];
    if (mesh->count > 1 || item->deformed || item->cap)
        set_world_box(job, mesh);
    else if (!set_own_corners(job, item, mesh))
        set_own_box(job, item, mesh);
    for (int k = 0; k < 3; k++) {
        bool has_side = vec3_normalize(mesh->normals[k]); /* a node may flatten it to a line */
        mesh->low[k] = has_side ? DBL_MAX : -DBL_MAX;
        mesh->high[k] = has_side ? -DBL_MAX : DBL_MAX;
        for (int corner = 0; corner < CORNERS; corner++) {
            double at = vec3_dot(mesh->normals[k], mesh->corners[corner]);
            mesh->low[k] = fmin(mesh->low[k], at);
            mesh->high[k] = fmax(mesh->high[k], at);
        }
        mesh->light[k] = light_along(frame, mesh->normals[k]);
        offset[k] = -frame->origin[k];
        for (int corner = 0; corner < CORNERS; corner++)
            offset[k] += mesh->corners[corner][k] / CORNERS;
    }
    mesh->middle = frame->shape == SHADOW_ORTHOGRAPHIC ? vec3_dot(frame->axis[2], offset)
                                                       : vec3_length(offset);
}

/* Whether all corners lie beyond one side of the pyramid |x|, |y| <= z reach, or behind the light.
 */
static bool is_outside(double at[CORNERS][3], const double reach[2])
{
    int beyond[5] = {0};
    for (int corner = 0; corner < CORNERS; corner++) {
        const double *p = at[corner];
        for (int k = 0; k < 2; k++) {
            beyond[2 * k] += p[k] > p[2] * reach[k];
            beyond[2 * k + 1] += -p[k] > p[2] * reach[k];
        }
        beyond[4] += p[2] <= 0;
    }
    for (int side = 0; side < 5; side++)
        if (beyond[side] == CORNERS)
            return true;
    return false;
}

static void set_extent(const struct partition_job *job, struct mesh *mesh, uint32_t face)
{
    const struct shadow_frame *frame = &job->desc->map->frame;
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC, is_whole = false;
    double margin = (double)MARGIN_TEXELS / job->desc->map->resolution, at[CORNERS][3];
    const double reach[2] = {(1 + margin) / frame->scale[0], (1 + margin) / frame->scale[1]};
    struct extent *extent = &mesh->extents[face];
    *extent = (struct extent){{DBL_MAX, DBL_MAX}, {-DBL_MAX, -DBL_MAX}};
    for (int corner = 0; corner < CORNERS; corner++) {
        double offset[3];
        vec3_sub(mesh->corners[corner], frame->origin, offset);
        for (int k = 0; k < 3; k++)
            at[corner][k] = vec3_dot(job->face_axes[face][k], offset);
        is_whole |= !is_flat && at[corner][2] <= frame->near_m;
    }
    if (!is_flat && is_outside(at, reach))
        return;
    for (int k = 0; k < 2; k++) {
        for (int corner = 0; corner < CORNERS; corner++) {
            double x = at[corner][k] * frame->scale[k] / (is_flat ? 1 : at[corner][2]);
            extent->low[k] = fmin(extent->low[k], is_whole ? -1 : x);
            extent->high[k] = fmax(extent->high[k], is_whole ? 1 : x);
        }
        extent->low[k] -= margin;
        extent->high[k] += margin;
    }
}

static void find_meshes(struct partition_job *job)
{
    const struct shadow_casters *casters = job->desc->casters;
    const struct state_item *items = job->desc->state->items;
    for (size_t i = 0; i < casters->count; i++)
        if (items[casters->items[i]].class_ == STATE_TRANSPARENT)
            job->members[job->member_count++] =
                (struct member){items[casters->items[i]].node, (uint32_t)i};
    qsort(job->members, job->member_count, sizeof *job->members, compare_members);
    for (size_t i = 0; i < job->member_count; i++) {
        if (!i || job->members[i].node != job->members[i - 1].node)
            job->meshes[job->mesh_count++].first = i;
        job->meshes[job->mesh_count - 1].count++;
    }
    for (size_t i = 0; i < job->mesh_count; i++) {
        set_box(job, &job->meshes[i]);
        for (uint32_t face = 0; face < job->desc->map->frame.face_count; face++)
            set_extent(job, &job->meshes[i], face);
    }
    qsort(job->meshes, job->mesh_count, sizeof *job->meshes, compare_meshes);
}

/* ---- pairs ---- */

static bool overlap(const struct partition_job *job, const struct mesh *a, const struct mesh *b)
{
    for (uint32_t face = 0; face < job->desc->map->frame.face_count; face++) {
        const struct extent *x = &a->extents[face], *y = &b->extents[face];
        if (x->low[0] <= y->high[0] && y->low[0] <= x->high[0] && x->low[1] <= y->high[1] &&
            y->low[1] <= x->high[1])
            return true;
    }
    return false;
}

struct span { /* along a direction */
    double low, high;
};

static struct span span_of(const struct mesh *mesh, const double direction[3])
{
    struct span span = {DBL_MAX, -DBL_MAX};
    for (int corner = 0; corner < CORNERS; corner++) {
        double at = vec3_dot(direction, mesh->corners[corner]);
        span.low = fmin(span.low, at);
        span.high = fmax(span.high, at);
    }
    return span;
}

/* What a plane between the two rules out: what is beyond it from the light is in front of nothing
 * on the light's side. Nothing where none lies between. */
static unsigned rule_out(struct span first, struct span second, double light)
{
    double hair = HAIR * (fabs(second.low) + fabs(second.high));
    unsigned ruled_out = 0;
    if (second.low >= first.high - hair)
        ruled_out |= (light < first.high ? 0u : FIRST_IS_NEARER) |
                     (light > second.low ? 0u : SECOND_IS_NEARER);
    if (second.high <= first.low + hair)
        ruled_out |= (light > first.low ? 0u : FIRST_IS_NEARER) |
                     (light < second.high ? 0u : SECOND_IS_NEARER);
    return ruled_out;
}

/* By planes along a side of either. */
static unsigned rule_out_by_sides(const struct mesh *first, const struct mesh *second)
{
    unsigned ruled_out = 0;
    for (int k = 0; k < 3; k++) {
        const struct span a = {first->low[k], first->high[k]};
        const struct span b = {second->low[k], second->high[k]};
        ruled_out |= rule_out(a, span_of(second, first->normals[k]), first->light[k]) |
                     rule_out(span_of(first, second->normals[k]), b, second->light[k]);
    }
    return ruled_out;
}

/* By planes along an edge of each: with those along sides, all that can lie between two boxes. */
static unsigned rule_out_by_edges(const struct shadow_frame *frame, const struct mesh *first,
                                  const struct mesh *second)
{
    unsigned ruled_out = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const double *a = first->edges[i], *b = second->edges[j];
            double normal[3];
            vec3_cross(a, b, normal);
            if (vec3_length(normal) > HAIR * vec3_length(a) * vec3_length(b) &&
                vec3_normalize(normal))
                ruled_out |= rule_out(span_of(first, normal), span_of(second, normal),
                                      light_along(frame, normal));
        }
    return ruled_out;
}

/* What is left: 0 where none casts a shadow on the other, both where each may. */
static unsigned compare_pair(const struct shadow_frame *frame, const struct mesh *first,
                             const struct mesh *second)
{
    unsigned left = EITHER & ~rule_out_by_sides(first, second);
    return left == EITHER ? EITHER & ~rule_out_by_edges(frame, first, second) : left;
}

static uint8_t *pair_of(const struct partition_job *job, size_t first, size_t second)
{
    return &job->pairs[second * (second - 1) / 2 + first];
}

/* Of all meshes, first < second in the order of their middles. */
static bool find_pairs(struct partition_job *job, struct error *err)
{
    size_t count = job->mesh_count * (job->mesh_count + 1) / 2 + 1;
    job->pairs = calloc(count, sizeof *job->pairs);
    if (!job->pairs)
        return error_set(err, ERROR_NO_MEMORY, "%zu pairs of transparent meshes", count);
    for (size_t j = 1; j < job->mesh_count; j++)
        for (size_t i = 0; i < j; i++) {
            const struct mesh *a = &job->meshes[i], *b = &job->meshes[j];
            if (overlap(job, a, b))
                *pair_of(job, i, j) = (uint8_t)compare_pair(&job->desc->map->frame, a, b);
        }
    return true;
}

/* Whether it moved. */
static bool move_behind(struct mesh *mesh, const struct mesh *nearer)
{
    if (mesh->partition > nearer->partition)
        return false;
    mesh->partition = nearer->partition + 1;
    return true;
}

/* Whether a mesh has moved that others were compared with before. Of two that are crossed the
 * middles tell in the first round alone, so that they and others do not drive each other on. Three
 * may lie before one another in a ring: what still moves in the last round is crossed, too. */
static bool order_pairs(struct partition_job *job, int round)
{
    bool has_moved = false;
    for (size_t j = 1; j < job->mesh_count; j++)
        for (size_t i = 0; i < j; i++) {
            struct mesh *a = &job->meshes[i], *b = &job->meshes[j];
            unsigned found = *pair_of(job, i, j);
            bool is_behind = found == SECOND_IS_NEARER && move_behind(a, b);
            if (found == FIRST_IS_NEARER || (found == EITHER && round == 0))
                (void)move_behind(b, a);
            a->is_crossed |= found == EITHER || (is_behind && round == ROUNDS - 1);
            has_moved |= is_behind;
        }
    return has_moved;
}

static bool share_partitions(struct partition_job *job, struct error *err)
{
    bool has_moved = true;
    if (!find_pairs(job, err))
        return false;
    for (int round = 0; has_moved && round < ROUNDS; round++)
        has_moved = order_pairs(job, round);
    return true;
}

/* ---- the result ---- */

static void write_partitions(const struct partition_job *job, struct shadow_partitions *partitions)
{
    partitions->wanted = 1;
    for (size_t i = 0; i < job->desc->casters->count; i++)
        partitions->of_casters[i] = SHADOW_NO_PARTITION;
    for (size_t i = 0; i < job->mesh_count; i++) {
        const struct mesh *mesh = &job->meshes[i];
        uint32_t partition = mesh->partition;
        if (partition >= partitions->wanted)
            partitions->wanted = partition + 1;
        if (partition >= SHADOW_PARTITIONS_MAX)
            partition = SHADOW_PARTITIONS_MAX - 1;
        for (size_t m = 0; m < mesh->count; m++)
            partitions->of_casters[job->members[mesh->first + m].caster] = partition;
        partitions->crossed += mesh->is_crossed;
    }
    partitions->count =
        partitions->wanted < SHADOW_PARTITIONS_MAX ? partitions->wanted : SHADOW_PARTITIONS_MAX;
}

static bool divide(struct partition_job *job, struct shadow_partitions *partitions,
                   struct error *err)
{
    const struct shadow_partitions_desc *desc = job->desc;
    find_meshes(job);
    if (desc->map->is_faithful && job->mesh_count > SHADOW_PARTITIONS_MAX)
        return error_set(err, ERROR_UNSUPPORTED,
                         "light %u: %zu transparent meshes, the limit is %u where each has a "
                         "partition: leave out faithful, and they share partitions",
                         desc->light, job->mesh_count, SHADOW_PARTITIONS_MAX);
    if (job->mesh_count > SHADOW_PARTITION_MESHES_MAX)
        return error_set(err, ERROR_UNSUPPORTED,
                         "light %u: %zu transparent meshes, the limit of composited shadows is %u",
                         desc->light, job->mesh_count, SHADOW_PARTITION_MESHES_MAX);
    for (size_t i = 0; i < job->mesh_count && desc->map->is_faithful; i++)
        job->meshes[i].partition = (uint32_t)i;
    if (!desc->map->is_faithful && !share_partitions(job, err))
        return false;
    partitions->of_casters = calloc(desc->casters->count + 1, sizeof *partitions->of_casters);
    if (!partitions->of_casters)
        return error_set(err, ERROR_NO_MEMORY, "partitions of %zu shadow casters",
                         desc->casters->count);
    write_partitions(job, partitions);
    return true;
}

bool shadow_partitions_find(struct shadow_partitions *partitions,
                            const struct shadow_partitions_desc *desc, struct error *err)
{
    struct partition_job job;
    *partitions = (struct shadow_partitions){.count = 0};
    bool ok = job_init(&job, desc, err) && divide(&job, partitions, err);
    job_finish(&job);
    return ok;
}
