/* SPDX-License-Identifier: MIT */
/* Which picture an idle worker times, and what it keeps for that. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <fcntl.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/worker/idle_timing.h"

static struct ipc_message message_of(const char *op, bool is_of_view, int id)
{
    struct error err = {0};
    int text = ipc_memfd_create("text", "{}", 2, &err);
    assert_true(text >= 0);
    return (struct ipc_message){
        .json = json_pack("{s:s,s:b,s:i}", "op", op, "reuse", is_of_view, "id", id),
        .fds = {text},
        .fd_count = 1};
}

static int id_of(const struct idle_timing *timing)
{
    return (int)json_integer_value(json_object_get(idle_timing_message(timing), "id"));
}

static bool is_open(int fd)
{
    return fcntl(fd, F_GETFD) != -1;
}

static void note(struct idle_timing *timing, const char *op, bool is_of_view, int id)
{
    struct ipc_message message = message_of(op, is_of_view, id);
    idle_timing_note(timing, &message);
    ipc_message_finish(&message);
}

static void only_renders_of_views_are_noted(void **state)
{
    struct idle_timing timing = {0};
    (void)state;
    note(&timing, "render", false, 1);
    note(&timing, "ask", true, 2);
    assert_null(idle_timing_message(&timing));
    note(&timing, "render", true, 3);
    note(&timing, "rest", false, 4);
    assert_int_equal(3, id_of(&timing));
    assert_true(is_open(timing.last.fds[0]));
    idle_timing_finish(&timing);
}

static void a_render_without_its_text_is_not_noted(void **state)
{
    struct idle_timing timing = {0};
    struct ipc_message message = message_of("render", true, 1);
    (void)state;
    close(ipc_message_take_fd(&message, 0));
    message.fd_count = 0;
    idle_timing_note(&timing, &message);
    ipc_message_finish(&message);
    assert_null(idle_timing_message(&timing));
}

static void the_next_picture_takes_the_place_of_the_last(void **state)
{
    struct idle_timing timing = {0};
    (void)state;
    note(&timing, "render", true, 1);
    int first = timing.last.fds[0];
    note(&timing, "render", true, 2);
    assert_int_equal(2, id_of(&timing));
    assert_int_not_equal(first, timing.last.fds[0]);
    assert_false(is_open(first));
    idle_timing_finish(&timing);
}

static bool never(void *context)
{
    (void)context;
    return false;
}

static void a_picture_whose_scenes_are_gone_is_forgotten_untimed(void **state)
{
    struct idle_timing timing = {0};
    (void)state;
    note(&timing, "render", true, 1);
    int text = timing.last.fds[0];
    assert_false(idle_timing_run(&timing, &(struct idle_timing_desc){.shall_stop = never}));
    assert_null(idle_timing_message(&timing));
    assert_false(is_open(text));
    assert_int_equal(0, timing.timed + timing.stopped);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(only_renders_of_views_are_noted),
        cmocka_unit_test(a_render_without_its_text_is_not_noted),
        cmocka_unit_test(the_next_picture_takes_the_place_of_the_last),
        cmocka_unit_test(a_picture_whose_scenes_are_gone_is_forgotten_untimed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
