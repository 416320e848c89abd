/* SPDX-License-Identifier: MIT */
/* Opens a scene blob: checks every offset, index, enum and number before anyone follows it. */
#include "renderer/scene/animated_members.h"
#include "renderer/scene/animation.h"
#include "renderer/scene/scene.h"

#include <math.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/scene/blob_check.h"
#include "renderer/scene/blob_writer.h"
#include "renderer/scene/deformation_check.h"
#include "renderer/scene/grid_check.h"
#include "renderer/scene/texture_levels.h"

static bool are_finite_f64(const double *values, int count)
{
    for (int i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return false;
    return true;
}

static bool in_range(float value, float low, float high)
{
    return value >= low && value <= high;
}

static bool is_index(int32_t index, uint64_t count)
{
    return index == -1 || (index >= 0 && (uint64_t)index < count);
}

/* ---- sections ---- */

static bool check_header(const struct scene_header *header, size_t size_bytes, bool is_head,
                         struct error *err)
{
    if (size_bytes < sizeof *header)
        return error_set(err, ERROR_INVALID_SCENE, "scene blob: %zu bytes are no header",
                         size_bytes);
    if (memcmp(header->magic, SCENE_BLOB_MAGIC, sizeof header->magic) != 0 ||
        header->version != SCENE_BLOB_VERSION || header->section_count != SCENE_SECTION_COUNT)
        return error_set(err, ERROR_INVALID_SCENE, "scene blob: of another kind or version than %d",
                         SCENE_BLOB_VERSION);
    if (is_head ? header->size_bytes < size_bytes : header->size_bytes != size_bytes)
        return error_set(err, ERROR_INVALID_SCENE, "scene blob: %zu bytes, its header says %llu",
                         size_bytes, (unsigned long long)header->size_bytes);
    if (!are_finite_f64(header->bounds_min, 3) || !are_finite_f64(header->bounds_max, 3))
        return error_set(err, ERROR_INVALID_SCENE, "scene blob: the bounds are not finite");
    return true;
}

/* Opens sections one after the other and remembers whether one was malformed. */
struct opener {
    const struct scene_header *header;
    uint64_t memory_bytes; /* from the header on; pixels may lie behind */
    struct error *err;
    bool has_failed;
};

/* NULL with count 0 when empty or malformed. Counts stay below 2^32, those of bytes excepted. */
static const void *open_section(struct opener *opener, enum scene_section which, uint64_t *count)
{
    const struct scene_header *header = opener->header;
    const struct scene_section_range *range = &header->sections[which];
    size_t stride = blob_record_bytes(which);
    uint64_t end = which == SCENE_PIXELS ? header->size_bytes : opener->memory_bytes;
    bool is_good = range->stride == stride && range->offset % 16 == 0 &&
                   range->offset >= sizeof *header && range->offset <= end &&
                   range->count <= (end - range->offset) / stride &&
                   (stride == 1 || range->count <= UINT32_MAX);
    *count = is_good ? range->count : 0;
    if (!is_good) {
        blob_refuse(opener->err, "section", which);
        opener->has_failed = true;
    }
    return *count ? (const char *)header + range->offset : NULL;
}

static const void *open_records(struct opener *opener, enum scene_section which, uint32_t *count)
{
    uint64_t count_64;
    const void *records = open_section(opener, which, &count_64);
    *count = (uint32_t)count_64;
    return records;
}

static void open_deformations(struct opener *o, struct scene *scene)
{
    scene->skins = open_records(o, SCENE_SKINS, &scene->skin_count);
    scene->joints = open_records(o, SCENE_JOINTS, &scene->joint_count);
    scene->deformations = open_records(o, SCENE_DEFORMATIONS, &scene->deformation_count);
    scene->influences = open_records(o, SCENE_INFLUENCES, &scene->influence_count);
    scene->targets = open_records(o, SCENE_TARGETS, &scene->target_count);
    scene->deltas = open_records(o, SCENE_DELTAS, &scene->delta_count);
    scene->deformed_nodes = open_records(o, SCENE_DEFORMED_NODES, &scene->deformed_node_count);
    scene->target_weights = open_records(o, SCENE_TARGET_WEIGHTS, &scene->target_weight_count);
}

static void open_grids(struct opener *o, struct scene *scene)
{
    scene->grids = open_records(o, SCENE_GRIDS, &scene->grid_count);
    scene->grid_bricks = open_records(o, SCENE_GRID_BRICKS, &scene->grid_brick_count);
    scene->grid_values = open_records(o, SCENE_GRID_VALUES, &scene->grid_value_count);
}

static bool open_sections(struct scene *scene, uint64_t memory_bytes, struct error *err)
{
    struct opener o = {.header = scene->header, .memory_bytes = memory_bytes, .err = err};
    scene->nodes = open_records(&o, SCENE_NODES, &scene->node_count);
    scene->meshes = open_records(&o, SCENE_MESHES, &scene->mesh_count);
    scene->primitives = open_records(&o, SCENE_PRIMITIVES, &scene->primitive_count);
    scene->materials = open_records(&o, SCENE_MATERIALS, &scene->material_count);
    scene->textures = open_records(&o, SCENE_TEXTURES, &scene->texture_count);
    scene->images = open_records(&o, SCENE_IMAGES, &scene->image_count);
    scene->pixels = open_section(&o, SCENE_PIXELS, &scene->pixel_bytes);
    if (memory_bytes < scene->header->size_bytes)
        scene->pixels = NULL;
    scene->lights = open_records(&o, SCENE_LIGHTS, &scene->light_count);
    scene->cameras = open_records(&o, SCENE_CAMERAS, &scene->camera_count);
    scene->indices = open_records(&o, SCENE_INDICES, &scene->index_count);
    scene->extensions_used = open_records(&o, SCENE_EXTENSIONS_USED, &scene->extension_used_count);
    scene->extensions_ignored =
        open_records(&o, SCENE_EXTENSIONS_IGNORED, &scene->extension_ignored_count);
    scene->warnings = open_records(&o, SCENE_WARNINGS, &scene->warning_count);
    scene->poses = open_records(&o, SCENE_POSES, &scene->pose_count);
    scene->animations = open_records(&o, SCENE_ANIMATIONS, &scene->animation_count);
    scene->channels = open_records(&o, SCENE_CHANNELS, &scene->channel_count);
    scene->keys = open_records(&o, SCENE_KEYS, &scene->key_count);
    scene->variants = open_records(&o, SCENE_VARIANTS, &scene->variant_count);
    scene->variant_materials =
        open_records(&o, SCENE_VARIANT_MATERIALS, &scene->variant_material_count);
    scene->hidden_nodes = open_records(&o, SCENE_HIDDEN_NODES, &scene->hidden_node_count);
    open_deformations(&o, scene);
    open_grids(&o, scene);
    if (o.has_failed)
        return false;
    if (scene->material_count == 0)
        return error_set(err, ERROR_INVALID_SCENE, "scene blob: there is no material");
    if (scene->node_count > INT32_MAX)
        return error_set(err, ERROR_INVALID_SCENE, "scene blob: too many nodes");
    return true;
}

static bool open_vertices(struct scene *scene, uint64_t memory_bytes, struct error *err)
{
    static const struct {
        enum scene_section section;
        bool is_required;
    } sections[] = {{SCENE_POSITIONS, true},    {SCENE_NORMALS, true},      {SCENE_TANGENTS, false},
                    {SCENE_TEXCOORDS_0, false}, {SCENE_TEXCOORDS_1, false}, {SCENE_COLORS, false}};
    const float **pointers[] = {&scene->positions,   &scene->normals,     &scene->tangents,
                                &scene->texcoords_0, &scene->texcoords_1, &scene->colors};
    struct opener opener = {.header = scene->header, .memory_bytes = memory_bytes, .err = err};
    uint64_t vertices = scene->header->sections[SCENE_POSITIONS].count;
    for (int i = 0; i < 6; i++) {
        enum scene_section section = sections[i].section;
        uint64_t count;
        const float *records = open_section(&opener, section, &count);
        if (opener.has_failed)
            return false;
        if (count != vertices && (sections[i].is_required || count != 0))
            return blob_refuse(err, "section", section);
        if (!blob_are_finite(records, count * (blob_record_bytes(section) / sizeof(float))))
            return error_set(err, ERROR_INVALID_SCENE,
                             "scene blob: section %d has a number that is not finite", section);
        *pointers[i] = records;
    }
    scene->vertex_count = (uint32_t)vertices;
    return true;
}

/* ---- text ---- */

static uint64_t string_bytes(const struct scene *scene)
{
    return scene->header->sections[SCENE_STRINGS].count;
}

/* The section ends in NUL, so any offset inside it is a string. */
static bool is_text(const struct scene *scene, uint32_t offset)
{
    return offset < string_bytes(scene);
}

static bool open_strings(struct scene *scene, uint64_t memory_bytes, struct error *err)
{
    struct opener opener = {.header = scene->header, .memory_bytes = memory_bytes, .err = err};
    uint64_t count;
    const char *strings = open_section(&opener, SCENE_STRINGS, &count);
    if (opener.has_failed)
        return false;
    if (count == 0 || strings[0] != '\0' || strings[count - 1] != '\0')
        return error_set(err, ERROR_INVALID_SCENE,
                         "scene blob: the strings do not begin and end with NUL");
    scene->strings = strings;
    return true;
}

static bool check_lines(const struct scene *scene, const uint32_t *lines, uint32_t count,
                        struct error *err)
{
    for (uint32_t i = 0; i < count; i++)
        if (!is_text(scene, lines[i]))
            return blob_refuse(err, "line of text", i);
    return true;
}

/* ---- records ---- */

static bool is_node(const struct scene *scene, const struct scene_node *node, uint32_t index)
{
    return are_finite_f64(node->local_matrix, 16) && are_finite_f64(node->world_matrix, 16) &&
           is_index(node->parent, index) && is_index(node->mesh, scene->mesh_count) &&
           is_index(node->camera, scene->camera_count) &&
           is_index(node->light, scene->light_count) && is_index(node->grid, scene->grid_count) &&
           is_text(scene, node->name);
}

static bool check_hierarchy(const struct scene *scene, struct error *err)
{
    for (uint32_t i = 0; i < scene->node_count; i++)
        if (!is_node(scene, &scene->nodes[i], i))
            return blob_refuse(err, "node", i);
    for (uint32_t i = 0; i < scene->mesh_count; i++) {
        const struct scene_mesh *mesh = &scene->meshes[i];
        if (mesh->first_primitive > scene->primitive_count ||
            mesh->primitive_count > scene->primitive_count - mesh->first_primitive ||
            !is_text(scene, mesh->name))
            return blob_refuse(err, "mesh", i);
    }
    int32_t camera = scene->header->default_camera_node;
    if (!is_index(camera, scene->node_count) || (camera >= 0 && scene->nodes[camera].camera < 0))
        return error_set(err, ERROR_INVALID_SCENE, "scene blob: the default camera is malformed");
    return true;
}

static bool is_primitive(const struct scene *scene, const struct scene_primitive *p)
{
    static const uint32_t corners[] = {
        [SCENE_POINTS] = 1, [SCENE_LINES] = 2, [SCENE_TRIANGLES] = 3};
    enum { HAS_ALL = 127, OF_TRIANGLES = SCENE_PRIMITIVE_IS_CLOSED | SCENE_PRIMITIVE_IS_SMOOTH };
    if (p->part != 0 || p->topology > SCENE_TRIANGLES || p->material >= scene->material_count ||
        p->flags > HAS_ALL || (p->topology != SCENE_TRIANGLES && (p->flags & OF_TRIANGLES)) ||
        (p->topology == SCENE_TRIANGLES && !(p->flags & SCENE_PRIMITIVE_HAS_NORMALS)))
        return false;
    if (((p->flags & SCENE_PRIMITIVE_HAS_TANGENTS) && !scene->tangents) ||
        ((p->flags & SCENE_PRIMITIVE_HAS_TEXCOORDS_0) && !scene->texcoords_0) ||
        ((p->flags & SCENE_PRIMITIVE_HAS_TEXCOORDS_1) && !scene->texcoords_1) ||
        ((p->flags & SCENE_PRIMITIVE_HAS_COLORS) && !scene->colors))
        return false;
    return p->index_count % corners[p->topology] == 0 && p->first_index <= scene->index_count &&
           p->index_count <= scene->index_count - p->first_index &&
           p->first_vertex <= scene->vertex_count &&
           p->vertex_count <= scene->vertex_count - p->first_vertex &&
           blob_are_finite(p->bounds_min, 3) && blob_are_finite(p->bounds_max, 3);
}

/* Ranges of indices may be shared, but not so often that checking them takes more than twice the
 * size of the blob. */
static bool check_primitives(const struct scene *scene, struct error *err)
{
    uint64_t checked = 0;
    for (uint32_t i = 0; i < scene->primitive_count; i++) {
        const struct scene_primitive *p = &scene->primitives[i];
        if (!is_primitive(scene, p))
            return blob_refuse(err, "primitive", i);
        checked += p->index_count;
        if (checked > scene->header->size_bytes / 2)
            return error_set(err, ERROR_INVALID_SCENE,
                             "scene blob: its primitives share too many indices");
        uint32_t largest = 0;
        for (uint32_t k = 0; k < p->index_count; k++) {
            uint32_t index = scene->indices[p->first_index + k];
            largest = index > largest ? index : largest;
        }
        if (p->index_count > 0 && largest >= p->vertex_count)
            return error_set(err, ERROR_INVALID_SCENE,
                             "scene blob: primitive %u has index %u of %u vertices", i, largest,
                             p->vertex_count);
    }
    return true;
}

static bool is_material(const struct scene *scene, const struct scene_material *m)
{
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
        const struct scene_texture_ref *ref = &m->textures[slot];
        if (!is_index(ref->texture, scene->texture_count) || ref->texcoord > 1 ||
            !blob_are_finite(ref->uv_transform, 6) || !blob_are_finite(ref->uv_scale, 2) ||
            !blob_are_finite(&ref->uv_rotation_rad, 1))
            return false;
    }
    for (int i = 0; i < 4; i++)
        if (!in_range(m->base_color[i], 0, 1))
            return false;
    for (int i = 0; i < 3; i++)
        if (!in_range(m->specular_color[i], 0, 1e30f) || !in_range(m->sheen_color[i], 0, 1))
            return false;
    if (!in_range(m->specular, 0, 1) || !in_range(m->clearcoat, 0, 1) ||
        !in_range(m->clearcoat_roughness, 0, 1) || !in_range(m->sheen_roughness, 0, 1))
        return false;
    for (int i = 0; i < 3; i++)
        if (!in_range(m->diffuse_transmission_color[i], 0, 1))
            return false;
    if (!in_range(m->diffuse_transmission, 0, 1) || !in_range(m->dispersion, 0, 1e30f))
        return false;
    if (!in_range(m->anisotropy, 0, 1) || !blob_are_finite(&m->anisotropy_rad, 1))
        return false;
    if (!in_range(m->iridescence, 0, 1) ||
        !in_range(m->film_ior, m->iridescence > 0 ? 1 : 0, 1000) ||
        !in_range(m->film_nm[0], 0, 1e7f) || !in_range(m->film_nm[1], 0, 1e7f))
        return false;
    for (int i = 0; i < 3; i++)
        if (!in_range(m->attenuation_color[i], 0, 1) || !in_range(m->edge_color[i], 0, 1) ||
            !in_range(m->emissive[i], 0, INFINITY))
            return false;
    return in_range(m->metallic, 0, 1) && in_range(m->roughness, 0, 1) &&
           in_range(m->transmission, 0, 1) && in_range(m->occlusion_strength, 0, 1) &&
           blob_are_finite(&m->normal_scale, 1) && blob_are_finite(&m->clearcoat_normal_scale, 1) &&
           blob_are_finite(m->emissive, 3) && in_range(m->alpha_cutoff, 0, INFINITY) &&
           (m->ior == 0 || in_range(m->ior, 1, 1000)) && in_range(m->thickness, 0, 1e30f) &&
           in_range(m->attenuation_distance, 0, 1e30f) && in_range(m->edge_exponent, 0, 1e6f) &&
           m->alpha_mode <= SCENE_BLEND && m->pass_through <= SCENE_PASS_EDGE &&
           m->flags <=
               (SCENE_MATERIAL_DOUBLE_SIDED | SCENE_MATERIAL_UNLIT | SCENE_MATERIAL_SPECULAR) &&
           is_text(scene, m->name);
}

