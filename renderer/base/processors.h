/* SPDX-License-Identifier: MIT */
/* How many threads keep the machine busy. Several processes that render each have a share.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_BASE_PROCESSORS_H
#define VITRAIL_RENDERER_BASE_PROCESSORS_H

/* Variable of the environment: the share of this process. */
#define PROCESSORS_VARIABLE "VITRAIL_THREADS"

/* 1 or more: this process' share, or all that are online and may run the calling thread. */
int processors_usable(void);

/* The share of each of so many processes. */
int processors_share(int processes);

#endif
