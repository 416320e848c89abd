/* SPDX-License-Identifier: MIT */
/* Meshes: every primitive mode becomes an indexed list that keeps only the vertices it uses. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/import/import_draco.h"
#include "renderer/import/importer.h"
#include "renderer/import/topology.h"
#include "renderer/scene/edge_table.h"
#include "renderer/scene/scene.h"

struct geometry_scratch {
    struct index_list corners; /* the accessor's vertex of each corner of the unrolled list */
    uint32_t *sources;         /* the accessor's vertex of each vertex kept */
    uint32_t source_count, source_capacity;
    uint32_t *seen, *renamed; /* by accessor vertex: where seen == round, renamed is its number */
    uint32_t seen_capacity, round;
};

/* One primitive under way. */
struct shape {
    const struct gltf_primitive *from;
    struct accessor attributes[GLTF_ATTRIBUTE_COUNT]; /* count 0: absent */
    struct draco_geometry draco;                      /* what the attributes may read from */
    bool has_flat_normals;                            /* each corner is a vertex of its own */
    bool is_skinned;                                  /* its mesh, by a shown node */
    struct scene_primitive out;
};

void importer_free_scratch(struct geometry_scratch *scratch)
{
    if (!scratch)
        return;
    index_list_finish(&scratch->corners);
    free(scratch->sources);
    free(scratch->seen);
    free(scratch->renamed);
    free(scratch);
}

/* ---- attributes ---- */

struct attribute_rule {
    const char *name;
    int components_min, components_max;
    bool takes_unnormalized; /* integers as they are (KHR_mesh_quantization) */
};

static const struct attribute_rule rules[GLTF_ATTRIBUTE_COUNT] = {
    [GLTF_POSITION] = {"POSITION", 3, 3, true},     [GLTF_NORMAL] = {"NORMAL", 3, 3, false},
    [GLTF_TANGENT] = {"TANGENT", 4, 4, false},      [GLTF_TEXCOORD_0] = {"TEXCOORD_0", 2, 2, true},
    [GLTF_TEXCOORD_1] = {"TEXCOORD_1", 2, 2, true}, [GLTF_COLOR_0] = {"COLOR_0", 3, 4, false},
    [GLTF_JOINTS_0] = {"JOINTS_0", 4, 4, true},     [GLTF_WEIGHTS_0] = {"WEIGHTS_0", 4, 4, false},
    [GLTF_JOINTS_1] = {"JOINTS_1", 4, 4, true},     [GLTF_WEIGHTS_1] = {"WEIGHTS_1", 4, 4, false},
};

static bool check_rule(const struct accessor *a, const struct attribute_rule *rule,
                       struct error *err)
{
    bool is_good = a->components >= rule->components_min && a->components <= rule->components_max &&
                   a->component != GLTF_UNSIGNED_INT &&
                   (a->component == GLTF_FLOAT || a->is_normalized || rule->takes_unnormalized);
    return is_good ||
           error_set(err, ERROR_INVALID_SCENE,
                     "accessor %d has an element type that %s cannot have", a->index, rule->name);
}

static bool open_attribute(struct importer *importer, struct shape *shape, int attribute,
                           struct error *err)
{
    struct accessor *a = &shape->attributes[attribute];
    const void *decoded = shape->draco.attributes[attribute];
    int index = shape->from->attributes[attribute];
    return decoded ? accessor_open_decoded(&importer->source, index, decoded, a, err)
                   : accessor_open(&importer->source, index, a, err);
}

static bool open_attributes(struct importer *importer, struct shape *shape, struct error *err)
{
    const struct accessor *position = &shape->attributes[GLTF_POSITION];
    for (int i = 0; i < GLTF_ATTRIBUTE_COUNT; i++) {
        struct accessor *a = &shape->attributes[i];
        if (shape->from->attributes[i] == -1 || (i >= GLTF_JOINTS_0 && !shape->is_skinned) ||
            (i == GLTF_TANGENT && shape->from->attributes[GLTF_NORMAL] == -1))
            continue;
        if (!open_attribute(importer, shape, i, err) || !check_rule(a, &rules[i], err))
            return error_wrap(err, "%s", rules[i].name);
        if (i != GLTF_POSITION && a->count != position->count)
            return error_set(err, ERROR_INVALID_SCENE, "%s has %u elements, POSITION has %u",
                             rules[i].name, a->count, position->count);
    }
    return true;
}