static bool check_variants(const struct scene *scene, struct error *err)
{
    for (uint32_t i = 0; i < scene->variant_material_count; i++) {
        const struct scene_variant_material *v = &scene->variant_materials[i];
        if (v->variant >= scene->variant_count || v->primitive >= scene->primitive_count ||
            v->material >= scene->material_count || (i > 0 && v->primitive < v[-1].primitive))
            return blob_refuse(err, "material of a variant", i);
    }
    return true;
}

static bool is_filter(uint32_t filter, bool is_min)
{
    return filter == 9728 || filter == 9729 || (is_min && filter >= 9984 && filter <= 9987);
}

static bool is_wrap(uint32_t wrap)
{
    return wrap == 10497 || wrap == 33071 || wrap == 33648;
}

static bool is_image(const struct scene *scene, const struct scene_image *image)
{
    uint64_t pixels = (uint64_t)image->width_px * image->height_px;
    if (image->part != 0 || image->width_px == 0 || image->height_px == 0 ||
        image->offset_bytes > scene->pixel_bytes ||
        pixels > (scene->pixel_bytes - image->offset_bytes) / 4)
        return false;
    uint64_t levels = texture_levels_bytes(image->width_px, image->height_px, 1);
    for (int i = 0; i < 2; i++)
        if (image->levels_offset_bytes[i] > scene->pixel_bytes ||
            (image->levels_offset_bytes[i] &&
             levels > scene->pixel_bytes - image->levels_offset_bytes[i]))
            return false;
    return image->least_alpha <= 255 && is_text(scene, image->name);
}

