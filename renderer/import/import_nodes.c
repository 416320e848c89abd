/* SPDX-License-Identifier: MIT */
/* The node hierarchy in f64, and the lights and cameras that nodes carry. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/import/converter.h"
#include "renderer/import/import_instances.h"
#include "renderer/import/importer.h"

enum { NODE_DEPTH_MAX = 4096 };
#define COORDINATE_MAX 1e12 /* m; beyond it even f64 loses the millimetre (LIMIT_COORDINATE) */
#define INTENSITY_MAX 1e12  /* cd or lx; keeps every product inside f32 */
#define TIGHT_BOUNDS_VERTICES_MAX \
    (64u << 20) /* instances times vertices; above it corners of boxes are used */

/* ---- hierarchy ---- */

static bool find_parents(const struct gltf_document *document, int32_t *parents, struct error *err)
{
    for (size_t i = 0; i < document->node_count; i++)
        parents[i] = -1;
    for (size_t i = 0; i < document->node_count; i++) {
        struct gltf_indices children = document->nodes[i].children;
        for (size_t c = 0; c < children.count; c++) {
            int child = children.values[c];
            if (child < 0 || (size_t)child >= document->node_count)
                return error_set(err, ERROR_INVALID_SCENE, "node %zu: there is no node %d", i,
                                 child);
            if (parents[child] >= 0)
                return error_set(err, ERROR_INVALID_SCENE,
                                 "node %d is a child of node %d and of node %zu", child,
                                 parents[child], i);
            parents[child] = (int32_t)i;
        }
    }
    return true;
}

/* With one parent each, a node that no root leads to is in or under a cycle. `order` is a scratch
 * stack here. */
static bool check_cycles(const struct gltf_document *document, const int32_t *parents,
                         uint32_t *order, struct error *err)
{
    size_t seen = 0, taken = 0;
    for (size_t i = 0; i < document->node_count; i++)
        if (parents[i] < 0)
            order[seen++] = (uint32_t)i;
    while (taken < seen) {
        struct gltf_indices children = document->nodes[order[taken++]].children;
        for (size_t c = 0; c < children.count; c++)
            order[seen++] = (uint32_t)children.values[c];
    }
    if (seen == document->node_count)
        return true;
    size_t at = 0;
    /* Walking up long enough ends in the cycle itself. */
    for (size_t i = 0; i < document->node_count; i++)
        if (parents[i] >= 0)
            at = i;
    for (size_t i = 0; i < document->node_count && parents[at] >= 0; i++)
        at = (size_t)parents[at];
    return error_set(err, ERROR_INVALID_SCENE, "the node hierarchy has a cycle (at node %zu)", at);
}

/* The index of a scene by its name, else by "#1"; -1. */
static int find_scene(const struct gltf_document *document, const char *name)
{
    for (size_t i = 0; i < document->scene_count; i++)
        if (strcmp(document->scenes[i].name, name) == 0)
            return (int)i;
    size_t place = scene_place(name, document->scene_count);
    return place < document->scene_count ? (int)place : -1;
}

/* Names those that the file has, as many as a message holds. */
static bool refuse_scene(const struct gltf_document *document, const char *wanted,
                         struct error *err)
{
    char names[120] = "";
    size_t used = 0, i = 0;
    const size_t around = sizeof ", ''" + sizeof ", ...";
    for (; i < document->scene_count && used + around < sizeof names; i++) {
        size_t room = sizeof names - used - around;
        used += (size_t)snprintf(names + used, sizeof names - used, "%s'%.*s'", i ? ", " : ": ",
                                 (int)(room < 40 ? room : 40), document->scenes[i].name);
    }
    return error_set(err, ERROR_INVALID_REQUEST, "the file has no scene '%.80s' among its %zu%s%s",
                     wanted, document->scene_count, names,
                     i < document->scene_count ? ", ..." : "");
}

static bool choose_scene(const struct importer *importer, int *scene, struct error *err)
{
    const struct gltf_document *document = importer->document;
    const char *wanted = importer->desc->scene;
    *scene = document->default_scene == -1 ? 0 : document->default_scene;
    if (wanted && (*scene = find_scene(document, wanted)) < 0)
        return refuse_scene(document, wanted, err);
    return document->scene_count == 0 || (*scene >= 0 && (size_t)*scene < document->scene_count) ||
           error_set(err, ERROR_INVALID_SCENE, "there is no scene %d", *scene);
}

