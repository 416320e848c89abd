/* SPDX-License-Identifier: MIT */
/* Whole frames of several variants of one case, rendered in turn. Thread: GL. */
#ifndef VITRAIL_TESTS_BENCH_FRAMES_H
#define VITRAIL_TESTS_BENCH_FRAMES_H

#include "tests/bench/bench.h"
#include "tests/support/render_support.h"

enum { VARIANTS_MAX = 8 };

struct frame_variant {
    const char *name;
    struct view view;
    bool rebuilds_shadows;                  /* each frame, as if every light had moved */
    bool asks_lookups;                      /* measures them by themselves, too: PART_LOOKUPS */
    bool moves_camera;                      /* a little each frame; the view's camera is LOOK_AT */
    const struct view_node_override *moved; /* slides along +X, a little each frame; NULL = none */
    double frame_s;                         /* the animation goes on by so much each frame */
    struct measurement measurement;         /* out */
};

/* Fills the measurements. */
MUST_CHECK bool frames_run(struct bench *bench, const struct rig_scene *scene,
                           struct frame_variant *variants, size_t count, struct error *err);
/* States the measurements, each as a result of its variant. */
void frames_tell(struct bench *bench, const char *scene, const char *subject,
                 const struct frame_variant *variants, int count);
/* The variant's passes, as a table; not with --json. */
void frames_print_split(const struct bench *bench, const struct frame_variant *variant);
void frames_finish(struct frame_variant *variants, size_t count);

/* One frame, measured. The report stays when `report` is given. */
MUST_CHECK bool frame_measure(struct renderer *renderer, const struct rig_scene *scene,
                              const struct view *view, bool rebuilds_shadows,
                              struct frame_times *times, struct frame_report *report,
                              struct error *err);

#endif