/* Whether the images that the material samples have their levels. */
static bool has_levels(const struct scene *scene, const struct scene_material *m)
{
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
        int32_t texture = m->textures[slot].texture;
        int32_t index = texture >= 0 ? scene->textures[texture].image : -1;
        const struct scene_image *image = index >= 0 ? &scene->images[index] : NULL;
        if (image && (image->width_px > 1 || image->height_px > 1) &&
            !image->levels_offset_bytes[scene_slot_is_srgb(slot)])
            return false;
    }
    return true;
}

static bool check_surfaces(const struct scene *scene, struct error *err)
{
    for (uint32_t i = 0; i < scene->material_count; i++)
        if (!is_material(scene, &scene->materials[i]))
            return blob_refuse(err, "material", i);
    for (uint32_t i = 0; i < scene->texture_count; i++) {
        const struct scene_texture *t = &scene->textures[i];
        if (!is_index(t->image, scene->image_count) || !is_filter(t->mag_filter, false) ||
            !is_filter(t->min_filter, true) || !is_wrap(t->wrap_s) || !is_wrap(t->wrap_t) ||
            !is_text(scene, t->name))
            return blob_refuse(err, "texture", i);
    }
    for (uint32_t i = 0; i < scene->image_count; i++)
        if (!is_image(scene, &scene->images[i]))
            return blob_refuse(err, "image", i);
    for (uint32_t i = 0; i < scene->material_count; i++)
        if (!has_levels(scene, &scene->materials[i]))
            return blob_refuse(err, "material", i);
    return true;
}