/* ---- corners ---- */

static bool read_decoded_corners(struct importer *importer, const struct shape *shape,
                                 struct error *err)
{
    struct index_list *corners = &importer->scratch->corners;
    uint32_t vertices = shape->attributes[GLTF_POSITION].count;
    if (shape->draco.index_count > UINT32_MAX)
        return error_set(err, ERROR_TOO_LARGE, "more than 4294967295 indices");
    if (!index_list_reserve(corners, (uint32_t)shape->draco.index_count, err))
        return false;
    for (uint32_t i = 0; i < shape->draco.index_count; i++) {
        uint32_t index = shape->draco.indices[i];
        if (index >= vertices)
            return error_set(err, ERROR_INVALID_SCENE,
                             "Draco: index %u at %u, there are %u vertices", index, i, vertices);
        corners->values[corners->count++] = index;
    }
    return true;
}

static bool read_corners(struct importer *importer, struct shape *shape, struct error *err)
{
    struct index_list *corners = &importer->scratch->corners;
    uint32_t vertices = shape->attributes[GLTF_POSITION].count;
    corners->count = 0;
    if (shape->draco.indices)
        return read_decoded_corners(importer, shape, err);
    if (shape->from->indices == -1)
        return index_list_append_sequence(corners, vertices, err);
    struct accessor a;
    if (!accessor_open(&importer->source, shape->from->indices, &a, err))
        return error_wrap(err, "indices");
    if (a.components != 1 || a.is_normalized ||
        (a.component != GLTF_UNSIGNED_BYTE && a.component != GLTF_UNSIGNED_SHORT &&
         a.component != GLTF_UNSIGNED_INT))
        return error_set(err, ERROR_INVALID_SCENE,
                         "accessor %d has an element type that indices cannot have", a.index);
    if (!index_list_reserve(corners, a.count, err))
        return false;
    for (uint32_t i = 0; i < a.count; i++) {
        uint32_t index = accessor_read_index(&a, i);
        if (index >= vertices)
            return error_set(err, ERROR_INVALID_SCENE,
                             "accessor %d: index %u at %u, there are %u vertices", a.index, index,
                             i, vertices);
        corners->values[corners->count++] = index;
    }
    return true;
}

static bool read_corner(const struct accessor *position, uint32_t vertex, double out[3],
                        struct error *err)
{
    float p[4];
    if (!accessor_read(position, vertex, p, err))
        return false;
    for (int i = 0; i < 3; i++)
        out[i] = p[i];
    return true;
}

/* Twice the area times the unit normal, exact but for one rounding in each product of f64. */
static void face_normal(const double a[3], const double b[3], const double c[3], double n[3])
{
    double u[3], v[3];
    for (int i = 0; i < 3; i++) {
        u[i] = b[i] - a[i];
        v[i] = c[i] - a[i];
    }
    n[0] = u[1] * v[2] - u[2] * v[1];
    n[1] = u[2] * v[0] - u[0] * v[2];
    n[2] = u[0] * v[1] - u[1] * v[0];
}

