/* SPDX-License-Identifier: MIT */
/* What the server has to say about a scene or a picture that is none of its author's intent. */
#ifndef VITRAIL_CLIENTS_VITRAIL_WARNINGS_H
#define VITRAIL_CLIENTS_VITRAIL_WARNINGS_H

#include <jansson.h>
#include <stdbool.h>

#include "clients/vitrail/session.h"

/* What of the scene's file its pictures leave out, an array of sentences: a new reference. NULL
 * where the server does not tell, which is no failure, or where a signal ended the question, which
 * is one. */
json_t *warnings_of_scene(struct session *session, const char *scene, struct failure *failure);

/* Likewise what was changed of an environment map. */
json_t *warnings_of_environment(struct session *session, const char *id, struct failure *failure);

/* Prints each sentence of the array (NULL: none) on stderr, after `of` (NULL: nothing). */
void warnings_print(const json_t *warnings, const char *of);

/* With --strict a warning is a failure, EXIT_CODE_REFUSED, that tells the first one and how many
 * there are. Both arrays may be NULL. */
bool warnings_refuse(const json_t *of_scene, const json_t *of_frame, struct failure *failure);

#endif
