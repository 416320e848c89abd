/* SPDX-License-Identifier: MIT */
/* How much memory the renderer may take where nobody says it. Thread: GL; gl_memory_budget: any. */
#ifndef VITRAIL_RENDERER_GL_MEMORY_BUDGET_H
#define VITRAIL_RENDERER_GL_MEMORY_BUDGET_H

#include <stdbool.h>
#include <stdint.h>

struct gl_memory {
    bool is_software;
    uint64_t free_bytes;    /* of the card, now; 0: its driver does not say */
    uint64_t machine_bytes; /* of the machine, at most what the process may take; 0: not known */
};

/* Reads GL_NVX_gpu_memory_info or GL_ATI_meminfo, /proc/meminfo and the control group. */
void gl_memory_read(bool is_software, struct gl_memory *memory);

/* Three quarters of what is free on the card; in software a quarter of the machine's memory, at
 * most 4 GiB; else 4 GiB, at most half of the machine's. *source: a phrase on it, never freed. */
uint64_t gl_memory_budget(const struct gl_memory *memory, const char **source);

#endif