/* Keeps the triangles that have an area; of morphed primitives those that may get one. */
static bool drop_degenerate(struct importer *importer, const struct shape *shape, struct error *err)
{
    const struct accessor *position = &shape->attributes[GLTF_POSITION];
    struct index_list *corners = &importer->scratch->corners;
    uint32_t kept = 0;
    for (uint32_t i = 0; i + 2 < corners->count; i += 3) {
        const uint32_t *corner = &corners->values[i];
        double p[3][3], n[3] = {0, 0, 0};
        for (int k = 0; k < 3; k++)
            if (!read_corner(position, corner[k], p[k], err))
                return false;
        bool has_corners =
            corner[0] != corner[1] && corner[1] != corner[2] && corner[2] != corner[0];
        if (has_corners)
            face_normal(p[0], p[1], p[2], n);
        if (has_corners && shape->from->target_count)
            n[0] = 1; /* as it stands, whatever its area at rest */
        if (n[0] == 0 && n[1] == 0 && n[2] == 0) {
            importer->degenerate_triangles++;
            continue;
        }
        memmove(&corners->values[kept], corner, 3 * sizeof *corner);
        kept += 3;
    }
    corners->count = kept;
    return true;
}

/* ---- vertices ---- */

static bool grow(uint32_t **values, uint32_t count, struct error *err)
{
    uint32_t *grown = realloc(*values, ((size_t)count + 1) * sizeof *grown);
    if (!grown)
        return error_set(err, ERROR_NO_MEMORY, "%u vertices", count);
    *values = grown;
    return true;
}

static bool reserve_seen(struct geometry_scratch *scratch, uint32_t count, struct error *err)
{
    if (count <= scratch->seen_capacity)
        return true;
    if (!grow(&scratch->seen, count, err) || !grow(&scratch->renamed, count, err))
        return false;
    memset(scratch->seen + scratch->seen_capacity, 0,
           (count - scratch->seen_capacity) * sizeof *scratch->seen);
    scratch->seen_capacity = count;
    return true;
}

/* Fills sources with the vertices in use, in order of first use, and the indices of the blob. */
static bool choose_vertices(struct importer *importer, struct shape *shape, struct error *err)
{
    struct geometry_scratch *scratch = importer->scratch;
    const struct index_list *corners = &scratch->corners;
    if (corners->count > scratch->source_capacity) {
        if (!grow(&scratch->sources, corners->count, err))
            return false;
        scratch->source_capacity = corners->count;
    }
    if (importer->writer.sections[SCENE_INDICES].count + corners->count > UINT32_MAX)
        return error_set(err, ERROR_TOO_LARGE, "the scene has more than 4294967295 indices");
    shape->out.first_index = (uint32_t)importer->writer.sections[SCENE_INDICES].count;
    shape->out.index_count = corners->count;
    uint32_t *indices = blob_writer_append(&importer->writer, SCENE_INDICES, corners->count, err);
    if (!indices || !reserve_seen(scratch, shape->attributes[GLTF_POSITION].count, err))
        return false;
    scratch->round++;
    scratch->source_count = 0;
    for (uint32_t i = 0; i < corners->count; i++) {
        uint32_t vertex = corners->values[i];
        if (shape->has_flat_normals || scratch->seen[vertex] != scratch->round) {
            scratch->seen[vertex] = scratch->round;
            scratch->renamed[vertex] = scratch->source_count;
            scratch->sources[scratch->source_count++] = vertex;
        }
        indices[i] = scratch->renamed[vertex];
    }
    return true;
}

static bool append_positions(struct importer *importer, struct shape *shape, struct error *err)
{
    const struct geometry_scratch *scratch = importer->scratch;
    uint64_t first = importer->writer.sections[SCENE_POSITIONS].count;
    if (first + scratch->source_count > UINT32_MAX)
        return error_set(err, ERROR_TOO_LARGE, "the scene has more than 4294967295 vertices");
    float *positions =
        blob_writer_append(&importer->writer, SCENE_POSITIONS, scratch->source_count, err);
    if (!positions)
        return false;
    shape->out.first_vertex = (uint32_t)first;
    shape->out.vertex_count = scratch->source_count;
    for (int i = 0; i < 3; i++) {
        shape->out.bounds_min[i] = INFINITY;
        shape->out.bounds_max[i] = -INFINITY;
    }
    for (uint32_t v = 0; v < scratch->source_count; v++, positions += 3) {
        float p[4];
        if (!accessor_read(&shape->attributes[GLTF_POSITION], scratch->sources[v], p, err))
            return error_wrap(err, "POSITION");
        for (int i = 0; i < 3; i++) {
            positions[i] = p[i];
            shape->out.bounds_min[i] = fminf(shape->out.bounds_min[i], p[i]);
            shape->out.bounds_max[i] = fmaxf(shape->out.bounds_max[i], p[i]);
        }
    }
    return true;
}

