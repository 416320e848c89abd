/* SPDX-License-Identifier: MIT */
/* The structures that views.c and live.c share. */
#ifndef VITRAIL_SERVER_VIEWS_VIEWS_INTERNAL_H
#define VITRAIL_SERVER_VIEWS_VIEWS_INTERNAL_H

#include <pthread.h>

#include "server/views/live.h"
#include "server/views/live_scale.h"

enum { ADDRESS_BYTES = 46 };

/* The names of one scene, shared by its views. */
struct scene_names {
    struct scene_names *next;
    char scene[65];
    int references;
    struct view_names *names;
};

/* Each better than those before it. */
enum live_kind { LIVE_NONE, LIVE_MOVING, LIVE_EXACT, LIVE_REFINED };

struct live {
    struct watcher *watchers;
    int watcher_count, active_count;
    struct live_frame newest; /* image NULL: none yet */
    struct live_frame noted;  /* of /image, for passive watchers; image NULL: none */
    uint64_t frame_number;
    enum live_kind pending;
    uint64_t pending_revision, pending_ticket;
    bool is_unwanted; /* the pending frame is cancelled */
    double pending_scale;
    /* The last frame of a picture over which all changes since then lie; or NONE. */
    enum live_kind under;
    uint64_t tried_revision; /* of the last frame, whether it failed or not */
    enum live_kind tried;    /* REFINED also where one failed: nothing is to follow */
    struct error problem;    /* of the last frame that failed */
    uint64_t problem_number;
    double scale;                 /* of moving frames */
    struct live_scale costs;      /* of the last of them */
    struct job_progress progress; /* of the pending frame */
    uint64_t progress_number;
    int64_t progress_ms; /* when to look next how far it is */
    int64_t shown_ms;    /* when the last frame was made */
};

struct view {
    struct view *next; /* newer */
    struct views *views;
    int references; /* of the table, of watchers, of pending frames */
    bool is_gone;
    char id[VIEW_ID_BYTES];
    char address[ADDRESS_BYTES];
    uint64_t revision;
    int home; /* the worker that made its last image: it has what such images share; 0: none */
    struct view_document *document;
    struct scene_names *names; /* NULL: not known */
    int64_t made_unix_s, used_ms, changed_ms;
    int expires_s; /* forgotten when so long nobody asks for it */
    struct live live;
};

struct watcher {
    struct watcher *next;
    struct view *view;
    struct watcher_desc desc; /* view: not used after create */
    bool is_waiting;          /* has room, and got no frame at its last look */
    bool is_beat_due;
    uint64_t seen_frame, seen_noted, seen_revision, seen_problem, seen_progress;
    int64_t beat_ms; /* when it last got something */
};

struct views {
    struct views_desc desc;
    pthread_mutex_t mutex; /* guards all below */
    pthread_cond_t poke;
    pthread_t thread;
    bool has_thread, is_stopping, is_poked;
    struct view *oldest;
    struct scene_names *names;
    int watcher_count;
    struct views_totals totals;
};

/* The functions below are called under the mutex. */
struct view *views_find(struct views *views, const char *id, struct error *err); /* and use it */
void view_release(struct view *view);
void views_poke(struct views *views); /* the thread looks at once */
void live_tell(struct view *view);    /* notifies every watcher */

/* The text and tag of a picture of the present revision. */
MUST_CHECK bool view_describe_frame(struct view *view, const struct view_frame_desc *frame,
                                    struct view_picture *picture, struct error *err);

/* A frame that the view's watchers need now, to be asked for outside the mutex. */
struct launch {
    struct launch *next;
    struct view *view; /* held */
    struct view_picture picture;
    enum image_format format;
    enum live_kind kind;
    uint64_t ticket;
    uint64_t unwanted; /* if not 0, all that this launch does is to cancel that ticket */
};

/* Decides under the mutex what to do for a view; NULL: nothing. Lowers *until_ms to the time of the
 * next look. */
struct launch *live_step(struct view *view, int64_t now_ms, int64_t *until_ms);
void live_launch(struct launch *launch); /* outside the mutex; takes it */
/* Under the mutex, before the view gets its next revision. is_over: the patch changes nothing but
 * what is drawn over the picture. */
void live_note_patch(struct view *view, bool is_over);
void live_finish(struct live *live); /* without watchers */

#endif