static bool is_light(const struct scene *scene, const struct scene_light *l)
{
    for (int i = 0; i < 3; i++)
        if (!in_range(l->color[i], 0, 1e30f))
            return false;
    return l->type <= SCENE_LIGHT_SPOT && in_range(l->intensity, 0, 1e30f) &&
           in_range(l->range, 0, 1e30f) && in_range(l->inner_cone_rad, 0, 1.5708f) &&
           in_range(l->outer_cone_rad, l->inner_cone_rad, 1.5708f) && is_text(scene, l->name);
}

static bool is_camera(const struct scene *scene, const struct scene_camera *c)
{
    if (c->is_orthographic > 1 || !is_text(scene, c->name) || !in_range(c->z_near, 0, 1e30f) ||
        !in_range(c->z_far, 0, 1e30f) || (c->z_far != 0 && c->z_far <= c->z_near))
        return false;
    if (c->is_orthographic)
        return in_range(c->x_mag, 1e-30f, 1e30f) && in_range(c->y_mag, 1e-30f, 1e30f);
    return in_range(c->y_fov_rad, 1e-30f, 3.1415927f) && in_range(c->aspect, 0, 1e30f);
}

static bool check_lights_and_cameras(const struct scene *scene, struct error *err)
{
    for (uint32_t i = 0; i < scene->light_count; i++)
        if (!is_light(scene, &scene->lights[i]))
            return blob_refuse(err, "light", i);
    for (uint32_t i = 0; i < scene->camera_count; i++)
        if (!is_camera(scene, &scene->cameras[i]))
            return blob_refuse(err, "camera", i);
    return true;
}

