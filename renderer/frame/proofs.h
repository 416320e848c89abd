/* SPDX-License-Identifier: MIT */
/* Which structures the device was seen to draw right. What most pictures are made of is tested
 * before anything is served, the rest before the first picture that uses it; what was found wrong
 * is refused. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_PROOFS_H
#define VITRAIL_RENDERER_FRAME_PROOFS_H

#include "renderer/base/content_key.h"
#include "renderer/frame/proof_file.h"
#include "renderer/frame/scene_selftest.h"
#include "renderer/renderer.h"

struct proofs;

struct proofs_desc {
    enum renderer_selftest policy;
    uint32_t at_start;  /* structures that are tested before anything is served */
    struct proof proof; /* of a start before; wide_floats: which the structures are drawn with */
    const char *path;   /* of the file; NULL: none is kept; copied */
    struct content_key key; /* of all else that the results depend on: program, driver, settings */
    /* Runs scene_selftest for these structures on a renderer that is thrown away. *is_wrong: it
       failed by what a picture shows. */
    bool (*test)(void *context, uint32_t structures, bool *is_wrong, struct error *err);
    void *context;
};

/* Tests what is asked for at a start. NULL with err where something is wrong. */
struct proofs *proofs_create(const struct proofs_desc *desc, struct error *err);
void proofs_destroy(struct proofs *proofs); /* accepts NULL */

/* Before a frame that uses these structures: tests those that were not yet, where the policy says
 * so. ERROR_UNSUPPORTED names what is wrong, and says so from then on; all others are those of
 * frames. */
MUST_CHECK bool proofs_ensure(struct proofs *proofs, uint32_t structures, struct error *err);

#endif
