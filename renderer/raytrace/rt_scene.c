/* SPDX-License-Identifier: MIT */
/* Embree geometry of a scene state, and the ordered collection of all hits of a ray. */
#include "renderer/raytrace/rt_scene.h"

#include <float.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_packet.h"
#include "renderer/raytrace/rt_surface.h"

bool rt_hits_init(struct rt_hits *hits, struct error *err)
{
    *hits = (struct rt_hits){.hits = malloc((RT_HITS_MAX + 1) * sizeof *hits->hits)};
    return hits->hits || error_set(err, ERROR_NO_MEMORY, "hits of a ray");
}

void rt_hits_finish(struct rt_hits *hits)
{
    free(hits->hits);
    *hits = (struct rt_hits){0};
}

/* Normals go by the cofactor matrix, which is the inverse transpose up to a positive scale and the
 * mirror's sign. */
static void find_normal_matrix(const double m[16], bool is_mirrored, double out[3][3])
{
    double sign = is_mirrored ? -1 : 1;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        for (int c = 0; c < 3; c++) {
            int a = 4 * ((c + 1) % 3), b = 4 * ((c + 2) % 3);
            out[i][c] = sign * (m[a + j] * m[b + k] - m[b + j] * m[a + k]);
        }
    }
}

static void bind_item(const struct rt_scene *scene, struct rt_mesh *mesh,
                      const struct state_item *item, const struct view_quality *quality)
{
    const struct state_geometry geometry = state_geometry_of(scene->state, item);
    const struct state_material *material = &scene->state->materials[item->material];
    const struct scene_material *m = &material->base;
    mesh->item = item;
    mesh->triangles = geometry.indices + geometry.primitive->first_index;
    mesh->class_ = item->class_;
    mesh->is_mirrored = item->is_mirrored;
    mesh->is_medium = item->is_medium;
    mesh->bend = quality->refraction == VIEW_REFRACTION_OFF ? STATE_BEND_NONE : item->bend;
    mesh->is_double_sided = m->flags & SCENE_MATERIAL_DOUBLE_SIDED;
    mesh->is_ground = item->is_ground;
    mesh->material = m;
    mesh->node = item->node;
    mesh->no_self_shadow = material->no_self_shadow;
    mesh->cast_once = material->cast_once;
    mesh->primitive = geometry.primitive;
    mesh->streams = scene_of_primitive(scene->state->scene, mesh->primitive);
    mesh->first_vertex = item->cap ? geometry.primitive->first_vertex
                                   : scene->state->scene->primitives[item->primitive].first_vertex;
    mesh->normals = geometry.normals + 3 * (size_t)geometry.primitive->first_vertex;
    mesh->tangents =
        geometry.tangents ? geometry.tangents + 4 * (size_t)geometry.primitive->first_vertex : NULL;
    mesh->world = geometry.world;
    mesh->local = geometry.positions + 3 * (size_t)geometry.primitive->first_vertex;
    mesh->origin = scene->origin;
    mesh->fits = scene->shapes.of_item && rt_shape_fits(scene->state, item);
    find_normal_matrix(geometry.world, item->is_mirrored, mesh->normal_matrix);
    mesh->slots = rt_surface_sampled_slots(scene->state->scene, m, mesh->primitive);
    mesh->is_bare = rt_surface_is_bare(mesh);
    mesh->is_plain = rt_surface_is_plain(mesh);
    mesh->is_filter_plain = rt_surface_plain_filter(mesh, quality->blend_filter, mesh->filter);
    mesh->is_sheet = mesh->is_filter_plain && m->alpha_mode != SCENE_MASK && !mesh->is_medium &&
                     !mesh->is_ground && !mesh->cast_once && mesh->bend == STATE_BEND_NONE;
}

/* FNV-1a by words: of the geometry alone, so that a change of colours keeps it. */
static uint64_t hash_words(uint64_t hash, const void *bytes, size_t size)
{
    const unsigned char *p = bytes;
    for (size_t i = 0; i + 8 <= size; i += 8) {
        uint64_t word;
        memcpy(&word, p + i, sizeof word);
        hash = (hash ^ word) * 0x100000001b3ull;
        hash ^= hash >> 29;
    }
    return hash;
}

