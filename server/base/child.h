/* SPDX-License-Identifier: MIT */
/* The other roles of this program as child processes: started from /proc/self/exe, spoken to over
 * one socket, ended with SIGKILL. Thread: any, one child on one thread at a time. */
#ifndef VITRAIL_SERVER_BASE_CHILD_H
#define VITRAIL_SERVER_BASE_CHILD_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#include "protocol/error.h"

enum { CHILD_SOCKET_FD = 3 /* where a child finds its end of the socket */ };

/* Zeroed = none. */
struct child {
    pid_t pid;
    int socket; /* our end; owned */
};

/* A decoder gets no environment but what its libraries need; a worker, like an assembler, ours. */
struct child_desc {
    const char *role; /* required: "worker", "decoder" or "assembler" */
    /* Of a worker: where drivers keep their shader caches unless ours says otherwise; NULL: where
     * they like. */
    const char *cache_dir;
    /* Of a worker: the threads that it may keep busy (renderer/base/processors.h), those of a
     * driver that draws on processors included unless ours says otherwise; 0: all. */
    int threads;
};
/* The child dies with the thread that started it. */
MUST_CHECK bool child_start(struct child *child, const struct child_desc *desc, struct error *err);

/* Closes our end, gives the child grace_ms to leave by itself, kills it, reaps it, and says how it
 * ended: "signal 11 (Segmentation fault)", "exit status 1". The text may be NULL. Accepts zeroed;
 * zeroes. */
void child_stop(struct child *child, int grace_ms, char *how, size_t how_bytes);

/* In the child, first of all: die with the parent. False when the parent is gone already. */
bool child_tie_to_parent(void);

#endif
