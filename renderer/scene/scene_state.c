/* SPDX-License-Identifier: MIT */
/* Evaluation of a scene for one view: overrides, world matrices, drawables and lights. */
#include "renderer/scene/scene_state.h"

#include <float.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/ground_plane.h"
#include "renderer/scene/material_lobes.h"
#include "renderer/scene/section.h"
#include "renderer/scene/state_animation.h"
#include "renderer/scene/state_caps.h"
#include "renderer/scene/studio.h"
#include "renderer/scene/variants.h"

static const double COORDINATE_MAX = 1e12; /* m; as of files (LIMIT_COORDINATE) */

enum state_class material_class(const struct scene_material *material)
{
    if (material->transmission > 0 || material->alpha_mode == SCENE_BLEND)
        return STATE_TRANSPARENT;
    return material->alpha_mode == SCENE_MASK ? STATE_MASKED : STATE_OPAQUE;
}

static bool apply_node_overrides(struct scene_state *state, const struct view *view,
                                 const double **locals, struct error *err)
{
    for (size_t i = 0; i < view->node_override_count; i++) {
        const struct view_node_override *o = &view->nodes[i];
        int32_t node = scene_find_node(state->scene, o->node);
        if (node < 0)
            return error_set_at(err, ERROR_NOT_FOUND, "/overrides/nodes",
                                "the scene has no node '%s'", o->node);
        if (o->has_visible)
            state->is_visible[node] = o->visible;
        if (o->has_matrix) {
            for (int k = 0; k < 16; k++)
                if (!isfinite(o->matrix[k]))
                    return error_set(err, ERROR_INVALID_REQUEST,
                                     "matrix of node '%s' is not finite", o->node);
            locals[node] = o->matrix;
        }
    }
    return true;
}

static bool place_parts(struct scene_state *state, const struct view *view, const double **locals,
                        struct error *err)
{
    const struct scene *scene = state->scene;
    for (uint32_t i = 1; i < scene->part_count; i++) {
        const struct view_part *part = &view->parts[scene->parts[i].source_index];
        uint32_t root = scene->parts[i].first_node - 1;
        state->is_visible[root] = !part->is_hidden;
        for (int k = 0; k < 16; k++)
            if (!isfinite(part->matrix[k]))
                return error_set(err, ERROR_INVALID_REQUEST, "matrix of part '%s' is not finite",
                                 part->name);
        locals[root] = part->matrix;
    }
    return true;
}

/* Parents come before children, so one pass composes matrices and passes invisibility down. */
static bool compose_nodes(struct scene_state *state, const struct view *view, struct error *err)
{
    const struct scene *scene = state->scene;
    const double **locals = calloc(scene->node_count + 1, sizeof *locals);
    if (!locals)
        return error_set(err, ERROR_NO_MEMORY, "%u nodes", scene->node_count);
    state_hide_nodes(state);
    struct moved_nodes moved = {.weights = state->deforms.weights};
    bool ok = place_parts(state, view, locals, err) &&
              (!view->is_animated || state_animate_nodes(state, view, &moved, locals, err)) &&
              apply_node_overrides(state, view, locals, err);
    for (uint32_t i = 0; ok && i < scene->node_count; i++) {
        const struct scene_node *node = &scene->nodes[i];
        const double *local = locals[i] ? locals[i] : node->local_matrix;
        if (node->parent < 0) {
            memcpy(state->world[i], local, sizeof state->world[i]);
        } else {
            mat4_mul(state->world[node->parent], local, state->world[i]);
            state->is_visible[i] = state->is_visible[i] && state->is_visible[node->parent];
        }
    }
    state->has_idle_animation = ok && view->is_animated && !state_moves_anything(scene, &moved);
    free(locals);
    moved_nodes_finish(&moved);
    return ok;
}

