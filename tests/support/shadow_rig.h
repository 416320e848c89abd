/* SPDX-License-Identifier: MIT */
/* Scenes of flat panes and of media made in memory, a shadow system to try them on, and an f64
 * model of what it must answer. */
#ifndef VITRAIL_TESTS_SUPPORT_SHADOW_RIG_H
#define VITRAIL_TESTS_SUPPORT_SHADOW_RIG_H

#include "renderer/gl/context.h"
#include "renderer/shadows/shadow_frame.h"
#include "tests/support/gl_shadow_probe.h"

enum pane_shape {
    PANE_FLAT, /* a rectangle center + a * u + b * v, |a|, |b| <= 1 */
    PANE_BOX,  /* a medium in a box, + c * w, |c| <= 1; mirrored where (u x v) * w < 0 */
    PANE_BALL, /* a medium where a^2 + b^2 + c^2 <= 1, nearly: BALL_ROWS rows of facets */
};
enum { BALL_ROWS = 400 };

struct pane {
    enum pane_shape shape;
    double center[3], u[3], v[3], w[3];
    float sigma[3]; /* of a medium [1/m], nearly: rounded by way of its attenuation colour */
    float color[3]; /* transmittance of light: base colour under full transmission */
    bool is_opaque;
    bool is_checkered; /* alpha 0 where a * b < 0: holes in a masked or blended pane */
    bool is_blended;   /* BLEND instead of transmission */
    enum scene_pass_through pass_through;
    bool no_self_shadow, cast_once;
};

struct pane_scene {
    struct scene scene;
    struct pane *panes;
    struct scene_node *nodes;
    struct scene_mesh *meshes;
    struct scene_primitive *primitives;
    struct scene_material *materials;
    float *ball_positions; /* all vertices, once there is a ball */
    uint32_t *ball_indices;
    uint32_t count, capacity;
};

void pane_scene_finish(struct pane_scene *panes);
/* Returns the pane's index, which is that of its node, too. */
uint32_t pane_scene_add(struct pane_scene *panes, const struct pane *pane);
/* Moves or recolours a pane that exists. */
void pane_scene_set(struct pane_scene *panes, uint32_t index, const struct pane *pane);
/* Leaning rectangles of many colours over 5 m x 5 m, 1 to 7 m up; every ninth is opaque. */
void pane_scene_add_random(struct pane_scene *panes, int count, uint64_t seed);
/* 6 m x 6 m, level, about the vertical axis; returns its index. */
uint32_t pane_scene_add_sheet(struct pane_scene *panes, double y, const float color[3]);

struct shadow_rig {
    struct gl_context *context;
    struct program_cache *programs;
    struct gpu_timeline *timeline;
    struct draw_arena *arena;
    struct texture_pool *textures;
    struct shadow_system *shadows;    /* one of these two */
    struct shadow_system *systems[2]; /* 0: as shipped; 1: as on graphics hardware */
    struct scene_gpu *gpu;            /* of the scene last prepared */
    struct scene_state state;
    const struct pane_scene *panes; /* borrowed while it is asked about */
    struct scene scene;             /* copy, so that the scene may end before the rig's */
    double eye[3];
    float tolerance[2];              /* of queries from now on: shadow_probe_desc */
    const struct yield_point *yield; /* of preparations from now on; NULL: all at once */
    struct view_quality quality;
    struct frame_report report;
};

/* A sun, a point and a spot of 30 degrees 10 m up, all a little askew. */
enum { SHADOW_RIG_LAMPS = 3 };
extern const struct view_light shadow_rig_lamps[SHADOW_RIG_LAMPS];

/* False when there is no GL device: the test is skipped. */
bool shadow_rig_open(struct shadow_rig *rig, uint64_t budget_bytes, uint64_t first_linked_elements);
/* The same, where lights get no locks of their lists: shadow_system_desc. */
bool shadow_rig_open_without_locks(struct shadow_rig *rig, uint64_t budget_bytes,
                                   uint64_t first_linked_elements, uint64_t refused_locks);
void shadow_rig_close(struct shadow_rig *rig);

/* Prepares the shadows of the scene for these lights. The scene's key is "panes". */
MUST_CHECK bool shadow_rig_prepare(struct shadow_rig *rig, const struct pane_scene *panes,
                                   const struct view_light *lights, size_t light_count,
                                   const double eye[3], const struct view_quality *quality,
                                   struct error *err);
/* For shadow_rig_lamps, seen from the origin; a failure ends the program. */
void shadow_rig_prepare_lamps(struct shadow_rig *rig, const struct pane_scene *panes,
                              const struct view_quality *quality);
/* Transmittance at world points, asked of the device. object: UINT32_MAX for none. */
void shadow_rig_query(struct shadow_rig *rig, uint32_t light, const double (*points)[3],
                      const double normal[3], uint32_t count, uint32_t object, float (*out)[4]);

/* The same of points that face up, of no object. */
void shadow_rig_ask(struct shadow_rig *rig, uint32_t light, const double (*points)[3],
                    uint32_t count, float (*out)[4]);

/* The same from the definition, in f64, with the same texel centres. Returns false where the answer
 * hangs on rounding: a texel centre on a pane's edge, a caster at the receiver's depth, a face
 * chosen by a hair. */
bool shadow_rig_model(const struct shadow_rig *rig, uint32_t light, const double point[3],
                      const double normal[3], double out[3]);

/* A deterministic stream of numbers in [0, 1). */
double rig_random(uint64_t *seed);
/* Always the same points, at most `half` away from the vertical axis in x and z, and from `low` to
 * `high` up. */
void rig_random_points(double (*points)[3], uint32_t count, double half, double low, double high);

#endif
