/* SPDX-License-Identifier: MIT */
/* How the vertices of a primitive follow joints and morph targets: glTF 2.0, sections 3.7.2.2 and
 * 3.7.3. What a scene deforms by is what its shown nodes ask for: influences of meshes that no
 * skinned node shows are not read. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/fnv.h"
#include "renderer/import/importer.h"

/* ---- influences ---- */

static bool is_joint_type(const struct accessor *a)
{
    return a->component == GLTF_UNSIGNED_BYTE || a->component == GLTF_UNSIGNED_SHORT;
}

/* How many sets of four the primitive has, after checking that joints and weights come in pairs. */
static bool count_sets(struct importer *importer, const struct deformed_shape *shape,
                       uint32_t *sets, struct error *err)
{
    *sets = 0;
    for (int set = 0; set < SCENE_INFLUENCE_SETS_MAX; set++) {
        const struct accessor *joints = &shape->attributes[GLTF_JOINTS_0 + 2 * set];
        const struct accessor *weights = &shape->attributes[GLTF_WEIGHTS_0 + 2 * set];
        if (!joints->count != !weights->count)
            return error_set(err, ERROR_INVALID_SCENE, "it has %s_%d without %s_%d",
                             joints->count ? "JOINTS" : "WEIGHTS", set,
                             joints->count ? "WEIGHTS" : "JOINTS", set);
        if (joints->count && (!is_joint_type(joints) || joints->is_normalized))
            return error_set(err, ERROR_INVALID_SCENE,
                             "accessor %d has an element type that JOINTS_%d cannot have",
                             joints->index, set);
        if (joints->count && *sets != (uint32_t)set)
            return error_set(err, ERROR_INVALID_SCENE, "it has JOINTS_%d without JOINTS_%d", set,
                             set - 1);
        *sets += joints->count > 0;
    }
    importer->unjointed_primitives += shape->is_skinned && *sets == 0;
    importer->left_out_influences += shape->is_skinned && shape->from->has_more_joints;
    return true;
}

/* Reads one set of a vertex; unused places name the first joint. */
static bool read_influence(const struct deformed_shape *shape, uint32_t set, uint32_t vertex,
                           struct scene_influence *out, uint32_t *joint_count, struct error *err)
{
    float joints[4], weights[4];
    uint32_t source = shape->sources[vertex];
    if (!accessor_read(&shape->attributes[GLTF_JOINTS_0 + 2 * set], source, joints, err) ||
        !accessor_read(&shape->attributes[GLTF_WEIGHTS_0 + 2 * set], source, weights, err))
        return error_wrap(err, "JOINTS_%u and WEIGHTS_%u", set, set);
    for (int k = 0; k < 4; k++) {
        if (weights[k] < 0)
            return error_set(err, ERROR_INVALID_SCENE, "vertex %u has the joint weight %g", source,
                             (double)weights[k]);
        out->weights[k] = weights[k];
        out->joints[k] = weights[k] > 0 ? (uint16_t)joints[k] : 0;
        *joint_count = out->joints[k] >= *joint_count ? out->joints[k] + 1u : *joint_count;
    }
    return true;
}

/* Section 3.7.3.3: the weights of a vertex have the sum 1, which quantised or rounded ones miss.
 * Returns whether there is any. */
static bool normalize_weights(struct scene_influence *first, uint32_t sets, uint32_t stride)
{
    double sum = 0;
    for (uint32_t s = 0; s < sets; s++)
        for (int k = 0; k < 4; k++)
            sum += (double)first[(size_t)s * stride].weights[k];
    for (uint32_t s = 0; sum > 0 && s < sets; s++)
        for (int k = 0; k < 4; k++) {
            float *weight = &first[(size_t)s * stride].weights[k];
            *weight = (float)((double)*weight / sum);
        }
    if (!(sum > 0))
        first->weights[0] = 1;
    return sum > 0;
}

static bool append_influences(struct importer *importer, const struct deformed_shape *shape,
                              struct scene_deformation *out, struct error *err)
{
    uint32_t vertices = shape->primitive->vertex_count;
    if (!count_sets(importer, shape, &out->influence_sets, err))
        return false;
    out->first_influence = (uint32_t)importer->writer.sections[SCENE_INFLUENCES].count;
    if (!out->influence_sets)
        return true;
    struct scene_influence *records = blob_writer_append(
        &importer->writer, SCENE_INFLUENCES, (uint64_t)out->influence_sets * vertices, err);
    if (!records)
        return false;
    out->joint_count = 1;
    for (uint32_t v = 0; v < vertices; v++) {
        for (uint32_t set = 0; set < out->influence_sets; set++)
            if (!read_influence(shape, set, v, &records[(size_t)set * vertices + v],
                                &out->joint_count, err))
                return false;
        importer->unbound_vertices +=
            !normalize_weights(&records[v], out->influence_sets, vertices);
    }
    return true;
}