/* ---- normals ---- */

static bool normalize(const double n[3], float out[3])
{
    double largest = fmax(fabs(n[0]), fmax(fabs(n[1]), fabs(n[2])));
    if (!(largest > 0) || !isfinite(largest))
        return false;
    /* divided first, so that no square underflows */
    double x = n[0] / largest, y = n[1] / largest, z = n[2] / largest;
    double length = sqrt(x * x + y * y + z * z);
    out[0] = (float)(x / length);
    out[1] = (float)(y / length);
    out[2] = (float)(z / length);
    return true;
}

static void triangle_normal(const float *positions, const uint32_t *corner, double n[3])
{
    double p[3][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            p[k][i] = positions[corner[k] * 3ull + (size_t)i];
    face_normal(p[0], p[1], p[2], n);
}

/* Normals of zero length take the area-weighted mean of the triangles around them. */
static bool repair_normals(struct importer *importer, const struct shape *shape, float *normals,
                           struct error *err)
{
    const uint32_t *indices = importer->writer.sections[SCENE_INDICES].records;
    const float *positions = importer->writer.sections[SCENE_POSITIONS].records;
    double(*sums)[3] = calloc(shape->out.vertex_count, sizeof *sums);
    if (!sums)
        return error_set(err, ERROR_NO_MEMORY, "%u normals", shape->out.vertex_count);
    indices += shape->out.first_index;
    positions += 3ull * shape->out.first_vertex;
    for (uint32_t i = 0; shape->out.topology == SCENE_TRIANGLES && i < shape->out.index_count;
         i += 3) {
        double n[3];
        triangle_normal(positions, indices + i, n);
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++)
                sums[indices[i + (uint32_t)k]][c] += n[c];
    }
    for (uint32_t v = 0; v < shape->out.vertex_count; v++) {
        float *n = normals + 3ull * v;
        if (n[0] != 0 || n[1] != 0 || n[2] != 0)
            continue;
        importer->repaired_normals++;
        if (!normalize(sums[v], n))
            n[1] = 1; /* no surface around it says otherwise */
    }
    free(sums);
    return true;
}

static bool read_normals(struct importer *importer, const struct shape *shape, float *normals,
                         struct error *err)
{
    bool has_zero = false;
    for (uint32_t v = 0; v < shape->out.vertex_count; v++) {
        float n[4];
        if (!accessor_read(&shape->attributes[GLTF_NORMAL], importer->scratch->sources[v], n, err))
            return error_wrap(err, "NORMAL");
        has_zero |= !normalize((double[3]){n[0], n[1], n[2]}, normals + 3ull * v);
    }
    return !has_zero || repair_normals(importer, shape, normals, err);
}

static bool append_normals(struct importer *importer, struct shape *shape, struct error *err)
{
    float *normals =
        blob_writer_append(&importer->writer, SCENE_NORMALS, shape->out.vertex_count, err);
    if (!normals)
        return false;
    if (shape->attributes[GLTF_NORMAL].count) {
        shape->out.flags |= SCENE_PRIMITIVE_HAS_NORMALS;
        return read_normals(importer, shape, normals, err);
    }
    if (!shape->has_flat_normals)
        return true;
    shape->out.flags |= SCENE_PRIMITIVE_HAS_NORMALS;
    const float *positions = importer->writer.sections[SCENE_POSITIONS].records;
    positions += 3ull * shape->out.first_vertex;
    for (uint32_t v = 0; v < shape->out.vertex_count; v += 3) {
        double n[3];
        triangle_normal(positions, (uint32_t[3]){v, v + 1, v + 2}, n);
        for (uint32_t k = 0; k < 3; k++)
            if (!normalize(n, normals + 3ull * (v + k))) { /* kept for its morph targets */
                if (!shape->from->target_count)
                    return error_set(err, ERROR_INTERNAL, "a triangle without area was kept");
                normals[3ull * (v + k) + 1] = 1;
            }
    }
    return true;
}

