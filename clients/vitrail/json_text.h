/* SPDX-License-Identifier: MIT */
/* JSON for people: an indented outline instead of brackets. */
#ifndef VITRAIL_CLIENTS_VITRAIL_JSON_TEXT_H
#define VITRAIL_CLIENTS_VITRAIL_JSON_TEXT_H

#include <jansson.h>
#include <stdbool.h>

#include "clients/vitrail/failure.h"
#include "clients/vitrail/output_file.h"

/* Prints on stdout: one line of JSON with `as_json`, else `key: value` lines, nested by two blanks,
 * with short lists of plain values on one line. */
void json_print(json_t *json, bool as_json);

/* Writes indented JSON and a line end. */
bool json_write(const json_t *json, struct output_file *file, struct failure *failure);

#endif
