/* SPDX-License-Identifier: MIT */
/* Signals as something to poll: Ctrl-C and TERM end a command in order, with its files and its
 * private server. */
#ifndef VITRAIL_CLIENTS_VITRAIL_INTERRUPT_H
#define VITRAIL_CLIENTS_VITRAIL_INTERRUPT_H

#include <signal.h>
#include <stdbool.h>

#include "clients/vitrail/failure.h"

/* Zeroed, or after finish: no signal is watched. */
struct interrupt {
    int fd;     /* signalfd of HUP, INT and TERM, which stay blocked; readable once one came */
    int signal; /* the one that came, or 0 */
    sigset_t mask_before; /* what a child must run with */
};

bool interrupt_init(struct interrupt *interrupt, struct failure *failure);
void interrupt_finish(struct interrupt *interrupt);

/* True while no signal came; else fails with 128 + its number. Never waits. */
bool interrupt_check(struct interrupt *interrupt, struct failure *failure);

/* As interrupt_check, but waits up to `ms` for a signal first. */
bool interrupt_sleep(struct interrupt *interrupt, int ms, struct failure *failure);

#endif