/* ---- animations ---- */

static bool is_pose(const struct scene *scene, uint32_t index)
{
    const struct scene_pose *pose = &scene->poses[index];
    const double *q = pose->rotation;
    double length2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    return pose->node < scene->node_count &&
           (index == 0 || pose->node > scene->poses[index - 1].node) &&
           are_finite_f64(pose->translation, 3) && are_finite_f64(pose->scale, 3) &&
           length2 > 0.999 && length2 < 1.001;
}

/* The channel's path, target and member are known to be good. */
static uint64_t channel_numbers(const struct scene *scene, const struct scene_channel *channel)
{
    uint64_t components = scene_channel_components(scene, channel);
    uint64_t values = channel->interpolation == SCENE_CUBIC ? 3 : 1;
    return channel->key_count * (1 + components * values);
}

/* Whether the channel before it has the same times, as those of instances have. */
static bool has_checked_times(const struct scene *scene, const struct scene_channel *channel)
{
    return channel > scene->channels && channel[-1].first_key == channel->first_key &&
           channel[-1].key_count == channel->key_count;
}

static uint32_t record_count(const struct scene *scene, enum animated_owner owner)
{
    return owner == ANIMATED_MATERIAL ? scene->material_count
           : owner == ANIMATED_LIGHT  ? scene->light_count
                                      : scene->camera_count;
}

