/* SPDX-License-Identifier: MIT */
/* What frames that were chosen for a time or an error really took, and what that says of the next
 * ones: the times of settings (renderer/cost/learning), what compiling costs on this device, and
 * whose programs stand. Thread: any. */
#ifndef VITRAIL_SERVER_WORKER_EXPERIENCE_H
#define VITRAIL_SERVER_WORKER_EXPERIENCE_H

#include <stdint.h>

#include "protocol/error.h"
#include "renderer/cost/choice.h"

struct experience;

struct experience *experience_create(struct error *err);
void experience_destroy(struct experience *experience); /* accepts NULL; writes what it keeps */

/* Keeps what times taught in that file from now on, after every 32 lessons and at the end, and
 * takes what an earlier start left there for the same key, which names device and build. The first
 * call counts. What cannot be written is learned again. */
void experience_keep(struct experience *experience, const char *path, const char *key);

/* A new worker has compiled nothing yet, and holds no memory. */
void experience_forget_programs(struct experience *experience);
/* The worker has given back what it held between frames. */
void experience_forget_memory(struct experience *experience);

/* A frame of a setting of a scene. */
struct experience_frame {
    const char *scene; /* required: its id */
    struct choice_setting setting;
    bool is_warm;     /* promised with what is kept from a frame before */
    double base_ms;   /* > 0: of the row, as measured or modelled */
    bool is_measured; /* that time was, for this very view */
    double bytes;     /* of its shadow maps and of the window; 0: not known */
};

/* What the next such frame takes, as far as it can be promised. Measured times grow where two
 * frames took more than half as long again; modelled ones follow what frames took, are the more
 * careful the less is known, and count the programs of a rasterising technique that has not drawn
 * the scene since the worker started, and the memory beyond what frames have had since then. */
double experience_expect(struct experience *experience, const struct experience_frame *frame);

/* It took so long. has_compiled: some of that went into programs. base_ms may be 0: what it took
 * says nothing then but that its programs stand. */
void experience_note(struct experience *experience, const struct experience_frame *frame,
                     double took_ms, bool has_compiled);

/* The scene's programs were compiled ahead, those of the candidates of `auto`. */
void experience_note_warm(struct experience *experience, const char *scene);

double experience_compile_ms(struct experience *experience); /* of a frame whose programs do not
                                                                stand */
double experience_memory_ms(struct experience *experience, double bytes); /* of making them */

#endif
