/* SPDX-License-Identifier: MIT */
/* Where the programs that belong to this one are. */
#ifndef VITRAIL_CLIENTS_VITRAIL_PROGRAM_PATH_H
#define VITRAIL_CLIENTS_VITRAIL_PROGRAM_PATH_H

/* malloc'ed path of the executable `name` beside this program, else in PATH; NULL when there is
 * none. */
char *program_path_find(const char *name);

#endif