static void override_factors(struct scene_material *m, const struct view_material_override *o)
{
    if (o->has_base_color)
        memcpy(m->base_color, o->base_color, sizeof m->base_color);
    if (o->has_metallic)
        m->metallic = o->metallic;
    if (o->has_roughness)
        m->roughness = o->roughness;
    if (o->has_emissive)
        memcpy(m->emissive, o->emissive, sizeof m->emissive);
    if (o->has_transmission)
        m->transmission = o->transmission;
    if (o->has_ior)
        m->ior = o->ior;
    if (o->has_thickness)
        m->thickness = o->thickness;
    if (o->has_attenuation) {
        memcpy(m->attenuation_color, o->attenuation_color, sizeof m->attenuation_color);
        m->attenuation_distance = o->attenuation_distance;
    }
    if (o->has_alpha_mode)
        m->alpha_mode = o->alpha_mode;
    if (o->has_pass_through) {
        m->pass_through = o->pass_through;
        memcpy(m->edge_color, o->edge_color, sizeof m->edge_color);
        m->edge_exponent = o->edge_exponent;
    }
    material_lobes_set(m, &o->lobes);
}

/* Extinction of the inside: attenuation_color is what remains after attenuation_distance, a length
 * of the world (KHR_materials_volume). A channel of 0 counts as 1e-30: finite, yet black within a
 * thousandth of any distance at which it matters. */
static void compute_extinction(struct state_material *material)
{
    const struct scene_material *m = &material->base;
    const double blackest = 1e-30;
    for (int k = 0; k < 3; k++)
        material->sigma[k] = m->attenuation_distance > 0
                                 ? -log(fmax((double)m->attenuation_color[k], blackest)) /
                                       (double)m->attenuation_distance
                                 : 0;
}

static bool apply_material_overrides(struct scene_state *state, const struct view *view,
                                     struct error *err)
{
    for (uint32_t i = 0; i < state->scene->material_count; i++)
        state->materials[i].base = state->scene->materials[i];
    if (view->is_animated && !state_animate_members(state, view, err))
        return false;
    for (size_t i = 0; i < view->material_override_count; i++) {
        const struct view_material_override *o = &view->materials[i];
        int32_t index = scene_find_material(state->scene, o->material);
        if (index < 0)
            return error_set_at(err, ERROR_NOT_FOUND, "/overrides/materials",
                                "the scene has no material '%s'", o->material);
        struct state_material *material = &state->materials[index];
        override_factors(&material->base, o);
        if (o->has_self_shadow)
            material->no_self_shadow = !o->self_shadow;
        if (o->has_cast_once)
            material->cast_once = o->cast_once;
    }
    for (uint32_t i = 0; i < state->scene->material_count; i++)
        compute_extinction(&state->materials[i]);
    return true;
}

void state_geometry_point(const struct state_geometry *geometry, size_t vertex, double world[3])
{
    const float *p = geometry->positions + 3 * (geometry->primitive->first_vertex + vertex);
    mat4_transform_point(geometry->world,
                         (const double[3]){(double)p[0], (double)p[1], (double)p[2]}, world);
}

void state_geometry_corner(const struct state_geometry *geometry, size_t index, double world[3])
{
    state_geometry_point(geometry, geometry->indices[geometry->primitive->first_index + index],
                         world);
}

/* FNV-1a by words instead of bytes, and folded, because a multiplication only carries upward. */
static uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t size)
{
    const unsigned char *p = bytes;
    for (size_t i = 0; i < size; i += 8) {
        uint64_t word = 0;
        memcpy(&word, p + i, size - i < 8 ? size - i : 8);
        hash = (hash ^ word) * 0x9e3779b97f4a7c15ull; /* golden ratio */
        hash ^= hash >> 32;
    }
    return hash;
}

#define HASH_FIELD(hash, field) (hash) = hash_bytes((hash), &(field), sizeof(field))

