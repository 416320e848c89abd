/* SPDX-License-Identifier: MIT */
/* A render request (the body of POST /v1/renders): plain C, and its JSON both ways. Thread: any.
 * The manual for clients is docs/reference/requests.md. Units are in the names: degrees, metres,
 * milliseconds, pixels. */
#ifndef VITRAIL_PROTOCOL_RENDER_REQUEST_H
#define VITRAIL_PROTOCOL_RENDER_REQUEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/lobe_members.h"
#include "protocol/error.h"
#include "protocol/limits.h"
#include "protocol/quality_setting.h"
#include "protocol/shadow_technique.h"
#include "protocol/transparency.h"

enum request_camera_kind {
    REQUEST_CAMERA_DEFAULT, /* the scene's first camera; without one, fit from the front */
    REQUEST_CAMERA_NODE,
    REQUEST_CAMERA_LOOK_AT,
    REQUEST_CAMERA_MATRIX,
    REQUEST_CAMERA_FIT,
};
enum request_fit {
    REQUEST_FIT_FRONT,
    REQUEST_FIT_TOP,
    REQUEST_FIT_RIGHT,
    REQUEST_FIT_ISO,
    REQUEST_FIT_BACK,
    REQUEST_FIT_LEFT,
    REQUEST_FIT_BOTTOM,
    REQUEST_FIT_THREE_QUARTER,
};
enum request_light_type {
    REQUEST_LIGHT_DIRECTIONAL,
    REQUEST_LIGHT_POINT,
    REQUEST_LIGHT_SPOT,
    REQUEST_LIGHT_RECT,
    REQUEST_LIGHT_DISK
};
enum request_alpha_mode { REQUEST_ALPHA_OPAQUE, REQUEST_ALPHA_MASK, REQUEST_ALPHA_BLEND };
enum request_pass_through { REQUEST_PASS_CONSTANT, REQUEST_PASS_SLAB, REQUEST_PASS_EDGE };
enum request_tone_mapping {
    REQUEST_TONE_NEUTRAL,
    REQUEST_TONE_NONE,
    REQUEST_TONE_AGX,
    REQUEST_TONE_ACES
};
enum request_studio { REQUEST_STUDIO_AUTO, REQUEST_STUDIO_ON, REQUEST_STUDIO_OFF };
enum request_light_lists {
    REQUEST_LIGHT_LISTS_AUTO,
    REQUEST_LIGHT_LISTS_CLUSTERED,
    REQUEST_LIGHT_LISTS_LINKED
};
/* What is in the way of an environment map's light in rasterised pictures. */
enum request_visibility { REQUEST_VISIBILITY_NONE, REQUEST_VISIBILITY_RAYS };
enum request_volume_map { REQUEST_VOLUME_LOGARITHMS, REQUEST_VOLUME_FACTORS };
enum request_silhouette_form {
    REQUEST_SILHOUETTE_COMPUTE,
    REQUEST_SILHOUETTE_GEOMETRY,
    REQUEST_SILHOUETTE_TESSELLATION,
    REQUEST_SILHOUETTE_TRIANGLES_TWO_PASS,
    REQUEST_SILHOUETTE_TRIANGLES_ONE_PASS,
    REQUEST_SILHOUETTE_TRIANGLES_GEOMETRY,
    REQUEST_SILHOUETTE_STENCIL
};
enum request_blend_filter {
    REQUEST_BLEND_TINT,
    REQUEST_BLEND_COVERAGE,
    REQUEST_BLEND_KIM,
    REQUEST_BLEND_MODISETT
};
enum request_refraction { REQUEST_REFRACTION_AUTO, REQUEST_REFRACTION_OFF };
enum request_output {
    REQUEST_OUTPUT_COLOR,
    REQUEST_OUTPUT_DEPTH,
    REQUEST_OUTPUT_NORMAL,
    REQUEST_OUTPUT_ALBEDO,
    REQUEST_OUTPUT_NODE,
    REQUEST_OUTPUT_MATERIAL,
    REQUEST_OUTPUT_POSITION,
    REQUEST_OUTPUT_TRANSMITTANCE,
    REQUEST_OUTPUT_LIGHTS,
    REQUEST_OUTPUT_LAYERS,
    REQUEST_OUTPUT_OPTICAL_DEPTH,
    REQUEST_OUTPUT_COUNT
};
enum request_format {
    REQUEST_FORMAT_ANY, /* by the Accept header; PNG when that leaves the choice */
    REQUEST_FORMAT_PNG,
    REQUEST_FORMAT_JPEG,
    REQUEST_FORMAT_WEBP,
    REQUEST_FORMAT_EXR,
    REQUEST_FORMAT_EXR_DEEP, /* OpenEXR of a list of samples per pixel; of the color output */
};

