/* SPDX-License-Identifier: MIT */
/* What frames that were chosen for a time or an error really took, and what that says of the next
 * ones: the times of settings (renderer/cost/learning), what compiling costs on this device, and
 * whose programs stand. Thread: any. */
#ifndef VITRAIL_SERVER_WORKER_TIME_ESTIMATOR_H
#define VITRAIL_SERVER_WORKER_TIME_ESTIMATOR_H

#include <jansson.h>
#include <stdint.h>

#include "protocol/error.h"
#include "renderer/cost/choice.h"

struct time_estimator;

struct time_estimator *time_estimator_create(struct error *err);
/* Writes what it keeps. Accepts NULL. */
void time_estimator_destroy(struct time_estimator *estimator);

/* Keeps what times taught in that file from now on, after every 32 observations and at the end, and
 * takes what an earlier start left there for the same key, which names device and build. The first
 * call counts. What cannot be written is learned again. */
void time_estimator_keep(struct time_estimator *estimator, const char *path, const char *key);

/* Writes no more: another process does. */
void time_estimator_only_read(struct time_estimator *estimator);

/* The worker has given back what it held between frames. */
void time_estimator_forget_memory(struct time_estimator *estimator);

/* A frame of a setting of a scene. */
struct time_estimator_frame {
    const char *scene; /* required: its id */
    struct quality_setting setting;
    bool is_warm;     /* promised with what is kept from a frame before */
    double base_ms;   /* > 0: of the row, as measured or modelled */
    bool is_measured; /* that time was, for this very view */
    bool is_hazy;     /* the frame has an atmosphere */
    double bytes;     /* of its shadow maps and of the window; 0: not known */
};

/* What the next such frame takes, as far as it can be promised. Measured times grow where two
 * frames took more than half as long again; modelled ones follow what frames took, are the more
 * careful the less is known, and count the programs of a rasterising technique that has not drawn
 * the scene since the worker started, and the memory beyond what frames have had since then. */
double time_estimator_expect(struct time_estimator *estimator,
                             const struct time_estimator_frame *frame);

/* It took so long. has_compiled: some of that went into programs. base_ms may be 0: what it took
 * says nothing then but that its programs stand. */
void time_estimator_note(struct time_estimator *estimator, const struct time_estimator_frame *frame,
                         double took_ms, bool has_compiled);

/* The last 16 frames that were promised and noted here, as JSON (server/mapping/lesson_mapping.h),
 * each once, the oldest first; NULL: none. */
json_t *time_estimator_take_lessons(struct time_estimator *estimator);

/* As if those frames of another process on such a device had been noted here, but that programs and
 * memory stay those of this process. NULL: none. */
void time_estimator_learn(struct time_estimator *estimator, const json_t *lessons);

/* The scene's programs were compiled ahead, those of the candidates of `auto`. */
void time_estimator_note_warm(struct time_estimator *estimator, const char *scene);

#endif
