/* SPDX-License-Identifier: MIT */
/* Skins that shown nodes have, and the nodes whose meshes deform. What is wrong with a skin that
 * nothing shows changes no picture. glTF 2.0, sections 3.7.3.3 and 5.28. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/import/importer.h"
#include "renderer/scene/deform.h"
#include "renderer/scene/scene_state.h"

enum { DEPTH = 8 /* of what is passed over, from the root of the document */ };

struct skin {         /* as the file has it */
    uint32_t *joints; /* owned: nodes of the file */
    size_t joint_count;
    int64_t matrices, skeleton; /* an accessor, a node; -1 when absent */
    int32_t blob_skin;          /* -1 until a shown node has it */
};

struct skins {
    struct importer *importer;
    struct skin *items; /* owned */
    size_t count;
    int32_t *blob_node; /* owned: per node of the file; -1 when the scene does not show it */
    size_t *named_by;   /* owned: per node of the file, 1 + the last skin that has it as a joint */
};

/* ---- reading ---- */

static bool scan_index(struct scanner *s, int64_t *index)
{
    uint64_t number;
    if (!scanner_unsigned(s, &number))
        return false;
    *index = number > INT32_MAX ? INT32_MAX : (int64_t)number;
    return true;
}

static bool scan_joint(struct scanner *s, void *list)
{
    struct skin *skin = list;
    int64_t joint;
    uint32_t *joints = scanner_grow(s, skin->joints, skin->joint_count, sizeof *joints);
    if (!joints)
        return false;
    skin->joints = joints;
    if (!scan_index(s, &joint))
        return false;
    joints[skin->joint_count++] = (uint32_t)joint;
    return true;
}

static bool scan_skin_member(struct scanner *s, struct span key, void *object)
{
    struct skin *skin = object;
    if (span_is(key, "joints"))
        return scanner_array(s, scan_joint, skin);
    if (span_is(key, "inverseBindMatrices"))
        return scan_index(s, &skin->matrices);
    if (span_is(key, "skeleton"))
        return scan_index(s, &skin->skeleton);
    return scanner_skip(s, DEPTH);
}

static bool scan_skin(struct scanner *s, void *list)
{
    struct skins *skins = list;
    struct skin *items = scanner_grow(s, skins->items, skins->count, sizeof *items);
    if (!items)
        return false;
    skins->items = items;
    struct skin *skin = &items[skins->count++];
    *skin = (struct skin){.matrices = -1, .skeleton = -1, .blob_skin = -1};
    return scanner_object(s, scan_skin_member, skin);
}

static bool skins_init(struct skins *skins, struct importer *importer, struct error *err)
{
    struct span text = importer->json.skins;
    struct scanner s = {.text = text.begin, .at = text.begin, .end = text.end, .err = err};
    size_t nodes = importer->document->node_count;
    *skins = (struct skins){.importer = importer,
                            .blob_node = malloc((nodes + 1) * sizeof *skins->blob_node),
                            .named_by = calloc(nodes + 1, sizeof *skins->named_by)};
    if (!skins->blob_node || !skins->named_by)
        return error_set(err, ERROR_NO_MEMORY, "joints of %zu nodes", nodes);
    for (size_t i = 0; i < nodes; i++)
        skins->blob_node[i] = -1;
    for (uint32_t i = 0; i < importer->node_count; i++)
        skins->blob_node[importer->node_order[i]] = (int32_t)i;
    return !text.begin || scanner_array(&s, scan_skin, skins) || error_wrap(err, "skins");
}

static void skins_finish(struct skins *skins)
{
    for (size_t i = 0; i < skins->count; i++)
        free(skins->items[i].joints);
    free(skins->items);
    free(skins->blob_node);
    free(skins->named_by);
}

/* ---- skins ---- */