static uint64_t shadow_hash(const struct scene_state *state, const struct state_item *item)
{
    const struct state_material *material = &state->materials[item->material];
    const struct scene_material *m = &material->base;
    uint64_t hash = 0xcbf29ce484222325ull;
    hash = hash_bytes(hash, state_geometry_of(state, item).world, sizeof *state->world);
    if (item->deformed)
        HASH_FIELD(hash, state->deforms.items[item->deformed - 1].pose);
    HASH_FIELD(hash, item->node);
    HASH_FIELD(hash, item->primitive);
    HASH_FIELD(hash, item->class_);
    if (state->scene->part_count) {
        uint64_t part =
            state->scene->parts[state->scene->primitives[item->primitive].part].identity;
        if (part) /* an item of the base has the hash that it has without parts */
            HASH_FIELD(hash, part);
    }
    if (item->class_ == STATE_OPAQUE)
        return hash;
    HASH_FIELD(hash, item->is_medium);
    HASH_FIELD(hash, m->base_color);
    HASH_FIELD(hash, m->alpha_mode);
    HASH_FIELD(hash, m->alpha_cutoff);
    HASH_FIELD(hash, m->transmission);
    HASH_FIELD(hash, m->thickness);
    HASH_FIELD(hash, m->attenuation_color);
    HASH_FIELD(hash, m->attenuation_distance);
    HASH_FIELD(hash, m->pass_through);
    HASH_FIELD(hash, m->edge_color);
    HASH_FIELD(hash, m->edge_exponent);
    HASH_FIELD(hash, m->textures[SCENE_TEXTURE_BASE_COLOR]);
    HASH_FIELD(hash, m->textures[SCENE_TEXTURE_TRANSMISSION]);
    HASH_FIELD(hash, m->textures[SCENE_TEXTURE_THICKNESS]);
    HASH_FIELD(hash, material->no_self_shadow);
    HASH_FIELD(hash, material->cast_once);
    return hash;
}

/* Around the box of the primitive's own coordinates, which turns with its node. */
static void compute_sphere(const struct scene_primitive *p, const double world[16],
                           struct state_item *item)
{
    double middle[3], half[3];
    for (int k = 0; k < 3; k++) {
        middle[k] = 0.5 * ((double)p->bounds_min[k] + (double)p->bounds_max[k]);
        half[k] = 0.5 * ((double)p->bounds_max[k] - (double)p->bounds_min[k]);
    }
    mat4_transform_point(world, middle, item->center);
    item->radius_m = 0;
    for (int corner = 0; corner < 4; corner++) { /* the other four are opposite */
        double diagonal[3] = {half[0], corner & 1 ? -half[1] : half[1],
                              corner & 2 ? -half[2] : half[2]};
        mat4_transform_direction(world, diagonal, diagonal);
        item->radius_m = fmax(item->radius_m, vec3_length(diagonal));
    }
}

static void compute_bounds(const struct scene_state *state, struct state_item *item)
{
    const struct state_geometry geometry = state_geometry_of(state, item);
    const struct scene_primitive *p = geometry.primitive;
    for (int k = 0; k < 3; k++) {
        item->bounds_min[k] = DBL_MAX;
        item->bounds_max[k] = -DBL_MAX;
    }
    for (int corner = 0; corner < 8; corner++) {
        double local[3], world[3];
        for (int k = 0; k < 3; k++)
            local[k] = (double)(corner >> k & 1 ? p->bounds_max[k] : p->bounds_min[k]);
        mat4_transform_point(geometry.world, local, world);
        for (int k = 0; k < 3; k++) {
            item->bounds_min[k] = fmin(item->bounds_min[k], world[k]);
            item->bounds_max[k] = fmax(item->bounds_max[k], world[k]);
        }
    }
    compute_sphere(p, geometry.world, item);
}

