/* SPDX-License-Identifier: MIT */
/* Messages between the roles: whole or not at all, with their descriptors, whatever the peer does.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <dirent.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/base/ipc.h"

static void make_pair(int sockets[2])
{
    struct error err = {0};
    assert_true(ipc_pair_create(sockets, &err));
}

static int open_files(void)
{
    int count = 0;
    DIR *directory = opendir("/proc/self/fd");
    while (readdir(directory))
        count++;
    closedir(directory);
    return count;
}

static void a_message_arrives_with_its_descriptors(void **state)
{
    (void)state;
    int sockets[2];
    struct error err = {0};
    make_pair(sockets);
    int first = ipc_memfd_create("one", "first", 5, &err);
    int second = ipc_memfd_create("two", "second", 6, &err);
    json_t *json = json_pack("{s:s,s:I}", "op", "héllo", "n", (json_int_t)1 << 60);
    assert_true(ipc_send(sockets[0], json, (int[]){first, second}, 2, &err));
    assert_true(ipc_send(sockets[0], json, NULL, 0, &err));

    struct ipc_message message;
    assert_int_equal(IPC_MESSAGE, ipc_receive(sockets[1], &message, &err));
    assert_true(json_equal(json, message.json));
    assert_int_equal(2, message.fd_count);
    int taken = ipc_message_take_fd(&message, 1);
    assert_int_equal(-1, ipc_message_take_fd(&message, 2));
    ipc_message_finish(&message);
    struct ipc_mapping mapping;
    assert_true(ipc_mapping_init(&mapping, taken, &err));
    assert_memory_equal("second", mapping.bytes, mapping.size_bytes);
    ipc_mapping_finish(&mapping);
    assert_true(fcntl(taken, F_GETFD) & FD_CLOEXEC);
    assert_int_equal(-1, write(taken, "x", 1)); /* sealed */

    assert_int_equal(IPC_MESSAGE, ipc_receive(sockets[1], &message, &err));
    assert_int_equal(0, message.fd_count);
    ipc_message_finish(&message);
    json_decref(json);
    int fds[] = {first, second, taken, sockets[0], sockets[1]};
    for (size_t i = 0; i < 5; i++)
        close(fds[i]);
}

struct sending {
    int socket;
    json_t *json;
};

static void *send_large(void *argument)
{
    struct sending *sending = argument;
    struct error err = {0};
    for (int i = 0; i < 20; i++)
        if (!ipc_send(sending->socket, sending->json, NULL, 0, &err))
            return NULL;
    return sending;
}

static void messages_larger_than_the_socket_arrive_whole(void **state)
{
    (void)state;
    int sockets[2];
    struct error err = {0};
    make_pair(sockets);
    char *text = malloc(1000000);
    memset(text, 'x', 999999);
    text[999999] = '\0';
    struct sending sending = {sockets[0], json_pack("{s:s}", "text", text)};
    pthread_t thread;
    assert_int_equal(0, pthread_create(&thread, NULL, send_large, &sending));
    for (int i = 0; i < 20; i++) {
        struct ipc_message message;
        assert_int_equal(IPC_MESSAGE, ipc_receive(sockets[1], &message, &err));
        assert_int_equal(999999, json_string_length(json_object_get(message.json, "text")));
        ipc_message_finish(&message);
    }
    void *result;
    pthread_join(thread, &result);
    assert_non_null(result);
    json_decref(sending.json);
    free(text);
    close(sockets[0]);
    close(sockets[1]);
}

static void what_does_not_fit_is_not_sent(void **state)
{
    (void)state;
    int sockets[2];
    struct error err = {0};
    make_pair(sockets);
    char *text = malloc(IPC_MESSAGE_BYTES + 1);
    memset(text, 'x', IPC_MESSAGE_BYTES);
    text[IPC_MESSAGE_BYTES] = '\0';
    json_t *json = json_pack("{s:s}", "text", text);
    assert_false(ipc_send(sockets[0], json, NULL, 0, &err));
    assert_non_null(strstr(err.message, "limit"));
    json_decref(json);
    free(text);
    close(sockets[0]);
    struct ipc_message message;
    err = (struct error){0};
    assert_int_equal(IPC_CLOSED, ipc_receive(sockets[1], &message, &err));
    assert_int_equal(ERROR_NONE, err.code);
    close(sockets[1]);
}

