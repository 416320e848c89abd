/* SPDX-License-Identifier: MIT */
/* Which build this is: what the linker stamped on the program. Thread: any. */
#ifndef VITRAIL_SERVER_BASE_BUILD_ID_H
#define VITRAIL_SERVER_BASE_BUILD_ID_H

enum { BUILD_ID_BYTES = 65 };

/* Hexadecimal digits of the GNU build id; the version where a linker left none. */
void build_id_get(char text[BUILD_ID_BYTES]);

#endif