enum state_bend state_bend_of(const struct scene_material *m)
{
    const double least = (double)STATE_BEND_ROUGHNESS_LEAST;
    if (m->transmission <= 0 || m->alpha_mode != SCENE_OPAQUE || m->ior <= 0)
        return STATE_BEND_NONE;
    if (m->thickness > 0 && m->ior > 1)
        return STATE_BEND_SLAB;
    return state_bend_roughness((double)m->ior, (double)m->roughness) >= least ? STATE_BEND_THIN
                                                                               : STATE_BEND_NONE;
}

static enum state_bend bend_of(const struct scene_material *m, const struct scene_primitive *p)
{
    enum state_bend bend = state_bend_of(m);
    if (p->topology != SCENE_TRIANGLES)
        return STATE_BEND_NONE;
    return bend == STATE_BEND_SLAB && p->flags & SCENE_PRIMITIVE_IS_CLOSED ? STATE_BEND_SOLID
                                                                           : bend;
}

/* Of numbers that are no numbers, too. */
static bool check_bounds(const struct scene_state *state, const struct state_item *item,
                         struct error *err)
{
    for (int k = 0; k < 3; k++)
        if (!(item->bounds_min[k] <= item->bounds_max[k] &&
              item->bounds_min[k] >= -COORDINATE_MAX && item->bounds_max[k] <= COORDINATE_MAX))
            return error_set(
                err, ERROR_INVALID_REQUEST,
                "node '%.80s' is where matrices, animations and parts put it more than "
                "%g m from the origin",
                state->scene->strings + state->scene->nodes[item->node].name, COORDINATE_MAX);
    return true;
}

/* deformed: 1 + its index, or 0. */
static void fill_item(const struct scene_state *state, uint32_t node, uint32_t primitive,
                      uint32_t deformed, struct state_item *item)
{
    const struct scene_primitive *p = &state->scene->primitives[primitive];
    const uint32_t material =
        state->variant_materials ? state->variant_materials[primitive] : p->material;
    const struct scene_material *m = &state->materials[material].base;
    double determinant = deformed ? state->deforms.items[deformed - 1].determinant
                                  : mat4_determinant3(state->world[node]);
    *item = (struct state_item){
        .node = node,
        .primitive = primitive,
        .deformed = deformed,
        .material = material,
        .class_ = material_class(m),
        .is_mirrored = determinant < 0,
        .length_scale = (float)cbrt(fabs(determinant)),
        .casts_shadow = p->topology == SCENE_TRIANGLES,
        .is_medium = (p->flags & SCENE_PRIMITIVE_IS_CLOSED) && scene_material_attenuates(m),
        .bend = bend_of(m, p),
    };
    /* blending with an alpha that is 1 everywhere lets nothing through */
    if (item->class_ == STATE_TRANSPARENT && m->transmission <= 0 && m->base_color[3] >= 1 &&
        m->textures[SCENE_TEXTURE_BASE_COLOR].texture < 0 &&
        !(p->flags & SCENE_PRIMITIVE_HAS_COLORS))
        item->class_ = STATE_OPAQUE;
    compute_bounds(state, item);
    item->shadow_hash = shadow_hash(state, item);
}

static bool is_open_volume(const struct scene_state *state, const struct state_item *item)
{
    return item->casts_shadow && !item->is_medium &&
           scene_material_attenuates(&state->materials[item->material].base);
}

/* Takes the next of what deforms, which lie in the order of the items, if it is this primitive:
 * 1 + its index, else 0. */
static uint32_t take_deformed(const struct state_deforms *deforms, uint32_t *next, uint32_t node,
                              uint32_t primitive)
{
    if (*next >= deforms->count || deforms->items[*next].node != node ||
        deforms->items[*next].index != primitive)
        return 0;
    return ++*next;
}

