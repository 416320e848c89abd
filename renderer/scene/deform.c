/* SPDX-License-Identifier: MIT */
/* Evaluation of skins and morph targets. Matrices are products in f64, rounded once; vertices are
 * blended in f32 in the order of the blob, so that a pose gives the same bits whenever it is asked
 * for. */
#include "renderer/scene/deform.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"

struct skin_pose {         /* of one skin */
    float (*matrices)[16]; /* owned; per joint: from the mesh at rest, relative to origin */
    double origin[3];      /* world: where the first joint is */
    double determinant;
    struct content_key key; /* of the matrices */
};

/* One plain scene under evaluation. */
struct member {
    const struct scene *scene;
    uint32_t first_node, first_primitive; /* in the whole scene */
    const float *weights;                 /* of its deformed nodes */
    struct skin_pose *skins;              /* owned; filled when first asked for */
};

struct evaluation {
    const struct scene *scene; /* the whole one */
    struct state_deforms *deforms;
    const double (*world)[16];
    const bool *is_visible;
    uint64_t vertices, deltas; /* so far */
    bool has_tangents;
};

static const struct scene *member_scene(const struct scene *scene, uint32_t index)
{
    return scene->part_count ? scene->parts[index].scene : scene;
}

static uint32_t member_count(const struct scene *scene)
{
    return scene->part_count ? scene->part_count : 1;
}

bool deforms_init(struct state_deforms *deforms, const struct scene *scene, struct error *err)
{
    size_t count = 0, nodes = 0, at = 0;
    *deforms = (struct state_deforms){.items = NULL};
    for (uint32_t i = 0; i < member_count(scene); i++) {
        count += member_scene(scene, i)->target_weight_count;
        nodes += member_scene(scene, i)->deformed_node_count;
    }
    if (!nodes)
        return true;
    deforms->weights = malloc((count + 1) * sizeof *deforms->weights);
    if (!deforms->weights)
        return error_set(err, ERROR_NO_MEMORY, "%zu weights", count);
    for (uint32_t i = 0; i < member_count(scene); i++) {
        const struct scene *member = member_scene(scene, i);
        if (member->target_weight_count)
            memcpy(deforms->weights + at, member->target_weights,
                   member->target_weight_count * sizeof *deforms->weights);
        at += member->target_weight_count;
    }
    return true;
}

void deforms_finish(struct state_deforms *deforms)
{
    free(deforms->items);
    free(deforms->positions);
    free(deforms->normals);
    free(deforms->tangents);
    free(deforms->weights);
    *deforms = (struct state_deforms){.items = NULL};
}