static bool has_target(const struct scene *scene, const struct scene_channel *channel)
{
    const struct animated_member *member = animated_member(channel->member);
    switch (channel->path) {
    case SCENE_TRANSLATION:
    case SCENE_ROTATION:
    case SCENE_SCALE:
        return channel->target < scene->pose_count;
    case SCENE_WEIGHTS:
        return channel->target < scene->deformed_node_count;
    case SCENE_VISIBILITY:
        return channel->target < scene->node_count;
    case SCENE_MEMBER:
        return member && channel->target < record_count(scene, member->owner);
    }
    return false;
}

static bool is_channel(const struct scene *scene, const struct scene_channel *channel)
{
    if (!has_target(scene, channel) || channel->interpolation > SCENE_CUBIC ||
        channel->key_count == 0 || channel->first_key > scene->key_count ||
        channel_numbers(scene, channel) > scene->key_count - channel->first_key)
        return false;
    const float *times = scene->keys + channel->first_key;
    if (has_checked_times(scene, channel))
        return true;
    for (uint32_t i = 0; i < channel->key_count; i++)
        if (!(times[i] >= (i > 0 ? times[i - 1] : 0)))
            return false;
    return true;
}

static bool check_hidden(const struct scene *scene, struct error *err)
{
    for (uint32_t i = 0; i < scene->hidden_node_count; i++)
        if (scene->hidden_nodes[i] >= scene->node_count ||
            (i > 0 && scene->hidden_nodes[i] <= scene->hidden_nodes[i - 1]))
            return blob_refuse(err, "hidden node", i);
    return true;
}

