/* SPDX-License-Identifier: MIT */
/* Renders that the worker has, in the order they were sent: what it does with them, how many more
 * it takes, and when it must be done. Not locked: its owner locks. */
#ifndef VITRAIL_SERVER_FRONT_FLIGHTS_H
#define VITRAIL_SERVER_FRONT_FLIGHTS_H

#include "server/front/render_queue.h"

enum { FLIGHTS_DEPTH_MAX = 8 };

enum flight_state {
    FLIGHT_SENT,
    FLIGHT_BEGUN,     /* on the GL thread */
    FLIGHT_PAUSED,    /* urgent ones go before the rest of it */
    FLIGHT_ON_DEVICE, /* the GL thread has another one, or waits for it */
    FLIGHT_ENCODING
};

/* How far a frame is in one of its stages: "shadows", "rays" or "shading". */
struct flight_progress {
    char stage[16];     /* "": nothing is told of it */
    double share;       /* of the stage that is finished, [0, 1] */
    double left_s;      /* of the stage, at the pace so far; below 0: not known */
    double first_share; /* of the first message of the stage ... */
    int64_t since_ms;   /* ... and when that came */
};

struct flight {
    struct render_task *task;
    enum flight_state state;
    int64_t since_ms; /* of the state; of one that was paused, later by as long as it was; of one on
                         the device, when it was begun, or the one before it was done */
    int64_t ran_ms;   /* of a paused one, until then */
    bool is_told;     /* the worker knows that it is cancelled */
    struct flight_progress progress;
};

/* What the worker says of how far it is. */
void flight_progress_note(struct flight_progress *progress, const char *stage, double share,
                          int64_t now_ms);
/* {"stage", "share", "left_s"}: a new reference; NULL: no memory. */
json_t *flight_progress_to_json(const struct flight_progress *progress);

/* Zeroed = none. Urgent ones have room of their own, so that others cannot keep them waiting. */
struct flights {
    struct flight list[2 * FLIGHTS_DEPTH_MAX];
    int count;
    int depth; /* urgent ones that the worker takes at a time, and as many others */
};

bool flights_have_room(const struct flights *flights, enum render_priority priority);
void flights_add(struct flights *flights, struct render_task *task, int64_t now_ms);
void flights_remove(struct flights *flights, int index);
int flights_find(const struct flights *flights, uint64_t ticket);                /* -1: none */
int flights_find_request(const struct flights *flights, const char *request_id); /* the newest */
bool flights_is_any(const struct flights *flights, enum flight_state state);

/* What the worker says of a flight; false for a word that is none of these: begin, paused, resumed,
 * submitted, rendered. */
bool flights_note(struct flight *flight, const char *op, int64_t now_ms);
/* One is off the device, where others waited behind it: their time begins. */
void flights_note_free_device(struct flights *flights, int64_t now_ms);
/* The context was lost by this one. */
void flights_note_lost(struct flights *flights, int index);

/* Which flight a death is charged to: the one on the GL thread, or the first one that is begun
 * where the worker was late; else the one on the device, else the oldest. -1: none. */
int flights_guilty(const struct flights *flights, bool is_late);

/* When the worker must have done something. limit_ms: for each state of a flight, where its task
 * has none of its own; last_event_ms: when the worker last said something. INT64_MAX: never. */
int64_t flights_deadline(const struct flights *flights, int64_t limit_ms, int64_t last_event_ms);
/* How long this flight may stay in its state. */
int64_t flight_limit_ms(const struct flight *flight, int64_t limit_ms);

#endif
