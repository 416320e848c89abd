/* SPDX-License-Identifier: MIT */
/* Reads what drivers and the system report of memory, and takes a share of it. */
#include "renderer/gl/memory_budget.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KIB = 1024 };
static const uint64_t ordinary = 4ull << 30, least = 64ull << 20;

#ifndef GL_GPU_MEMORY_INFO_CURRENT_AVAILABLE_VIDMEM_NVX
#define GL_GPU_MEMORY_INFO_CURRENT_AVAILABLE_VIDMEM_NVX 0x9049
#endif
#ifndef GL_TEXTURE_FREE_MEMORY_ATI
#define GL_TEXTURE_FREE_MEMORY_ATI 0x87FC
#endif

/* Both count in KiB. */
static uint64_t read_card(void)
{
    GLint kib[4] = {0}; /* ATI: all that is free, the largest block, and the same of host memory */
    if (epoxy_has_gl_extension("GL_NVX_gpu_memory_info"))
        glGetIntegerv(GL_GPU_MEMORY_INFO_CURRENT_AVAILABLE_VIDMEM_NVX, kib);
    else if (epoxy_has_gl_extension("GL_ATI_meminfo"))
        glGetIntegerv(GL_TEXTURE_FREE_MEMORY_ATI, kib);
    return kib[0] > 0 ? (uint64_t)kib[0] * KIB : 0;
}

/* 0 where there is no such number. */
static uint64_t read_number(const char *path, const char *format)
{
    char line[256];
    unsigned long long number = 0;
    FILE *file = fopen(path, "re");
    if (file && fgets(line, sizeof line, file) && sscanf(line, format, &number) != 1)
        number = 0;
    if (file)
        fclose(file);
    return number;
}

static uint64_t less(uint64_t a, uint64_t b)
{
    return !a || (b && b < a) ? b : a;
}

/* Control groups of version 2, as containers see their own; and of version 1. */
static uint64_t read_machine(void)
{
    uint64_t machine = read_number("/proc/meminfo", "MemTotal: %llu kB") * KIB;
    machine = less(machine, read_number("/sys/fs/cgroup/memory.max", "%llu"));
    return less(machine, read_number("/sys/fs/cgroup/memory/memory.limit_in_bytes", "%llu"));
}

void gl_memory_read(bool is_software, struct gl_memory *memory)
{
    *memory = (struct gl_memory){.is_software = is_software,
                                 .free_bytes = is_software ? 0 : read_card(),
                                 .machine_bytes = read_machine()};
}

uint64_t gl_memory_budget(const struct gl_memory *memory, const char **source)
{
    uint64_t share = memory->machine_bytes / (memory->is_software ? 4 : 2), budget = ordinary;
    *source = "4 GiB";
    if (!memory->is_software && memory->free_bytes) {
        *source = "three quarters of the card's free memory";
        budget = memory->free_bytes / 4 * 3;
    } else if (memory->machine_bytes && share < budget) {
        *source = memory->is_software ? "a quarter of the machine's memory"
                                      : "half of the machine's memory";
        budget = share;
    }
    return budget > least ? budget : least;
}
