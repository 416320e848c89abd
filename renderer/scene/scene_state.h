/* SPDX-License-Identifier: MIT */
/* A scene as one view sees it: overrides applied, matrices composed, lights placed, drawables
 * listed. CPU only, f64. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_SCENE_STATE_H
#define VITRAIL_RENDERER_SCENE_SCENE_STATE_H

#include "renderer/scene/deform.h"
#include "renderer/scene/scene.h"
#include "renderer/scene/state_grids.h"
#include "renderer/view.h"

enum state_class {
    STATE_OPAQUE,      /* blocks light and view completely */
    STATE_MASKED,      /* blocks where its alpha reaches the cutoff */
    STATE_TRANSPARENT, /* lets filtered light through: BLEND, or transmission > 0 */
};

/* What a transmissive surface does to the direction of what the camera sees through it
 * (docs/explanation/shading.md, section 8). */
enum state_bend {
    STATE_BEND_NONE,  /* straight through */
    STATE_BEND_THIN,  /* a thin wall that scatters: it is rough */
    STATE_BEND_SLAB,  /* an open surface with a thickness: it shifts */
    STATE_BEND_SOLID, /* a side of a closed volume: it refracts */
};

/* Smoother surfaces count as smooth: their directions spread by less than 0.3 degrees. */
#define STATE_BEND_ROUGHNESS_LEAST 0.07f /* as shaders have it: shaders/shared/records.h */

struct state_item { /* one primitive of one visible node */
    uint32_t node, primitive, material;
    enum state_class class_;
    bool is_mirrored;   /* negative determinant: front faces wind clockwise */
    float length_scale; /* world over model lengths: cube root of the determinant's size */
    bool casts_shadow;  /* triangles only; points and lines cast none */
    bool is_medium;     /* its inside attenuates with the material's sigma, its surface is a
                           filter without thickness (docs/explanation/shading.md, 1) */
    enum state_bend bend;
    double center[3], radius_m; /* world bounding sphere */
    double bounds_min[3], bounds_max[3];
    bool is_ground;       /* the ground plane: no object, and no light meets it on its way */
    uint32_t cap;         /* 1 + index of state->caps for what closes a cut and for the ground
                             plane; else 0 */
    uint32_t deformed;    /* 1 + index of state->deforms for vertices in a pose; else 0 */
    uint64_t shadow_hash; /* of all that decides its shadow: matrix, primitive, pose, filter factors
                             and textures */
};

struct state_light {
    enum scene_light_type type;
    double position[3], direction[3]; /* world; unit */
    double up[3];                     /* world: +Y of its node or its own, of any length; all 0
                                         for none */
    float color[3];                   /* tint * intensity [cd, lx or nt] */
    float range;                      /* 0 = unbounded */
    float inner_cone_rad, outer_cone_rad;
    bool casts_shadow;
    int32_t node;                /* index of the scene's node, or -1 */
    double half_u[3], half_v[3]; /* rect: half its sides; disk: two radii; world, normal to
                                    direction */
    double area_m2;              /* rect and disk, else 0 */
};

static inline bool state_light_is_area(const struct state_light *light)
{
    return light->type == SCENE_LIGHT_RECT || light->type == SCENE_LIGHT_DISK;
}

struct state_material {
    struct scene_material base; /* with overrides */
    double sigma[3];            /* extinction of the inside [1/m], world lengths; finite, >= 0 */
    bool no_self_shadow, cast_once;
    bool catches_shadows; /* the ground plane's */
};

struct state_cap {                    /* a cut surface, or the ground: a mesh of its own */
    struct scene_primitive primitive; /* of the arrays of state_caps */
    double world[16];                 /* world from its vertices: a shift */
    uint32_t source_material;         /* index in the scene */
};

struct state_caps {         /* zeroed: none */
    struct state_cap *caps; /* owned */
    size_t count;
    float *positions, *normals; /* owned */
    uint32_t *indices;          /* owned */
    uint32_t vertex_count;      /* and of indices */
    uint64_t serial;            /* of this cut, no other has it; 0: none was made */
};

struct state_ground_plane { /* zeroed: none */
    bool is_there;
    double center[3]; /* of what there is of it, world */
    double whole_m;   /* from there to where shadows begin to fade */
    double reach_m;   /* and to its end */
};

