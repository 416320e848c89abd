/* SPDX-License-Identifier: MIT */
/* The worker's side of a trade-off: one step of a measurement. Thread: GL.
 *
 * A step is one message, and short: a probe, a band of rows of the reference, one frame compared
 * with it, or one cold and one warm frame. The reference lives in a memory file that the front
 * holds, so that the loss of a worker loses one step. */
#ifndef VITRAIL_SERVER_WORKER_MEASURE_H
#define VITRAIL_SERVER_WORKER_MEASURE_H

#include <jansson.h>
#include <stdbool.h>

#include "protocol/error.h"
#include "protocol/render_request.h"
#include "renderer/renderer.h"

struct measure_desc {
    struct renderer *renderer; /* required */
    /* Required; its quality is the setting. The scene is attached. */
    const struct render_request *request;
    const json_t *step; /* required, below */
    int reference_fd; /* -1 in a probe; else a file of width * height * 4 floats, rows from the top:
                         linear radiance with associated alpha */
};

/* "step" and its other members, and the members of the answer:
 *
 * probe      {}                      lights, shadowed_lights, triangles, transparent_casters,
 *                                    layers, layer_needs (enum transparency_can),
 *                                    max_samples (per pixel, of the rasteriser), processors, ms
 * reference  {first_row, row_count}  build_ms, trace_ms: of these rows, written to the file
 * show       {}                      image: the reference as WebP
 * error      {keep_image}            ms, rmse, p999, max, flip, bytes, and the image if kept
 * time       {settles}               cold_ms (all structures built anew), warm_ms; settles: after a
 *                                    cold frame that is not timed. Frames that yielded to urgent
 *                                    ones are made again, three times or for ten
 *                                    seconds; then they yield no more
 *
 * New reference. *image_fd becomes a sealed memory file, or -1. ERROR_NO_DEVICE: the context is
 * lost. */
MUST_CHECK json_t *measure_step(const struct measure_desc *desc, int *image_fd, struct error *err);

#endif
