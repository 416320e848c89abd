/* SPDX-License-Identifier: MIT */
/* One datagram to the socket named in the environment. */
#include "server/base/sd_notify.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

void sd_notify_state(const char *state)
{
    const char *path = getenv("NOTIFY_SOCKET");
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    size_t length = path ? strlen(path) : 0;
    if (length < 2 || length >= sizeof address.sun_path || (path[0] != '/' && path[0] != '@'))
        return;
    memcpy(address.sun_path, path, length);
    if (path[0] == '@')
        address.sun_path[0] = '\0'; /* the abstract namespace */
    int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0)
        return;
    const void *to = &address;
    ssize_t ignored = sendto(fd, state, strlen(state), MSG_NOSIGNAL, to,
                             (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length));
    (void)ignored; /* a service manager that is gone is none of our business */
    close(fd);
}