/* ---- targets ---- */

bool import_check_targets(const struct gltf_mesh *mesh, struct error *err)
{
    size_t count = mesh->primitive_count ? mesh->primitives[0].target_count : 0;
    for (size_t i = 1; i < mesh->primitive_count; i++)
        if (mesh->primitives[i].target_count != count)
            return error_set(err, ERROR_INVALID_SCENE,
                             "primitive %zu has %zu morph targets, primitive 0 has %zu", i,
                             mesh->primitives[i].target_count, count);
    if (count > SCENE_TARGETS_MAX)
        return error_set(err, ERROR_TOO_LARGE, "%zu morph targets, limit is %d", count,
                         SCENE_TARGETS_MAX);
    if (mesh->weights.count && mesh->weights.count != count)
        return error_set(err, ERROR_INVALID_SCENE, "%zu weights for %zu morph targets",
                         mesh->weights.count, count);
    return true;
}

/* The accessors of one target; count 0: absent. */
struct target {
    struct accessor position, normal, tangent;
};

static bool open_difference(struct importer *importer, const struct deformed_shape *shape,
                            int index, enum gltf_attribute of, struct accessor *a,
                            struct error *err)
{
    static const char *const names[] = {
        [GLTF_POSITION] = "POSITION", [GLTF_NORMAL] = "NORMAL", [GLTF_TANGENT] = "TANGENT"};
    const struct accessor *base = &shape->attributes[of];
    *a = (struct accessor){.count = 0};
    if (index == -1 || !base->count)
        return true;
    if (!accessor_open(&importer->source, index, a, err))
        return error_wrap(err, "%s", names[of]);
    if (a->components != 3 || a->component == GLTF_UNSIGNED_INT ||
        (a->component != GLTF_FLOAT && !a->is_normalized && of != GLTF_POSITION))
        return error_set(err, ERROR_INVALID_SCENE,
                         "accessor %d has an element type that %s of a morph target cannot have",
                         a->index, names[of]);
    if (a->count != base->count)
        return error_set(err, ERROR_INVALID_SCENE, "%s has %u elements, that of the mesh has %u",
                         names[of], a->count, base->count);
    return true;
}

static bool open_target(struct importer *importer, const struct deformed_shape *shape,
                        const struct gltf_target *from, struct target *target, struct error *err)
{
    return open_difference(importer, shape, from->position, GLTF_POSITION, &target->position,
                           err) &&
           open_difference(importer, shape, from->normal, GLTF_NORMAL, &target->normal, err) &&
           open_difference(importer, shape, from->tangent, GLTF_TANGENT, &target->tangent, err);
}

static bool read_difference(const struct accessor *a, uint32_t source, float out[3], bool *is_any,
                            struct error *err)
{
    if (a->count && !accessor_read(a, source, out, err))
        return false;
    *is_any = *is_any || out[0] != 0 || out[1] != 0 || out[2] != 0;
    return true;
}

/* Only vertices that the target moves or turns are kept. */
static bool append_deltas(struct importer *importer, const struct deformed_shape *shape,
                          const struct target *target, struct error *err)
{
    for (uint32_t v = 0; v < shape->primitive->vertex_count; v++) {
        struct scene_delta delta = {.vertex = v};
        bool is_any = false;
        uint32_t source = shape->sources[v];
        if (!read_difference(&target->position, source, delta.position, &is_any, err) ||
            !read_difference(&target->normal, source, delta.normal, &is_any, err) ||
            !read_difference(&target->tangent, source, delta.tangent, &is_any, err))
            return false;
        if (!is_any)
            continue;
        struct scene_delta *record = blob_writer_append(&importer->writer, SCENE_DELTAS, 1, err);
        if (!record)
            return false;
        *record = delta;
    }
    return true;
}

static bool append_target(struct importer *importer, const struct deformed_shape *shape,
                          const struct gltf_target *from, struct error *err)
{
    struct target target;
    uint64_t first = importer->writer.sections[SCENE_DELTAS].count;
    if (!open_target(importer, shape, from, &target, err) ||
        !append_deltas(importer, shape, &target, err))
        return false;
    struct scene_target *record = blob_writer_append(&importer->writer, SCENE_TARGETS, 1, err);
    if (!record)
        return false;
    *record = (struct scene_target){
        .first_delta = (uint32_t)first,
        .delta_count = (uint32_t)(importer->writer.sections[SCENE_DELTAS].count - first)};
    return true;
}

