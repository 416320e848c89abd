/* SPDX-License-Identifier: MIT */
/* The HTTP server ends whatever its threads are doing: while clients connect, and while a request
 * is between its wait and its answer. */
#include <arpa/inet.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/http/http.h"

enum { LONG_ENOUGH_MS = 100 }; /* for another thread to do what it is about to do */

static const char request[] = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";

static void rest(int ms)
{
    nanosleep(&(struct timespec){.tv_nsec = ms * 1000000}, NULL);
}

/* ---- a client ---- */

static int connect_to(int port)
{
    const struct sockaddr_in address = {.sin_family = AF_INET,
                                        .sin_port = htons((uint16_t)port),
                                        .sin_addr = {htonl(INADDR_LOOPBACK)}};
    int peer = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_true(peer >= 0);
    assert_int_equal(0, connect(peer, (const struct sockaddr *)&address, sizeof address));
    return peer;
}

static void ask(int peer)
{
    assert_int_equal(sizeof request - 1, send(peer, request, sizeof request - 1, MSG_NOSIGNAL));
}

/* Of the reply's first line; 0 where the connection ends without one. */
static int status_of_reply(int peer)
{
    char text[512] = "";
    int status = 0;
    if (recv(peer, text, sizeof text - 1, 0) > 0)
        assert_int_equal(1, sscanf(text, "HTTP/1.1 %d", &status));
    return status;
}

/* ---- a server ---- */

static struct {
    struct config config;
    struct log log;
    struct http_server *server;
    bool waits;                 /* requests are answered after a wait */
    atomic_bool is_between;     /* a request waits and has no answer yet */
    atomic_int port_of_clients; /* while it is not 0 the main thread's epoll_ctl lets one come */
    pthread_t main;
} stage;

/* libmicrohttpd's calls come here, too. Before the main thread takes a socket out of the epoll of
 * one of the server's threads, a client wakes that thread. */
int epoll_ctl(int epoll, int what, int fd, struct epoll_event *event)
{
    int port = atomic_load(&stage.port_of_clients);
    if (port && what == EPOLL_CTL_DEL && pthread_equal(pthread_self(), stage.main)) {
        int peer = connect_to(port);
        rest(LONG_ENOUGH_MS);
        close(peer);
    }
    return (int)syscall(SYS_epoll_ctl, epoll, what, fd, event);
}

static void open_exchange(void *context, struct http_exchange *exchange)
{
    (void)context, (void)exchange;
}

static void run_exchange(void *context, struct http_exchange *exchange)
{
    (void)context;
    if (stage.waits) {
        http_wait(exchange, NULL, NULL, 0);
        atomic_store(&stage.is_between, true);
        rest(LONG_ENOUGH_MS);
    }
    http_reply_empty(exchange, 204);
    if (stage.waits)
        http_resume(exchange);
}

static void begin(bool waits)
{
    struct error err = {0};
    struct sockaddr_in *address = (struct sockaddr_in *)(void *)&stage.config.address;
    stage.config = (struct config){.listen = "127.0.0.1:0",
                                   .listen_host = "127.0.0.1",
                                   .is_loopback = true,
                                   .connections = 16};
    *address = (struct sockaddr_in){.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    stage.waits = waits;
    stage.main = pthread_self();
    atomic_store(&stage.is_between, false);
    stage.server = http_server_create(
        &(struct http_server_desc){
            .config = &stage.config,
            .log = &stage.log,
            .service = {.open = open_exchange, .run = run_exchange, .close = open_exchange}},
        &err);
    if (!stage.server || !http_server_start(stage.server, &err))
        fail_msg("%s", err.message);
}

/* ---- claims ---- */

static void clients_that_come_while_the_server_quiesces_end_nothing(void **state)
{
    (void)state;
    begin(false);
    int port = http_server_port(stage.server), before = connect_to(port);
    ask(before);
    assert_int_equal(204, status_of_reply(before));
    atomic_store(&stage.port_of_clients, port);
    http_server_quiesce(stage.server);
    atomic_store(&stage.port_of_clients, 0);
    int after = connect_to(port);
    assert_int_equal(0, status_of_reply(after));
    ask(before); /* who was there is served until the end */
    assert_int_equal(204, status_of_reply(before));
    http_server_destroy(stage.server);
    close(after);
    close(before);
}

static void a_request_that_is_about_to_be_answered_is_answered(void **state)
{
    (void)state;
    begin(true);
    int peer = connect_to(http_server_port(stage.server));
    ask(peer);
    for (int i = 0; i < 100 && !atomic_load(&stage.is_between); i++)
        rest(LONG_ENOUGH_MS / 10);
    assert_true(atomic_load(&stage.is_between));
    http_server_quiesce(stage.server);
    http_server_destroy(stage.server); /* which ends the process where it finds one waiting */
    close(peer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(clients_that_come_while_the_server_quiesces_end_nothing),
        cmocka_unit_test(a_request_that_is_about_to_be_answered_is_answered),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
