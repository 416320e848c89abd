/* SPDX-License-Identifier: MIT */
/* What to render of a scene: camera, size, lights, edits and quality. Plain data; zero is the
 * default everywhere. */
#ifndef VITRAIL_RENDERER_VIEW_H
#define VITRAIL_RENDERER_VIEW_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/lobe_members.h"
#include "protocol/shadow_technique.h"
#include "protocol/transparency.h"
#include "renderer/image/tone_map.h"
#include "renderer/scene/scene_blob.h"

struct auto_choice;

enum view_camera_kind {
    VIEW_CAMERA_DEFAULT, /* the scene's first camera node; without one, fit the bounds from the
                            front */
    VIEW_CAMERA_NODE,
    VIEW_CAMERA_LOOK_AT,
    VIEW_CAMERA_MATRIX,
    VIEW_CAMERA_FIT,
};

enum view_fit {
    VIEW_FIT_FRONT,
    VIEW_FIT_TOP,
    VIEW_FIT_RIGHT,
    VIEW_FIT_ISO,
    VIEW_FIT_BACK,
    VIEW_FIT_LEFT,
    VIEW_FIT_BOTTOM,
    VIEW_FIT_THREE_QUARTER, /* as products are photographed: renderer/scene/camera.c */
};

struct view_camera {
    enum view_camera_kind kind;
    const char *node;                /* NODE: name, borrowed */
    double eye[3], target[3], up[3]; /* LOOK_AT, world [m]; up all zero means +Y */
    double matrix[16];               /* MATRIX: world_from_camera, column-major, looks along -Z */
    enum view_fit fit;               /* FIT */
    bool is_orthographic;            /* FIT: without perspective, as high as the scene needs */
    double fov_y_deg;                /* (0, 179); 0 means 45, or the node's own: an image narrower
                                        than the node's aspect then shows all its width */
    double ortho_height;             /* m; > 0 makes the camera orthographic */
};

struct view_light {
    enum scene_light_type type;
    double position[3], direction[3]; /* world; direction of travel, normalised by the renderer; of
                                         rect and disk the centre, and the side they emit to */
    float color[3];                   /* linear */
    float intensity;                  /* cd, lx for directional, nt for rect and disk */
    float range;                      /* m; 0 = unbounded */
    float inner_cone_deg, outer_cone_deg; /* half angles, 0 <= inner <= outer <= 90; outer 0 means
                                             45 */
    bool casts_no_shadow;
    double width_m, height_m; /* rect: sides, > 0; the height runs along up */
    double up[3];    /* rect: across the direction; all zero means +Y, or -Z where it shines up
                        or down. Others: how the texels of their shadow map lie, as +Y of a node;
                        all zero means an axis of the world */
    double radius_m; /* disk: > 0 */
};

struct view_node_override {
    const char *node;
    bool has_visible, visible; /* false hides the node and its children */
    bool has_matrix;
    double matrix[16]; /* replaces the local matrix */
};

struct view_grid_override {
    const char *grid; /* a density grid; members as of struct scene_grid */
    bool has_density;
    float density;
    bool has_extinction;
    float extinction[3];
    bool has_color;
    float color[3];
    bool has_anisotropy;
    float anisotropy;
};

struct view_material_override {
    const char *material;
    bool has_base_color;
    float base_color[4];
    bool has_metallic;
    float metallic;
    bool has_roughness;
    float roughness;
    bool has_emissive;
    float emissive[3];
    bool has_transmission;
    float transmission;
    bool has_ior;
    float ior;
    bool has_thickness;
    float thickness;
    bool has_attenuation;
    float attenuation_color[3], attenuation_distance;
    bool has_alpha_mode;
    enum scene_alpha_mode alpha_mode;
    bool has_pass_through;
    enum scene_pass_through pass_through;
    float edge_color[3], edge_exponent;
    bool has_self_shadow, self_shadow; /* false: the object ignores its own events (Lindbeck 2015,
                                          "no self shadow") */
    bool has_cast_once, cast_once; /* true: neighbouring events of one object count once (Lindbeck
                                      2015) */
    struct lobe_members lobes;
};

/* Another scene as a child of a node. Its own node has the part's name; renderer/scene/compose.h
 * says how the nodes and materials inside are called. */
struct view_part {
    const char *name;      /* unique, no '/' in it */
    const char *scene_key; /* a scene on the GPU */
    const char *parent;    /* node of the view's scene or of another part; NULL: the world */
    bool is_hidden;
    double matrix[16]; /* parent_from_part */
};

