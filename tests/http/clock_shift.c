/* SPDX-License-Identifier: MIT */
/* A system's clock that jumps, for tests of the daemon (LD_PRELOAD): it is off by the seconds in
 * the file that CLOCK_SHIFT_FILE names, a 64-bit number that may change at any time. The monotonic
 * clock stays as it is. */
#include <dlfcn.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

static int (*real_clock)(clockid_t clock, struct timespec *now);
static const _Atomic int64_t *shift_s; /* mapped while there is a sandbox to come */

__attribute__((constructor)) static void map_shift(void)
{
    const char *path = getenv("CLOCK_SHIFT_FILE");
    int fd = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    void *mapped = fd >= 0 ? mmap(NULL, sizeof *shift_s, PROT_READ, MAP_SHARED, fd, 0) : MAP_FAILED;
    if (fd >= 0)
        close(fd);
    shift_s = mapped != MAP_FAILED ? mapped : NULL;
    *(void **)&real_clock = dlsym(RTLD_NEXT, "clock_gettime");
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    if (!real_clock) /* before the constructor */
        *(void **)&real_clock = dlsym(RTLD_NEXT, "clock_gettime");
    int status = real_clock(clock, now);
    if (status == 0 && clock == CLOCK_REALTIME && shift_s)
        now->tv_sec += (time_t)atomic_load(shift_s);
    return status;
}

time_t time(time_t *seconds)
{
    struct timespec now = {0};
    clock_gettime(CLOCK_REALTIME, &now);
    if (seconds)
        *seconds = now.tv_sec;
    return now.tv_sec;
}