static bool check_skin(struct skins *skins, size_t index, struct error *err)
{
    const struct skin *skin = &skins->items[index];
    size_t nodes = skins->importer->document->node_count;
    if (skin->joint_count == 0)
        return error_set(err, ERROR_INVALID_SCENE, "it has no joints");
    for (size_t i = 0; i < skin->joint_count; i++) {
        uint32_t node = skin->joints[i];
        if (node >= nodes)
            return error_set(err, ERROR_INVALID_SCENE,
                             "it has the joint %u, but there is no such node", node);
        if (skins->blob_node[node] < 0)
            return error_set(err, ERROR_INVALID_SCENE,
                             "its joint %zu is node %u, which is not in the scene", i, node);
        if (skins->named_by[node] == index + 1)
            return error_set(err, ERROR_INVALID_SCENE, "it has the joint %u twice", node);
        skins->named_by[node] = index + 1;
    }
    if (skin->skeleton >= (int64_t)nodes)
        return error_set(err, ERROR_INVALID_SCENE,
                         "it has the skeleton %lld, but there is no such node",
                         (long long)skin->skeleton);
    return true;
}

/* A matrix that is absent is the identity. */
static bool read_matrix(const struct accessor *matrices, uint32_t joint, float out[12],
                        struct error *err)
{
    float m[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    if (matrices->count && !accessor_read(matrices, joint, m, err))
        return false;
    if (fabsf(m[3]) > 1e-5f || fabsf(m[7]) > 1e-5f || fabsf(m[11]) > 1e-5f ||
        fabsf(m[15] - 1) > 1e-5f)
        return error_set(err, ERROR_INVALID_SCENE, "inverse bind matrix %u is not affine", joint);
    for (int column = 0; column < 4; column++)
        memcpy(out + 3 * (size_t)column, m + 4 * (size_t)column, 3 * sizeof *out);
    return true;
}

static bool write_joints(struct skins *skins, const struct skin *skin, struct error *err)
{
    struct blob_writer *writer = &skins->importer->writer;
    struct accessor matrices = {.count = 0};
    if (skin->matrices >= 0) {
        if (!accessor_open_matrices(&skins->importer->source, (int)skin->matrices, &matrices, err))
            return error_wrap(err, "inverseBindMatrices");
        if (matrices.count < skin->joint_count)
            return error_set(err, ERROR_INVALID_SCENE,
                             "it has %zu joints, but inverse bind matrices for %u",
                             skin->joint_count, matrices.count);
    }
    struct scene_joint *joints = blob_writer_append(writer, SCENE_JOINTS, skin->joint_count, err);
    if (!joints)
        return false;
    for (uint32_t i = 0; i < skin->joint_count; i++) {
        joints[i].node = (uint32_t)skins->blob_node[skin->joints[i]];
        if (!read_matrix(&matrices, i, joints[i].inverse_bind, err))
            return false;
    }
    return true;
}

static bool write_skin(struct skins *skins, size_t index, struct error *err)
{
    struct blob_writer *writer = &skins->importer->writer;
    struct skin *skin = &skins->items[index];
    if (skin->blob_skin >= 0)
        return true;
    struct scene_skin record = {.first_joint = (uint32_t)writer->sections[SCENE_JOINTS].count,
                                .joint_count = (uint32_t)skin->joint_count};
    if (!check_skin(skins, index, err) || !write_joints(skins, skin, err))
        return error_wrap(err, "skin %zu", index);
    skin->blob_skin = (int32_t)writer->sections[SCENE_SKINS].count;
    struct scene_skin *to = blob_writer_append(writer, SCENE_SKINS, 1, err);
    if (!to)
        return false;
    *to = record;
    return true;
}

/* ---- deformed nodes ---- */

/* Whether the skin has all joints that the mesh's influences name. */
static bool check_influences(const struct importer *importer, const struct scene_mesh *mesh,
                             const struct skin *skin, struct error *err)
{
    const struct blob_section *section = &importer->writer.sections[SCENE_DEFORMATIONS];
    const struct scene_deformation *deformations = section->records;
    uint32_t count = (uint32_t)section->count;
    for (uint32_t i = deformation_from(deformations, count, mesh->first_primitive);
         i < count && deformations[i].primitive - mesh->first_primitive < mesh->primitive_count;
         i++)
        if (deformations[i].joint_count > skin->joint_count)
            return error_set(err, ERROR_INVALID_SCENE,
                             "its mesh names the joint %u, its skin has %zu",
                             deformations[i].joint_count - 1, skin->joint_count);
    return true;
}

static bool append_weights(struct importer *importer, const struct gltf_node *from, uint32_t count,
                           struct error *err)
{
    const struct gltf_mesh *mesh = &importer->document->meshes[from->mesh];
    const struct gltf_numbers *numbers = from->weights.count ? &from->weights : &mesh->weights;
    if (numbers->count && numbers->count != count)
        return error_set(err, ERROR_INVALID_SCENE, "%zu weights for %u morph targets",
                         numbers->count, count);
    if (!count)
        return true;
    float *weights = blob_writer_append(&importer->writer, SCENE_TARGET_WEIGHTS, count, err);
    return weights && import_numbers(*numbers, count, -3e38, 3e38, weights, "weights", err);
}

static bool write_node(struct skins *skins, uint32_t blob_node, struct error *err)
{
    struct importer *importer = skins->importer;
    const struct scene_node *nodes = importer->writer.sections[SCENE_NODES].records;
    const struct gltf_node *from = &importer->document->nodes[nodes[blob_node].source_index];
    const struct scene_mesh *meshes = importer->writer.sections[SCENE_MESHES].records;
    const struct gltf_mesh *mesh = &importer->document->meshes[from->mesh];
    struct scene_deformed_node record = {
        .node = blob_node,
        .skin = -1,
        .first_weight = (uint32_t)importer->writer.sections[SCENE_TARGET_WEIGHTS].count,
        .weight_count = mesh->primitive_count ? (uint32_t)mesh->primitives[0].target_count : 0};
    if (from->skin < -1 || from->skin >= (int64_t)skins->count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no skin %d", from->skin);
    if (from->skin >= 0) {
        if (!write_skin(skins, (size_t)from->skin, err) ||
            !check_influences(importer, &meshes[nodes[blob_node].mesh], &skins->items[from->skin],
                              err))
            return false;
        record.skin = skins->items[from->skin].blob_skin;
    }
    if (record.skin < 0 && record.weight_count == 0)
        return true;
    if (!append_weights(importer, from, record.weight_count, err))
        return false;
    struct scene_deformed_node *to =
        blob_writer_append(&importer->writer, SCENE_DEFORMED_NODES, 1, err);
    if (!to)
        return false;
    *to = record;
    return true;
}

bool import_skins(struct importer *importer, struct error *err)
{
    struct skins skins;
    bool is_done = skins_init(&skins, importer, err);
    const struct blob_section *section = &importer->writer.sections[SCENE_NODES];
    const struct scene_node *nodes = section->records;
    for (uint32_t i = 0; is_done && i < section->count; i++) /* instances are among them */
        is_done = nodes[i].mesh < 0 || write_node(&skins, i, err) ||
                  error_wrap(err, "node %u '%s'", nodes[i].source_index,
                             importer->document->nodes[nodes[i].source_index].name);
    skins_finish(&skins);
    return is_done;
}

/* ---- bounds ---- */

static void grow(struct scene_header *header, const struct scene_state *state,
                 const struct state_item *item)
{
    const struct state_geometry geometry = state_geometry_of(state, item);
    for (uint32_t v = 0; v < geometry.primitive->vertex_count; v++) {
        double point[3];
        state_geometry_point(&geometry, v, point);
        for (int k = 0; k < 3; k++) {
            header->bounds_min[k] = fmin(header->bounds_min[k], point[k]);
            header->bounds_max[k] = fmax(header->bounds_max[k], point[k]);
        }
    }
}

bool import_rest_bounds(struct scene_header *header, const struct scene *scene, struct error *err)
{
    struct scene_state state;
    if (!scene->deformed_node_count)
        return true;
    if (!scene_state_init(&state, scene, &(struct view){.outputs = 0}, err))
        return error_wrap(err, "at rest");
    struct scene_header grown = *header;
    if (grown.bounds_min[0] > grown.bounds_max[0])
        for (int k = 0; k < 3; k++) {
            grown.bounds_min[k] = INFINITY;
            grown.bounds_max[k] = -INFINITY;
        }
    for (size_t i = 0, n = 0; i < state.item_count; i++) {
        while (n < scene->deformed_node_count &&
               scene->deformed_nodes[n].node < state.items[i].node)
            n++;
        if (n < scene->deformed_node_count && scene->deformed_nodes[n].node == state.items[i].node)
            grow(&grown, &state, &state.items[i]);
    }
    scene_state_finish(&state);
    if (grown.bounds_min[0] <= grown.bounds_max[0])
        *header = grown;
    return import_check_bounds(header, err);
}