/* Of what there is, wherever it stands. */
static uint64_t structure_key(const struct scene_state *state)
{
    uint64_t hash = hash_words(0xcbf29ce484222325ull, &state->scene->indices, sizeof(uint32_t *));
    const uint64_t images = state->scene->image_count; /* hidden parts have some, too */
    hash = hash_words(hash, &images, sizeof images);
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        const uint64_t words[2] = {(uint64_t)item->node << 32 | item->primitive,
                                   (uint64_t)item->class_ << 1 | item->casts_shadow};
        hash = hash_words(hash, words, sizeof words);
        if (state->scene->part_count) {
            uint32_t part = state->scene->primitives[item->primitive].part;
            hash = hash_words(hash, &state->scene->parts[part].identity, sizeof(uint64_t));
        }
        if (item->cap)
            hash = hash_words(hash, &item->shadow_hash, sizeof item->shadow_hash);
    }
    return hash;
}

/* Of where an item's vertices are. */
static uint64_t place_key(const struct scene_state *state, const struct state_item *item)
{
    uint64_t hash = hash_words(0xcbf29ce484222325ull, state_geometry_of(state, item).world,
                               sizeof *state->world);
    if (item->deformed)
        hash = hash_words(hash, &state->deforms.items[item->deformed - 1].pose,
                          sizeof(struct content_key));
    return hash;
}

static uint64_t geometry_key(const struct scene_state *state)
{
    uint64_t hash = structure_key(state);
    for (size_t i = 0; i < state->item_count; i++) {
        uint64_t place = place_key(state, &state->items[i]);
        hash = hash_words(hash, &place, sizeof place);
    }
    return hash;
}

static void place_vertices(const struct rt_scene *scene, struct rt_mesh *mesh,
                           const struct state_geometry *from, float *vertices)
{
    for (uint32_t i = 0; i < from->primitive->vertex_count; i++) {
        double world[3];
        state_geometry_point(from, i, world);
        vec3_sub(world, scene->origin, mesh->positions[i]);
        for (int k = 0; k < 3; k++)
            vertices[3 * i + (uint32_t)k] = (float)mesh->positions[i][k];
    }
}

static bool add_instance(struct rt_scene *scene, const struct state_item *item, size_t shape,
                         const struct view_quality *quality, struct error *err)
{
    struct rt_mesh *mesh = &scene->meshes[scene->mesh_count++];
    bind_item(scene, mesh, item, quality);
    mesh->place = place_key(scene->state, item);
    RTCScene shared =
        rt_shape_take(&scene->shapes, shape, scene->device, scene->state, item, rt_packet_filter);
    if (!shared)
        return error_set(err, ERROR_NO_MEMORY, "ray tracing %u vertices",
                         mesh->primitive->vertex_count);
    RTCGeometry instance = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, shared);
    rt_shape_place(instance, mesh->world, scene->origin);
    rtcCommitGeometry(instance);
    rtcAttachGeometryByID(scene->scene, instance, (unsigned)(scene->mesh_count - 1));
    rtcReleaseGeometry(instance);
    return true;
}

static bool add_own_mesh(struct rt_scene *scene, const struct state_item *item,
                         const struct view_quality *quality, struct error *err)
{
    const struct state_geometry from = state_geometry_of(scene->state, item);
    const struct scene_primitive *p = from.primitive;
    struct rt_mesh *mesh = &scene->meshes[scene->mesh_count];
    mesh->positions = calloc(p->vertex_count, sizeof *mesh->positions);
    RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                              RTC_FORMAT_FLOAT3, 12, p->vertex_count);
    uint32_t *indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                                RTC_FORMAT_UINT3, 12, p->index_count / 3);
    scene->mesh_count++;
    scene->vertex_bytes += p->vertex_count * sizeof *mesh->positions;
    bind_item(scene, mesh, item, quality);
    if (!mesh->positions || !vertices || !indices) {
        rtcReleaseGeometry(geometry);
        return error_set(err, ERROR_NO_MEMORY, "ray tracing %u vertices", p->vertex_count);
    }
    place_vertices(scene, mesh, &from, vertices);
    mesh->place = place_key(scene->state, item);
    memcpy(indices, from.indices + p->first_index, (size_t)p->index_count / 3 * 12);
    if (item->class_ != STATE_OPAQUE) { /* rays in packets stop at opaque ones by themselves */
        rtcSetGeometryIntersectFilterFunction(geometry, rt_packet_filter);
        rtcSetGeometryOccludedFilterFunction(geometry, rt_packet_filter);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene->scene, geometry, (unsigned)(scene->mesh_count - 1));
    rtcReleaseGeometry(geometry);
    return true;
}

