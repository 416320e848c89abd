/* SPDX-License-Identifier: MIT */
/* The processors that may run us, and a variable that says how many of them are ours. */
#include "renderer/base/processors.h"

#include <sched.h>
#include <stdlib.h>
#include <unistd.h>

enum { THREADS_MAX = 1024 };

/* The kernel leaves out those that are offline. sysconf opens a file for each question, and frames
 * ask several times; it answers where the set does not fit cpu_set_t. */
static long count_allowed(void)
{
    cpu_set_t allowed;
    return sched_getaffinity(0, sizeof allowed, &allowed) == 0 ? CPU_COUNT(&allowed)
                                                               : sysconf(_SC_NPROCESSORS_ONLN);
}

int processors_usable(void)
{
    const char *share = getenv(PROCESSORS_VARIABLE);
    long count = share ? strtol(share, NULL, 10) : count_allowed();
    return count < 1 ? 1 : count > THREADS_MAX ? THREADS_MAX : (int)count;
}

int processors_share(int processes)
{
    int share = processors_usable() / processes;
    return share < 1 ? 1 : share;
}
