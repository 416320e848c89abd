/* SPDX-License-Identifier: MIT */
/* Scenes that crashed workers. After two crashes without a success between them a scene is not
 * rendered any more. Not locked: its owner locks. */
#ifndef VITRAIL_SERVER_FRONT_QUARANTINE_H
#define VITRAIL_SERVER_FRONT_QUARANTINE_H

#include <stdbool.h>

#include "protocol/error.h"
#include "server/base/digest.h"

enum {
    QUARANTINE_CRASHES = 2,
    QUARANTINE_SCENES = 64, /* remembered; beyond it the scene with the oldest crash is forgotten */
};

struct quarantine_entry {
    char scene[DIGEST_TEXT_BYTES]; /* "" = free */
    int crashes;
    unsigned long when; /* order of the last crash */
    char reason[96];
};

/* Zeroed = empty. */
struct quarantine {
    struct quarantine_entry entries[QUARANTINE_SCENES];
    unsigned long clock;
};

void quarantine_add_crash(struct quarantine *quarantine, const char *scene, const char *reason);
/* To be called after a success of the scene, or a new upload. */
void quarantine_clear(struct quarantine *quarantine, const char *scene);

/* ERROR_RENDER_FAILED, with the reason of the last crash, if the scene is quarantined. */
MUST_CHECK bool quarantine_check(const struct quarantine *quarantine, const char *scene,
                                 struct error *err);
int quarantine_count(const struct quarantine *quarantine);

#endif
