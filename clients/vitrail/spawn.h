/* SPDX-License-Identifier: MIT */
/* A private vitraild for one call: started on a free port, ended with us however we end. */
#ifndef VITRAIL_CLIENTS_VITRAIL_SPAWN_H
#define VITRAIL_CLIENTS_VITRAIL_SPAWN_H

#include <stdbool.h>
#include <sys/types.h>

#include "clients/vitrail/failure.h"
#include "clients/vitrail/interrupt.h"
#include "clients/vitrail/progress.h"

struct spawn_desc {
    const char *state_dir;       /* NULL means a folder that goes away with the server */
    struct interrupt *interrupt; /* required */
    struct progress *progress;   /* NULL is silent */
    double deadline_s;           /* on clock_s(), for being ready; 0 means two minutes from now */
};

/* Zeroed = none. A keeper process stands between us and the daemon: it ends the daemon and removes
 * the temporary folder as soon as our end of the lifeline closes, which the kernel does even when
 * we are killed. */
struct spawned_server {
    pid_t keeper;
    int lifeline;  /* write end; nothing is ever written */
    int log;       /* what the daemon prints; readable after the folder is gone */
    char url[128]; /* "http://127.0.0.1:PORT" */
};

/* Starts the vitraild beside this program, else the one in PATH, and waits for "listening on
 * http://...". Whether it is ready to render is for the caller to ask. */
bool spawned_server_start(struct spawned_server *server, const struct spawn_desc *desc,
                          struct failure *failure);

/* True while the daemon lives; else fails with its last words. */
bool spawned_server_check(struct spawned_server *server, struct failure *failure);

/* Ends it and waits until it is gone: at most a few seconds. Accepts zeroed. */
void spawned_server_stop(struct spawned_server *server);

#endif
