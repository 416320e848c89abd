/* SPDX-License-Identifier: MIT */
/* Framed messages with descriptors: an 8-byte header that carries the descriptors, then the JSON
 * text. */
#include "server/base/ipc.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

enum { IPC_MAGIC = 0x56495432 }; /* "VIT2": a stream out of step is noticed at once */

struct ipc_header {
    uint32_t magic;
    uint32_t size_bytes;
};

union control {
    char bytes[CMSG_SPACE(sizeof(int) * IPC_FDS_MAX)];
    struct cmsghdr align;
};

void ipc_message_finish(struct ipc_message *message)
{
    json_decref(message->json);
    for (int i = 0; i < message->fd_count; i++)
        if (message->fds[i] >= 0)
            close(message->fds[i]);
    *message = (struct ipc_message){0};
}

int ipc_message_take_fd(struct ipc_message *message, int index)
{
    if (index < 0 || index >= message->fd_count)
        return -1;
    int fd = message->fds[index];
    message->fds[index] = -1;
    return fd;
}

bool ipc_pair_create(int sockets[2], struct error *err)
{
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0)
        return error_set(err, ERROR_INTERNAL, "socketpair: %s", strerror(errno));
    return true;
}

bool ipc_set_timeout(int socket, int timeout_s, struct error *err)
{
    struct timeval limit = {.tv_sec = timeout_s};
    if (setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit) != 0 ||
        setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit) != 0)
        return error_set(err, ERROR_INTERNAL, "setsockopt: %s", strerror(errno));
    return true;
}

static bool send_all(int socket, const void *bytes, size_t size_bytes, struct error *err)
{
    const char *at = bytes;
    while (size_bytes > 0) {
        ssize_t sent = send(socket, at, size_bytes, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR)
            continue;
        if (sent < 0)
            return error_set(err, ERROR_INTERNAL, "send to peer: %s", strerror(errno));
        at += sent;
        size_bytes -= (size_t)sent;
    }
    return true;
}

static bool send_header(int socket, const struct ipc_header *header, const int *fds, int fd_count,
                        struct error *err)
{
    struct iovec part = {.iov_base = &(struct ipc_header){header->magic, header->size_bytes},
                         .iov_len = sizeof *header};
    union control control = {0};
    struct msghdr message = {.msg_iov = &part, .msg_iovlen = 1};
    if (fd_count > 0) {
        message.msg_control = control.bytes;
        message.msg_controllen = CMSG_SPACE(sizeof(int) * (size_t)fd_count);
        struct cmsghdr *cmsg = CMSG_FIRSTHDR(&message);
        cmsg->cmsg_level = SOL_SOCKET;
        cmsg->cmsg_type = SCM_RIGHTS;
        cmsg->cmsg_len = CMSG_LEN(sizeof(int) * (size_t)fd_count);
        memcpy(CMSG_DATA(cmsg), fds, sizeof(int) * (size_t)fd_count);
    }
    ssize_t sent;
    do
        sent = sendmsg(socket, &message, MSG_NOSIGNAL);
    while (sent < 0 && errno == EINTR);
    if (sent < 0)
        return error_set(err, ERROR_INTERNAL, "send to peer: %s", strerror(errno));
    /* The descriptors went with the first byte; what is left of the header goes plainly. */
    return send_all(socket, (const char *)header + sent, sizeof *header - (size_t)sent, err);
}

bool ipc_send(int socket, const json_t *json, const int *fds, int fd_count, struct error *err)
{
    if (fd_count < 0 || fd_count > IPC_FDS_MAX)
        return error_set(err, ERROR_INTERNAL, "%d descriptors in one message, limit is %d",
                         fd_count, IPC_FDS_MAX);
    char *text = json_dumps(json, JSON_COMPACT);
    if (!text)
        return error_set(err, ERROR_NO_MEMORY, "message to peer");
    size_t size_bytes = strlen(text);
    bool is_sent = false;
    if (size_bytes > IPC_MESSAGE_BYTES) {
        error_set(err, ERROR_INTERNAL, "message of %zu bytes, limit is %d", size_bytes,
                  IPC_MESSAGE_BYTES);
    } else {
        struct ipc_header header = {IPC_MAGIC, (uint32_t)size_bytes};
        is_sent = send_header(socket, &header, fds, fd_count, err) &&
                  send_all(socket, text, size_bytes, err);
    }
    free(text);
    return is_sent;
}

