/* SPDX-License-Identifier: MIT */
/* Heads of requests, content negotiation, and the watch over connections. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <poll.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/base/clock.h"
#include "server/http/http_lines.h"
#include "server/http/http_rules.h"
#include "server/http/http_watch.h"
#include "server/http/negotiate.h"

/* ---- heads ---- */

/* fields: "Name: value|Name: value". Answers the message of the refusal, or "". */
static const char *check(const char *fields, bool is_change, struct error *err)
{
    const struct http_policy policy = {
        .is_loopback = true, .listen_host = "192.0.2.7", .allow_host = "a.example,b.example"};
    struct http_head head = {.is_change = is_change};
    static char text[1024];
    snprintf(text, sizeof text, "%s", fields);
    *err = (struct error){0};
    char *at = text;
    for (char *field; (field = strsep(&at, "|"));) {
        char *value = strchr(field, ':');
        *value = '\0';
        http_head_add(&head, field, value + 1 + strspn(value + 1, " "));
    }
    return http_head_check(&head, &policy, err) ? "" : err->message;
}

static void framing_that_two_readers_may_read_differently_is_refused(void **state)
{
    (void)state;
    static const struct {
        const char *fields, *part;
    } table[] = {
        {"Host: localhost", ""},
        {"Host: localhost|Content-Length: 12", ""},
        {"Host: localhost|Transfer-Encoding: Chunked", ""},
        {"X: y", "no Host"},
        {"Host: localhost|host: localhost", "2 Host"},
        {"Host: localhost|Content-Length: 1|content-length: 1", "2 Content-Length"},
        {"Host: localhost|Content-Length: 1|Transfer-Encoding: chunked", "both"},
        {"Host: localhost|Transfer-Encoding: chunked|Transfer-Encoding: chunked", "2 Transfer"},
        {"Host: localhost|Transfer-Encoding: gzip, chunked", "not understood"},
        {"Host: localhost|Transfer-Encoding: ", "not understood"},
        {"Host: localhost|Content-Length: ", "not a length"},
        {"Host: localhost|Content-Length: 1 1", "not a length"},
        {"Host: localhost|Content-Length: 1234567890123456789", "not a length"},
        {"Host: localhost|X: a\x01z", "control characters"},
        {"Host: evil.example", "not a name of this server"},
        {"Host: B.EXAMPLE:8090", ""},
        {"Host: 192.0.2.7", ""},
        {"Host: a.exampl", "not a name"},
        {"Host: ", "not a host"},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        struct error err;
        const char *message = check(table[i].fields, false, &err);
        if (*table[i].part ? !strstr(message, table[i].part) : *message != '\0')
            fail_msg("%s: '%s', expected '%s'", table[i].fields, message, table[i].part);
    }
}

/* A head as the library leaves it in its buffer, zeros in place of line ends; names and values are
 * told by their places. */
static bool is_plain(const char *head, size_t size_bytes, const int (*fields)[2], int count)
{
    struct http_lines lines;
    http_lines_init(&lines, head + 6);
    for (int i = 0; i < count; i++)
        http_lines_add(&lines, head + fields[i][0], head + fields[i][1]);
    return http_lines_are_plain(&lines, head, size_bytes);
}
#define IS_PLAIN(head, ...)                                         \
    is_plain(head, sizeof(head) - 1, (const int[][2]){__VA_ARGS__}, \
             sizeof((const int[][2]){__VA_ARGS__}) / sizeof(int[2]))

static void lines_of_a_head_are_plain_where_each_begins_behind_the_one_before(void **state)
{
    (void)state;
    assert_true(IS_PLAIN("GET\0/\0HTTP/1.1\0\0A\0 b\0\0C\0\0\0\0\0", {16, 19}, {22, 24}));
    assert_false(IS_PLAIN("GET\0/\0HTTP/1.1\0A\0 b\0\0\0\0", {15, 18})); /* LF after the version */
    assert_false(IS_PLAIN("GET\0/\0HTTP/1.1\0\0A\0 b\0\0\0", {16, 19})); /* LF after the field */
    assert_false(IS_PLAIN("GET\0/\0HTTP/1.1\0\0A\0 b\0x\0\0\0\0", {16, 19}));      /* a zero byte */
    assert_false(IS_PLAIN("GET\0/\0HTTP/1.1\0\0A\0 b\0\0\0 x\0\0\0\0", {16, 19})); /* no name */
    /* The name was copied and has grown; its value has not moved. */
    assert_false(IS_PLAIN("GET\0/\0HTTP/1.1\0\0A\0 b\0\0 c\0\0\0\0Ac\0", {28, 19}));
    assert_false(IS_PLAIN("GET\0/\0HTTP/1.1\0\0A\0 b\0\0\0\0", {16, 16}));
}