/* ---- optional attributes ---- */

/* Brings a section that not all primitives have up to `count` vertices; colours are white where
 * none are given. */
static bool pad_section(struct importer *importer, enum scene_section section, uint64_t count,
                        struct error *err)
{
    uint64_t have = importer->writer.sections[section].count;
    if (have >= count)
        return true;
    float *values = blob_writer_append(&importer->writer, section, count - have, err);
    if (!values)
        return false;
    for (uint64_t i = 0; section == SCENE_COLORS && i < (count - have) * 4; i++)
        values[i] = 1;
    return true;
}

/* Fits a value just read to what the blob promises of its section. */
static void conform(struct importer *importer, enum scene_section section, int components,
                    float value[4])
{
    if (section == SCENE_TANGENTS) {
        normalize((double[3]){value[0], value[1], value[2]}, value);
        value[3] = value[3] < 0 ? -1 : 1;
    }
    if (section != SCENE_COLORS)
        return;
    if (components == 3)
        value[3] = 1;
    bool is_outside = false;
    for (int i = 0; i < 4; i++) {
        is_outside |= value[i] < 0 || value[i] > 1.00001f; /* a rounded 1 is no news */
        value[i] = fminf(fmaxf(value[i], 0), 1);
    }
    importer->clamped_colors += is_outside;
}

static bool append_optional(struct importer *importer, struct shape *shape,
                            enum gltf_attribute attribute, enum scene_section section,
                            uint32_t flag, struct error *err)
{
    const struct accessor *a = &shape->attributes[attribute];
    if (!a->count)
        return true;
    if (!pad_section(importer, section, shape->out.first_vertex, err))
        return false;
    float *values = blob_writer_append(&importer->writer, section, shape->out.vertex_count, err);
    if (!values)
        return false;
    size_t components = blob_record_bytes(section) / sizeof *values;
    for (uint32_t v = 0; v < shape->out.vertex_count; v++, values += components) {
        float value[4];
        if (!accessor_read(a, importer->scratch->sources[v], value, err))
            return error_wrap(err, "%s", rules[attribute].name);
        conform(importer, section, a->components, value);
        memcpy(values, value, components * sizeof *values);
    }
    shape->out.flags |= flag;
    return true;
}

static bool append_optionals(struct importer *importer, struct shape *shape, struct error *err)
{
    return append_optional(importer, shape, GLTF_TANGENT, SCENE_TANGENTS,
                           SCENE_PRIMITIVE_HAS_TANGENTS, err) &&
           append_optional(importer, shape, GLTF_TEXCOORD_0, SCENE_TEXCOORDS_0,
                           SCENE_PRIMITIVE_HAS_TEXCOORDS_0, err) &&
           append_optional(importer, shape, GLTF_TEXCOORD_1, SCENE_TEXCOORDS_1,
                           SCENE_PRIMITIVE_HAS_TEXCOORDS_1, err) &&
           append_optional(importer, shape, GLTF_COLOR_0, SCENE_COLORS, SCENE_PRIMITIVE_HAS_COLORS,
                           err);
}

/* ---- primitives and meshes ---- */

/* Those that the material asks for. */
static bool lacks_texcoords(const struct gltf_primitive *from, const struct scene_material *m)
{
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
        const struct scene_texture_ref *ref = &m->textures[slot];
        enum gltf_attribute set = ref->texcoord ? GLTF_TEXCOORD_1 : GLTF_TEXCOORD_0;
        if (ref->texture >= 0 && from->attributes[set] == -1)
            return true;
    }
    return false;
}

