/* SPDX-License-Identifier: MIT */
/* Paths with a number in them, as "view_%02d.png". */
#ifndef VITRAIL_CLIENTS_VITRAIL_NUMBERED_PATH_H
#define VITRAIL_CLIENTS_VITRAIL_NUMBERED_PATH_H

#include "clients/vitrail/failure.h"

/* Whether it is a pattern, as protocol/numbered_name.h has it. */
bool numbered_path_check(const char *pattern, struct failure *failure);

/* The number in place of the %d. malloc'ed; NULL: no memory. */
char *numbered_path_make(const char *pattern, int number);

#endif
