/* SPDX-License-Identifier: MIT */
/* One light's shadow structure, and what is known while it is being built. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_MAP_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_MAP_H

#include "renderer/base/content_key.h"
#include "renderer/draw/scene_gpu.h"
#include "renderer/gl/program_list.h"
#include "renderer/gl/scope.h"
#include "renderer/shadows/shadow_frame.h"
#include "renderer/shadows/shadow_store.h"

struct shadow_method;

struct shadow_ways {    /* how structures are built on a device */
    bool scans_on_host; /* counts of lists are summed in C */
    bool layers_faces;  /* all faces of all lights in one pass */
};

struct shadow_window { /* rows of one face, built by themselves; no rows: all of the map */
    uint32_t face;
    int first_row, row_count;
};

/* A medium around a light that clip planes cut away: it begins at the cut. */
enum { SHADOW_AROUND_MAX = 16 };
struct shadow_around {
    uint32_t item; /* of state->items */
    bool enters;   /* false: its surface winds the other way */
};

struct shadow_map {
    struct content_key key;   /* of all that decides the structure */
    struct content_key scene; /* of the scene's key alone */
    struct shadow_frame frame;
    const struct shadow_method *method; /* of its technique */
    uint32_t flags;                     /* SHADOW_FLAG_* */
    bool is_faithful;                   /* the structure as published */
    bool holds_grids;                   /* density grids cast into its lists */
    bool keeps_exact;                   /* deep lists that were to be compressed, and cannot be */
    int resolution;
    struct shadow_window window;
    double compression;     /* SHADOW_FLAG_NODES: greatest error of a transmittance */
    int prefilter;          /* sub-texel samples per side; 0 and 1: none. Of a map of such samples,
                               too, whose resolution is theirs */
    bool has_media;         /* SHADOW_FLAG_NODES: among its casters */
    uint64_t exact_events;  /* SHADOW_FLAG_NODES: of the lists that were compressed */
    uint32_t built_windows; /* SHADOW_FLAG_NODES: pieces it was built in */
    struct shadow_range depths, heads, events, nodes, texels;
    double planes[VIEW_CLIP_PLANES_MAX][4]; /* world; those that run through some caster */
    uint32_t plane_count;
    double sigma[3]; /* SHADOW_FLAG_MEDIA: extinction where the light stands [1/m] */
    struct shadow_around around[SHADOW_AROUND_MAX]; /* until it is built */
    uint32_t around_count;
    float keys_per_m;               /* of deep lists: shadow_key.glsl */
    double nearest_m, depths_per_m; /* of moments: technique_moments.c */
    bool has_layers;         /* likewise: a ray may cross more than one transparent surface */
    uint32_t light;          /* of the state that it was first made for */
    uint64_t expected_nodes; /* of linked lists: those that a map of the same light had; 0: none */
    uint32_t lock_failures;  /* is_faithful: elements that found no lock; if any, the lists were
                                made again without locks */
    uint32_t layers;         /* of texels, one after the other in their pool; 0 means 1 */
    uint32_t wanted_layers, crossed_meshes; /* of divided casters: shadow_partitions.h */
    uint64_t event_count, longest_list, occupied_texels; /* guessed: the room for them */
    uint64_t guess;      /* of deep lists: number of the guess while sizes are not known; else 0 */
    uint64_t last_frame; /* number of the last frame that used it */
    uint64_t progress;   /* shadow_progress: number of the one that it was built for; 0: none */
};

/* Texels of all faces, or of the window. */
static inline uint64_t shadow_map_texels(const struct shadow_map *map)
{
    uint64_t side = (uint64_t)map->resolution;
    return map->window.row_count ? side * (uint64_t)map->window.row_count
                                 : map->frame.face_count * side * side;
}

/* Elements of the pool of texels. */
static inline uint64_t shadow_map_layered_texels(const struct shadow_map *map)
{
    return shadow_map_texels(map) * (map->layers ? map->layers : 1);
}

struct shadow_casters { /* what one light meets */
    uint32_t *items;    /* indices of state->items, in their order */
    uint8_t *faces;     /* per item: bit f for face f */
    size_t count, capacity;
    size_t opaque_count, transparent_count;
    size_t grid_count;                          /* density grids of the scene */
    uint32_t opaque_planes, transparent_planes; /* bits of state->shadow_planes: those that run
                                                   through casters of either kind */
    double farthest_m;                          /* no event of theirs is deeper */
    bool has_exclusions; /* a transparent caster's material is no_self_shadow or cast_once */
    bool has_layers;     /* a ray may cross more than one transparent surface ... */
    bool has_bodies;     /* ... of one mesh */
    bool has_media;      /* a transparent caster is a medium */
};

struct shadow_build { /* a map that must be built in this frame */
    struct shadow_map *map;
    struct shadow_casters casters;
    uint32_t *partitions;            /* of each caster: shadow_partitions.h; NULL: undivided */
    uint32_t light;                  /* index of state->lights */
    uint32_t target_layer;           /* first of its faces in store->target */
    uint32_t slot;                   /* linked: of the light in the statistics */
    uint32_t lock_tries;             /* linked, as published: of each element */
    bool is_done;                    /* linked: the pool was large enough */
    struct draw_placement placement; /* of the casters, about the frame's origin */
};

struct shadow_grids { /* density grids on the device, as lights/density_grids.glsl reads them */
    const struct gl_texture *records, *bricks, *values;
};

struct shadow_scene { /* what the builders draw */
    const struct scene_gpu *gpu;
    const struct scene_state *state;
    struct draw_arena *arena;
    uint32_t blend_filter;
    struct shadow_grids grids;         /* of maps that hold them */
    const double *eye, (*eye_axes)[3]; /* likewise: the records' space, rows x, y, z */
};

#endif
