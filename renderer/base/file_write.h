/* SPDX-License-Identifier: MIT */
/* Thread: any. */
#ifndef VITRAIL_RENDERER_BASE_FILE_WRITE_H
#define VITRAIL_RENDERER_BASE_FILE_WRITE_H

#include <errno.h>
#include <stdbool.h>
#include <stddef.h>
#include <unistd.h>

/* Writes everything, whatever the interruptions. False, and errno says why. */
static inline bool file_write_all(int fd, const void *bytes, size_t size_bytes)
{
    for (size_t done = 0; done < size_bytes;) {
        ssize_t put = write(fd, (const char *)bytes + done, size_bytes - done);
        if (put < 0 && errno != EINTR)
            return false;
        done += put > 0 ? (size_t)put : 0;
    }
    return true;
}

#endif
