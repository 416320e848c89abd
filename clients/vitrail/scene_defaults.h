/* SPDX-License-Identifier: MIT */
/* What a command asks for where neither the command line nor the scene says how the scene is looked
 * at: the camera that products are photographed with, and exposure by what is seen. */
#ifndef VITRAIL_CLIENTS_VITRAIL_SCENE_DEFAULTS_H
#define VITRAIL_CLIENTS_VITRAIL_SCENE_DEFAULTS_H

#include <jansson.h>
#include <stdbool.h>

#include "clients/vitrail/failure.h"
#include "clients/vitrail/session.h"

/* What the server says of a scene: a new reference. NULL where it says nothing, which is no
 * failure, or where a signal ended the question, which is one. */
json_t *scene_describe(struct session *session, const char *scene, struct failure *failure);

/* Puts into a request for the scene so described (NULL: nothing is known of it, and nothing put in)
 * camera {"fit": "three-quarter"} where the scene has no camera, and exposure_ev "auto" where no
 * light of scene or request shines. What the request has stays; one with parts stays as it is,
 * since parts may bring both. False without memory. */
bool scene_defaults_put(const json_t *description, json_t *request, struct failure *failure);

/* Both, one after the other. */
bool scene_defaults_ask(struct session *session, const char *scene, json_t *request,
                        struct failure *failure);

#endif