static void versions_of_the_library_that_leave_heads_in_place_are_known(void **state)
{
    (void)state;
    assert_true(http_lines_can_judge("0.9.75") && http_lines_can_judge("0.9.77"));
    assert_false(http_lines_can_judge("1.0.1") || http_lines_can_judge("0.10.1"));
}

static void foreign_pages_may_read_nothing_new_and_change_nothing(void **state)
{
    (void)state;
    struct error err;
    static const char foreign[] = "Host: localhost:8090|Origin: http://evil.example";
    assert_string_equal("", check(foreign, false, &err));
    assert_non_null(strstr(check(foreign, true, &err), "may not change"));
    assert_string_equal("",
                        check("Host: localhost:8090|Origin: http://localhost:8090", true, &err));
    assert_non_null(
        strstr(check("Host: localhost|Sec-Fetch-Site: cross-site", true, &err), "another site"));
}

static void the_length_of_a_body_is_known_or_without_bound(void **state)
{
    (void)state;
    struct http_head head = {0};
    assert_int_equal(0, http_head_body_bytes(&head));
    http_head_add(&head, "Content-Length", "123456789012");
    assert_true(http_head_body_bytes(&head) == 123456789012u);
    http_head_add(&head, "Transfer-Encoding", "chunked");
    assert_true(http_head_body_bytes(&head) == UINT64_MAX);
}

/* ---- negotiation ---- */

static void only_allowed_formats_are_negotiated(void **state)
{
    (void)state;
    enum image_format format;
    struct error err = {0};
    unsigned lossless = 1u << IMAGE_FORMAT_PNG | 1u << IMAGE_FORMAT_EXR;
    assert_true(negotiate_format("image/jpeg, image/x-exr;q=0.1", lossless, &format, &err));
    assert_int_equal(IMAGE_FORMAT_EXR, format);
    assert_true(negotiate_format(NULL, lossless, &format, &err));
    assert_int_equal(IMAGE_FORMAT_PNG, format);
    assert_false(negotiate_format("image/jpeg", lossless, &format, &err));
    assert_int_equal(ERROR_NOT_ACCEPTABLE, err.code);
    assert_null(strstr(err.message, "jpeg"));
}

static void odd_accept_headers_are_survived(void **state)
{
    (void)state;
    static const char *const odd[] = {
        ",,,",  ";q=1",        "image/png;q=",      "image/png;q=9",
        "*",    "image/png;",  "\"image/png, x\"",  "image/png;q=1.0000001",
        "*/*;", "image/png;x", "image/png ; q=0.5 "};
    for (size_t i = 0; i < sizeof odd / sizeof odd[0]; i++) {
        enum image_format format = IMAGE_FORMAT_COUNT;
        struct error err = {0};
        if (negotiate_format(odd[i], 15, &format, &err))
            assert_int_in_range(format, 0, IMAGE_FORMAT_COUNT - 1);
        else
            assert_int_equal(ERROR_NOT_ACCEPTABLE, err.code);
    }
}

static void tags_match_as_a_whole(void **state)
{
    (void)state;
    assert_true(negotiate_tag_matches("\"abc\"", "\"abc\""));
    assert_true(negotiate_tag_matches("\"x,y\" ,W/\"abc\"", "\"abc\""));
    assert_true(negotiate_tag_matches("*", "\"abc\""));
    assert_false(negotiate_tag_matches("\"abcd\", \"ab\", abc, W/", "\"abc\""));
    assert_false(negotiate_tag_matches(NULL, "\"abc\""));
    assert_true(negotiate_is_type("Application/JSON ; charset=utf-8", "application/json"));
    assert_false(negotiate_is_type("application/jsonp", "application/json"));
    assert_false(negotiate_is_type(NULL, "application/json"));
}

/* ---- the watch ---- */

struct watched_pair {
    struct http_watch *watch;
    struct http_watched *watched;
    int ours, theirs;
    atomic_uint_least64_t gone;
};