static bool list_items(struct scene_state *state, struct error *err)
{
    const struct scene *scene = state->scene;
    size_t count = 0;
    uint32_t deformed = 0;
    for (uint32_t i = 0; i < scene->node_count; i++)
        if (state->is_visible[i] && scene->nodes[i].mesh >= 0)
            count += scene->meshes[scene->nodes[i].mesh].primitive_count;
    state->items = calloc(count + 1, sizeof *state->items);
    if (!state->items)
        return error_set(err, ERROR_NO_MEMORY, "%zu drawables", count);
    for (int k = 0; k < 3; k++) {
        state->bounds_min[k] = DBL_MAX;
        state->bounds_max[k] = -DBL_MAX;
    }
    for (uint32_t i = 0; i < scene->node_count; i++) {
        if (!state->is_visible[i] || scene->nodes[i].mesh < 0)
            continue;
        const struct scene_mesh *mesh = &scene->meshes[scene->nodes[i].mesh];
        for (uint32_t p = 0; p < mesh->primitive_count; p++) {
            uint32_t primitive = mesh->first_primitive + p;
            if (!scene->primitives[primitive].index_count)
                continue;
            struct state_item *item = &state->items[state->item_count++];
            fill_item(state, i, primitive, take_deformed(&state->deforms, &deformed, i, primitive),
                      item);
            if (!check_bounds(state, item, err))
                return false;
            state->medium_count += item->is_medium;
            state->open_volume_count += is_open_volume(state, item);
            for (int k = 0; k < 3; k++) {
                state->bounds_min[k] = fmin(state->bounds_min[k], item->bounds_min[k]);
                state->bounds_max[k] = fmax(state->bounds_max[k], item->bounds_max[k]);
            }
        }
    }
    return true;
}

static bool add_light(struct scene_state *state, const struct state_light *light)
{
    if (!(light->color[0] > 0 || light->color[1] > 0 || light->color[2] > 0))
        return false; /* emits nothing */
    state->lights[state->light_count] = *light;
    return vec3_normalize(state->lights[state->light_count].direction) && ++state->light_count;
}

static void add_scene_light(struct scene_state *state, uint32_t node)
{
    int32_t index = state->scene->nodes[node].light;
    const struct scene_light *source =
        state->file_lights ? &state->file_lights[index] : &state->scene->lights[index];
    const double *world = state->world[node];
    struct state_light light = {
        .type = (enum scene_light_type)source->type,
        .position = {world[12], world[13], world[14]},
        .direction = {-world[8], -world[9], -world[10]},
        .up = {world[4], world[5], world[6]},
        .range = source->range,
        .inner_cone_rad = source->inner_cone_rad,
        .outer_cone_rad = source->outer_cone_rad,
        .casts_shadow = true,
        .node = (int32_t)node,
    };
    for (int k = 0; k < 3; k++)
        light.color[k] = source->color[k] * source->intensity;
    if (light.type == SCENE_LIGHT_POINT && !(vec3_length(light.direction) > 0))
        light.direction[0] = light.direction[1] = 0, light.direction[2] = -1;
    add_light(state, &light);
}

/* The sides of an area light about its unit direction; docs/explanation/shading.md, section 4. */
static void span_area(const struct view_light *source, struct state_light *light)
{
    bool is_rect = light->type == SCENE_LIGHT_RECT;
    double up[3], side[3];
    memcpy(up, source->up, sizeof up);
    if (vec3_length(up) == 0)
        up[1] = 1;
    vec3_cross(light->direction, up, side);
    if (vec3_length(side) < 1e-9 * vec3_length(up)) { /* shines along up */
        up[0] = up[1] = 0, up[2] = -1;
        vec3_cross(light->direction, up, side);
    }
    vec3_normalize(side);
    vec3_cross(side, light->direction, up);
    for (int k = 0; k < 3; k++) {
        light->half_u[k] = side[k] * (is_rect ? 0.5 * source->width_m : source->radius_m);
        light->half_v[k] = up[k] * (is_rect ? 0.5 * source->height_m : source->radius_m);
    }
    light->area_m2 =
        is_rect ? source->width_m * source->height_m : M_PI * source->radius_m * source->radius_m;
}

