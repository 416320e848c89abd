/* SPDX-License-Identifier: MIT */
/* The parts of a render request that are read on their own. Internal to the parser. */
#ifndef VITRAIL_PROTOCOL_REQUEST_PARTS_H
#define VITRAIL_PROTOCOL_REQUEST_PARTS_H

#include "protocol/json_read.h"
#include "protocol/render_request.h"

/* Each reads its member of the root into the request, whose defaults are in place. What they own is
 * released by render_request_finish, also after a failure. */
MUST_CHECK bool request_read_camera(const struct json_node *node, struct request_camera *camera);
/* Its members eye, target and up; and fov_y_deg and ortho_height. */
MUST_CHECK bool request_read_look_at(const struct json_node *node, struct request_camera *camera);
MUST_CHECK bool request_read_lens(const struct json_node *node, struct request_camera *camera);
/* What is wrong with a look-at camera that was not read, in words; NULL: nothing. */
const char *request_look_at_fault(const struct request_camera *camera);
MUST_CHECK bool request_read_lights(const struct json_node *node, struct render_request *request);
MUST_CHECK bool request_read_overrides(const struct json_node *node,
                                       struct render_request *request);

MUST_CHECK bool request_read_highlight(const struct json_node *node,
                                       struct request_highlight *highlight);
MUST_CHECK bool request_read_edges(const struct json_node *node, struct request_edges *edges);

/* Reads /parts: other scenes that hang on nodes. */
MUST_CHECK bool request_read_parts(const struct json_node *node, struct render_request *request);

/* An id of 64 hexadecimal digits; required. */
MUST_CHECK bool request_read_scene(const struct json_node *node, char scene[65]);

/* A whole request. On failure it is zeroed. */
MUST_CHECK bool request_read_root(const struct json_node *root, struct render_request *request);

/* The same of a picture that its reader cuts into tiles: of up to LIMIT_PICTURE_SIDE_PX a side. */
MUST_CHECK bool request_read_picture(const struct json_node *root, struct render_request *request);

/* The members of a request that a view has; the others are said when an image is asked for.
 * NULL-terminated. */
const char *const *request_view_members(void);

/* A direction: three finite numbers that are not all (nearly) zero. */
MUST_CHECK bool request_read_direction(const struct json_node *node, double *direction);

/* Whether two directions span a plane, as an up and a view must. */
bool request_are_independent(const double a[3], const double b[3]);

/* The up of a look-at camera that names none: +Y, but where the camera looks along +Y, -Z from
 * above and +Z from below, as the top view that fits a scene has it. */
void request_default_up(const double forward[3], double up[3]);

/* 16 numbers, column-major: affine and invertible. */
MUST_CHECK bool request_read_matrix(const struct json_node *node, double *matrix);

#endif