static bool add_mesh(struct rt_scene *scene, const struct state_item *item,
                     const struct view_quality *quality, struct error *err)
{
    const uint32_t *shapes = scene->shapes.of_item;
    uint32_t shape = shapes ? shapes[item - scene->state->items] : 0;
    return shape ? add_instance(scene, item, shape - 1, quality, err)
                 : add_own_mesh(scene, item, quality, err);
}

static bool add_mask(struct rt_scene *scene, const struct state_item *item, struct error *err)
{
    const struct scene *s = scene->state->scene;
    const struct scene_material *m = &scene->state->materials[item->material].base;
    int32_t texture = m->textures[SCENE_TEXTURE_BASE_COLOR].texture;
    int32_t image = texture < 0 ? -1 : s->textures[texture].image;
    if (item->class_ != STATE_MASKED || image < 0 || scene->masks[image].bounds)
        return true;
    const struct scene_image *from = &s->images[image];
    scene->vertex_bytes +=
        (uint64_t)from->width_px * from->height_px +
        (uint64_t)from->width_px * from->height_px / (RT_MASK_BLOCK * RT_MASK_BLOCK) * 2;
    return rt_mask_init(&scene->masks[image], scene_image_pixels(s, from), from->width_px,
                        from->height_px, err);
}

/* Farther than any two surfaces are apart; of the ground, as far as shadows on it are seen. */
static double find_size(const struct scene_state *state)
{
    const struct state_ground_plane *ground = &state->ground_plane;
    double diagonal[3];
    vec3_sub(state->bounds_max, state->bounds_min, diagonal);
    const double size = 4 * vec3_length(diagonal);
    if (!ground->is_there)
        return size;
    double above = fabs(state->bounds_max[1] - ground->center[1]);
    return fmax(size, hypot(ground->reach_m, above) + vec3_length(diagonal));
}

static void bind_view(struct rt_scene *scene, const struct scene_state *state,
                      const struct view *view)
{
    scene->state = state;
    scene->size_m = find_size(state);
    scene->clip_planes = view->clip_planes;
    scene->clip_plane_count = view->clip_plane_count;
    scene->cuts = view->cuts;
    if (scene->images)
        rt_images_find(state->scene, scene->images);
}

/* Rays that start on a surface, with directions in which it is seen edge on, meet another set of
 * triangles in a hierarchy that was moved than in one that was built, now and then one. Views with
 * such rays trace hierarchies that were built, so that what was kept changes no bit. */
static bool has_bends(const struct scene_state *state, const struct view *view)
{
    if (view->quality.refraction == VIEW_REFRACTION_OFF)
        return false;
    for (size_t i = 0; i < state->item_count; i++)
        if (state->items[i].casts_shadow && state->items[i].bend != STATE_BEND_NONE)
            return true;
    return false;
}

bool rt_scene_rebind(struct rt_scene *scene, const struct scene_state *state,
                     const struct view *view)
{
    if (!scene->scene || scene->key != geometry_key(state) ||
        (scene->is_dynamic && has_bends(state, view)))
        return false;
    bind_view(scene, state, view);
    size_t mesh = 0;
    for (size_t i = 0; i < state->item_count; i++)
        if (state_item_is_traced(&state->items[i]))
            bind_item(scene, &scene->meshes[mesh++], &state->items[i], &view->quality);
    return true;
}

static void find_constants(struct rt_scene *scene, const struct scene_state *state)
{
    double diagonal[3] = {0};
    if (state->bounds_min[0] <= state->bounds_max[0]) {
        vec3_sub(state->bounds_max, state->bounds_min, diagonal);
        for (int k = 0; k < 3; k++)
            scene->origin[k] = 0.5 * (state->bounds_min[k] + state->bounds_max[k]);
    }
    scene->epsilon = 2e-5;
    scene->nudge_m = 1e-6 * 0.5 * vec3_length(diagonal); /* 16 ulp of the outermost vertex */
}