static bool tell_scenes(const struct importer *importer, int shown, struct error *err)
{
    const struct scene_import_desc *desc = importer->desc;
    for (size_t i = 0; desc->tell_scene && i < importer->document->scene_count; i++)
        if (!desc->tell_scene(desc->context, importer->document->scenes[i].name, i == (size_t)shown,
                              err))
            return false;
    return true;
}

/* The scene's roots: those of the scene that is shown; without scenes, all nodes without parent. */
static bool push_roots(struct importer *importer, const int32_t *parents, uint32_t *stack,
                       size_t *count, struct error *err)
{
    const struct gltf_document *document = importer->document;
    int scene;
    *count = 0;
    if (!choose_scene(importer, &scene, err) || !tell_scenes(importer, scene, err))
        return false;
    if (document->scene_count == 0) {
        for (size_t i = document->node_count; i-- > 0;)
            if (parents[i] < 0)
                stack[(*count)++] = (uint32_t)i;
        return *count == 0 ||
               importer_warn(importer, err, "the file has no scene; all its nodes are shown");
    }
    struct gltf_indices roots = document->scenes[scene].nodes;
    for (size_t i = roots.count; i-- > 0;) {
        int root = roots.values[i];
        if (root < 0 || (size_t)root >= document->node_count)
            return error_set(err, ERROR_INVALID_SCENE, "scene %d: there is no node %d", scene,
                             root);
        if (parents[root] >= 0)
            return error_set(err, ERROR_INVALID_SCENE,
                             "scene %d: node %d is no root, its parent is node %d", scene, root,
                             parents[root]);
        if (*count == document->node_count)
            return error_set(err, ERROR_INVALID_SCENE, "scene %d lists a node twice", scene);
        stack[(*count)++] = (uint32_t)root;
    }
    return true;
}

/* Visits nodes depth first, children in file order. Each node may come once, since a root that is
 * listed twice would overrun. */
static bool order_nodes(struct importer *importer, const int32_t *parents, uint32_t *stack,
                        uint32_t *depths, struct error *err)
{
    const struct gltf_document *document = importer->document;
    size_t count;
    if (!push_roots(importer, parents, stack, &count, err))
        return false;
    memset(depths, 0, document->node_count * sizeof *depths);
    for (size_t i = 0; i < count; i++) {
        if (depths[stack[i]])
            return error_set(err, ERROR_INVALID_SCENE, "the scene lists node %u twice", stack[i]);
        depths[stack[i]] = 1;
    }
    while (count > 0) {
        uint32_t node = stack[--count];
        if (depths[node] > NODE_DEPTH_MAX)
            return error_set(err, ERROR_TOO_LARGE, "node %u is deeper than %d levels", node,
                             NODE_DEPTH_MAX);
        importer->node_order[importer->node_count++] = node;
        struct gltf_indices children = document->nodes[node].children;
        for (size_t c = children.count; c-- > 0;) {
            depths[children.values[c]] = depths[node] + 1;
            stack[count++] = (uint32_t)children.values[c];
        }
    }
    return true;
}

static bool mark_meshes(struct importer *importer, struct error *err)
{
    const struct gltf_document *document = importer->document;
    for (size_t i = 0; i < document->mesh_count; i++)
        importer->mesh_of[i] = -1;
    for (uint32_t i = 0; i < importer->node_count; i++) {
        const struct gltf_node *node = &document->nodes[importer->node_order[i]];
        if (node->mesh == -1)
            continue;
        if (node->mesh < 0 || (size_t)node->mesh >= document->mesh_count)
            return error_set(err, ERROR_INVALID_SCENE, "node %u: there is no mesh %d",
                             importer->node_order[i], node->mesh);
        importer->mesh_of[node->mesh] = 0; /* wanted; numbered by import_meshes */
        importer->is_mesh_skinned[node->mesh] |= node->skin != -1;
    }
    return true;
}