static bool lacks_direction(const struct gltf_primitive *from, const struct scene_material *m)
{
    const struct scene_texture_ref *ref = &m->textures[SCENE_TEXTURE_ANISOTROPY];
    return m->anisotropy > 0 && from->attributes[GLTF_TANGENT] == -1 &&
           from->attributes[ref->texcoord ? GLTF_TEXCOORD_1 : GLTF_TEXCOORD_0] == -1;
}

static bool choose_material(struct importer *importer, struct shape *shape, struct error *err)
{
    const struct blob_section *materials = &importer->writer.sections[SCENE_MATERIALS];
    int material = shape->from->material;
    if (material < -1 || material >= (int64_t)importer->document->material_count)
        return error_set(err, ERROR_INVALID_SCENE, "there is no material %d", material);
    shape->out.material = material == -1 ? (uint32_t)materials->count - 1 : (uint32_t)material;
    const struct scene_material *records = materials->records;
    bool is_missing = lacks_texcoords(shape->from, &records[shape->out.material]);
    for (size_t i = 0; i < shape->from->mapping_count && !is_missing; i++) {
        material = shape->from->mappings[i].material;
        is_missing = material >= 0 && (size_t)material < importer->document->material_count &&
                     lacks_texcoords(shape->from, &records[material]);
    }
    importer->missing_texcoords += is_missing;
    importer->undirected_primitives += lacks_direction(shape->from, &records[shape->out.material]);
    return true;
}

/* What KHR_materials_volume calls a closed mesh. Open meshes are warned of where the material would
 * make use of it. */
static bool find_closed(struct importer *importer, struct shape *shape, bool keeps_closed,
                        struct error *err)
{
    struct scene_primitive *p = &shape->out;
    const float *positions = importer->writer.sections[SCENE_POSITIONS].records;
    const uint32_t *indices = importer->writer.sections[SCENE_INDICES].records;
    const struct scene_material *material = importer->writer.sections[SCENE_MATERIALS].records;
    bool is_closed;
    if (!edge_mesh_is_closed(
            &(struct edge_mesh){.positions = positions + 3 * (size_t)p->first_vertex,
                                .vertex_count = p->vertex_count,
                                .indices = indices + p->first_index,
                                .index_count = p->index_count},
            &is_closed, err))
        return false;
    if (is_closed && keeps_closed)
        p->flags |= SCENE_PRIMITIVE_IS_CLOSED;
    else if (scene_material_attenuates(&material[p->material]))
        importer->open_volumes++;
    return true;
}

/* Whether its triangles stand for a curved surface. */
static void find_smooth(const struct importer *importer, struct scene_primitive *p)
{
    const float *normals = importer->writer.sections[SCENE_NORMALS].records;
    const uint32_t *indices = importer->writer.sections[SCENE_INDICES].records;
    bool is_smooth = false;
    normals += 3 * (size_t)p->first_vertex;
    indices += p->first_index;
    for (uint32_t i = 0; i < p->index_count && !is_smooth; i++) {
        const float *a = normals + 3 * (size_t)indices[i - i % 3];
        const float *b = normals + 3 * (size_t)indices[i];
        is_smooth = a[0] != b[0] || a[1] != b[1] || a[2] != b[2];
    }
    if (is_smooth)
        p->flags |= SCENE_PRIMITIVE_IS_SMOOTH;
}

/* Draco's streams hold single triangles, also of a strip. */
static int drawn_mode(const struct shape *shape)
{
    return shape->draco.indices ? GLTF_TRIANGLES : shape->from->mode;
}

