/* SPDX-License-Identifier: MIT */
/* Watching views: moving frames while a view changes, one exact frame when it rests, the same for
 * all who watch. A watcher takes the newest frame when it has room for one, so nothing queues up.
 * Thread: any, one watcher on one thread at a time. */
#ifndef VITRAIL_SERVER_VIEWS_LIVE_H
#define VITRAIL_SERVER_VIEWS_LIVE_H

#include <jansson.h>

#include "server/front/worker_jobs.h"
#include "server/views/views.h"

struct watcher;

/* Called when there may be news, on any thread, with a lock held: it must not call back and not
 * wait. */
struct watcher_desc {
    const char *view; /* required */
    bool is_passive;  /* causes no renders */
    void *context;
    void (*notify)(void *context);
};
/* ERROR_NOT_FOUND, or ERROR_OVERLOADED when too many watch. */
struct watcher *watcher_create(struct views *views, const struct watcher_desc *desc,
                               struct error *err);
void watcher_destroy(struct watcher *watcher); /* afterwards notify is not called; accepts NULL */

/* A frame as it is shown; never changes. */
struct live_frame {
    struct view_image *image; /* held */
    uint64_t number;          /* of the view's frames, from 1 */
    uint64_t revision;
    bool is_exact, is_refined; /* the latter is exact, too, with the samples that are wanted at rest
                                */
    double scale;
};

/* The changes since the last look. Zeroed = nothing. */
struct watcher_news {
    bool is_gone; /* the view was deleted, or the daemon stops: nothing follows */
    bool has_revision;
    uint64_t revision; /* the present one, also when it is not new */
    bool has_frame;
    struct live_frame frame; /* its image is the caller's, to be released */
    bool has_problem;
    struct error problem; /* of a frame that could not be rendered */
    bool has_progress;
    struct job_progress progress; /* of the frame that is being made, since it takes long */
    bool is_beat_due;             /* nothing was sent for a while: say something */
};

/* wants_frame: there is room for one; none is handed out otherwise. A passive watcher gets each
 * frame that is newest when it looks. */
void watcher_look(struct watcher *watcher, bool wants_frame, struct watcher_news *news);

/* The newest frame once more, for a beat; false when there is none. The image is the caller's. */
bool watcher_repeat(struct watcher *watcher, struct live_frame *frame);

/* An image of the view that was rendered for others: passive watchers see it, and its worker is the
 * view's. */
void live_note_image(struct views *views, const char *view, uint64_t revision,
                     struct view_image *image);

#endif
