/* SPDX-License-Identifier: MIT */
/* What a scene holds, as GET /v1/scenes/{id} tells it. Thread: any. */
#ifndef VITRAIL_PROTOCOL_SCENE_SUMMARY_H
#define VITRAIL_PROTOCOL_SCENE_SUMMARY_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/scene_format.h"
#include "protocol/scene_outline.h"

enum { SCENE_SUMMARY_NAMES_MAX = 4096 /* of each list; the count beside it is the true one */ };

/* An owned list of owned strings. Zeroed = empty. */
struct name_list {
    char **names;
    size_t count;
};
/* Copies the name. */
MUST_CHECK bool name_list_add(struct name_list *list, const char *name, struct error *err);
void name_list_finish(struct name_list *list);

/* A light or a camera: what it is called and which kind it is. */
struct summary_item {
    char *name;       /* owned */
    const char *type; /* static: directional point spot | perspective orthographic */
};

struct summary_animation {
    char *name;        /* owned */
    double duration_s; /* time of its last key */
};

/* Zeroed = empty; scene_summary_finish frees everything. */
struct scene_summary {
    char id[65];
    char *name;         /* owned; as uploaded, NULL = none */
    uint64_t triangles; /* over all nodes, instances counted each time */
    uint64_t vertices, nodes, meshes, primitives, textures, images;
    /* May be more than the lists hold. */
    uint64_t material_count, light_count, camera_count, animation_count;
    struct name_list materials, node_names;
    struct name_list file_scenes; /* of the file, in its order; "" without a name */
    struct name_list variants;    /* of materials */
    uint64_t variant_count;       /* may be more than the list holds */
    struct name_list grids;       /* density grids; "" without a name */
    uint64_t grid_count;          /* may be more than the list holds */
    uint64_t file_scene_count;    /* may be more than the list holds */
    uint64_t file_scene;          /* which of them is shown, where there are any */
    struct summary_item *lights;  /* owned; light_list_count of them */
    size_t light_list_count;
    struct summary_item *cameras; /* owned */
    size_t camera_list_count;
    struct summary_animation *animations; /* owned */
    size_t animation_list_count;
    bool has_bounds;                     /* false: no geometry, bounds is null */
    double bounds_min[3], bounds_max[3]; /* world [m] */
    uint64_t upload_bytes, decoded_bytes;
    struct scene_origin source; /* written where its unit_m is above 0: older summaries have none */
    struct name_list extensions_used, extensions_ignored, warnings;
    int64_t created_unix_s;       /* written as RFC 3339, UTC */
    struct scene_outline outline; /* served by a route of its own */
};

/* type is matched against the names above; an unknown one is refused. */
MUST_CHECK bool scene_summary_add_light(struct scene_summary *summary, const char *name,
                                        const char *type, struct error *err);
MUST_CHECK bool scene_summary_add_camera(struct scene_summary *summary, const char *name,
                                         const char *type, struct error *err);
MUST_CHECK bool scene_summary_add_animation(struct scene_summary *summary, const char *name,
                                            double duration_s, struct error *err);
/* One more scene of the file; beyond SCENE_SUMMARY_NAMES_MAX its name is left out. */
MUST_CHECK bool scene_summary_add_file_scene(struct scene_summary *summary, const char *name,
                                             bool is_shown, struct error *err);
/* What a scene may be called: 1 to LIMIT_FILE_NAME_BYTES bytes of UTF-8 without control
 * characters; else ERROR_INVALID_REQUEST. */
MUST_CHECK bool scene_name_check(const char *name, struct error *err);
void scene_summary_finish(struct scene_summary *summary); /* accepts zeroed; zeroes */

/* A new reference, or malloc'ed text; NULL only when memory runs out. */
MUST_CHECK json_t *scene_summary_to_json(const struct scene_summary *summary);
MUST_CHECK char *scene_summary_to_json_text(const struct scene_summary *summary);

/* Reads what scene_summary_to_json writes; unknown members are passed over. On failure the summary
 * is zeroed. */
MUST_CHECK bool scene_summary_from_json_text(const char *json, size_t length,
                                             struct scene_summary *summary, struct error *err);

#endif
