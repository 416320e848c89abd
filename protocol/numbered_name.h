/* SPDX-License-Identifier: MIT */
/* Names of files with a number in them, as "view_%02d.png". Thread: any. */
#ifndef VITRAIL_PROTOCOL_NUMBERED_NAME_H
#define VITRAIL_PROTOCOL_NUMBERED_NAME_H

#include <stdbool.h>
#include <stddef.h>

/* One %d, which may have a width of one digit or two, and nothing else that printf reads. */
bool numbered_name_is_pattern(const char *pattern);
int numbered_name_width(const char *pattern); /* digits at least; 0: as many as there are */

/* The number in place of the %d of a pattern; as snprintf. */
int numbered_name_print(char *name, size_t size_bytes, const char *pattern, int number);

#endif
