/* SPDX-License-Identifier: MIT */
/* The processors that are online, and a variable that says how many of them are ours. */
#include "renderer/base/processors.h"

#include <stdlib.h>
#include <unistd.h>

enum { THREADS_MAX = 1024 };

int processors_usable(void)
{
    const char *share = getenv(PROCESSORS_VARIABLE);
    long count = share ? strtol(share, NULL, 10) : sysconf(_SC_NPROCESSORS_ONLN);
    return count < 1 ? 1 : count > THREADS_MAX ? THREADS_MAX : (int)count;
}

int processors_share(int processes)
{
    int share = processors_usable() / processes;
    return share < 1 ? 1 : share;
}