/* Keeps up to IPC_FDS_MAX descriptors and closes the rest: a peer cannot make us leak. */
static void collect_fds(struct msghdr *received, struct ipc_message *message)
{
    for (struct cmsghdr *cmsg = CMSG_FIRSTHDR(received); cmsg; cmsg = CMSG_NXTHDR(received, cmsg)) {
        if (cmsg->cmsg_level != SOL_SOCKET || cmsg->cmsg_type != SCM_RIGHTS)
            continue;
        size_t count = (cmsg->cmsg_len - CMSG_LEN(0)) / sizeof(int);
        for (size_t i = 0; i < count; i++) {
            int fd;
            memcpy(&fd, CMSG_DATA(cmsg) + i * sizeof fd, sizeof fd);
            if (message->fd_count < IPC_FDS_MAX)
                message->fds[message->fd_count++] = fd;
            else
                close(fd);
        }
    }
}

/* Reads exactly size_bytes; false with *got = 0 at a clean end of stream, false with an error
 * otherwise. */
static bool receive_all(int socket, void *bytes, size_t size_bytes, struct ipc_message *message,
                        size_t *got, struct error *err)
{
    *got = 0;
    while (*got < size_bytes) {
        struct iovec part = {.iov_base = (char *)bytes + *got, .iov_len = size_bytes - *got};
        union control control = {0};
        struct msghdr received = {.msg_iov = &part,
                                  .msg_iovlen = 1,
                                  .msg_control = control.bytes,
                                  .msg_controllen = sizeof control.bytes};
        ssize_t size = recvmsg(socket, &received, MSG_CMSG_CLOEXEC);
        if (size < 0 && errno == EINTR)
            continue;
        if (size < 0 && errno != ECONNRESET)
            return error_set(err, ERROR_INTERNAL, "receive from peer: %s",
                             errno == EAGAIN ? "stalled in the middle of a message"
                                             : strerror(errno));
        if (size > 0)
            collect_fds(&received, message);
        if (size <= 0)
            return *got == 0 ? false
                             : error_set(err, ERROR_INTERNAL, "peer ended inside a message");
        *got += (size_t)size;
    }
    return true;
}

enum ipc_status ipc_receive(int socket, struct ipc_message *message, struct error *err)
{
    *message = (struct ipc_message){0};
    struct error problem = {0};
    struct ipc_header header;
    size_t got;
    char *text = NULL;
    if (!receive_all(socket, &header, sizeof header, message, &got, &problem)) {
        if (problem.code == ERROR_NONE) {
            ipc_message_finish(message);
            return IPC_CLOSED;
        }
        goto fail;
    }
    if (header.magic != IPC_MAGIC || header.size_bytes > IPC_MESSAGE_BYTES) {
        error_set(&problem, ERROR_INTERNAL, "peer sent a malformed message header");
        goto fail;
    }
    text = malloc((size_t)header.size_bytes + 1);
    if (!text) {
        error_set(&problem, ERROR_NO_MEMORY, "message of %u bytes", header.size_bytes);
        goto fail;
    }
    if (!receive_all(socket, text, header.size_bytes, message, &got, &problem)) {
        error_set(&problem, ERROR_INTERNAL, "peer ended inside a message");
        goto fail;
    }
    json_error_t where;
    message->json = json_loadb(text, header.size_bytes, JSON_REJECT_DUPLICATES, &where);
    if (!json_is_object(message->json)) {
        error_set(&problem, ERROR_INTERNAL, "peer sent what is not a JSON object: %s", where.text);
        goto fail;
    }
    free(text);
    return IPC_MESSAGE;

fail:
    free(text);
    ipc_message_finish(message);
    error_pass(err, &problem);
    return IPC_FAILED;
}