static void add_view_light(struct scene_state *state, const struct view_light *source)
{
    const float degree = 0.017453292519943295f;
    float outer_deg = source->outer_cone_deg > 0 ? source->outer_cone_deg : 45;
    struct state_light light = {
        .type = source->type,
        .range = source->range,
        .inner_cone_rad = source->inner_cone_deg * degree,
        .outer_cone_rad = outer_deg * degree,
        .casts_shadow = !source->casts_no_shadow,
        .node = -1,
    };
    memcpy(light.position, source->position, sizeof light.position);
    memcpy(light.direction, source->direction, sizeof light.direction);
    memcpy(light.up, source->up, sizeof light.up);
    for (int k = 0; k < 3; k++)
        light.color[k] = source->color[k] * source->intensity;
    if (vec3_length(light.direction) == 0)
        light.direction[1] = -1; /* points need none; others default to straight down */
    if (state_light_is_area(&light)) {
        light.inner_cone_rad = 0;
        light.outer_cone_rad = (float)M_PI_2;
        vec3_normalize(light.direction);
        span_area(source, &light);
    }
    add_light(state, &light);
}

static bool list_lights(struct scene_state *state, const struct view *view, struct error *err)
{
    const struct scene *scene = state->scene;
    state->lights = calloc(scene->node_count + view->light_count + 1, sizeof *state->lights);
    if (!state->lights)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", view->light_count);
    state->has_environment = view->has_environment;
    memcpy(state->sky, view->sky, sizeof state->sky);
    memcpy(state->ground, view->ground, sizeof state->ground);
    for (uint32_t i = 0; !view->ignore_scene_lights && i < scene->node_count; i++) {
        if (scene->nodes[i].light >= 0 && state->is_visible[i])
            add_scene_light(state, i);
    }
    for (size_t i = 0; i < view->light_count; i++)
        add_view_light(state, &view->lights[i]);
    enum view_studio studio = studio_of(scene, view);
    if (studio != VIEW_STUDIO_OFF) {
        const struct view_light key = studio_key_light();
        add_view_light(state, &key);
    }
    state->has_default_lights = studio == VIEW_STUDIO_BY_DEFAULT;
    return true;
}

bool scene_state_cut(struct scene_state *state, const struct view *view, struct error *err)
{
    state->shadow_plane_count = 0;
    if (view->clip_plane_count > VIEW_CLIP_PLANES_MAX)
        return error_set(err, ERROR_INVALID_REQUEST, "%zu clip planes, limit is %d",
                         view->clip_plane_count, VIEW_CLIP_PLANES_MAX);
    for (size_t i = 0; i < view->clip_plane_count; i++)
        if (!view->cuts || !view->cuts[i].spares_shadows)
            memcpy(state->shadow_planes[state->shadow_plane_count++], view->clip_planes[i],
                   sizeof *state->shadow_planes);
    section_drop(state);
    return section_add(state, view, err) && ground_plane_add(state, view, err);
}

bool state_planes_meet(const double (*planes)[4], size_t count, const double bounds_min[3],
                       const double bounds_max[3], uint32_t *through)
{
    *through = 0;
    for (size_t i = 0; i < count; i++) {
        double low = planes[i][3], high = low;
        for (int k = 0; k < 3; k++) {
            double a = planes[i][k] * bounds_min[k], b = planes[i][k] * bounds_max[k];
            low += fmin(a, b);
            high += fmax(a, b);
        }
        if (high < 0)
            return false;
        if (low < 0)
            *through |= 1u << i;
    }
    return true;
}

/* The size of a primitive however its node is turned: the sum of squared extents in the world. */
static double primitive_size(const struct scene_primitive *primitive, const double world[16])
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        double extent = (double)primitive->bounds_max[k] - (double)primitive->bounds_min[k];
        square += extent * extent * vec3_dot(world + 4 * k, world + 4 * k);
    }
    return sqrt(square);
}