/* Whether the constants of the scene are what they would be if it was built for this state. */
static bool has_same_constants(const struct rt_scene *scene, const struct scene_state *state)
{
    struct rt_scene wanted = {.nudge_m = 0};
    find_constants(&wanted, state);
    return wanted.nudge_m == scene->nudge_m && wanted.origin[0] == scene->origin[0] &&
           wanted.origin[1] == scene->origin[1] && wanted.origin[2] == scene->origin[2];
}

/* Where it is elsewhere than before. */
static void move_mesh(struct rt_scene *scene, const struct state_item *item, unsigned id)
{
    struct rt_mesh *mesh = &scene->meshes[id];
    uint64_t place = place_key(scene->state, item);
    if (place == mesh->place)
        return;
    RTCGeometry geometry = rtcGetGeometry(scene->scene, id);
    if (mesh->positions) {
        const struct state_geometry from = state_geometry_of(scene->state, item);
        place_vertices(scene, mesh, &from,
                       rtcGetGeometryBufferData(geometry, RTC_BUFFER_TYPE_VERTEX, 0));
        rtcUpdateGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0);
    } else {
        rt_shape_place(geometry, mesh->world, scene->origin);
    }
    rtcCommitGeometry(geometry);
    mesh->place = place;
}

bool rt_scene_move(struct rt_scene *scene, const struct scene_state *state, const struct view *view)
{
    if (!scene->scene || scene->structure != structure_key(state) ||
        !has_same_constants(scene, state) || has_bends(state, view))
        return false;
    bind_view(scene, state, view);
    if (!scene->is_dynamic) { /* from now on each mesh has a hierarchy of its own, which stays */
        rtcSetSceneBuildQuality(scene->scene, RTC_BUILD_QUALITY_LOW);
        rtcSetSceneFlags(scene->scene,
                         RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC | EMBREE_SCENE_FILTERS);
    }
    scene->is_dynamic = true;
    scene->key = 0; /* until all is in its place */
    unsigned id = 0;
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        if (!state_item_is_traced(item))
            continue;
        struct rt_mesh *mesh = &scene->meshes[id];
        bool fitted = mesh->fits;
        bind_item(scene, mesh, item, &view->quality);
        if (mesh->fits != fitted) /* a new scene would share otherwise */
            return false;
        move_mesh(scene, item, id++);
    }
    rtcCommitScene(scene->scene);
    if (rtcGetDeviceError(scene->device) != RTC_ERROR_NONE)
        return false;
    scene->key = geometry_key(state);
    return true;
}

void rt_scene_withhold(struct rt_scene *scene, const uint8_t *texture_levels)
{
    rt_images_withhold(scene->images, scene->state->scene->image_count, texture_levels);
}

uint64_t rt_scene_size_bytes(const struct rt_scene *scene)
{
    return scene->scene ? (uint64_t)atomic_load(&scene->embree_bytes) + scene->vertex_bytes : 0;
}

static bool count_memory(void *scene, ssize_t bytes, bool is_after)
{
    (void)is_after;
    atomic_fetch_add(&((struct rt_scene *)scene)->embree_bytes, bytes);
    return true;
}