bool import_hierarchy(struct importer *importer, struct error *err)
{
    size_t count = importer->document->node_count;
    int32_t *parents = malloc((count + 1) * sizeof *parents);
    uint32_t *stack = malloc((count + 1) * sizeof *stack),
             *depths = malloc((count + 1) * sizeof *depths);
    importer->node_order = calloc(count + 1, sizeof *importer->node_order);
    importer->mesh_of = malloc((importer->document->mesh_count + 1) * sizeof *importer->mesh_of);
    importer->is_mesh_skinned =
        calloc(importer->document->mesh_count + 1, sizeof *importer->is_mesh_skinned);
    bool is_done = false;
    if (!parents || !stack || !depths || !importer->node_order || !importer->mesh_of ||
        !importer->is_mesh_skinned)
        error_set(err, ERROR_NO_MEMORY, "%zu nodes", count);
    else
        is_done = find_parents(importer->document, parents, err) &&
                  check_cycles(importer->document, parents, stack, err) &&
                  order_nodes(importer, parents, stack, depths, err) && mark_meshes(importer, err);
    free(parents);
    free(stack);
    free(depths);
    return is_done;
}

/* ---- matrices ---- */

static bool copy_doubles(struct gltf_numbers numbers, size_t count, double *out, const char *what,
                         struct error *err)
{
    if (numbers.count == 0)
        return true;
    if (numbers.count != count)
        return error_set(err, ERROR_INVALID_SCENE, "%s has %zu numbers, not %zu", what,
                         numbers.count, count);
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(numbers.values[i]))
            return error_set(err, ERROR_INVALID_SCENE, "%s is not finite", what);
        out[i] = numbers.values[i];
    }
    return true;
}

bool import_pose(const struct gltf_node *node, struct scene_pose *pose, struct error *err)
{
    double *q = pose->rotation;
    q[3] = pose->scale[0] = pose->scale[1] = pose->scale[2] = 1;
    if (!copy_doubles(node->translation, 3, pose->translation, "translation", err) ||
        !copy_doubles(node->rotation, 4, q, "rotation", err) ||
        !copy_doubles(node->scale, 3, pose->scale, "scale", err))
        return false;
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 0) || !isfinite(length))
        return error_set(err, ERROR_INVALID_SCENE, "rotation has no direction");
    for (int i = 0; i < 4; i++)
        q[i] /= length;
    return true;
}

static bool compose(const struct gltf_node *node, double m[16], struct error *err)
{
    struct scene_pose pose = {.node = 0};
    if (!import_pose(node, &pose, err))
        return false;
    mat4_compose(pose.translation, pose.rotation, pose.scale, m);
    return true;
}

static bool local_matrix(const struct gltf_node *node, double m[16], struct error *err)
{
    if (node->matrix.count == 0)
        return compose(node, m, err);
    if (!copy_doubles(node->matrix, 16, m, "matrix", err))
        return false;
    if (fabs(m[3]) > 1e-9 || fabs(m[7]) > 1e-9 || fabs(m[11]) > 1e-9 || fabs(m[15] - 1) > 1e-9)
        return error_set(err, ERROR_INVALID_SCENE, "matrix is not affine");
    m[3] = m[7] = m[11] = 0;
    m[15] = 1;
    return true;
}

static bool is_finite_matrix(const double m[16])
{
    for (int i = 0; i < 16; i++)
        if (!isfinite(m[i]) || !isfinite((float)m[i]))
            return false;
    return true;
}

/* ---- nodes ---- */

