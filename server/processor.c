/* SPDX-License-Identifier: MIT */
/* The processor's name, from /proc/cpuinfo. */
#include "server/processor.h"

#include <stdio.h>

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