static bool append_shape(struct importer *importer, struct shape *shape, struct error *err)
{
    if (!open_attributes(importer, shape, err) || !choose_material(importer, shape, err) ||
        !read_corners(importer, shape, err) ||
        !topology_unroll(&importer->scratch->corners, drawn_mode(shape), &shape->out.topology, err))
        return false;
    bool is_surface = shape->out.topology == SCENE_TRIANGLES;
    bool keeps_closed = true;
    if (is_surface && !drop_degenerate(importer, shape, err))
        return error_wrap(err, "POSITION");
    if (importer->scratch->corners.count == 0)
        return true;
    shape->has_flat_normals = is_surface && !shape->attributes[GLTF_NORMAL].count;
    if (!choose_vertices(importer, shape, err) || !append_positions(importer, shape, err) ||
        !append_normals(importer, shape, err) || !append_optionals(importer, shape, err))
        return false;
    const struct deformed_shape deformed = {.from = shape->from,
                                            .attributes = shape->attributes,
                                            .sources = importer->scratch->sources,
                                            .primitive = &shape->out,
                                            .is_flat = shape->has_flat_normals,
                                            .is_skinned = shape->is_skinned};
    if ((deformed_shape_deforms(&deformed) &&
         !import_deformation(importer, &deformed, &keeps_closed, err)) ||
        (is_surface && !find_closed(importer, shape, keeps_closed, err)))
        return false;
    if (is_surface)
        find_smooth(importer, &shape->out);
    struct scene_primitive *record =
        blob_writer_append(&importer->writer, SCENE_PRIMITIVES, 1, err);
    if (!record)
        return false;
    *record = shape->out;
    return import_variant_materials(importer, shape->from, err);
}

static bool import_primitive(struct importer *importer, const struct gltf_primitive *from,
                             bool is_skinned, struct error *err)
{
    if (from->attributes[GLTF_POSITION] == -1)
        return importer_warn(importer, err, "a primitive without POSITION is left out");
    struct shape shape = {.from = from, .is_skinned = is_skinned};
    bool is_done = draco_geometry_init(&shape.draco, importer, from, err) &&
                   append_shape(importer, &shape, err);
    draco_geometry_finish(&shape.draco);
    return is_done;
}

static bool import_mesh(struct importer *importer, size_t index, struct error *err)
{
    const struct gltf_mesh *from = &importer->document->meshes[index];
    struct scene_mesh mesh = {.first_primitive =
                                  (uint32_t)importer->writer.sections[SCENE_PRIMITIVES].count};
    if (!import_check_targets(from, err))
        return error_wrap(err, "mesh %zu '%s'", index, from->name);
    for (size_t i = 0; i < from->primitive_count; i++)
        if (!import_primitive(importer, &from->primitives[i], importer->is_mesh_skinned[index],
                              err))
            return error_wrap(err, "mesh %zu '%s', primitive %zu", index, from->name, i);
    mesh.primitive_count =
        (uint32_t)importer->writer.sections[SCENE_PRIMITIVES].count - mesh.first_primitive;
    if (!blob_writer_add_text(&importer->writer, from->name, &mesh.name, err))
        return false;
    struct scene_mesh *record = blob_writer_append(&importer->writer, SCENE_MESHES, 1, err);
    if (!record)
        return false;
    *record = mesh;
    return true;
}

bool import_meshes(struct importer *importer, struct error *err)
{
    static const enum scene_section optional[] = {SCENE_TANGENTS, SCENE_TEXCOORDS_0,
                                                  SCENE_TEXCOORDS_1, SCENE_COLORS};
    importer->scratch = calloc(1, sizeof *importer->scratch);
    if (!importer->scratch)
        return error_set(err, ERROR_NO_MEMORY, "geometry");
    for (size_t i = 0; i < importer->document->mesh_count; i++) {
        if (importer->mesh_of[i] < 0)
            continue;
        importer->mesh_of[i] = (int32_t)importer->writer.sections[SCENE_MESHES].count;
        if (!import_mesh(importer, i, err))
            return false;
        importer_advance(importer, SCENE_IMPORT_MESHES, i + 1, importer->document->mesh_count);
    }
    uint64_t vertices = importer->writer.sections[SCENE_POSITIONS].count;
    for (size_t i = 0; i < sizeof optional / sizeof *optional; i++)
        if (importer->writer.sections[optional[i]].count > 0 &&
            !pad_section(importer, optional[i], vertices, err))
            return false;
    return true;
}