static bool append_targets(struct importer *importer, const struct deformed_shape *shape,
                           struct scene_deformation *out, struct error *err)
{
    out->first_target = (uint32_t)importer->writer.sections[SCENE_TARGETS].count;
    out->target_count = (uint32_t)shape->from->target_count;
    for (size_t i = 0; i < shape->from->target_count; i++)
        if (!append_target(importer, shape, &shape->from->targets[i], err))
            return error_wrap(err, "morph target %zu", i);
    return true;
}

/* ---- closed surfaces ---- */

struct place { /* of a vertex at rest, and a digest of all that moves it */
    float position[3];
    uint32_t pad;
    uint64_t motion;
};

static int compare_places(const void *left, const void *right)
{
    const struct place *a = left, *b = right;
    for (int k = 0; k < 3; k++)
        if (a->position[k] != b->position[k])
            return a->position[k] < b->position[k] ? -1 : 1;
    return 0;
}

static void digest_motions(const struct importer *importer, const struct scene_deformation *d,
                           struct place *places, uint32_t vertices)
{
    const struct blob_section *sections = importer->writer.sections;
    const struct scene_influence *influences = sections[SCENE_INFLUENCES].records;
    const struct scene_target *targets = sections[SCENE_TARGETS].records;
    const struct scene_delta *deltas = sections[SCENE_DELTAS].records;
    for (uint32_t set = 0; set < d->influence_sets; set++)
        for (uint32_t v = 0; v < vertices; v++)
            places[v].motion = fnv_add(places[v].motion,
                                       &influences[d->first_influence + (size_t)set * vertices + v],
                                       sizeof *influences);
    for (uint32_t t = 0; t < d->target_count; t++) {
        const struct scene_target *target = &targets[d->first_target + t];
        for (uint32_t i = 0; i < target->delta_count; i++) {
            const struct scene_delta *delta = &deltas[target->first_delta + i];
            uint64_t *motion = &places[delta->vertex].motion;
            *motion = fnv_add(*motion, &t, sizeof t);
            *motion = fnv_add(*motion, delta->position, sizeof delta->position);
        }
    }
}

/* Vertices at one place that move alike stay at one place in every pose, bit for bit. */
static bool find_whether_closed(const struct importer *importer, const struct deformed_shape *shape,
                                const struct scene_deformation *d, bool *keeps_closed,
                                struct error *err)
{
    uint32_t vertices = shape->primitive->vertex_count;
    const float *positions = importer->writer.sections[SCENE_POSITIONS].records;
    struct place *places = calloc((size_t)vertices + 1, sizeof *places);
    if (!places)
        return error_set(err, ERROR_NO_MEMORY, "%u vertices that deform", vertices);
    positions += 3 * (size_t)shape->primitive->first_vertex;
    for (uint32_t v = 0; v < vertices; v++)
        for (int k = 0; k < 3; k++)
            places[v].position[k] = positions[3 * (size_t)v + (size_t)k];
    digest_motions(importer, d, places, vertices);
    qsort(places, vertices, sizeof *places, compare_places);
    for (uint32_t v = 1; v < vertices; v++)
        if (!compare_places(&places[v - 1], &places[v]) && places[v - 1].motion != places[v].motion)
            *keeps_closed = false;
    free(places);
    return true;
}

bool import_deformation(struct importer *importer, const struct deformed_shape *shape,
                        bool *keeps_closed, struct error *err)
{
    struct scene_deformation deformation = {
        .primitive = (uint32_t)importer->writer.sections[SCENE_PRIMITIVES].count,
        .flags = shape->is_flat ? SCENE_DEFORMATION_IS_FLAT : 0};
    *keeps_closed = true;
    if (!append_influences(importer, shape, &deformation, err) ||
        !append_targets(importer, shape, &deformation, err))
        return false;
    if (!deformation.influence_sets && !deformation.target_count)
        return true;
    if (!find_whether_closed(importer, shape, &deformation, keeps_closed, err))
        return false;
    struct scene_deformation *record =
        blob_writer_append(&importer->writer, SCENE_DEFORMATIONS, 1, err);
    if (!record)
        return false;
    *record = deformation;
    return true;
}
