/* SPDX-License-Identifier: MIT */
/* What of a scene can be edited, with the values it came with, as GET /v1/scenes/{id}/outline tells
 * it: the words are those of requests, so that a value can be copied into one. Thread: any. */
#ifndef VITRAIL_PROTOCOL_SCENE_OUTLINE_H
#define VITRAIL_PROTOCOL_SCENE_OUTLINE_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#include "protocol/lobe_members.h"
#include "protocol/error.h"

enum {
    SCENE_OUTLINE_NODES_MAX = 131072,    /* assemblies of 100,000 parts; more are cut */
    SCENE_OUTLINE_NAMES_BYTES = 8 << 20, /* of all nodes together; the list is cut there */
    SCENE_OUTLINE_ITEMS_MAX = 4096,      /* of each other list; longer ones are cut */
    SCENE_OUTLINE_NODE_MATERIALS_MAX = 8 /* of one node; more are left out */
};

/* Names are owned; an index counts nodes or materials in the order of the file. */
struct outline_node {
    char *name;
    int parent; /* -1 = root; always of a node before it */
    int materials[SCENE_OUTLINE_NODE_MATERIALS_MAX], material_count;
    bool has_bounds;   /* false: no geometry of its own */
    double bounds[6];  /* world [m] at rest: least x y z, greatest x y z */
    double matrix[16]; /* parent from node, column-major; the identity is not written */
    bool is_hidden;    /* in the file, as "visible": false; written only then */
};

struct outline_material { /* members as of overrides.materials; factors without their textures */
    char *name;
    double base_color[4], emissive[3], attenuation_color[3];
    double metallic, roughness, transmission, ior, thickness;
    double attenuation_distance; /* m; 0 = infinite, not written */
    int alpha_mode;              /* as request_alpha_mode_name */
    struct lobe_members lobes;   /* those that the material has */
};

struct outline_grid { /* members as of overrides.grids */
    char *name;
    double density; /* 1/m */
    double extinction[3], color[3];
    double anisotropy;
};

struct outline_light { /* members as of lights, placed in the world */
    char *name;
    int node;
    int type; /* as request_light_type_name */
    double position[3], direction[3], color[3];
    double up[3]; /* world: +Y of its node, unit; 0 = none, not written */
    double intensity, range, inner_cone_deg, outer_cone_deg;
};

struct outline_camera { /* members as of camera */
    char *name;
    int node;
    double matrix[16];              /* world from camera */
    double fov_y_deg, ortho_height; /* one of them is 0 and not written */
    double aspect; /* width over height of what the file's camera shows; 0 = none, not written */
};

/* Zeroed = empty; scene_outline_finish frees everything. Arrays are owned. */
struct scene_outline {
    struct outline_node *nodes;
    struct outline_material *materials;
    struct outline_grid *grids;
    struct outline_light *lights;
    struct outline_camera *cameras;
    size_t node_count, material_count, grid_count, light_count, camera_count;
};

/* Room for one more at the end of a list, zeroed but for its copied name. NULL with err set: no
 * memory, or the list is full (which its caller has to see to). */
struct outline_node *scene_outline_add_node(struct scene_outline *outline, const char *name,
                                            struct error *err);
struct outline_material *scene_outline_add_material(struct scene_outline *outline, const char *name,
                                                    struct error *err);
struct outline_grid *scene_outline_add_grid(struct scene_outline *outline, const char *name,
                                            struct error *err);
struct outline_light *scene_outline_add_light(struct scene_outline *outline, const char *name,
                                              struct error *err);
struct outline_camera *scene_outline_add_camera(struct scene_outline *outline, const char *name,
                                                struct error *err);
void scene_outline_finish(struct scene_outline *outline); /* accepts zeroed; zeroes */

/* A new reference; NULL only when memory runs out. */
MUST_CHECK json_t *scene_outline_to_json(const struct scene_outline *outline);

struct json_node;
/* Reads what scene_outline_to_json writes; unknown members are passed over, an absent node is an
 * empty outline. On failure the caller finishes it. */
MUST_CHECK bool scene_outline_read(const struct json_node *node, struct scene_outline *outline);

#endif
