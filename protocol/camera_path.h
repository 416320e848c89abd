/* SPDX-License-Identifier: MIT */
/* A camera that moves through keys: the member camera_path of a job, and where it is at a moment.
 * Thread: any. The manual for clients is docs/reference/jobs.md. */
#ifndef VITRAIL_PROTOCOL_CAMERA_PATH_H
#define VITRAIL_PROTOCOL_CAMERA_PATH_H

#include <jansson.h>
#include <stdbool.h>

#include "protocol/error.h"
#include "protocol/frame_list.h"
#include "protocol/json_read.h"
#include "protocol/render_request.h"

enum camera_interpolation {
    CAMERA_INTERPOLATION_SMOOTH, /* a curve without corners */
    CAMERA_INTERPOLATION_LINEAR, /* straight from key to key */
};

/* A look-at camera at a moment. */
struct camera_key {
    double at; /* a frame's number, or seconds; [-LIMIT_PATH_MOMENT, LIMIT_PATH_MOMENT] */
    double eye[3], target[3]; /* world [m] */
    double up[3];             /* of any length */
    double fov_y_deg;         /* [0.001, 179) */
    double ortho_height;      /* m; 0 = perspective, in all keys or in none */
};

/* Zeroed = no path. */
struct camera_path {
    struct camera_key *keys; /* owned; in the order of their moments */
    int count;               /* [2, LIMIT_CAMERA_KEYS] */
    bool is_timed;           /* moments are seconds, else numbers of frames */
    enum camera_interpolation interpolation;
    bool is_closed;
    double closes_at; /* where the first key comes again, after the last */
};

/* Reads the member; an absent one is no path. On failure the path is to be finished all the same.
 */
MUST_CHECK bool camera_path_read(const struct json_node *node, struct camera_path *path);
void camera_path_finish(struct camera_path *path); /* accepts zeroed; zeroes */

/* Every member in canonical form. New reference; NULL: no memory. */
MUST_CHECK json_t *camera_path_to_json(const struct camera_path *path);

/* Reads and checks a path for the frames of a list. On failure it is zeroed. */
MUST_CHECK bool camera_path_load(json_t *json, const struct frame_list *frames, double frame_rate,
                                 struct camera_path *path, struct error *err);

/* The moment of a frame, in the unit of the keys. */
double camera_path_moment(const struct camera_path *path, int frame, double frame_rate);

/* The camera at a moment: exactly that of a key at its moment, the first before the first and the
 * last after the last; on a closed path the moments go round. */
struct request_camera camera_path_at(const struct camera_path *path, double moment);

/* Refuses, at the node, a path on which a camera of a frame cannot be: its eye meets its target, or
 * its up the direction of view. */
MUST_CHECK bool camera_path_check(const struct json_node *node, const struct camera_path *path,
                                  const struct frame_list *frames, double frame_rate);

#endif
