/* SPDX-License-Identifier: MIT */
/* Encoded images of views: equal ones that are asked for at the same time are rendered once, and
 * the last few are kept. Thread: any; completions come on the supervisor's thread, or at once on
 * the caller's. */
#ifndef VITRAIL_SERVER_VIEWS_VIEW_IMAGES_H
#define VITRAIL_SERVER_VIEWS_VIEW_IMAGES_H

#include <stdatomic.h>

#include "protocol/frame_stats.h"
#include "server/front/frames.h"
#include "server/front/metrics.h"
#include "server/front/resources.h"
#include "server/views/image_tag.h"

/* One encoded image; never changes. */
struct view_image {
    atomic_int references;
    int fd; /* of a memfd */
    const void *bytes;
    size_t size_bytes;
    enum image_format format;
    int width_px, height_px;
    char frame[FRAME_ID_BYTES];
    char timing[FRAME_SERVER_TIMING_BYTES]; /* Server-Timing */
    double queue_ms, cost_ms, total_ms;     /* cost: of the renderer and the encoder */
    char *stats;                            /* owned JSON */
    char drawn[DIGEST_TEXT_BYTES];          /* render_outcome.drawn */
    int worker;                             /* render_outcome.worker */
};
struct view_image *view_image_hold(struct view_image *image);
void view_image_release(struct view_image *image); /* accepts NULL */

enum view_image_source { VIEW_IMAGE_RENDERED, VIEW_IMAGE_SHARED, VIEW_IMAGE_KEPT };

struct view_image_request {
    const char *scene;                         /* required */
    const struct request_resources *resources; /* optional: beside its scene */
    const char *text;                          /* required; canonical, names its format */
    const char *tag;                           /* required; image_tag_make of text and offer */
    enum image_format format;
    enum render_priority priority;
    const char *request_id; /* borrowed until done; NULL: none */
    const char *view;       /* for the stats */
    uint64_t revision;
    int home;       /* render_task.home */
    bool is_moving; /* of a moving frame: not cached */
    json_t *offer;  /* borrowed; of the task, or NULL */
    void *context;
    /* Called exactly once. image is borrowed and NULL on failure. */
    void (*done)(void *context, struct view_image *image, enum view_image_source source,
                 const struct error *problem);
};

struct view_images;

struct view_images_desc {
    struct supervisor *supervisor; /* all required, borrowed */
    const struct resources *resources;
    struct frames *frames;
    struct metrics *metrics;
};
struct view_images *view_images_create(const struct view_images_desc *desc, struct error *err);

/* To be called after the supervisor, which completes what waits, was destroyed. Accepts NULL. */
void view_images_destroy(struct view_images *images);

/* A ticket for a later request. */
uint64_t view_images_next_ticket(struct view_images *images);

/* All strings are borrowed for the call. `ticket` may cancel from now on. */
void view_images_ask(struct view_images *images, const struct view_image_request *request,
                     uint64_t ticket);

/* Completes the request with ERROR_OVERLOADED; the render goes on when others wait for it. No-op
 * for unknown tickets. */
void view_images_cancel(struct view_images *images, uint64_t ticket);

/* The progress of the image with this ticket; false: not known, as for quick images. */
bool view_images_get_progress(struct view_images *images, uint64_t ticket,
                              struct job_progress *progress);

/* The supervisor's ticket of what is being made for the newest with this request id; 0: nothing. */
uint64_t view_images_find_render(struct view_images *images, const char *request_id);

struct view_images_totals {
    uint64_t rendered, shared, kept;
    uint64_t held_bytes, held;
};
struct view_images_totals view_images_get_totals(struct view_images *images);

#endif