static void a_peer_that_lies_or_dies_is_an_error(void **state)
{
    (void)state;
    static const struct {
        uint32_t magic, size_bytes;
        const char *text;
    } table[] = {{0x56495432, 5, "{}"},
                 {0x56495432, 2, "[]"},
                 {0x56495432, 2, "{"},
                 {0x56495432, 0, ""},
                 {0x12345678, 2, "{}"},
                 {0x56495432, 0xffffffff, "{}"},
                 {0x56495432, 14, "{\"a\":1,\"a\":2}"}};
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        int sockets[2];
        make_pair(sockets);
        uint32_t header[2] = {table[i].magic, table[i].size_bytes};
        assert_int_equal(8, write(sockets[0], header, 8));
        size_t length = strlen(table[i].text);
        assert_int_equal(length, write(sockets[0], table[i].text, length));
        close(sockets[0]);
        struct ipc_message message;
        struct error err = {0};
        assert_int_equal(IPC_FAILED, ipc_receive(sockets[1], &message, &err));
        assert_int_equal(ERROR_INTERNAL, err.code);
        close(sockets[1]);
    }
}

static void a_peer_that_stalls_inside_a_message_is_an_error_in_time(void **state)
{
    (void)state;
    int sockets[2];
    struct error err = {0};
    make_pair(sockets);
    assert_true(ipc_set_timeout(sockets[1], 1, &err));
    assert_int_equal(3, write(sockets[0], "2TI", 3));
    struct ipc_message message;
    assert_int_equal(IPC_FAILED, ipc_receive(sockets[1], &message, &err));
    assert_non_null(strstr(err.message, "stalled"));
    close(sockets[0]);
    close(sockets[1]);
}

static void descriptors_beyond_the_limit_do_not_leak(void **state)
{
    (void)state;
    int sockets[2];
    make_pair(sockets);
    int before = open_files();
    union {
        char bytes[CMSG_SPACE(10 * sizeof(int))];
        struct cmsghdr align;
    } control = {0};
    uint32_t header[2] = {0x56495432, 2};
    struct iovec part = {header, sizeof header};
    struct msghdr message = {.msg_iov = &part,
                             .msg_iovlen = 1,
                             .msg_control = control.bytes,
                             .msg_controllen = sizeof control.bytes};
    struct cmsghdr *cmsg = CMSG_FIRSTHDR(&message);
    cmsg->cmsg_level = SOL_SOCKET;
    cmsg->cmsg_type = SCM_RIGHTS;
    cmsg->cmsg_len = CMSG_LEN(10 * sizeof(int));
    for (size_t i = 0; i < 10; i++)
        memcpy(CMSG_DATA(cmsg) + i * sizeof(int), &sockets[0], sizeof(int));
    assert_int_equal(8, sendmsg(sockets[0], &message, 0));
    assert_int_equal(2, write(sockets[0], "{}", 2));
    struct ipc_message received;
    struct error err = {0};
    assert_int_equal(IPC_MESSAGE, ipc_receive(sockets[1], &received, &err));
    assert_true(received.fd_count <= IPC_FDS_MAX);
    ipc_message_finish(&received);
    assert_int_equal(before, open_files());
    close(sockets[0]);
    close(sockets[1]);
}

static void errors_cross_the_wire(void **state)
{
    (void)state;
    struct error sent = {0}, received = {0};
    error_set_at(&sent, ERROR_OVER_BUDGET, "/width", "needs %d MiB", 7);
    json_t *json = ipc_error_to_json(&sent);
    ipc_error_from_json(json, &received);
    json_decref(json);
    assert_int_equal(sent.code, received.code);
    assert_string_equal(sent.message, received.message);
    assert_string_equal(sent.pointer, received.pointer);
    struct error unknown = {0};
    ipc_error_from_json(NULL, &unknown);
    assert_int_equal(ERROR_INTERNAL, unknown.code);
    assert_true(unknown.message[0] != '\0');
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_message_arrives_with_its_descriptors),
        cmocka_unit_test(messages_larger_than_the_socket_arrive_whole),
        cmocka_unit_test(what_does_not_fit_is_not_sent),
        cmocka_unit_test(a_peer_that_lies_or_dies_is_an_error),
        cmocka_unit_test(a_peer_that_stalls_inside_a_message_is_an_error_in_time),
        cmocka_unit_test(descriptors_beyond_the_limit_do_not_leak),
        cmocka_unit_test(errors_cross_the_wire),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
