/* SPDX-License-Identifier: MIT */
/* Starts the daemon in a process group of its own and guarantees that nothing of it is left. */
#include "clients/vitrail/keeper.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/pidfd.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

enum {
    GRACE_MS = 3000, /* for an orderly end; nobody waits for what it was doing */
    FOLDER_FDS = 16,
};

static int remove_entry(const char *path, const struct stat *status, int type, struct FTW *where)
{
    (void)status;
    (void)type;
    (void)where;
    remove(path);
    return 0;
}

void folder_remove(const char *path)
{
    nftw(path, remove_entry, FOLDER_FDS, FTW_DEPTH | FTW_PHYS);
}

static _Noreturn void exec_daemon(const struct keeper_desc *desc, pid_t keeper)
{
    int null = open("/dev/null", O_RDONLY);

    prctl(PR_SET_PDEATHSIG, SIGKILL); /* the last resort: the keeper itself was killed */
    if (getppid() != keeper)
        _exit(127);
    setpgid(0, 0);
    dup2(null, STDIN_FILENO);
    dup2(desc->log, STDOUT_FILENO);
    dup2(desc->log, STDERR_FILENO);
    close_range(STDERR_FILENO + 1, ~0u, 0);
    signal(SIGPIPE, SIG_DFL);
    unsetenv("VITRAIL_SERVER"); /* ours; the daemon refuses variables that it does not know */
    sigprocmask(SIG_SETMASK, desc->child_mask, NULL);
    execv(desc->argv[0], desc->argv);
    dprintf(STDERR_FILENO, "cannot execute %s: %s\n", desc->argv[0], strerror(errno));
    _exit(127);
}

/* True once the daemon has ended; false when the lifeline ended first, or after `ms` (-1: never).
 */
static bool wait_for_end(int daemon_fd, int lifeline, int ms)
{
    struct pollfd waited[] = {{.fd = daemon_fd, .events = POLLIN},
                              {.fd = lifeline, .events = POLLIN}};

    while (poll(waited, 2, ms) < 0 && errno == EINTR)
        continue;
    return waited[0].revents != 0;
}

_Noreturn void keeper_run(const struct keeper_desc *desc)
{
    pid_t keeper, daemon;
    siginfo_t ended;
    int daemon_fd;
    int null = open("/dev/null", O_RDWR | O_CLOEXEC);

    /* A terminal that goes away, or a group that is killed, must not take the keeper along. */
    setsid();
    prctl(PR_SET_CHILD_SUBREAPER, 1); /* workers that a daemon leaves behind become ours to reap */
    keeper = getpid();
    dup2(null, STDIN_FILENO);
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
    daemon = fork();
    if (daemon == 0)
        exec_daemon(desc, keeper);
    if (daemon > 0) {
        setpgid(daemon, daemon);
        daemon_fd = pidfd_open(daemon, 0);
        if (!wait_for_end(daemon_fd, desc->lifeline, -1)) {
            kill(daemon, SIGTERM);
            wait_for_end(daemon_fd, -1, GRACE_MS);
        }
        kill(daemon, SIGKILL);
        /* Not reaped yet, so its number still names its group and no other: end workers it left
         * behind. */
        waitid(P_PID, (id_t)daemon, &ended, WEXITED | WNOWAIT);
        kill(-daemon, SIGKILL);
        /* A killed worker runs on for the moment that its end takes: the call returns after that.
         */
        while (waitpid(-daemon, NULL, 0) > 0 || errno == EINTR)
            continue;
    }
    if (desc->temporary_dir)
        folder_remove(desc->temporary_dir);
    if (daemon < 0)
        _exit(127);
    _exit(ended.si_code == CLD_EXITED ? ended.si_status : 128 + ended.si_status);
}