/* Channels may share keys, within the same bound as primitives their indices. */
static bool check_animations(const struct scene *scene, struct error *err)
{
    uint64_t checked = 0, channels = 0;
    if (!blob_are_finite(scene->keys, scene->key_count))
        return error_set(err, ERROR_INVALID_SCENE, "scene blob: a key is not finite");
    for (uint32_t i = 0; i < scene->pose_count; i++)
        if (!is_pose(scene, i))
            return blob_refuse(err, "pose", i);
    for (uint32_t i = 0; i < scene->channel_count; i++) {
        checked += has_checked_times(scene, &scene->channels[i]) ? 0 : scene->channels[i].key_count;
        if (checked > scene->header->size_bytes / 2 || !is_channel(scene, &scene->channels[i]))
            return blob_refuse(err, "channel", i);
    }
    for (uint32_t i = 0; i < scene->animation_count; i++) {
        const struct scene_animation *a = &scene->animations[i];
        if (!is_text(scene, a->name) || a->first_channel != channels ||
            a->channel_count > scene->channel_count - channels ||
            !in_range(a->duration_s, 0, 3e38f))
            return blob_refuse(err, "animation", i);
        channels += a->channel_count;
    }
    return true;
}

static bool open_blob(struct scene *scene, const void *blob, size_t size_bytes, bool is_head,
                      struct error *err)
{
    static atomic_uint_least64_t serial;
    memset(scene, 0, sizeof *scene);
    if ((uintptr_t)blob % _Alignof(struct scene_header) != 0)
        return error_set(err, ERROR_INTERNAL, "scene blob: not aligned");
    if (!check_header(blob, size_bytes, is_head, err))
        return false;
    scene->header = blob;
    scene->serial = ++serial;
    bool is_good =
        open_strings(scene, size_bytes, err) && open_sections(scene, size_bytes, err) &&
        open_vertices(scene, size_bytes, err) &&
        check_lines(scene, scene->extensions_used, scene->extension_used_count, err) &&
        check_lines(scene, scene->extensions_ignored, scene->extension_ignored_count, err) &&
        check_lines(scene, scene->warnings, scene->warning_count, err) &&
        check_lines(scene, scene->variants, scene->variant_count, err) &&
        check_hierarchy(scene, err) && check_primitives(scene, err) && check_surfaces(scene, err) &&
        check_variants(scene, err) && check_lights_and_cameras(scene, err) &&
        scene_check_deformations(scene, err) && check_animations(scene, err) &&
        check_hidden(scene, err) && scene_check_grids(scene, string_bytes(scene), err);
    if (!is_good)
        memset(scene, 0, sizeof *scene);
    return is_good;
}

bool scene_open(struct scene *scene, const void *blob, size_t size_bytes, struct error *err)
{
    return open_blob(scene, blob, size_bytes, false, err);
}