struct request_camera {
    enum request_camera_kind kind;
    char *node;                      /* NODE: owned name, or "#12" for index 12 */
    double eye[3], target[3], up[3]; /* LOOK_AT, world [m]; up all zero = +Y */
    double matrix[16];               /* MATRIX: world_from_camera, column-major, looks along -Z */
    enum request_fit fit;            /* FIT */
    bool is_orthographic;            /* FIT: without perspective, as high as the scene needs */
    double fov_y_deg;                /* [0.001, 179); 0 = 45, or the node's own */
    double ortho_height;             /* m; 0 = perspective */
};

struct request_light {
    enum request_light_type type;
    double position[3];    /* world [m]; the centre of an area light; not of directional ones */
    double direction[3];   /* of travel, not normalised; the side that an area light emits to */
    double color[3];       /* linear, [0, 1] */
    double intensity;      /* cd, lx for directional, nt for rect and disk */
    double range;          /* m; 0 = unbounded */
    double inner_cone_deg; /* half angles of a spot; [0, outer] */
    double outer_cone_deg; /* [0.001, 90]; default 45 */
    double width, height;  /* of a rect [m]; height runs along up */
    double up[3]; /* of a rect, a spot or a sun, across its direction; all zero = +Y, or -Z where it
                     shines up or down */
    double radius; /* of a disk [m] */
    bool casts_no_shadow;
};

struct request_node_override {
    char *node; /* owned */
    bool has_visible, visible;
    bool has_matrix;
    double matrix[16]; /* replaces the local one; column-major, affine, invertible */
};

struct request_grid_override { /* of a density grid */
    char *grid;                /* owned */
    bool has_density;
    double density; /* extinction of a value of 1 [1/m], [0, LIMIT_GRID_FACTOR] */
    bool has_extinction;
    double extinction[3]; /* what each channel takes of that, likewise */
    bool has_color;
    double color[3]; /* linear, [0, 1]: the share of the extinction that scatters */
    bool has_anisotropy;
    double anisotropy; /* [-LIMIT_GRID_ANISOTROPY, LIMIT_GRID_ANISOTROPY] */
};

struct request_material_override {
    char *material; /* owned */
    bool has_base_color;
    double base_color[4];
    bool has_metallic;
    double metallic;
    bool has_roughness;
    double roughness;
    bool has_emissive;
    double emissive[3];
    bool has_transmission;
    double transmission;
    bool has_ior;
    double ior;
    bool has_thickness;
    double thickness;
    bool has_attenuation;
    double attenuation_color[3], attenuation_distance;
    bool has_alpha_mode;
    enum request_alpha_mode alpha_mode;
    bool has_pass_through;
    enum request_pass_through pass_through;
    double edge_color[3], edge_exponent; /* EDGE */
    bool has_self_shadow, self_shadow;
    bool has_cast_once, cast_once;
    struct lobe_members lobes;
};

/* Another scene as a child of a node. */
struct request_part {
    char *name;     /* owned; [1, LIMIT_PART_NAME_BYTES] bytes without '/' */
    char scene[65]; /* as that of the request */
    char *parent;   /* owned; a node of the scene or of another part; NULL = the world */
    bool is_hidden;
    double matrix[16]; /* parent from part; column-major, affine, invertible */
};

/* What a request needs beside its scene. Zeroed = nothing. */
struct request_resources {
    char scenes[LIMIT_PART_SCENES][65]; /* the different ones of its parts */
    int scene_count;
    char environment[65]; /* an environment map, as in struct request_environment */
};

/* The scene at a time of its animations. */
struct request_animation {
    bool is_given;
    char *name;    /* owned; name or "#0"; NULL: all, in file order */
    double time_s; /* [0, 1e9] */
};

