/* SPDX-License-Identifier: MIT */
/* The processor that software devices run on. Thread: any. */
#ifndef VITRAIL_SERVER_BASE_PROCESSOR_H
#define VITRAIL_SERVER_BASE_PROCESSOR_H

enum { PROCESSOR_NAME_BYTES = 128 };

/* Its model as the kernel names it, or "unknown". */
void processor_get_name(char name[PROCESSOR_NAME_BYTES]);

/* How many processes shared each processor in the last minute: how much longer work takes than
 * alone. [1, 4]. */
double processor_crowding(void);

#endif