struct scene_state {
    const struct scene *scene;
    double (*world)[16];              /* per node, world_from_node */
    bool *is_visible;                 /* per node */
    struct state_material *materials; /* per material */
    struct scene_light *file_lights;  /* as an animation has them; NULL: as the scene has them */
    struct scene_camera *cameras;     /* likewise */
    uint32_t *variant_materials;      /* per primitive, under the view's variant; NULL: its own */
    struct state_item *items;         /* node order, then primitive order */
    size_t item_count;
    size_t whole_count; /* items before the first cap */
    struct state_caps caps;
    struct state_ground_plane ground_plane;
    struct state_deforms deforms;
    uint32_t material_count;    /* the scene's, then one for each cap and for the ground */
    size_t open_section_count;  /* meshes that a plane cuts and that cannot be capped: not closed */
    size_t medium_count;        /* items that are media */
    size_t open_volume_count;   /* items that would be if their surface were closed */
    struct state_light *lights; /* scene lights in node order, then those of the view */
    size_t light_count;
    struct state_grid *grids; /* of visible nodes, in node order */
    size_t grid_count;
    bool has_idle_animation; /* animated, and no mesh, joint, light or camera hangs on a moved node
                              */
    bool has_default_lights; /* neither scene nor view brought a light: the studio's */
    bool has_environment;
    float sky[3], ground[3];             /* nt */
    double bounds_min[3], bounds_max[3]; /* world, of all items but caps and the ground, and of
                                            grids; min > max when empty */
    double shadow_planes[VIEW_CLIP_PLANES_MAX][4]; /* clip planes that let light in, world */
    size_t shadow_plane_count;
    double unit_m; /* size of the largest primitive, hidden ones too: grows with the scene, does
                      not know how it is turned and placed; > 0 */
};

/* Errors: ERROR_NOT_FOUND naming an unknown node, material or variant; ERROR_INVALID_REQUEST for a
 * degenerate matrix. */
MUST_CHECK bool scene_state_init(struct scene_state *state, const struct scene *scene,
                                 const struct view *view, struct error *err);
void scene_state_finish(struct scene_state *state);              /* the scene may be gone */
size_t scene_state_area_lights(const struct scene_state *state); /* their number */

/* Takes the clip planes of another view, which is otherwise equal. ERROR_INVALID_REQUEST where
 * there are too many. */
MUST_CHECK bool scene_state_cut(struct scene_state *state, const struct view *view,
                                struct error *err);

/* Rays meet it: triangles. */
static inline bool state_item_is_traced(const struct state_item *item)
{
    return item->casts_shadow || item->is_ground;
}

/* The mesh that an item is drawn from. Borrowed from the state and its scene. */
struct state_geometry {
    const struct scene_primitive *primitive;
    const float *positions, *normals; /* of all vertices, the primitive's from its first on */
    const float *tangents;            /* likewise; NULL: none */
    const uint32_t *indices;          /* likewise */
    const double *world;              /* 4 x 4 */
};
static inline struct state_geometry state_geometry_of(const struct scene_state *state,
                                                      const struct state_item *item)
{
    const struct scene_primitive *p = &state->scene->primitives[item->primitive];
    const struct scene *from = scene_of_primitive(state->scene, p);
    if (item->cap) {
        const struct state_cap *cap = &state->caps.caps[item->cap - 1];
        return (struct state_geometry){.primitive = &cap->primitive,
                                       .positions = state->caps.positions,
                                       .normals = state->caps.normals,
                                       .indices = state->caps.indices,
                                       .world = cap->world};
    }
    if (item->deformed) {
        const struct state_deforms *deforms = &state->deforms;
        const struct state_deformed *deformed = &deforms->items[item->deformed - 1];
        return (struct state_geometry){.primitive = &deformed->primitive,
                                       .positions = deforms->positions,
                                       .normals = deforms->normals,
                                       .tangents = deforms->tangents,
                                       .indices = from->indices,
                                       .world = deformed->world};
    }
    return (struct state_geometry){.primitive = p,
                                   .positions = from->positions,
                                   .normals = from->normals,
                                   .tangents = from->tangents,
                                   .indices = from->indices,
                                   .world = state->world[item->node]};
}

/* The position of a vertex of the primitive, and the vertex of one of its indices. */
void state_geometry_point(const struct state_geometry *geometry, size_t vertex, double world[3]);
void state_geometry_corner(const struct state_geometry *geometry, size_t index, double world[3]);

/* How a box lies to clip planes: bits of those that run through it. False where one of them cuts
 * all of it away. */
bool state_planes_meet(const double (*planes)[4], size_t count, const double bounds_min[3],
                       const double bounds_max[3], uint32_t *through);

/* Of a surface that is not closed. */
enum state_bend state_bend_of(const struct scene_material *material);

/* What transmission makes of a roughness: nothing is scattered by an index of 1. As in the sample
 * code of KHR_materials_volume (Khronos), all is from 1.5 on. */
static inline double state_bend_roughness(double ior, double roughness)
{
    double share = 2 * ior - 2;
    return roughness * (share < 0 ? 0 : share > 1 ? 1 : share);
}

enum state_class material_class(const struct scene_material *material);

#endif