/* Defaults: protocol/quality_defaults.h. */
struct request_quality {
    enum shadow_technique shadows;
    enum transparency transparency;
    enum request_light_lists light_lists;
    enum request_blend_filter blend_filter;
    enum request_refraction refraction;
    int shadow_resolution;                         /* texels per side, [1, 16384] */
    int shadow_taps;                               /* 1, 4, 9, 16 or 64 */
    bool says_shadow_resolution, says_shadow_taps; /* said beside max_error or budget_ms, so that
                                                      the server may not choose them */
    int samples; /* per pixel, 1, 4, 8 or 16, raytraced also 64 or 256; 0 = the default, or 1 where
                    the device cannot */
    bool reference; /* ray traced in double precision with every light; shadows AUTO or RAYTRACED */
    int area_samples; /* per area light and point, [1, 4096]; 0 = the default */
    enum request_visibility environment_visibility;
    int environment_samples;   /* towards an environment map per point, [1, 4096]; likewise */
    int atmosphere_samples;    /* slices of haze on the way of a pixel, [1, 4096]; likewise */
    int refraction_samples;    /* directions behind a rough surface, [1, 4096]; likewise */
    double shadow_compression; /* of deep lists: greatest error of a transmittance; [0.001, 0.5];
                                  0 = exact, but with a prefilter 0.001; shadows AUTO or DEEP */
    int shadow_prefilter;      /* of deep lists: rays averaged per side of a texel, [1, 4]; likewise
                                  AUTO or DEEP where it is not 1; default 1 */
    double shadow_fallback;    /* where exact deep lists exceed the budget they are compressed to
                                  this error; [0.001, 0.5]; 0 = refused */
    bool faithful;             /* techniques exactly as published, where they have such a form */
    enum request_volume_map volume_map; /* faithful, shadows VOLUME: what half floats hold */
    enum request_silhouette_form silhouette_form; /* shadows SILHOUETTE: what draws faces */
    double max_error;                             /* [1e-9, 1e6]; 0 = none asked for */
    double budget_ms;                             /* [0.001, 86400000]; 0 = none asked for */
};

/* Light from an environment map. */
#define REQUEST_ENVIRONMENT_STUDIO "studio" /* the one that is built in */
struct request_environment {
    char image[65];      /* 64 lowercase hexadecimal digits, or the above; "": none */
    double rotation_deg; /* about +Y, counter-clockwise from above, [-360, 360]; default 0 */
    double intensity;    /* factor, [0, LIMIT_ENVIRONMENT_INTENSITY]; default 1 */
    bool is_background;  /* it is seen where nothing is */
};

/* What becomes of the cut of a clip plane. */
struct request_cut {
    bool spares_shadows; /* what it cuts away still casts its shadow */
    bool has_cap, has_cap_color;
    double cap_color[3]; /* linear, [0, 1] */
};

/* The outline of nodes, and of all below them. */
struct request_highlight {
    char **nodes; /* owned, and each of them: names, or "#12" */
    size_t node_count;
    double color[3]; /* nt */
    double width_px; /* [0.5, 32]; default 2 */
    double hidden;   /* [0, 1]: opacity where it is hidden; default 0.3 */
};

/* Feature edges. */
struct request_edges {
    bool is_given;
    double crease_deg; /* [0, 180]; default 30 */
    bool omits_borders, omits_silhouettes;
    double color[3]; /* nt */
    double width_px; /* [0.5, 32]; default 1 */
    double hidden;   /* [0, 1]; default 0 */
};

/* A rectangle of the picture, px, its first row on top. */
struct request_tile {
    bool is_given;
    int x, y, width, height; /* within the picture; sides [1, LIMIT_IMAGE_SIDE_PX] */
};

/* A horizontal plane that catches shadows. */
struct request_ground_plane {
    bool is_given, has_height; /* without: just below the scene */
    double height;             /* m, along +Y */
};

/* Haze in all of space. */
struct request_atmosphere {
    bool is_given;
    double density;    /* extinction, 1/m, [0, LIMIT_HAZE_DENSITY]; 0: there is none */
    double color[3];   /* linear, [0, 1]: share of the extinction that scatters; default 1 */
    double anisotropy; /* [-LIMIT_HAZE_ANISOTROPY, LIMIT_HAZE_ANISOTROPY]; default 0 */
    double falloff;    /* m, [0, LIMIT_HAZE_FALLOFF]; 0, the default: as dense at any height */
    double base;       /* m, along +Y: below it the density is even; default 0 */
};