json_t *ipc_error_to_json(const struct error *problem)
{
    return json_pack("{s:s,s:s,s:s}", "code", error_code_name(problem->code), "message",
                     problem->message, "pointer", problem->pointer);
}

void ipc_error_from_json(const json_t *json, struct error *problem)
{
    const char *code = json_string_value(json_object_get(json, "code"));
    const char *message = json_string_value(json_object_get(json, "message"));
    const char *pointer = json_string_value(json_object_get(json, "pointer"));
    enum error_code known = code ? error_code_from_name(code) : ERROR_INTERNAL;
    if (known == ERROR_NONE)
        known = ERROR_INTERNAL;
    error_set_at(problem, known, pointer ? pointer : "", "%s",
                 message && *message ? message : "peer gave no reason");
}

int ipc_memfd_create(const char *name, const void *bytes, size_t size_bytes, struct error *err)
{
    int fd = memfd_create(name, MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (fd < 0) {
        error_set(err, ERROR_NO_MEMORY, "memfd_create: %s", strerror(errno));
        return -1;
    }
    if (!ipc_write_all(fd, bytes, size_bytes, err))
        goto fail;
    if (fcntl(fd, F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_GROW | F_SEAL_SHRINK | F_SEAL_SEAL) != 0) {
        error_set(err, ERROR_INTERNAL, "sealing a memfd: %s", strerror(errno));
        goto fail;
    }
    return fd;

fail:
    close(fd);
    return -1;
}

bool ipc_mapping_init(struct ipc_mapping *mapping, int fd, struct error *err)
{
    *mapping = (struct ipc_mapping){0};
    struct stat about;
    if (fd < 0 || fstat(fd, &about) != 0)
        return error_set(err, ERROR_INTERNAL, "mapping: %s",
                         fd < 0 ? "no descriptor" : strerror(errno));
    if (about.st_size <= 0)
        return error_set(err, ERROR_INTERNAL, "mapping: the file is empty");
    void *bytes = mmap(NULL, (size_t)about.st_size, PROT_READ, MAP_PRIVATE, fd, 0);
    if (bytes == MAP_FAILED)
        return error_set(err, ERROR_NO_MEMORY, "mapping %lld bytes: %s", (long long)about.st_size,
                         strerror(errno));
    mapping->bytes = bytes;
    mapping->size_bytes = (size_t)about.st_size;
    return true;
}

void ipc_mapping_finish(struct ipc_mapping *mapping)
{
    if (mapping->bytes)
        munmap(mapping->bytes, mapping->size_bytes);
    *mapping = (struct ipc_mapping){0};
}

/* offset_bytes: NULL writes where the descriptor stands. */
static bool write_all(int fd, const void *bytes, size_t size_bytes, const uint64_t *offset_bytes,
                      struct error *err)
{
    const char *at = bytes;
    for (size_t done = 0; done < size_bytes;) {
        ssize_t written =
            offset_bytes ? pwrite(fd, at + done, size_bytes - done, (off_t)(*offset_bytes + done))
                         : write(fd, at + done, size_bytes - done);
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            return error_set(err, ERROR_IO, "write: %s", strerror(errno));
        done += (size_t)written;
    }
    return true;
}

bool ipc_write_all(int fd, const void *bytes, size_t size_bytes, struct error *err)
{
    return write_all(fd, bytes, size_bytes, NULL, err);
}

bool ipc_pwrite_all(int fd, const void *bytes, size_t size_bytes, uint64_t offset_bytes,
                    struct error *err)
{
    return write_all(fd, bytes, size_bytes, &offset_bytes, err);
}
