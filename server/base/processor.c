/* SPDX-License-Identifier: MIT */
/* The processor's name, from /proc/cpuinfo, and the load. */
#include "server/base/processor.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

void processor_get_name(char name[PROCESSOR_NAME_BYTES])
{
    FILE *file = fopen("/proc/cpuinfo", "re");
    char line[256];
    snprintf(name, PROCESSOR_NAME_BYTES, "unknown");
    while (file && fgets(line, sizeof line, file))
        if (sscanf(line, "model name : %127[^\n]", name) == 1)
            break;
    if (file)
        fclose(file);
}

double processor_crowding(void)
{
    const double most = 4; /* a minute's load says too little of the next second for more */
    double load, processors = fmax((double)sysconf(_SC_NPROCESSORS_ONLN), 1);
    return getloadavg(&load, 1) == 1 ? fmin(fmax(load / processors, 1), most) : 1;
}