/* Made by render_request_parse or render_request_init_defaults; owns all its strings and arrays. */
struct render_request {
    char scene[65];    /* 64 lowercase hexadecimal digits; "" until it is known */
    int width, height; /* px, [1, LIMIT_IMAGE_SIDE_PX]; with a tile [1, LIMIT_PICTURE_SIDE_PX] */
    struct request_tile tile; /* what of the picture is rendered; not of views */
    struct request_camera camera;
    struct request_light *lights; /* owned, in addition to those of the scene */
    size_t light_count;
    bool ignore_scene_lights;
    enum request_studio studio;          /* AUTO: where neither scene nor request has a light */
    struct request_node_override *nodes; /* owned, sorted by name */
    size_t node_count;
    struct request_material_override *materials; /* owned, sorted by name */
    size_t material_count;
    struct request_grid_override *grids; /* owned, sorted by name */
    size_t grid_count;
    struct request_part *parts; /* owned, sorted by name */
    size_t part_count;
    double clip_planes[8][4];   /* a point with ax+by+cz+d < 0 is cut away */
    struct request_cut cuts[8]; /* per clip plane */
    size_t clip_plane_count;
    struct request_animation animation;
    char *variant; /* owned; of materials: name or "#0"; NULL: as the file has them */
    struct request_ground_plane ground_plane;
    struct request_atmosphere atmosphere;
    struct request_highlight highlight;
    struct request_edges edges;
    double background[4]; /* linear, unassociated alpha */
    double exposure_ev;   /* stops, [-64, 64]; 0 where it is metered */
    bool meters_exposure; /* exposure_ev is "auto" */
    enum request_tone_mapping tone_mapping;
    bool has_environment;
    double sky[3], ground[3]; /* nt */
    struct request_environment environment;
    struct request_quality quality;
    uint32_t outputs; /* bit set of 1u << enum request_output, never empty */
    enum request_format format;
    int quality_percent;   /* of JPEG and WebP, [1, 100]; 0 = 90 */
    bool omits_provenance; /* of the image's file: protocol/provenance.h */
};

/* 1280x720, default camera, scene lights, color. The scene id stays empty. */
void render_request_init_defaults(struct render_request *request);

/* Reads and checks one JSON text. On failure the request is zeroed and err names the member
 * (pointer), what was found and what is allowed. `null` means the same as leaving a member out.
 * Unknown and duplicate members are refused. Several outputs without a format become EXR, the only
 * one that holds them. Canonical texts are read too, so the bound here is
 * LIMIT_CANONICAL_JSON_BYTES; LIMIT_REQUEST_JSON_BYTES is for the HTTP server to enforce. */
MUST_CHECK bool render_request_parse(const char *json, size_t length,
                                     struct render_request *request, struct error *err);

void render_request_finish(struct render_request *request); /* accepts zeroed; zeroes */

/* Whether the server shall choose what quality leaves open, by max_error or budget_ms. */
bool request_quality_asks(const struct request_quality *quality);

/* Puts a setting in the place of what quality leaves open; no target is left. Where exact lists
 * exceed the budget of memory, the error that was asked for is allowed to them, too. */
void request_quality_set(struct request_quality *quality, const struct quality_setting *setting);

/* What a technique of shadows must be able to do for what else the request asks for: enum
 * shadow_can. */
unsigned render_request_needs(const struct render_request *request);

/* Whether these outputs of the request cannot be a deep image, and why, as json_refuse has it. */
enum { DEEP_FAULT_BYTES = 224 };
bool render_request_deep_fault(const struct render_request *request, uint32_t outputs,
                               char why[DEEP_FAULT_BYTES]);

/* False when there are more scenes than LIMIT_PART_SCENES: then the first ones. */
bool render_request_resources(const struct render_request *request,
                              struct request_resources *resources);
/* Adds a scene that is not there yet; false when there is no room for it. */
bool request_resources_add_scene(struct request_resources *resources, const char *id);
/* Whether the image is the id of a map, not "" and none that is built in. */
bool request_environment_is_uploaded(const char *image);

/* Canonical JSON: every member, fixed key order, numbers to 17 digits, so that equal requests have
 * equal text. Parsing it gives the same request (resolution and taps that were not said are null
 * only where the server shall choose them). malloc'ed, caller frees; NULL only when memory
 * runs out. */
MUST_CHECK char *render_request_to_json(const struct render_request *request);

/* Wire names. The index is the enum; NULL past the last, so that a loop can list them all. */
const char *request_fit_name(int fit);
const char *request_light_type_name(int type);
const char *request_alpha_mode_name(int mode);
const char *request_pass_through_name(int model);
const char *request_tone_mapping_name(int mapping);
const char *request_studio_name(int studio);
const char *request_light_lists_name(int light_lists);
const char *request_blend_filter_name(int filter);
const char *request_volume_map_name(int map);
const char *request_silhouette_form_name(int form);
const char *request_refraction_name(int refraction);
const char *request_visibility_name(int visibility);
const char *request_output_name(int output);
const char *request_format_name(int format); /* index 0 is "any", which no request may say */

#endif