enum view_light_lists {
    VIEW_LIGHT_LISTS_AUTO,
    VIEW_LIGHT_LISTS_CLUSTERED,
    VIEW_LIGHT_LISTS_LINKED
};

/* What t is for an alpha-blended surface seen by light (docs/explanation/shading.md). */
enum view_blend_filter {
    VIEW_BLEND_TINT,
    VIEW_BLEND_COVERAGE,
    VIEW_BLEND_KIM,
    VIEW_BLEND_MODISETT
};

/* What the half floats of `volume`, as published, hold (docs/explanation/shading.md). */
enum view_volume_map { VIEW_VOLUME_LOGARITHMS, VIEW_VOLUME_FACTORS };

/* What draws the faces of `silhouette` (docs/explanation/shading.md, "Silhouettes"). */
enum view_silhouette_form {
    VIEW_SILHOUETTE_COMPUTE,
    VIEW_SILHOUETTE_GEOMETRY,
    VIEW_SILHOUETTE_TESSELLATION,
    VIEW_SILHOUETTE_TRIANGLES_TWO_PASS, /* tessellator: the three sides behind each triangle; */
    VIEW_SILHOUETTE_TRIANGLES_ONE_PASS, /* and the triangle with them */
    VIEW_SILHOUETTE_TRIANGLES_GEOMETRY, /* a geometry program, all that */
    VIEW_SILHOUETTE_STENCIL,            /* a geometry program, into a stencil of 8 bits */
    VIEW_SILHOUETTE_FORMS
};

/* How the camera sees what lies behind transmissive surfaces (docs/explanation/shading.md, 8). */
enum view_refraction {
    VIEW_REFRACTION_AUTO, /* as the materials say */
    VIEW_REFRACTION_OFF,  /* straight through, whatever their index and roughness */
};

/* What the light of an environment map passes in rasterised pictures. */
enum view_visibility {
    VIEW_VISIBILITY_NONE, /* everything */
    VIEW_VISIBILITY_RAYS  /* rays find what is in its way: quality.environment_samples per point */
};

struct view_quality {
    enum shadow_technique shadows;
    enum transparency transparency;
    enum view_light_lists light_lists;
    enum view_blend_filter blend_filter;
    enum view_refraction refraction;
    /* 0 in the next three and in area_samples: the default (protocol/quality_defaults.h) */
    int shadow_resolution; /* texels per side of one map face */
    int shadow_taps;       /* 1, 4, 9, 16, 64: nearest, or a tent of sqrt(taps) texels */
    int samples;   /* per pixel, 1, 4, 8 or 16; by default 1 where the device's targets have one;
                      raytraced: also 64 and 256; of these 16, 64 and 256 on a regular grid */
    bool faithful; /* techniques exactly as published, with their approximations: those that have
                      such a form */
    enum view_volume_map volume_map;           /* faithful, shadows VOLUME */
    enum view_silhouette_form silhouette_form; /* shadows SILHOUETTE */
    bool reference; /* the ground truth: ray traced in f64, every light, pixels on a regular grid;
                       shadows AUTO or RAYTRACED only */
    bool expects_reuse; /* shadows AUTO: one of many frames, so what is kept between them costs
                           nothing (renderer/cost/auto_technique.h) */
    bool may_be_coarse; /* one of many frames in motion: drawn with the levels of textures that are
                           there, and some more are brought; else the frame waits for all */
    int area_samples;   /* per area light and point, [1, 4096] */
    int environment_samples; /* rays towards the map, per point, [1, 4096]; 0: the default */
    int atmosphere_samples;  /* of haze: slices of the way of a pixel, of ray traced pictures points
                                for each light; [1, 4096]; 0: the default */
    enum view_visibility environment_visibility; /* of rasterised pictures */
    int refraction_samples;      /* ray traced: directions behind a rough surface, per sample of the
                                    pixel, [1, 4096]; 0: the default */
    double shadow_compression;   /* deep: lists are approximated, nowhere farther off than this
                                   transmittance; [0.001, 0.5]; 0: they are exact, but with a
                                   prefilter 0.001 */
    int shadow_prefilter;        /* deep: sub-texel samples per side of a texel, whose visibility
                                    functions are averaged; [1, 4], 0 means 1 */
    double shadow_error_allowed; /* deep: where exact lists exceed the budget, compress them to
                                   this rather than refuse; as above; 0 refuses */
};

