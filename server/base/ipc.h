/* SPDX-License-Identifier: MIT */
/* Messages between the roles of vitraild: length-prefixed JSON plus file descriptors over a
 * socketpair. Thread: any, one thread per direction of a socket at a time. */
#ifndef VITRAIL_SERVER_BASE_IPC_H
#define VITRAIL_SERVER_BASE_IPC_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

enum {
    IPC_FDS_MAX = 20, /* a request, a scene, those of 16 parts, a map, a reference */
    /* A frame's stats are 60 KiB at most; all that is larger travels as a memfd. */
    IPC_MESSAGE_BYTES = 1 << 20,
};

/* Zeroed = empty; owns its JSON and descriptors. */
struct ipc_message {
    json_t *json;
    int fds[IPC_FDS_MAX];
    int fd_count;
};
/* Accepts zeroed; closes descriptors not taken. */
void ipc_message_finish(struct ipc_message *message);

/* Hands descriptor `index` over to the caller; -1 when there is none. */
int ipc_message_take_fd(struct ipc_message *message, int index);

/* A connected pair of close-on-exec stream sockets. */
MUST_CHECK bool ipc_pair_create(int sockets[2], struct error *err);

/* Bounds how long one send or receive may stall, so that a wedged peer cannot wedge us. */
MUST_CHECK bool ipc_set_timeout(int socket, int timeout_s, struct error *err);

/* Borrows json and fds. Never raises SIGPIPE. */
MUST_CHECK bool ipc_send(int socket, const json_t *json, const int *fds, int fd_count,
                         struct error *err);

enum ipc_status { IPC_MESSAGE, IPC_CLOSED, IPC_FAILED };

/* Waits for one message (IPC_MESSAGE: the caller finishes it) or for the end of the stream
 * (IPC_CLOSED). */
MUST_CHECK enum ipc_status ipc_receive(int socket, struct ipc_message *message, struct error *err);

/* An error as {"code","message","pointer"}, both ways. */
MUST_CHECK json_t *ipc_error_to_json(const struct error *problem);
/* problem must hold no error; afterwards it does. */
void ipc_error_from_json(const json_t *json, struct error *problem);

/* A sealed memfd holding a copy of bytes; -1 on failure. */
MUST_CHECK int ipc_memfd_create(const char *name, const void *bytes, size_t size_bytes,
                                struct error *err);

/* Maps a whole file or memfd for reading. Empty files are refused. */
struct ipc_mapping {
    void *bytes;
    size_t size_bytes;
};
MUST_CHECK bool ipc_mapping_init(struct ipc_mapping *mapping, int fd, struct error *err);
void ipc_mapping_finish(struct ipc_mapping *mapping); /* accepts zeroed */

/* Writes everything, whatever the interruptions. */
MUST_CHECK bool ipc_pwrite_all(int fd, const void *bytes, size_t size_bytes, uint64_t offset_bytes,
                               struct error *err);
MUST_CHECK bool ipc_write_all(int fd, const void *bytes, size_t size_bytes, struct error *err);

#endif
