/* SPDX-License-Identifier: MIT */
/* EXT_mesh_gpu_instancing: TRANSLATION, ROTATION and SCALE of instances, from accessors. */
#include "renderer/import/import_instances.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "renderer/base/matrix.h"

enum { INSTANCES_MAX = 1 << 20 }; /* of a scene: 300 MB of nodes, from a few bytes of JSON */

struct attribute {
    const char *name;
    int components;
    float fallback[4];
    bool takes_normalized; /* signed integers */
};

static const struct attribute attributes[GLTF_INSTANCE_ATTRIBUTE_COUNT] = {
    [GLTF_INSTANCE_TRANSLATION] = {"TRANSLATION", 3, {0, 0, 0, 0}, false},
    [GLTF_INSTANCE_ROTATION] = {"ROTATION", 4, {0, 0, 0, 1}, true},
    [GLTF_INSTANCE_SCALE] = {"SCALE", 3, {1, 1, 1, 0}, false},
};

/* The instances of one node. */
struct instances {
    uint32_t count;
    struct accessor from[GLTF_INSTANCE_ATTRIBUTE_COUNT]; /* count 0: absent */
};

bool node_has_instances(const struct gltf_node *node)
{
    bool has_any = false;
    for (int i = 0; i < GLTF_INSTANCE_ATTRIBUTE_COUNT; i++)
        has_any |= node->instance_attributes[i] != -1;
    return node->is_instanced && node->mesh >= 0 && has_any && node->skin == -1;
}

static bool check_type(const struct accessor *a, const struct attribute *attribute,
                       struct error *err)
{
    bool is_signed = a->component == GLTF_BYTE || a->component == GLTF_SHORT;
    bool is_good = a->component == GLTF_FLOAT ||
                   (attribute->takes_normalized && a->is_normalized && is_signed);
    return (is_good && a->components == attribute->components) ||
           error_set(err, ERROR_INVALID_SCENE,
                     "accessor %d has an element type that it cannot have", a->index);
}

static bool instances_open(struct instances *instances, const struct importer *importer,
                           const struct gltf_node *node, struct error *err)
{
    const char *first = NULL;
    *instances = (struct instances){.count = 0};
    for (int i = 0; i < GLTF_INSTANCE_ATTRIBUTE_COUNT; i++) {
        struct accessor *a = &instances->from[i];
        const char *name = attributes[i].name;
        if (node->instance_attributes[i] == -1)
            continue;
        if (!accessor_open(&importer->source, node->instance_attributes[i], a, err) ||
            !check_type(a, &attributes[i], err))
            return error_wrap(err, "%s of its instances", name);
        if (first && a->count != instances->count)
            return error_set(err, ERROR_INVALID_SCENE,
                             "%s of its instances has %u elements, %s has %u", name, a->count,
                             first, instances->count);
        first = first ? first : name;
        instances->count = a->count;
    }
    return true;
}

static bool read_instance(const struct instances *instances, uint32_t index, double matrix[16],
                          struct error *err)
{
    double values[GLTF_INSTANCE_ATTRIBUTE_COUNT][4] = {{0}};
    for (int i = 0; i < GLTF_INSTANCE_ATTRIBUTE_COUNT; i++) {
        float value[4];
        memcpy(value, attributes[i].fallback, sizeof value);
        if (instances->from[i].count && !accessor_read(&instances->from[i], index, value, err))
            return error_wrap(err, "%s of its instances", attributes[i].name);
        for (int k = 0; k < attributes[i].components; k++)
            values[i][k] = value[k];
    }
    double *q = values[GLTF_INSTANCE_ROTATION];
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 0))
        return error_set(err, ERROR_INVALID_SCENE, "ROTATION of its instance %u has no direction",
                         index);
    for (int k = 0; k < 4; k++)
        q[k] /= length;
    mat4_compose(values[GLTF_INSTANCE_TRANSLATION], q, values[GLTF_INSTANCE_SCALE], matrix);
    return true;
}

static bool is_finite_matrix(const double m[16])
{
    for (int i = 0; i < 16; i++)
        if (!isfinite((float)m[i]))
            return false;
    return true;
}

/* "Tree #3", if the node has a name and no other node has this one. */
static bool add_name(struct importer *importer, const struct node_names *names, const char *of_node,
                     uint32_t index, uint32_t *offset, struct error *err)
{
    char name[300];
    int length = snprintf(name, sizeof name, "%s #%u", of_node, index);
    bool is_free = of_node[0] && (size_t)length < sizeof name && !node_names_are_taken(names, name);
    return blob_writer_add_text(&importer->writer, is_free ? name : "", offset, err);
}

static bool append_instances(struct importer *importer, const struct node_names *names,
                             uint32_t blob_node, struct error *err)
{
    uint32_t source = importer->node_order[blob_node];
    const struct gltf_node *node = &importer->document->nodes[source];
    const char *name = node_names_find(names, importer->document, node);
    struct instances instances;
    if (!instances_open(&instances, importer, node, err))
        return false;
    uint64_t have = importer->writer.sections[SCENE_NODES].count - importer->node_count;
    if (have + instances.count > INSTANCES_MAX)
        return error_set(err, ERROR_TOO_LARGE, "with its %u instances there are %llu, limit is %d",
                         instances.count, (unsigned long long)have + instances.count,
                         INSTANCES_MAX);
    struct scene_node *to =
        blob_writer_append(&importer->writer, SCENE_NODES, instances.count, err);
    if (!to)
        return false;
    const struct scene_node *nodes = importer->writer.sections[SCENE_NODES].records;
    for (uint32_t i = 0; i < instances.count; i++, to++) {
        if (!read_instance(&instances, i, to->local_matrix, err))
            return false;
        mat4_mul(nodes[blob_node].world_matrix, to->local_matrix, to->world_matrix);
        if (!is_finite_matrix(to->local_matrix) || !is_finite_matrix(to->world_matrix))
            return error_set(err, ERROR_INVALID_SCENE,
                             "the world matrix of its instance %u is not finite", i);
        to->parent = (int32_t)blob_node;
        to->mesh = importer->mesh_of[node->mesh];
        to->camera = to->light = to->grid = -1;
        to->source_index = source;
        if (!add_name(importer, names, name, i, &to->name, err))
            return false;
    }
    return true;
}

bool import_instances(struct importer *importer, const struct node_names *names, struct error *err)
{
    for (uint32_t i = 0; i < importer->node_count; i++) {
        uint32_t source = importer->node_order[i];
        const struct gltf_node *node = &importer->document->nodes[source];
        importer->skinned_instances += node->is_instanced && node->skin != -1;
        if (node_has_instances(node) && !append_instances(importer, names, i, err))
            return error_wrap(err, "node %u '%s'", source, node->name);
    }
    return true;
}
