/* SPDX-License-Identifier: MIT */
/* The benchmark program: its options, what a suite works with, and how it states results.
 *
 * Protocol of every suite: after the warm-up, the variants of a case take turns (A B C A B C ...),
 * one frame each, until there are `frames` rounds or the case has taken `seconds`; at least five
 * rounds. Reported are the median, the median absolute deviation and the 95th percentile, of wall
 * time and of the processor time of the whole process. Thread: one. */
#ifndef VITRAIL_TESTS_BENCH_BENCH_H
#define VITRAIL_TESTS_BENCH_BENCH_H

#include <jansson.h>

#include "renderer/renderer.h"
#include "tests/bench/meter.h"

struct bench_options {
    bool is_json;      /* one JSON document on standard output instead of tables */
    bool is_quick;     /* the smallest case of a suite, few frames: does it still run? */
    int frames;        /* rounds; 0 means 30, 5 when quick */
    int warm_up;       /* rounds; 0 means 3, 1 when quick */
    double seconds;    /* per case; 0 means 12, 2 when quick */
    int width, height; /* 0 means the suite's own */
    const char *scene; /* only this one; NULL means all that the suite has */
    /* Of suite `silhouettes`; 0 means the suite's own. */
    int triangles, objects, texels; /* texels: of a side of a map */
    bool saves_pictures;            /* of each variant, below images/ of the build folder */
};

struct bench {
    struct bench_options options;
    const char *suite;         /* name of the running one */
    struct renderer *renderer; /* of the running suite; use bench_renderer */
    struct renderer_info info;
    json_t *results, *checks, *series; /* arrays */
    const char *table;                 /* columns of the table last begun; NULL before any */
};

/* Opens the renderer of the suite on first use. Exits with 77 when there is no device. */
struct renderer *bench_renderer(struct bench *bench);
bool bench_wants_scene(const struct bench *bench, const char *name);
void bench_size(const struct bench *bench, int width, int height, int size[2]);

/* Whether another round is due. */
struct rounds {
    int done; /* measured ones, the warm-up not counted */
    int least, most;
    double seconds, begin_ms;
    bool is_warming;
};
struct rounds rounds_begin(const struct bench *bench);
/* for (struct rounds r = rounds_begin(bench); rounds_next(&r);) */
bool rounds_next(struct rounds *rounds);

/* One line of results. */
struct result {
    const char *scene, *subject, *variant; /* "demo", "100 lights", "clustered" */
    int width, height;                     /* of the image, or of the lookups */
    const char *stage;                     /* a part's name to state beside the frame, or NULL */
    double mean_light_list;                /* entries per list; 0 when not asked for */
    uint64_t structure_bytes;              /* of what the suite is about; 0 when not asked for */
    const struct measurement *measurement;
};
void bench_result(struct bench *bench, const struct result *result);

/* A figure that the issue sets a bound to, or a plain figure when `relation` is NULL. */
struct check {
    const char *scene, *subject, *name; /* name: "build deep / deep-linked" */
    double value;
    const char *relation; /* "<=" or ">=" */
    double bound;
    double p; /* of the difference behind the value, NAN without */
};
void bench_check(struct bench *bench, const struct check *check);

/* How something grows with a number, and how its time may grow: in exponents of a power law. */
enum growth {
    GROWTH_ANY,
    GROWTH_LOG,
    GROWTH_LINEAR,
    GROWTH_SORT,
    GROWTH_SQUARE
}; /* SORT: n log n */
enum { SERIES_MAX = 8 };
struct series {
    const char *scene, *subject, *name; /* "demo", "map side", "build cpu, deep" */
    const char *of, *unit;              /* of x: "texels per side"; of y: "ms" */
    const double *x, *y;                /* y that is not positive was lost in noise: left out */
    int count;                          /* at most SERIES_MAX; nothing is told below two */
    enum growth growth;                 /* no faster than this */
};
/* Checks the exponent of all points and, from five points on, that of the last half of them. A
 * bound is the exponent that the growth itself has over the same x, and 5 % for noise. */
void bench_series(struct bench *bench, const struct series *series);

/* Arguments: a seed and a file. Writes the scene there and the request to standard output. Returns
 * the exit status. */
int bench_generate(int count, char **arguments);

struct suite {
    const char *name, *purpose;
    bool (*run)(struct bench *bench, struct error *err);
};
bool suite_lights(struct bench *bench, struct error *err);
bool suite_deep(struct bench *bench, struct error *err);
bool suite_both(struct bench *bench, struct error *err);
bool suite_layers(struct bench *bench, struct error *err);
bool suite_demo(struct bench *bench, struct error *err);
bool suite_draws(struct bench *bench, struct error *err);
bool suite_raytrace(struct bench *bench, struct error *err);
bool suite_foliage(struct bench *bench, struct error *err);
bool suite_forecast(struct bench *bench, struct error *err);
bool suite_auto(struct bench *bench, struct error *err);
bool suite_linear(struct bench *bench, struct error *err);
bool suite_standing(struct bench *bench, struct error *err);
bool suite_ahead(struct bench *bench, struct error *err);
bool suite_environment(struct bench *bench, struct error *err);
bool suite_smoke(struct bench *bench, struct error *err);
bool suite_grids(struct bench *bench, struct error *err);
bool suite_peels(struct bench *bench, struct error *err);
bool suite_finders(struct bench *bench, struct error *err);
bool suite_traced(struct bench *bench, struct error *err);
bool suite_techniques(struct bench *bench, struct error *err);
bool suite_silhouettes(struct bench *bench, struct error *err);
bool suite_area(struct bench *bench, struct error *err);
bool suite_skin(struct bench *bench, struct error *err);
bool suite_import(struct bench *bench, struct error *err);
bool suite_targets(struct bench *bench, struct error *err);
bool suite_scaling(struct bench *bench, struct error *err);

/* The cases of a suite over all sizes of its number, for suite_scaling. */
bool scale_layers(struct bench *bench, struct error *err); /* and quads */
bool scale_maps(struct bench *bench, struct error *err);
bool scale_lights(struct bench *bench, struct error *err);

#endif
