/* SPDX-License-Identifier: MIT */
/* The process between the CLI and its private daemon. It outlives neither. */
#ifndef VITRAIL_CLIENTS_VITRAIL_KEEPER_H
#define VITRAIL_CLIENTS_VITRAIL_KEEPER_H

#include <signal.h>
#include <stdbool.h>

struct keeper_desc {
    char *const *argv;          /* of the daemon; argv[0] is the path to execute */
    int lifeline;               /* read end; end of file: the CLI is gone or done */
    int log;                    /* stdout and stderr of the daemon */
    const sigset_t *child_mask; /* signals blocked in the daemon */
    const char *temporary_dir;  /* removed with all it holds once the daemon is gone */
};

/* Runs the daemon until the lifeline ends or the daemon does by itself. Call in a fresh child;
 * never returns. The exit status is the daemon's, or 128 + its signal. */
_Noreturn void keeper_run(const struct keeper_desc *desc);

/* Removes a folder with all it holds; does not follow symbolic links. */
void folder_remove(const char *path);

#endif
