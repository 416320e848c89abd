/* SPDX-License-Identifier: MIT */
/* The scenes of the benchmark, their cameras and the lights put into them. Thread: GL. */
#ifndef VITRAIL_TESTS_BENCH_SCENES_H
#define VITRAIL_TESTS_BENCH_SCENES_H

#include "tests/bench/bench.h"
#include "tests/support/render_support.h"

enum { BENCH_LIGHTS_MAX = 4096, CURTAINS_MAX = 16 };

struct bench_scene {
    const char *name; /* "demo", "sponza" */
    struct rig_scene rig;
    struct view_camera camera;     /* LOOK_AT */
    double box_min[3], box_max[3]; /* where lights are put */
    double light_range_m;          /* of one of many */
    struct view_light spot;        /* one spot whose light passes through the curtains */
    struct view_material_override curtains[CURTAINS_MAX];
    size_t curtain_count;
};

/* Opens the demo scene. */
MUST_CHECK bool bench_demo_open(struct bench_scene *scene, struct renderer *renderer,
                                struct error *err);
/* Opens 100 spheres over a floor, as in Lexolights (`silhouettes`, `finders`). stacks: of a sphere,
 * which has 4 n (n - 1) triangles. */
enum { SPHERES_SIDE = 10 };
MUST_CHECK bool bench_spheres_open(struct rig_scene *rig, struct renderer *renderer, int stacks,
                                   struct error *err);
void bench_scene_close(struct bench_scene *scene, struct renderer *renderer);

/* Runs for each scene that the options want and this machine has; --quick wants the demo only. */
MUST_CHECK bool bench_scenes_run(struct bench *bench,
                                 bool (*run)(struct bench *bench, const struct bench_scene *scene,
                                             struct error *err),
                                 struct error *err);

/* A view with the scene's camera and curtains and no light of the scene's own. */
struct view bench_scene_view(const struct bench_scene *scene, const int size[2]);

/* `count` cones, range light_range_m, at random in the box, pointing down and aside. The first n of
 * them are the same for every count. */
void bench_scene_cones(const struct bench_scene *scene, struct view_light *lights, int count);
/* `count` shadowed spots around scene->spot, each through the curtains. */
void bench_scene_spots(const struct bench_scene *scene, struct view_light *lights, int count);

/* A case of suites `standing` and `targets`: at most 250 spots whose shadows stand. */
MUST_CHECK bool standing_run(struct bench *bench, const struct bench_scene *scene, int count,
                             struct error *err);

#endif