static bool fill_node(struct importer *importer, uint32_t source,
                      const int32_t *blob_node_of_parent, const struct node_names *names,
                      struct scene_node *out, struct error *err)
{
    const struct gltf_document *document = importer->document;
    const struct gltf_node *node = &document->nodes[source];
    const struct scene_node *nodes = importer->writer.sections[SCENE_NODES].records;
    if (node->camera < -1 || node->camera >= (int64_t)document->camera_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no camera %d", node->camera);
    if (node->light >= (int64_t)document->light_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no light %d", node->light);
    if (node->grid >= (int64_t)document->grid_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no density grid %d", node->grid);
    if (!local_matrix(node, out->local_matrix, err))
        return false;
    out->parent = blob_node_of_parent[source];
    if (out->parent >= 0)
        mat4_mul(nodes[out->parent].world_matrix, out->local_matrix, out->world_matrix);
    else
        memcpy(out->world_matrix, out->local_matrix, sizeof out->world_matrix);
    if (!is_finite_matrix(out->world_matrix))
        return error_set(err, ERROR_INVALID_SCENE, "its world matrix is not finite");
    bool has_mesh = node->mesh >= 0 && !node_has_instances(node);
    out->mesh = has_mesh ? importer->mesh_of[node->mesh] : -1;
    out->camera = node->camera;
    out->light = node->light;
    out->grid = node->grid;
    out->source_index = source;
    return blob_writer_add_text(&importer->writer, node_names_find(names, document, node),
                                &out->name, err);
}

static bool hide_node(struct importer *importer, const struct gltf_node *node, uint32_t index,
                      struct error *err)
{
    if (node->is_visible)
        return true;
    uint32_t *hidden = blob_writer_append(&importer->writer, SCENE_HIDDEN_NODES, 1, err);
    if (hidden)
        *hidden = index;
    return hidden != NULL;
}

/* parent_of: blob index of the parent, by glTF index; filled for the children as each node is
 * written. */
static bool append_nodes(struct importer *importer, int32_t *parent_of,
                         const struct node_names *names, struct error *err)
{
    const struct gltf_document *document = importer->document;
    for (uint32_t i = 0; i < importer->node_count; i++) {
        uint32_t source = importer->node_order[i];
        struct scene_node node = {.parent = -1};
        if (!fill_node(importer, source, parent_of, names, &node, err))
            return error_wrap(err, "node %u '%s'", source, document->nodes[source].name);
        struct scene_node *record = blob_writer_append(&importer->writer, SCENE_NODES, 1, err);
        if (!record)
            return false;
        *record = node;
        if (!hide_node(importer, &document->nodes[source], i, err))
            return false;
        struct gltf_indices children = document->nodes[source].children;
        for (size_t c = 0; c < children.count; c++)
            parent_of[children.values[c]] = (int32_t)i;
        importer_advance(importer, SCENE_IMPORT_NODES, i + 1, importer->node_count);
    }
    return true;
}

static void grow_bounds(struct scene_header *header, const double point[3])
{
    for (int i = 0; i < 3; i++) {
        header->bounds_min[i] = fmin(header->bounds_min[i], point[i]);
        header->bounds_max[i] = fmax(header->bounds_max[i], point[i]);
    }
}

static void grow_by_corners(struct scene_header *header, const double world[16],
                            const float bounds_min[3], const float bounds_max[3])
{
    for (int corner = 0; corner < 8; corner++) {
        double point[3];
        for (int i = 0; i < 3; i++)
            point[i] = corner >> i & 1 ? bounds_max[i] : bounds_min[i];
        mat4_transform_point(world, point, point);
        grow_bounds(header, point);
    }
}

static void grow_by_vertices(struct scene_header *header, const double world[16],
                             const float *positions, uint32_t count)
{
    for (uint32_t v = 0; v < count; v++) {
        double point[3] = {positions[v * 3ull], positions[v * 3ull + 1], positions[v * 3ull + 2]};
        mat4_transform_point(world, point, point);
        grow_bounds(header, point);
    }
}

bool import_check_bounds(const struct scene_header *header, struct error *err)
{
    for (int i = 0; i < 3; i++)
        if (header->bounds_min[i] <= header->bounds_max[i] &&
            !(fmax(fabs(header->bounds_min[i]), fabs(header->bounds_max[i])) <= COORDINATE_MAX))
            return error_set(err, ERROR_INVALID_SCENE,
                             "the scene spans %g to %g m, limit is %g from the origin",
                             header->bounds_min[i], header->bounds_max[i], COORDINATE_MAX);
    return true;
}

/* Whether the node's mesh is shown in a pose, which import_rest_bounds measures. */
static bool is_posed(const struct importer *importer, const struct scene_node *node)
{
    const struct gltf_node *from = &importer->document->nodes[node->source_index];
    if (from->mesh < 0)
        return false;
    const struct gltf_mesh *mesh = &importer->document->meshes[from->mesh];
    return from->skin != -1 || (mesh->primitive_count && mesh->primitives[0].target_count);
}

/* Per node, whether it or one above it is hidden. */
static bool *find_hidden(const struct importer *importer, struct error *err)
{
    const struct blob_section *sections = importer->writer.sections;
    const struct scene_node *nodes = sections[SCENE_NODES].records;
    const uint32_t *hidden = sections[SCENE_HIDDEN_NODES].records;
    uint64_t count = sections[SCENE_NODES].count;
    bool *is_hidden = calloc(count + 1, sizeof *is_hidden);
    if (!is_hidden) {
        error_set(err, ERROR_NO_MEMORY, "%llu nodes", (unsigned long long)count);
        return NULL;
    }
    for (uint64_t i = 0; i < sections[SCENE_HIDDEN_NODES].count; i++)
        is_hidden[hidden[i]] = true;
    for (uint64_t i = 0; i < count; i++)
        if (nodes[i].parent >= 0)
            is_hidden[i] |= is_hidden[nodes[i].parent];
    return is_hidden;
}

/* Bounds of what is shown at rest, and triangle count over all nodes. */
static bool measure(struct importer *importer, struct error *err)
{
    bool *is_hidden = find_hidden(importer, err);
    if (!is_hidden)
        return false;
    const struct blob_section *sections = importer->writer.sections;
    const struct scene_node *nodes = sections[SCENE_NODES].records;
    const struct scene_mesh *meshes = sections[SCENE_MESHES].records;
    const struct scene_primitive *primitives = sections[SCENE_PRIMITIVES].records;
    const struct scene_grid *grids = sections[SCENE_GRIDS].records;
    const float *positions = sections[SCENE_POSITIONS].records;
    struct scene_header *header = &importer->header;
    uint64_t visited = 0;
    for (uint64_t n = 0; n < sections[SCENE_NODES].count; n++) {
        if (header->default_camera_node < 0 && nodes[n].camera >= 0)
            header->default_camera_node = (int32_t)n;
        if (nodes[n].grid >= 0 && !is_hidden[n])
            grow_by_corners(header, nodes[n].world_matrix, grids[nodes[n].grid].bounds_min,
                            grids[nodes[n].grid].bounds_max);
        const struct scene_mesh *mesh = nodes[n].mesh < 0 ? NULL : &meshes[nodes[n].mesh];
        for (uint32_t i = 0; mesh && i < mesh->primitive_count; i++) {
            const struct scene_primitive *p = &primitives[mesh->first_primitive + i];
            if (p->topology == SCENE_TRIANGLES)
                header->triangle_count += p->index_count / 3;
            if (is_hidden[n] || is_posed(importer, &nodes[n]))
                continue;
            visited += p->vertex_count;
            if (visited > TIGHT_BOUNDS_VERTICES_MAX)
                grow_by_corners(header, nodes[n].world_matrix, p->bounds_min, p->bounds_max);
            else
                grow_by_vertices(header, nodes[n].world_matrix, positions + 3ull * p->first_vertex,
                                 p->vertex_count);
        }
    }
    free(is_hidden);
    return import_check_bounds(header, err);
}

bool import_nodes(struct importer *importer, struct error *err)
{
    size_t count = importer->document->node_count;
    int32_t *parent_of = malloc((count + 1) * sizeof *parent_of);
    if (!parent_of)
        return error_set(err, ERROR_NO_MEMORY, "%zu nodes", count);
    for (size_t i = 0; i < count; i++)
        parent_of[i] = -1;
    struct node_names names;
    bool is_done = node_names_init(&names, importer->document, err) &&
                   append_nodes(importer, parent_of, &names, err) &&
                   import_instances(importer, &names, err);
    node_names_finish(&names);
    free(parent_of);
    for (int i = 0; i < 3; i++) {
        importer->header.bounds_min[i] = INFINITY;
        importer->header.bounds_max[i] = -INFINITY;
    }
    importer->header.default_camera_node = -1;
    if (!is_done || !measure(importer, err))
        return false;
    if (importer->header.bounds_min[0] <= importer->header.bounds_max[0])
        return true;
    for (int i = 0; i < 3; i++) { /* no geometry: min > max, yet finite */
        importer->header.bounds_min[i] = 1;
        importer->header.bounds_max[i] = -1;
    }
    return true;
}

/* ---- lights and cameras ---- */

static bool import_light(const struct gltf_light *from, struct scene_light *to, struct error *err)
{
    static const char *const types[] = {[SCENE_LIGHT_DIRECTIONAL] = "directional",
                                        [SCENE_LIGHT_POINT] = "point",
                                        [SCENE_LIGHT_SPOT] = "spot"};
    while (to->type < 3 && strcmp(from->type, types[to->type]) != 0)
        to->type++;
    if (to->type == 3)
        return error_set(err, ERROR_INVALID_SCENE, "type is '%s', not directional, point or spot",
                         from->type);
    to->color[0] = to->color[1] = to->color[2] = 1;
    if (!import_numbers(from->color, 3, 0, INTENSITY_MAX, to->color, "color", err) ||
        !import_number(from->intensity, 0, INTENSITY_MAX, &to->intensity, "intensity", err) ||
        !import_number(fmin(from->range, COORDINATE_MAX), 0, COORDINATE_MAX, &to->range, "range",
                       err))
        return false;
    if (to->type != SCENE_LIGHT_SPOT)
        return true;
    if (!import_number(from->inner_cone_rad, 0, M_PI_2, &to->inner_cone_rad, "innerConeAngle",
                       err) ||
        !import_number(from->outer_cone_rad, 0, M_PI_2, &to->outer_cone_rad, "outerConeAngle", err))
        return false;
    if (to->inner_cone_rad > to->outer_cone_rad)
        return error_set(err, ERROR_INVALID_SCENE,
                         "innerConeAngle %g is wider than outerConeAngle %g", to->inner_cone_rad,
                         to->outer_cone_rad);
    return true;
}

bool import_lights(struct importer *importer, struct error *err)
{
    for (size_t i = 0; i < importer->document->light_count; i++) {
        const struct gltf_light *from = &importer->document->lights[i];
        struct scene_light light = {.type = 0};
        if (!import_light(from, &light, err))
            return error_wrap(err, "light %zu '%s'", i, from->name);
        if (!blob_writer_add_text(&importer->writer, from->name, &light.name, err))
            return false;
        struct scene_light *record = blob_writer_append(&importer->writer, SCENE_LIGHTS, 1, err);
        if (!record)
            return false;
        *record = light;
    }
    return true;
}

/* Half the width or height of an orthographic view; some files give it a sign. */
static bool import_extent(double extent, float *out, const char *what, struct error *err)
{
    if (!(fabs(extent) > 1e-12))
        return error_set(err, ERROR_INVALID_SCENE, "%s is %g, too small", what, extent);
    return import_number(fabs(extent), 0, COORDINATE_MAX, out, what, err);
}

static bool import_camera(const struct gltf_camera *from, struct scene_camera *to,
                          struct error *err)
{
    to->is_orthographic = from->is_orthographic;
    if (!from->is_orthographic && !(from->z_near > 0))
        return error_set(err, ERROR_INVALID_SCENE, "znear is %g, not positive", from->z_near);
    if (!import_number(from->z_near, 0, COORDINATE_MAX, &to->z_near, "znear", err) ||
        !import_number(fmin(from->z_far, COORDINATE_MAX), 0, COORDINATE_MAX, &to->z_far, "zfar",
                       err))
        return false;
    if (to->z_far != 0 && to->z_far <= to->z_near)
        return error_set(err, ERROR_INVALID_SCENE, "zfar %g is not beyond znear %g", from->z_far,
                         from->z_near);
    if (from->is_orthographic)
        return import_extent(from->x_mag, &to->x_mag, "xmag", err) &&
               import_extent(from->y_mag, &to->y_mag, "ymag", err);
    if (!(from->y_fov_rad > 0 && from->y_fov_rad < M_PI))
        return error_set(err, ERROR_INVALID_SCENE, "yfov is %g, not in (0, pi)", from->y_fov_rad);
    to->y_fov_rad = (float)from->y_fov_rad;
    return import_number(from->aspect, 0, 1e6, &to->aspect, "aspectRatio", err);
}

bool import_cameras(struct importer *importer, struct error *err)
{
    for (size_t i = 0; i < importer->document->camera_count; i++) {
        const struct gltf_camera *from = &importer->document->cameras[i];
        struct scene_camera camera = {.is_orthographic = 0};
        if (!import_camera(from, &camera, err))
            return error_wrap(err, "camera %zu '%s'", i, from->name);
        if (!blob_writer_add_text(&importer->writer, from->name, &camera.name, err))
            return false;
        struct scene_camera *record = blob_writer_append(&importer->writer, SCENE_CAMERAS, 1, err);
        if (!record)
            return false;
        *record = camera;
    }
    return true;
}