static void pair_begin(struct watched_pair *pair)
{
    struct error err = {0};
    int fds[2];
    *pair = (struct watched_pair){0};
    assert_int_equal(0, socketpair(AF_UNIX, SOCK_STREAM, 0, fds));
    pair->ours = fds[0];
    pair->theirs = fds[1];
    pair->watch = http_watch_create(
        &(struct http_watch_desc){
            .head_ms = 300, .idle_ms = 700, .patience_ms = 500, .least_bytes_per_s = 1000},
        &err);
    assert_non_null(pair->watch);
    pair->watched = http_watch_add(pair->watch, pair->ours);
    assert_non_null(pair->watched);
}

static void pair_end(struct watched_pair *pair)
{
    http_watch_remove(pair->watch, pair->watched);
    http_watch_destroy(pair->watch);
    close(pair->ours);
    close(pair->theirs);
}

/* Milliseconds until the peer sees the end, or -1 after wait_ms. */
static int ms_until_shut(const struct watched_pair *pair, int wait_ms)
{
    int64_t began = now_ms();
    struct pollfd end = {.fd = pair->theirs, .events = POLLRDHUP};
    return poll(&end, 1, wait_ms) > 0 ? (int)(now_ms() - began) : -1;
}

static void a_head_that_does_not_come_ends_the_connection(void **state)
{
    (void)state;
    struct watched_pair pair;
    pair_begin(&pair);
    assert_int_in_range(ms_until_shut(&pair, 3000), 100, 2000);
    pair_end(&pair);
}

static void a_body_may_be_large_but_not_slow(void **state)
{
    (void)state;
    struct watched_pair pair;
    pair_begin(&pair);
    http_watch_expect_body(pair.watch, pair.watched);
    http_watch_count_body(pair.watch, pair.watched, 2000); /* earns two seconds */
    assert_int_equal(-1, ms_until_shut(&pair, 1500));
    assert_int_in_range(ms_until_shut(&pair, 5000), 0, 4000);
    pair_end(&pair);
}

static void a_client_that_leaves_in_its_body_is_noticed(void **state)
{
    (void)state;
    struct watched_pair pair;
    pair_begin(&pair);
    http_watch_expect_body(pair.watch, pair.watched);
    http_watch_count_body(pair.watch, pair.watched, 1 << 20);
    assert_int_equal(0, shutdown(pair.theirs, SHUT_WR));
    struct pollfd end = {.fd = pair.theirs, .events = POLLRDHUP};
    assert_int_equal(1, poll(&end, 1, 3000));
    pair_end(&pair);
}

static void on_gone(void *context, uint64_t ticket)
{
    atomic_store((atomic_uint_least64_t *)context, ticket);
}

static void who_waits_has_no_deadline_but_is_missed_when_gone(void **state)
{
    (void)state;
    struct watched_pair pair;
    pair_begin(&pair);
    http_watch_wait(pair.watch, pair.watched, on_gone, &pair.gone, 42);
    assert_int_equal(-1, ms_until_shut(&pair, 1500));
    assert_int_equal(0, atomic_load(&pair.gone));
    shutdown(pair.theirs, SHUT_WR);
    for (int i = 0; i < 300 && atomic_load(&pair.gone) == 0; i++)
        nanosleep(&(struct timespec){.tv_nsec = 10000000}, NULL);
    assert_int_equal(42, atomic_load(&pair.gone));
    pair_end(&pair);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(framing_that_two_readers_may_read_differently_is_refused),
        cmocka_unit_test(lines_of_a_head_are_plain_where_each_begins_behind_the_one_before),
        cmocka_unit_test(versions_of_the_library_that_leave_heads_in_place_are_known),
        cmocka_unit_test(foreign_pages_may_read_nothing_new_and_change_nothing),
        cmocka_unit_test(the_length_of_a_body_is_known_or_without_bound),
        cmocka_unit_test(only_allowed_formats_are_negotiated),
        cmocka_unit_test(odd_accept_headers_are_survived),
        cmocka_unit_test(tags_match_as_a_whole),
        cmocka_unit_test(a_head_that_does_not_come_ends_the_connection),
        cmocka_unit_test(a_body_may_be_large_but_not_slow),
        cmocka_unit_test(a_client_that_leaves_in_its_body_is_noticed),
        cmocka_unit_test(who_waits_has_no_deadline_but_is_missed_when_gone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