bool rt_scene_init(struct rt_scene *scene, const struct scene_state *state, const struct view *view,
                   struct error *err)
{
    *scene = (struct rt_scene){.key = geometry_key(state), .structure = structure_key(state)};
    scene->images = calloc(state->scene->image_count + 1, sizeof *scene->images);
    bind_view(scene, state, view);
    find_constants(scene, state);
    rt_texel_tables_fill(&scene->tables);
    scene->meshes = calloc(state->item_count + 1, sizeof *scene->meshes);
    scene->device = rtcNewDevice("threads=1");
    scene->mask_count = state->scene->image_count;
    scene->masks = calloc(scene->mask_count + 1, sizeof *scene->masks);
    if (!scene->meshes || !scene->images || !scene->masks || !scene->device) {
        error_set(err, ERROR_NO_MEMORY, "ray tracing %zu drawables", state->item_count);
        goto fail;
    }
    if (!rt_shapes_init(&scene->shapes, state, err))
        goto fail;
    rtcSetDeviceMemoryMonitorFunction(scene->device, count_memory, scene);
    scene->lanes =
        rtcGetDeviceProperty(scene->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)  ? 16
        : rtcGetDeviceProperty(scene->device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? 8
                                                                                         : 1;
    scene->scene = rtcNewScene(scene->device);
    rtcSetSceneFlags(scene->scene, RTC_SCENE_FLAG_ROBUST | EMBREE_SCENE_FILTERS);
    rtcSetSceneBuildQuality(scene->scene, RTC_BUILD_QUALITY_MEDIUM); /* no spatial splits */
    for (size_t i = 0; i < state->item_count; i++)
        if (state_item_is_traced(&state->items[i]) &&
            (!add_mesh(scene, &state->items[i], &view->quality, err) ||
             !add_mask(scene, &state->items[i], err)))
            goto fail;
    rtcCommitScene(scene->scene);
    if (rtcGetDeviceError(scene->device) != RTC_ERROR_NONE) {
        error_set(err, ERROR_NO_MEMORY, "Embree cannot build a scene of %zu drawables",
                  scene->mesh_count);
        goto fail;
    }
    return true;

fail:
    rt_scene_finish(scene);
    return false;
}

void rt_scene_finish(struct rt_scene *scene)
{
    if (scene->scene)
        rtcReleaseScene(scene->scene);
    rt_shapes_finish(&scene->shapes);
    if (scene->device)
        rtcReleaseDevice(scene->device);
    for (size_t i = 0; scene->meshes && i < scene->mesh_count; i++)
        free(scene->meshes[i].positions);
    free(scene->meshes);
    for (size_t i = 0; scene->masks && i < scene->mask_count; i++)
        rt_mask_finish(&scene->masks[i]);
    free(scene->masks);
    free(scene->images);
    *scene = (struct rt_scene){0};
}

/* Moeller and Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection", in f64 and without
 * its edge tests: inside or outside is Embree's decision, whose tests are watertight; f64 ones on
 * their own would leave cracks. False for a triangle seen edge-on. */
static bool refine_hit(const struct rt_mesh *mesh, const struct rt_ray *ray, struct rt_hit *hit)
{
    double room[3][3], e1[3], e2[3], across[3], from[3], q[3];
    const double *v[3];
    rt_mesh_corners(mesh, hit->triangle, room, v);
    vec3_sub(v[1], v[0], e1);
    vec3_sub(v[2], v[0], e2);
    vec3_sub(ray->origin, v[0], from);
    vec3_cross(ray->direction, e2, across);
    double det = vec3_dot(e1, across); /* the normal against the ray, times its length */
    if (!(fabs(det) > DBL_MIN))        /* its inverse is finite */
        return false;
    double inverse = 1 / det;
    vec3_cross(from, e1, q);
    hit->t = vec3_dot(e2, q) * inverse;
    hit->u = vec3_dot(from, across) * inverse;
    hit->v = vec3_dot(ray->direction, q) * inverse;
    hit->is_front = (det > 0) != mesh->is_mirrored;
    return true;
}

void rt_scene_normal(const struct rt_scene *scene, const struct rt_hit *hit, double normal[3])
{
    const struct rt_mesh *mesh = &scene->meshes[hit->mesh];
    double room[3][3], e1[3], e2[3];
    const double *v[3];
    rt_mesh_corners(mesh, hit->triangle, room, v);
    vec3_sub(v[1], v[0], e1);
    vec3_sub(v[2], v[0], e2);
    vec3_cross(e1, e2, normal);
    double length = vec3_length(normal);
    double scale = length > 0 ? (mesh->is_mirrored ? -1 : 1) / length : 0;
    for (int k = 0; k < 3; k++)
        normal[k] *= scale;
}

/* Whether the plane counts for the ray. */
static bool cuts(const struct rt_scene *scene, const struct rt_ray *ray, size_t plane)
{
    return ray->culls_back_faces || !scene->cuts || !scene->cuts[plane].spares_shadows;
}

static double height_above(const struct rt_scene *scene, size_t plane, const double point[3])
{
    const double *p = scene->clip_planes[plane];
    return p[3] + p[0] * (point[0] + scene->origin[0]) + p[1] * (point[1] + scene->origin[1]) +
           p[2] * (point[2] + scene->origin[2]);
}

void rt_scene_kept_range(const struct rt_scene *scene, const struct rt_ray *ray, double range[2])
{
    range[0] = -INFINITY;
    range[1] = INFINITY;
    for (size_t i = 0; i < scene->clip_plane_count; i++) {
        if (!cuts(scene, ray, i))
            continue;
        double height = height_above(scene, i, ray->origin);
        double climb = vec3_dot(scene->clip_planes[i], ray->direction);
        double at = climb != 0 ? -height / climb : height < 0 ? INFINITY : -INFINITY;
        if (climb < 0)
            range[1] = fmin(range[1], at);
        else
            range[0] = fmax(range[0], at);
    }
    range[1] = fmax(range[0], range[1]);
}

static bool is_clipped(const struct rt_scene *scene, const struct rt_ray *ray, double t)
{
    double point[3];
    for (int k = 0; k < 3; k++)
        point[k] = ray->origin[k] + ray->direction[k] * t;
    for (size_t i = 0; i < scene->clip_plane_count; i++)
        if (cuts(scene, ray, i) && height_above(scene, i, point) < 0)
            return true;
    return false;
}

struct collect_context {
    struct embree_context embree; /* first: filters are handed it */
    const struct rt_scene *scene;
    const struct rt_ray *ray;
    struct rt_hits *hits;
};

static bool is_drawn(const struct rt_mesh *mesh, const struct rt_ray *ray, const struct rt_hit *hit)
{
    return !ray->culls_back_faces || hit->is_front || mesh->is_double_sided;
}

/* Opaque, or a solid place of a mask. */
static bool ends_rays(const struct rt_scene *scene, const struct rt_mesh *mesh,
                      const struct rt_hit *hit)
{
    return mesh->class_ == STATE_OPAQUE ||
           (mesh->class_ == STATE_MASKED && rt_surface_is_solid(scene, hit));
}

/* Of a mask that transmits. The borders of media are crossed there, too, or they would not close.
 */
static bool is_in_hole(const struct rt_scene *scene, const struct rt_mesh *mesh,
                       const struct rt_hit *hit)
{
    return mesh->class_ == STATE_TRANSPARENT && mesh->material->alpha_mode == SCENE_MASK &&
           !mesh->is_medium && !rt_surface_is_solid(scene, hit);
}

bool rt_scene_add_hit(const struct rt_scene *scene, const struct rt_ray *ray, uint32_t mesh,
                      uint32_t triangle, struct rt_hits *hits)
{
    const struct rt_mesh *m = &scene->meshes[mesh];
    if (mesh == ray->skip_mesh && triangle == ray->skip_triangle)
        return false;
    if ((ray->only_media && !m->is_medium) || (m->is_ground && !ray->culls_back_faces))
        return false;
    struct rt_hit *hit = &hits->hits[hits->count]; /* filled in its place */
    hit->mesh = mesh;
    hit->triangle = triangle;
    if (!refine_hit(m, ray, hit) || hit->t <= 0 || hit->t >= ray->t_max ||
        is_in_hole(scene, m, hit))
        return false;
    /* a medium entered before the camera's near plane is entered all the same */
    if (hit->t <= ray->t_min && (ray->is_bent || !(m->is_medium && ray->culls_back_faces)))
        return false;
    bool is_cut = ray->only_media || hit->t <= ray->t_min ||
                  (scene->clip_plane_count && !m->item->cap && is_clipped(scene, ray, hit->t));
    hit->is_hidden = is_cut || !is_drawn(m, ray, hit);
    hit->is_left_unseen = hit->is_hidden && !is_cut;
    if (hit->is_hidden && !m->is_medium && !(hit->is_left_unseen && m->bend == STATE_BEND_SOLID))
        return false;
    if (hits->count == RT_HITS_MAX) {
        hits->has_overflowed = true;
        return false;
    }
    hit->is_opaque = !hit->is_hidden && ends_rays(scene, m, hit);
    hits->count++;
    return hit->is_opaque;
}

/* Rejects every hit after recording it, so that Embree shows them all; an opaque one is accepted,
 * which shortens the ray to it. */
static void on_hit(const struct RTCFilterFunctionNArguments *args)
{
    struct collect_context *context = (struct collect_context *)embree_context_of(args);
    const struct RTCHit *hit = (const struct RTCHit *)args->hit;
    bool ends =
        rt_scene_add_hit(context->scene, context->ray, rt_mesh_of_hit(hit->geomID, hit->instID[0]),
                         hit->primID, context->hits);
    args->valid[0] = ends ? -1 : 0;
}

static int compare_hits(const void *a, const void *b)
{
    const struct rt_hit *x = a, *y = b;
    if (x->t != y->t)
        return x->t < y->t ? -1 : 1;
    if (x->mesh != y->mesh)
        return x->mesh < y->mesh ? -1 : 1;
    return x->triangle < y->triangle ? -1 : x->triangle > y->triangle;
}

/* In a robust scene a ray through an edge meets the triangles on both sides of it. */
static bool is_at_border(const struct rt_hit *hit)
{
    return hit->u < 1e-5 || hit->v < 1e-5 || hit->u + hit->v > 1 - 1e-5;
}

static bool is_same_point(const double a[3], const double b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

static int count_shared_corners(const struct rt_scene *scene, const struct rt_hit *a,
                                const struct rt_hit *b)
{
    double rooms[2][3][3];
    const double *of_a[3], *of_b[3];
    int shared = 0;
    rt_mesh_corners(&scene->meshes[a->mesh], a->triangle, rooms[0], of_a);
    rt_mesh_corners(&scene->meshes[a->mesh], b->triangle, rooms[1], of_b);
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 3; j++)
            shared += is_same_point(of_a[i], of_b[j]);
    return shared;
}

static bool is_same_crossing(const struct rt_scene *scene, const struct rt_hit *a,
                             const struct rt_hit *b)
{
    if (a->mesh != b->mesh || a->is_front != b->is_front)
        return false;
    if (a->triangle == b->triangle)
        return true;
    if (!is_at_border(a) || !is_at_border(b))
        return false;
    int shared = count_shared_corners(scene, a, b);
    return shared == 1 || shared == 2; /* 3: a triangle that the file has twice */
}

/* Of a triangle reported twice both hits have the same t, so that they are neighbours. */
static bool is_known(const struct rt_scene *scene, const struct rt_hits *hits, size_t kept,
                     const struct rt_hit *hit)
{
    size_t first = is_at_border(hit) ? 0 : kept ? kept - 1 : 0;
    for (size_t k = kept; k-- > first;) {
        if (hit->t - hits->hits[k].t > 4 * scene->nudge_m)
            return false;
        if (is_same_crossing(scene, &hits->hits[k], hit))
            return true;
    }
    return false;
}

/* Few hits, as most rays have, are sorted by insertion. */
static void sort_hits(struct rt_hits *hits)
{
    if (hits->count > 16) {
        qsort(hits->hits, hits->count, sizeof *hits->hits, compare_hits);
        return;
    }
    for (size_t i = 1; i < hits->count; i++) {
        struct rt_hit hit = hits->hits[i];
        size_t k = i;
        for (; k && compare_hits(&hits->hits[k - 1], &hit) > 0; k--)
            hits->hits[k] = hits->hits[k - 1];
        hits->hits[k] = hit;
    }
}

void rt_scene_order_hits(const struct rt_scene *scene, struct rt_hits *hits)
{
    if (hits->count <= 1)
        return;
    sort_hits(hits);
    size_t kept = 0;
    for (size_t i = 0; i < hits->count; i++) {
        const struct rt_hit *hit = &hits->hits[i];
        if (is_known(scene, hits, kept, hit))
            continue;
        if (kept != i)
            hits->hits[kept] = *hit;
        if (hits->hits[kept++].is_opaque)
            break;
    }
    hits->count = kept;
}

void rt_scene_collect(const struct rt_scene *scene, const struct rt_ray *ray, struct rt_hits *hits)
{
    struct collect_context context = {.scene = scene, .ray = ray, .hits = hits};
    struct RTCRayHit query = {
        .ray =
            {
                .org_x = (float)ray->origin[0],
                .org_y = (float)ray->origin[1],
                .org_z = (float)ray->origin[2],
                .dir_x = (float)ray->direction[0],
                .dir_y = (float)ray->direction[1],
                .dir_z = (float)ray->direction[2],
                .tnear = 0,
                /* a little beyond, because the f64 test decides */
                .tfar = ray->t_max < (double)FLT_MAX ? (float)(ray->t_max * 1.0001) : FLT_MAX,
                .mask = UINT32_MAX,
            },
        .hit = {.geomID = RTC_INVALID_GEOMETRY_ID},
    };
    hits->count = 0;
    hits->has_overflowed = false;
    embree_context_init(&context.embree);
    context.embree.filter = on_hit;
    embree_intersect1(scene->scene, &context.embree, &query);
    rt_scene_order_hits(scene, hits);
}