bool scene_open_head(struct scene *scene, const void *head, size_t head_bytes, struct error *err)
{
    return open_blob(scene, head, head_bytes, true, err);
}

/* ---- names ---- */

/* The index in "#12", or -1 when it is none below count. */
static int32_t index_from_name(const char *name, uint32_t count)
{
    if (name[0] != '#' || name[1] < '0' || name[1] > '9')
        return -1;
    char *end;
    unsigned long long index = strtoull(name + 1, &end, 10);
    return *end == '\0' && index < count ? (int32_t)index : -1;
}

/* The part that "PART/#12" names, and the index in its scene; 0 if the name has another form. */
static uint32_t part_of_name(const struct scene *scene, const char *name, const char **index)
{
    const char *slash = strchr(name, '/');
    for (uint32_t i = 1; slash && i < scene->part_count; i++) {
        size_t length = strlen(scene->parts[i].name);
        if ((size_t)(slash - name) == length && memcmp(scene->parts[i].name, name, length) == 0) {
            *index = slash + 1;
            return i;
        }
    }
    return 0;
}

/* Finds a name, or "#12", in an array whose elements hold, `member` bytes from their start, the
 * offset of a name in the scene's strings; -1 if there is none. */
static int32_t find_name(const struct scene *scene, const char *name, const void *array,
                         size_t element_bytes, size_t member, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        uint32_t offset;
        memcpy(&offset, (const char *)array + i * element_bytes + member, sizeof offset);
        if (strcmp(scene->strings + offset, name) == 0)
            return (int32_t)i;
    }
    return index_from_name(name, count);
}

int32_t scene_find_node(const struct scene *scene, const char *name)
{
    int32_t index = find_name(scene, name, scene->nodes, sizeof *scene->nodes,
                              offsetof(struct scene_node, name), scene->node_count);
    const char *inside;
    uint32_t part = index < 0 ? part_of_name(scene, name, &inside) : 0;
    if (!part)
        return index;
    index = index_from_name(inside, scene->parts[part].scene->node_count);
    return index < 0 ? -1 : index + (int32_t)scene->parts[part].first_node;
}

int32_t scene_find_material(const struct scene *scene, const char *name)
{
    int32_t index = find_name(scene, name, scene->materials, sizeof *scene->materials,
                              offsetof(struct scene_material, name), scene->material_count);
    const char *inside;
    uint32_t part = index < 0 ? part_of_name(scene, name, &inside) : 0;
    if (!part)
        return index;
    index = index_from_name(inside, scene->parts[part].scene->material_count);
    return index < 0 ? -1 : index + (int32_t)scene->parts[part].first_material;
}

int32_t scene_find_grid(const struct scene *scene, const char *name)
{
    int32_t index = find_name(scene, name, scene->grids, sizeof *scene->grids,
                              offsetof(struct scene_grid, name), scene->grid_count);
    const char *inside;
    uint32_t part = index < 0 ? part_of_name(scene, name, &inside) : 0;
    if (!part)
        return index;
    index = index_from_name(inside, scene->parts[part].scene->grid_count);
    return index < 0 ? -1 : index + (int32_t)scene->parts[part].first_grid;
}

int32_t scene_find_animation(const struct scene *scene, const char *name)
{
    return find_name(scene, name, scene->animations, sizeof *scene->animations,
                     offsetof(struct scene_animation, name), scene->animation_count);
}

int32_t scene_find_variant(const struct scene *scene, const char *name)
{
    return find_name(scene, name, scene->variants, sizeof *scene->variants, 0,
                     scene->variant_count);
}

bool scene_material_attenuates(const struct scene_material *m)
{
    return m->transmission > 0 && m->thickness > 0 && m->attenuation_distance > 0 &&
           (m->attenuation_color[0] < 1 || m->attenuation_color[1] < 1 ||
            m->attenuation_color[2] < 1);
}
