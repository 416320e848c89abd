/* SPDX-License-Identifier: MIT */
/* Blocks HUP, INT and TERM and reads them from a signalfd, so that nothing is ever cut half way. */
#include "clients/vitrail/interrupt.h"

#include <errno.h>
#include <poll.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

bool interrupt_init(struct interrupt *interrupt, struct failure *failure)
{
    static const int SIGNALS[] = {SIGHUP, SIGINT, SIGTERM};
    struct sigaction before;
    sigset_t watched;

    *interrupt = (struct interrupt){.fd = -1};
    sigemptyset(&watched);
    for (size_t i = 0; i < sizeof SIGNALS / sizeof *SIGNALS; i++) {
        /* Ignored on purpose, by nohup or a shell's background job: stays so. */
        if (sigaction(SIGNALS[i], NULL, &before) == 0 && before.sa_handler != SIG_IGN)
            sigaddset(&watched, SIGNALS[i]);
    }
    signal(SIGPIPE, SIG_IGN); /* a reader that went away is a write error, not the end of this
                                 program */
    if (sigprocmask(SIG_BLOCK, &watched, &interrupt->mask_before) == 0)
        interrupt->fd = signalfd(-1, &watched, SFD_CLOEXEC | SFD_NONBLOCK);
    if (interrupt->fd < 0)
        return fail(failure, EXIT_CODE_OS_ERROR, "cannot watch signals: %s", strerror(errno));
    return true;
}

void interrupt_finish(struct interrupt *interrupt)
{
    if (interrupt->fd > 0)
        close(interrupt->fd);
    interrupt->fd = -1;
}

bool interrupt_check(struct interrupt *interrupt, struct failure *failure)
{
    struct signalfd_siginfo info;

    if (!interrupt->signal && read(interrupt->fd, &info, sizeof info) == (ssize_t)sizeof info)
        interrupt->signal = (int)info.ssi_signo;
    if (!interrupt->signal)
        return true;
    return fail(failure, EXIT_CODE_SIGNAL_BASE + interrupt->signal, "interrupted (%s)",
                strsignal(interrupt->signal));
}

bool interrupt_sleep(struct interrupt *interrupt, int ms, struct failure *failure)
{
    struct pollfd waited = {.fd = interrupt->fd, .events = POLLIN};

    poll(&waited, 1, ms);
    return interrupt_check(interrupt, failure);
}