/* A neutral studio: the map that is built in, and one key light (renderer/scene/studio.h). */
enum view_studio {
    VIEW_STUDIO_AUTO, /* where neither the scene nor the view has a light */
    VIEW_STUDIO_ON,   /* beside what the scene and the view have; a map of the view takes the place
                         of the studio's */
    VIEW_STUDIO_OFF,
    VIEW_STUDIO_BY_DEFAULT, /* what AUTO comes to without any light: as ON */
};
#define VIEW_STUDIO_KEY "studio" /* of the map that every renderer has */

enum view_output {
    VIEW_OUTPUT_COLOR,    /* F32 RGBA, linear radiance, associated alpha; or see view_screen */
    VIEW_OUTPUT_DEPTH,    /* F32, metres along the view direction; +inf where nothing opaque is */
    VIEW_OUTPUT_NORMAL,   /* F32 RGB, world space, unit; 0 where nothing is */
    VIEW_OUTPUT_ALBEDO,   /* F32 RGB, linear base colour */
    VIEW_OUTPUT_NODE,     /* U32, index + 1 of the scene's node; 0 where nothing is */
    VIEW_OUTPUT_MATERIAL, /* U32, index + 1 */
    VIEW_OUTPUT_POSITION, /* F32 RGB, world space [m]; +inf where nothing is */
    VIEW_OUTPUT_TRANSMITTANCE, /* F32 RGB, of all transparent layers to the first opaque surface */
    VIEW_OUTPUT_LIGHTS, /* U32, entries of the light list at the nearest surface; 0 where none is */
    VIEW_OUTPUT_LAYERS, /* U32, entries of the pixel's transparent list */
    VIEW_OUTPUT_OPTICAL_DEPTH, /* F32 RGB, of media, haze and density grids to the first opaque
                                  surface, without filters; +inf in haze without an end */
    VIEW_OUTPUT_COUNT
};

/* The outline of selected nodes, drawn over the picture. */
struct view_highlight {
    const char *const *nodes; /* names; each with all below it; borrowed */
    size_t node_count;        /* 0: none */
    float color[3];           /* linear radiance [nt], as that of unlit surfaces */
    float width_px;           /* > 0 */
    float hidden;             /* [0, 1]: opacity where something opaque is before it */
};

/* Edges of the geometry, drawn over the picture. */
struct view_edges {
    bool is_drawn;
    float crease_deg; /* [0, 180]: an edge between faces that turn by more is a crease */
    bool omits_borders, omits_silhouettes;
    float width_px; /* > 0 */
    float color[3]; /* as above */
    float hidden;   /* as above */
};

/* The colour as a screen shows it. */
struct view_screen {
    int channels; /* 3, or 4 with alpha: the colour output may be U8, as tone_map gives it, where
                     the device does that sooner than the processor; 0: it is linear */
    struct tone_map_desc mapping;
    bool has_backdrop; /* the background is a colour of the screen, behind the mapped picture
                          (tone_map_over): a linear colour output is no radiance, but what is left
                          to encode (view_screen_code) */
};

/* What maps a linear colour output to the screen. */
static inline struct tone_map_desc view_screen_code(const struct view_screen *screen)
{
    struct tone_map_desc encoding = {.operator_ = TONE_MAPPING_NONE};
    return screen->has_backdrop ? encoding : screen->mapping;
}

enum { VIEW_CLIP_PLANES_MAX = 8 };

/* What becomes of a clip plane's cut; zeroed is the default. */
struct view_cut {
    bool spares_shadows; /* what it cuts away from the picture still casts its shadow */
    bool has_cap;        /* closed meshes are closed again where it cuts them; not with
                            spares_shadows */
    bool has_cap_color;  /* of opaque ones; else they show their material's factors */
    float cap_color[3];  /* linear */
};

/* A horizontal plane under the scene that catches its shadows (renderer/scene/ground_plane.h). */
struct view_ground_plane {
    bool is_shown;
    bool has_height; /* else just below the lowest point of the scene */
    double height_m; /* world, along +Y */
};

/* Haze in all of the space around the scene (docs/explanation/media.md): what it scatters once
 * towards the camera is seen, and it dims what is behind it and what lamps send. The extinction at
 * height y is density_per_m * exp(-max(y - base_m, 0) / falloff_m). */