uint32_t deformation_from(const struct scene_deformation *deformations, uint32_t count,
                          uint32_t primitive)
{
    uint32_t low = 0, high = count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (deformations[middle].primitive < primitive)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* ---- joints ---- */

void deform_joint_matrix(const double *joint_world, const struct scene_joint *joint, double out[16])
{
    double inverse_bind[16];
    mat4_identity(inverse_bind);
    for (int column = 0; column < 4; column++)
        for (int row = 0; row < 3; row++)
            inverse_bind[4 * column + row] = (double)joint->inverse_bind[3 * column + row];
    mat4_mul(joint_world, inverse_bind, out);
}

static int compare_nodes(const void *key, const void *element)
{
    uint32_t node = *(const uint32_t *)key;
    const struct scene_deformed_node *found = element;
    return node < found->node ? -1 : node > found->node;
}

const struct scene_joint *deform_first_joint(const struct scene *scene, uint32_t node,
                                             uint32_t *joint_node)
{
    for (uint32_t i = member_count(scene); i-- > 0;) {
        const struct scene *member = member_scene(scene, i);
        uint32_t first = scene->part_count ? scene->parts[i].first_node : 0, own = node - first;
        if (node < first || own >= member->node_count || !member->deformed_node_count)
            continue;
        const struct scene_deformed_node *found =
            bsearch(&own, member->deformed_nodes, member->deformed_node_count, sizeof *found,
                    compare_nodes);
        if (!found || found->skin < 0)
            return NULL;
        const struct scene_joint *joint = &member->joints[member->skins[found->skin].first_joint];
        *joint_node = first + joint->node;
        return joint;
    }
    return NULL;
}

static bool pose_skin(const struct evaluation *e, const struct member *member, uint32_t index,
                      struct error *err)
{
    const struct scene_skin *skin = &member->scene->skins[index];
    const struct scene_joint *joints = &member->scene->joints[skin->first_joint];
    struct skin_pose *pose = &member->skins[index];
    double size = 0;
    int64_t sign = 0;
    if (pose->matrices)
        return true;
    pose->matrices = malloc(skin->joint_count * sizeof *pose->matrices);
    if (!pose->matrices)
        return error_set(err, ERROR_NO_MEMORY, "%u joints", skin->joint_count);
    memcpy(pose->origin, e->world[member->first_node + joints[0].node] + 12, sizeof pose->origin);
    for (uint32_t i = 0; i < skin->joint_count; i++) {
        double m[16];
        deform_joint_matrix(e->world[member->first_node + joints[i].node], &joints[i], m);
        vec3_sub(m + 12, pose->origin, m + 12);
        for (int k = 0; k < 16; k++)
            pose->matrices[i][k] = (float)(k == 15 ? 0 : m[k]);
        double determinant = mat4_determinant3(m);
        sign += determinant < 0 ? -1 : 1;
        size += fabs(determinant) / skin->joint_count;
    }
    pose->determinant = sign < 0 ? -size : size;
    pose->key = content_key_begin();
    content_key_add(&pose->key, pose->matrices, skin->joint_count * sizeof *pose->matrices);
    return true;
}

/* ---- vertices ---- */

/* One primitive under evaluation; the arrays begin at its first vertex. */
struct shape {
    const struct scene *scene;
    const struct scene_deformation *deformation;
    const struct scene_primitive *rest;
    const struct skin_pose *skin; /* NULL: morphed only */
    const float *weights;         /* of its targets; NULL: skinned only */
    uint32_t weight_count;
    float *positions, *normals, *tangents; /* tangents NULL: it has none */
};

static void copy_rest(const struct shape *s)
{
    const struct scene *from = s->scene;
    size_t first = s->rest->first_vertex, count = s->rest->vertex_count;
    memcpy(s->positions, from->positions + 3 * first, 3 * count * sizeof(float));
    memcpy(s->normals, from->normals + 3 * first, 3 * count * sizeof(float));
    if (s->tangents)
        memcpy(s->tangents, from->tangents + 4 * first, 4 * count * sizeof(float));
}

/* Section 3.7.2.2: the weighted differences are added. */
static void add_target(const struct shape *s, uint32_t index)
{
    const struct scene_target *target = &s->scene->targets[s->deformation->first_target + index];
    const struct scene_delta *delta = s->scene->deltas + target->first_delta;
    const float weight = s->weights[index];
    for (uint32_t i = 0; i < target->delta_count; i++, delta++) {
        float *position = s->positions + 3 * (size_t)delta->vertex;
        float *normal = s->normals + 3 * (size_t)delta->vertex;
        for (int k = 0; k < 3; k++) {
            position[k] += weight * delta->position[k];
            normal[k] += weight * delta->normal[k];
            if (s->tangents)
                s->tangents[4 * (size_t)delta->vertex + (size_t)k] += weight * delta->tangent[k];
        }
    }
}

/* Divides by the length; false, and unchanged, where there is none. */
static bool to_unit(float v[3])
{
    /* Whose squares do not underflow. */
    double x = (double)v[0], y = (double)v[1], z = (double)v[2];
    double square = x * x + y * y + z * z;
    if (!(square > 0 && isfinite(square)))
        return false;
    double scale = 1 / sqrt(square);
    v[0] = (float)(x * scale);
    v[1] = (float)(y * scale);
    v[2] = (float)(z * scale);
    return true;
}

/* The cofactor matrix of the upper 3 x 3, which is its inverse transpose times its determinant. */
static void transform_normal(const float m[16], float n[3])
{
    double c[3][3], d[16], out[3];
    for (int k = 0; k < 12; k++)
        d[k] = (double)m[k];
    for (int i = 0; i < 3; i++)
        vec3_cross(d + 4 * ((i + 1) % 3), d + 4 * ((i + 2) % 3), c[i]);
    for (int k = 0; k < 3; k++)
        out[k] = c[0][k] * (double)n[0] + c[1][k] * (double)n[1] + c[2][k] * (double)n[2];
    if (!vec3_normalize(out))
        return;
    for (int k = 0; k < 3; k++)
        n[k] = (float)out[k];
}

static void blend_matrices(const struct shape *s, uint32_t vertex, float out[16])
{
    const struct scene_influence *influence =
        s->scene->influences + s->deformation->first_influence + vertex;
    for (int k = 0; k < 16; k++)
        out[k] = 0;
    for (uint32_t set = 0; set < s->deformation->influence_sets; set++) {
        for (int i = 0; i < 4; i++) {
            const float weight = influence->weights[i];
            const float *joint = s->skin->matrices[influence->joints[i]];
            for (int k = 0; weight > 0 && k < 16; k++)
                out[k] += weight * joint[k];
        }
        influence += s->rest->vertex_count;
    }
}

/* Section 3.7.3.3: linear blend skinning. */
static void skin_vertices(const struct shape *s)
{
    for (uint32_t v = 0; v < s->rest->vertex_count; v++) {
        float m[16], *p = s->positions + 3 * (size_t)v, *n = s->normals + 3 * (size_t)v;
        const float x = p[0], y = p[1], z = p[2];
        blend_matrices(s, v, m);
        for (int k = 0; k < 3; k++)
            p[k] = m[k] * x + m[4 + k] * y + m[8 + k] * z + m[12 + k];
        transform_normal(m, n);
        if (!s->tangents)
            continue;
        float *t = s->tangents + 4 * (size_t)v;
        const float u[3] = {t[0], t[1], t[2]};
        for (int k = 0; k < 3; k++)
            t[k] = m[k] * u[0] + m[4 + k] * u[1] + m[8 + k] * u[2];
        to_unit(t);
    }
}

/* Section 3.7.2.1: without normals the triangles are flat, in each pose. */
static void flatten_normals(const struct shape *s)
{
    for (uint32_t v = 0; v + 2 < s->rest->vertex_count; v += 3) {
        const float *p = s->positions + 3 * (size_t)v;
        double a[3], b[3], n[3];
        for (int k = 0; k < 3; k++) {
            a[k] = (double)p[3 + k] - (double)p[k];
            b[k] = (double)p[6 + k] - (double)p[k];
        }
        vec3_cross(a, b, n);
        if (!vec3_normalize(n))
            continue;
        for (int i = 0; i < 9; i++)
            s->normals[3 * (size_t)v + (size_t)i] = (float)n[i % 3];
    }
}

static bool find_bounds(const struct shape *s, struct scene_primitive *p, struct error *err)
{
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    float sum = 0; /* stays zero unless some number is NaN or infinite */
    for (size_t v = 0; v < s->rest->vertex_count; v++)
        for (size_t k = 0; k < 3; k++) {
            float value = s->positions[3 * v + k];
            low[k] = value < low[k] ? value : low[k];
            high[k] = value > high[k] ? value : high[k];
            sum += value * 0 + s->normals[3 * v + k] * 0;
        }
    if (sum != 0)
        return error_set(err, ERROR_INVALID_SCENE, "its vertices in this pose are not finite");
    memcpy(p->bounds_min, low, sizeof low);
    memcpy(p->bounds_max, high, sizeof high);
    return true;
}

static bool evaluate_shape(const struct shape *s, struct state_deformed *out, struct error *err)
{
    copy_rest(s);
    bool is_turned = false;
    for (uint32_t i = 0; i < s->weight_count; i++)
        if (s->weights[i] != 0) {
            add_target(s, i);
            is_turned = true;
        }
    for (size_t v = 0; is_turned && v < s->rest->vertex_count; v++) {
        to_unit(s->normals + 3 * v);
        if (s->tangents)
            to_unit(s->tangents + 4 * v);
    }
    if (s->skin)
        skin_vertices(s);
    if (s->deformation->flags & SCENE_DEFORMATION_IS_FLAT)
        flatten_normals(s);
    return find_bounds(s, &out->primitive, err);
}

/* ---- what deforms ---- */

/* Whether the node deforms the primitive by its skin, and by how many targets. */
static bool is_deformed(const struct member *member, const struct scene_deformed_node *node,
                        const struct scene_deformation *d, bool *is_skinned, uint32_t *targets)
{
    const struct scene *scene = member->scene;
    *is_skinned = node->skin >= 0 && d->influence_sets > 0 &&
                  d->joint_count <= scene->skins[node->skin].joint_count;
    *targets = node->weight_count < d->target_count ? node->weight_count : d->target_count;
    return (*is_skinned || *targets > 0) && scene->primitives[d->primitive].index_count > 0;
}

static void count_item(struct evaluation *e, const struct member *member,
                       const struct scene_deformed_node *node, const struct scene_deformation *d)
{
    const struct scene *scene = member->scene;
    bool is_skinned;
    uint32_t targets;
    if (!is_deformed(member, node, d, &is_skinned, &targets))
        return;
    e->deforms->count++;
    e->vertices += scene->primitives[d->primitive].vertex_count;
    e->has_tangents |= scene->primitives[d->primitive].flags & SCENE_PRIMITIVE_HAS_TANGENTS;
    for (uint32_t i = 0; i < targets; i++)
        e->deltas += member->weights[node->first_weight + i] != 0
                         ? scene->targets[d->first_target + i].delta_count
                         : 0;
}

static bool add_item(struct evaluation *e, const struct member *member,
                     const struct scene_deformed_node *node, const struct scene_deformation *d,
                     struct error *err)
{
    const struct scene *scene = member->scene;
    struct state_deforms *deforms = e->deforms;
    bool is_skinned;
    struct shape shape = {
        .scene = scene, .deformation = d, .rest = &scene->primitives[d->primitive]};
    if (!is_deformed(member, node, d, &is_skinned, &shape.weight_count))
        return true;
    struct state_deformed *item = &deforms->items[deforms->count++];
    *item = (struct state_deformed){
        .node = member->first_node + node->node,
        .index = member->first_primitive + d->primitive,
        .primitive = e->scene->primitives[member->first_primitive + d->primitive],
        .pose = content_key_begin(),
        .scene_serial = scene->serial};
    item->primitive.first_vertex = (uint32_t)e->vertices;
    e->vertices += shape.rest->vertex_count;
    shape.weights = member->weights + node->first_weight;
    shape.positions = deforms->positions + 3 * (size_t)item->primitive.first_vertex;
    shape.normals = deforms->normals + 3 * (size_t)item->primitive.first_vertex;
    if (shape.rest->flags & SCENE_PRIMITIVE_HAS_TANGENTS)
        shape.tangents = deforms->tangents + 4 * (size_t)item->primitive.first_vertex;
    content_key_add(&item->pose, shape.weights, shape.weight_count * sizeof *shape.weights);
    if (is_skinned) {
        if (!pose_skin(e, member, (uint32_t)node->skin, err))
            return false;
        shape.skin = &member->skins[node->skin];
        item->joint_count = scene->skins[node->skin].joint_count;
        mat4_identity(item->world);
        memcpy(item->world + 12, shape.skin->origin, sizeof shape.skin->origin);
        item->determinant = shape.skin->determinant;
        content_key_add(&item->pose, &shape.skin->key, sizeof shape.skin->key);
    } else {
        memcpy(item->world, e->world[item->node], sizeof item->world);
        item->determinant = mat4_determinant3(item->world);
    }
    return evaluate_shape(&shape, item, err) ||
           error_wrap(err, "node %u '%s'", scene->nodes[node->node].source_index,
                      scene->strings + scene->nodes[node->node].name);
}

/* Counts the items of one member, or adds them. */
static bool walk_member(struct evaluation *e, const struct member *member, bool is_counting,
                        struct error *err)
{
    const struct scene *scene = member->scene;
    for (uint32_t i = 0; i < scene->deformed_node_count; i++) {
        const struct scene_deformed_node *node = &scene->deformed_nodes[i];
        const struct scene_mesh *mesh = &scene->meshes[scene->nodes[node->node].mesh];
        if (!e->is_visible[member->first_node + node->node])
            continue;
        uint32_t at =
            deformation_from(scene->deformations, scene->deformation_count, mesh->first_primitive);
        for (; at < scene->deformation_count &&
               scene->deformations[at].primitive - mesh->first_primitive < mesh->primitive_count;
             at++) {
            if (is_counting)
                count_item(e, member, node, &scene->deformations[at]);
            else if (!add_item(e, member, node, &scene->deformations[at], err))
                return false;
        }
    }
    return true;
}

static bool reserve(struct evaluation *e, struct error *err)
{
    struct state_deforms *deforms = e->deforms;
    if (e->vertices > DEFORM_VERTICES_MAX || e->deltas > DEFORM_DELTAS_MAX)
        return error_set(err, ERROR_TOO_LARGE,
                         "skins and morph targets move %llu vertices by %llu differences, the "
                         "limits are %d and %d",
                         (unsigned long long)e->vertices, (unsigned long long)e->deltas,
                         DEFORM_VERTICES_MAX, DEFORM_DELTAS_MAX);
    deforms->items = calloc(deforms->count + 1, sizeof *deforms->items);
    deforms->positions = malloc((3 * e->vertices + 1) * sizeof *deforms->positions);
    deforms->normals = malloc((3 * e->vertices + 1) * sizeof *deforms->normals);
    if (e->has_tangents)
        deforms->tangents = calloc(4 * e->vertices + 1, sizeof *deforms->tangents);
    deforms->vertex_count = (uint32_t)e->vertices;
    deforms->count = 0;
    e->vertices = 0;
    return (deforms->items && deforms->positions && deforms->normals &&
            (deforms->tangents || !e->has_tangents)) ||
           error_set(err, ERROR_NO_MEMORY, "%u vertices that deform", deforms->vertex_count);
}

static bool init_members(struct member *members, const struct scene *scene, const float *weights,
                         struct error *err)
{
    for (uint32_t i = 0; i < member_count(scene); i++) {
        struct member *member = &members[i];
        member->scene = member_scene(scene, i);
        member->first_node = scene->part_count ? scene->parts[i].first_node : 0;
        member->first_primitive = scene->part_count ? scene->parts[i].first_primitive : 0;
        member->weights = weights;
        member->skins = calloc((size_t)member->scene->skin_count + 1, sizeof *member->skins);
        if (!member->skins)
            return error_set(err, ERROR_NO_MEMORY, "%u skins", member->scene->skin_count);
        weights += member->scene->target_weight_count;
    }
    return true;
}

static void finish_members(struct member *members, uint32_t count)
{
    for (uint32_t i = 0; members && i < count; i++) {
        for (uint32_t s = 0; members[i].skins && s < members[i].scene->skin_count; s++)
            free(members[i].skins[s].matrices);
        free(members[i].skins);
    }
    free(members);
}

bool deforms_evaluate(struct state_deforms *deforms, const struct scene *scene,
                      const double (*world)[16], const bool *is_visible, struct error *err)
{
    static atomic_uint_least64_t serial;
    struct evaluation e = {
        .scene = scene, .deforms = deforms, .world = world, .is_visible = is_visible};
    if (!deforms->weights) /* nothing deforms */
        return true;
    uint32_t count = member_count(scene);
    struct member *members = calloc(count, sizeof *members);
    bool ok = members || error_set(err, ERROR_NO_MEMORY, "%u parts", count);
    ok = ok && init_members(members, scene, deforms->weights, err);
    for (uint32_t i = 0; ok && i < count; i++)
        ok = walk_member(&e, &members[i], true, err);
    ok = ok && reserve(&e, err);
    for (uint32_t i = 0; ok && i < count; i++)
        ok = walk_member(&e, &members[i], false, err);
    finish_members(members, count);
    deforms->serial = ++serial;
    return ok;
}
