/* SPDX-License-Identifier: MIT */
/* The decoder's cage: after it, this process can compute, and read and write what it already holds,
 * and nothing else. Thread: main, once. */
#ifndef VITRAIL_SERVER_DECODER_SANDBOX_H
#define VITRAIL_SERVER_DECODER_SANDBOX_H

#include <stdint.h>

#include "protocol/error.h"

struct sandbox_desc {
    uint64_t memory_bytes; /* address space beyond what is mapped now; 0 means no limit */
    uint64_t file_bytes;   /* largest file that may be written; required */
    int cpu_s;             /* processor time; required */
};

/* Resource limits, no new privileges, no core file, and a system call filter: opening files fails
 * with EPERM, executing, sockets, tracing and new processes kill. There is no way back. */
MUST_CHECK bool sandbox_enter(const struct sandbox_desc *desc, struct error *err);

#endif