struct view_atmosphere {
    double density_per_m; /* extinction, [0, 1e6]; 0: there is none */
    float color[3];       /* linear, [0, 1]: the share of the extinction that scatters */
    double anisotropy;    /* [-0.95, 0.95]: mean cosine of Henyey and Greenstein 1941; 0: alike in
                             all directions, > 0: onwards */
    double falloff_m;     /* [0, 1e9]; 0: as dense at any height */
    double base_m;        /* world, along +Y: below it the density is even */
};

/* A rectangle of a picture, its first row on top. */
struct view_tile {
    int x_px, y_px, width_px, height_px;
};
enum {
    VIEW_SIDE_MAX_PX = 16384,    /* of an image */
    VIEW_PICTURE_MAX_PX = 65536, /* of a picture of which tiles are rendered */
};

struct view {
    int width_px, height_px;        /* required; [1, VIEW_SIDE_MAX_PX], with a tile
                                       [1, VIEW_PICTURE_MAX_PX] */
    struct view_tile tile;          /* what of the picture is rendered, with the bits that the
                                       whole has there; outputs have its size. width 0: all. Not
                                       with highlight, edges or row_count_px */
    uint32_t outputs;               /* bit set of 1u << enum view_output; 0 means color */
    int first_row_px, row_count_px; /* of quality.reference: only these rows, the others stay 0, so
                                       that long work can be cut; count 0 means all */
    struct view_camera camera;
    const struct view_light *lights; /* borrowed, in addition to those of the scene */
    size_t light_count;
    bool ignore_scene_lights;
    enum view_studio studio;
    bool has_environment;    /* a hemisphere of uniform radiance, unshadowed */
    float sky[3], ground[3]; /* nt, above and below the horizon */
    /* A map of radiance from all around, beside the hemisphere (docs/explanation/shading.md). */
    const char *environment_key; /* of renderer_attach_environment, or VIEW_STUDIO_KEY; borrowed;
                                    NULL, "": none */
    double environment_rotation_deg; /* [-360, 360], about +Y, counter-clockwise from above */
    double environment_intensity;    /* factor on the map's radiance, [0, 1e6] */
    bool environment_is_background;  /* it is seen where nothing is, in the place of `background`;
                                        not with screen.has_backdrop */
    const struct view_node_override *nodes;
    size_t node_override_count;
    const struct view_material_override *materials;
    size_t material_override_count;
    const struct view_grid_override *grids;
    size_t grid_override_count;
    const struct view_part *parts; /* borrowed, sorted by name */
    size_t part_count;
    const double (*clip_planes)[4]; /* a point with ax+by+cz+d < 0 is cut away */
    size_t clip_plane_count;        /* at most VIEW_CLIP_PLANES_MAX */
    const struct view_cut *cuts;    /* per clip plane; NULL: the default for all */
    struct view_ground_plane ground_plane;
    struct view_atmosphere atmosphere;
    struct view_highlight highlight;
    struct view_edges edges;
    bool is_animated;      /* false: the scene stands as its nodes say */
    const char *animation; /* name, or "#0" for index 0; borrowed; NULL: all, in file order */
    double animation_time_s;
    const char *variant; /* of materials: name, or "#0" for index 0; borrowed; NULL: as the
                            primitives say */
    float background[4]; /* linear, unassociated alpha; 0 = transparent black */
    struct view_screen screen;
    bool wants_deep; /* the colour as a deep image, too (renderer/image/deep_image.h): rasterised,
                        of one sample per pixel, without refraction, haze and overlays */
    struct view_quality quality;
    /* quality.shadows AUTO: what it has become (renderer_choose); borrowed. NULL: nobody has
     * chosen, and the rasteriser's default stands. */
    const struct auto_choice *choice;
};

static inline struct view_tile view_tile_of(const struct view *view)
{
    struct view_tile whole = {.width_px = view->width_px, .height_px = view->height_px};
    return view->tile.width_px ? view->tile : whole;
}

static inline bool view_has_environment(const struct view *view)
{
    return view->environment_key && *view->environment_key;
}

static inline bool view_has_atmosphere(const struct view *view)
{
    return view->atmosphere.density_per_m > 0;
}

/* The background as a colour of the screen: linear, no channel above 1, associated alpha. */
static inline void view_backdrop(const struct view *view, float backdrop[4])
{
    const float *b = view->background;
    for (int k = 0; k < 3; k++)
        backdrop[k] = (b[k] < 1 ? b[k] : 1) * b[3];
    backdrop[3] = b[3];
}

#endif