/* The matrices that a node's mesh is about as large by: at present, and in the file. A skinned one
 * is as large as its first joint makes it. */
static void find_frames(const struct scene_state *state, uint32_t node, double now[16],
                        double in_file[16])
{
    const struct scene *scene = state->scene;
    uint32_t joint_node = node;
    const struct scene_joint *joint =
        state->deforms.weights ? deform_first_joint(scene, node, &joint_node) : NULL;
    memcpy(now, state->world[joint_node], 16 * sizeof *now);
    memcpy(in_file, scene->nodes[joint_node].world_matrix, 16 * sizeof *now);
    if (!joint)
        return;
    deform_joint_matrix(now, joint, now);
    deform_joint_matrix(in_file, joint, in_file);
}

/* A node that is only moved keeps the size that it has in the file, whatever the last bits of its
 * matrix. */
static double find_unit(const struct scene_state *state)
{
    const double rounding = 1e-5; /* more than that of a matrix written with six digits */
    const struct scene *scene = state->scene;
    double unit = 0;
    for (uint32_t i = 0; i < scene->node_count; i++) {
        const struct scene_node *node = &scene->nodes[i];
        double now[16], first[16];
        if (node->mesh >= 0)
            find_frames(state, i, now, first);
        for (uint32_t p = 0; node->mesh >= 0 && p < scene->meshes[node->mesh].primitive_count;
             p++) {
            const struct scene_primitive *primitive =
                &scene->primitives[scene->meshes[node->mesh].first_primitive + p];
            double size = primitive_size(primitive, now);
            if (size * (1 + 2 * rounding) <= unit)
                continue;
            double in_file = primitive_size(primitive, first);
            unit = fmax(unit, fabs(size - in_file) <= rounding * in_file ? in_file : size);
        }
    }
    return unit > 0 && isfinite(unit) ? unit : 1;
}

bool scene_state_init(struct scene_state *state, const struct scene *scene, const struct view *view,
                      struct error *err)
{
    *state = (struct scene_state){.scene = scene};
    state->world = calloc(scene->node_count + 1, sizeof *state->world);
    state->is_visible = calloc(scene->node_count + 1, sizeof *state->is_visible);
    state->materials = calloc(scene->material_count + 1, sizeof *state->materials);
    if (!state->world || !state->is_visible || !state->materials) {
        error_set(err, ERROR_NO_MEMORY, "state of %u nodes", scene->node_count);
        goto fail;
    }
    if (!deforms_init(&state->deforms, scene, err) || !compose_nodes(state, view, err) ||
        !deforms_evaluate(&state->deforms, scene, (const double(*)[16])state->world,
                          state->is_visible, err) ||
        !apply_material_overrides(state, view, err) ||
        !variant_materials_create(scene, view->variant, &state->variant_materials, err) ||
        !list_items(state, err) || !state_grids_init(state, view, err) ||
        !list_lights(state, view, err))
        goto fail;
    state->unit_m = find_unit(state);
    state->whole_count = state->item_count;
    if (!scene_state_cut(state, view, err))
        goto fail;
    return true;

fail:
    scene_state_finish(state);
    return false;
}

size_t scene_state_area_lights(const struct scene_state *state)
{
    size_t count = 0;
    for (size_t i = 0; i < state->light_count; i++)
        count += state_light_is_area(&state->lights[i]);
    return count;
}

void scene_state_finish(struct scene_state *state)
{
    free(state->world);
    free(state->is_visible);
    free(state->materials);
    free(state->file_lights);
    free(state->cameras);
    free(state->variant_materials);
    state_caps_finish(&state->caps);
    deforms_finish(&state->deforms);
    free(state->items);
    state_grids_finish(state);
    free(state->lights);
    *state = (struct scene_state){0};
}
