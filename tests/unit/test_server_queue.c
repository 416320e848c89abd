/* SPDX-License-Identifier: MIT */
/* What waits and what is remembered: the render queue, the quarantine, the reports of frames. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/front/frames.h"
#include "server/front/quarantine.h"
#include "server/front/render_queue.h"

static struct render_task *task(uint64_t ticket, enum render_priority priority)
{
    struct render_task *made = render_task_create();
    made->ticket = ticket;
    made->priority = priority;
    made->queued_us = (int64_t)(1000 - ticket);
    return made;
}

static uint64_t pop(struct render_queue *queue)
{
    struct render_task *first = render_queue_pop(queue);
    uint64_t ticket = first ? first->ticket : 0;
    render_task_destroy(first);
    return ticket;
}

static void urgent_tasks_go_first_and_equals_in_order(void **state)
{
    (void)state;
    struct render_queue queue = {0};
    assert_true(render_queue_push(&queue, task(1, RENDER_BATCH), 9));
    assert_true(render_queue_push(&queue, task(2, RENDER_NORMAL), 9));
    assert_true(render_queue_push(&queue, task(3, RENDER_INTERACTIVE), 9));
    assert_true(render_queue_push(&queue, task(4, RENDER_NORMAL), 9));
    render_queue_push_back(&queue, task(5, RENDER_NORMAL));
    assert_int_equal(5, queue.count);
    assert_int_equal(995, render_queue_oldest_us(&queue, 7000));
    uint64_t expected[] = {3, 5, 2, 4, 1, 0};
    for (size_t i = 0; i < 6; i++)
        assert_int_equal(expected[i], pop(&queue));
    assert_int_equal(7000, render_queue_oldest_us(&queue, 7000));
}

static void a_full_queue_refuses_but_takes_retries(void **state)
{
    (void)state;
    struct render_queue queue = {0};
    struct render_task *third = task(3, RENDER_NORMAL);
    assert_true(render_queue_push(&queue, task(1, RENDER_NORMAL), 2));
    assert_true(render_queue_push(&queue, task(2, RENDER_NORMAL), 2));
    assert_false(render_queue_push(&queue, third, 2));
    render_queue_push_back(&queue, third);
    assert_int_equal(3, pop(&queue));
    assert_int_equal(1, pop(&queue));
    assert_int_equal(2, pop(&queue));
}

static void a_task_can_be_taken_out_by_its_ticket_once(void **state)
{
    (void)state;
    struct render_queue queue = {0};
    for (uint64_t i = 1; i <= 3; i++)
        assert_true(render_queue_push(&queue, task(i, (enum render_priority)(i - 1)), 9));
    struct render_task *second = render_queue_remove(&queue, 2);
    assert_int_equal(2, second->ticket);
    render_task_destroy(second);
    assert_null(render_queue_remove(&queue, 2));
    assert_int_equal(1, pop(&queue));
    assert_int_equal(3, pop(&queue));
    assert_int_equal(0, queue.count);
}

static void two_crashes_in_a_row_quarantine_a_scene(void **state)
{
    (void)state;
    struct quarantine quarantine = {0};
    struct error err = {0};
    quarantine_add_crash(&quarantine, "a", "signal 11");
    assert_true(quarantine_check(&quarantine, "a", &err));
    quarantine_clear(&quarantine, "a"); /* a success between them */
    quarantine_add_crash(&quarantine, "a", "signal 11");
    assert_true(quarantine_check(&quarantine, "a", &err));
    quarantine_add_crash(&quarantine, "a", "signal 7");
    assert_false(quarantine_check(&quarantine, "a", &err));
    assert_int_equal(ERROR_RENDER_FAILED, err.code);
    assert_non_null(strstr(err.message, "signal 7"));
    err = (struct error){0};
    assert_true(quarantine_check(&quarantine, "b", &err));
    assert_int_equal(1, quarantine_count(&quarantine));
    quarantine_clear(&quarantine, "a");
    assert_true(quarantine_check(&quarantine, "a", &err));
    assert_int_equal(0, quarantine_count(&quarantine));
}

static void the_oldest_crash_is_forgotten_when_the_table_is_full(void **state)
{
    (void)state;
    struct quarantine quarantine = {0};
    struct error err = {0};
    char name[16];
    for (int i = 0; i < QUARANTINE_SCENES + 1; i++) {
        snprintf(name, sizeof name, "scene-%d", i);
        quarantine_add_crash(&quarantine, name, "x");
        quarantine_add_crash(&quarantine, name, "x");
    }
    assert_int_equal(QUARANTINE_SCENES, quarantine_count(&quarantine));
    assert_true(quarantine_check(&quarantine, "scene-0", &err));
    assert_false(quarantine_check(&quarantine, "scene-1", &err));
    assert_false(quarantine_check(&quarantine, name, &err));
}

static void the_newest_frames_are_kept(void **state)
{
    (void)state;
    struct error err = {0};
    struct frames *frames = frames_create(3, &err);
    for (int i = 0; i < 5; i++) {
        char id[FRAME_ID_BYTES], *json = NULL;
        snprintf(id, sizeof id, "%d", i);
        assert_true(asprintf(&json, "{%d}", i) > 0);
        frames_add(frames, id, json);
    }
    frames_add(frames, "none", NULL);
    assert_int_equal(3, frames_count(frames));
    assert_null(frames_get(frames, "1", &err));
    assert_int_equal(ERROR_NOT_FOUND, err.code);
    err = (struct error){0};
    char *json = frames_get(frames, "2", &err);
    assert_string_equal("{2}", json);
    free(json);
    frames_destroy(frames);
}

static void *add_and_get(void *context)
{
    struct error err = {0};
    for (int i = 0; i < 2000; i++) {
        char id[FRAME_ID_BYTES];
        if (!frames_make_id(id, &err))
            return NULL;
        frames_add(context, id, strdup("{}"));
        free(frames_get(context, id, NULL));
    }
    return context;
}

static void frames_may_be_used_by_several_threads(void **state)
{
    (void)state;
    struct error err = {0};
    struct frames *frames = frames_create(50, &err);
    pthread_t threads[4];
    for (int i = 0; i < 4; i++)
        assert_int_equal(0, pthread_create(&threads[i], NULL, add_and_get, frames));
    for (int i = 0; i < 4; i++) {
        void *result;
        pthread_join(threads[i], &result);
        assert_non_null(result);
    }
    assert_int_equal(50, frames_count(frames));
    frames_destroy(frames);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(urgent_tasks_go_first_and_equals_in_order),
        cmocka_unit_test(a_full_queue_refuses_but_takes_retries),
        cmocka_unit_test(a_task_can_be_taken_out_by_its_ticket_once),
        cmocka_unit_test(two_crashes_in_a_row_quarantine_a_scene),
        cmocka_unit_test(the_oldest_crash_is_forgotten_when_the_table_is_full),
        cmocka_unit_test(the_newest_frames_are_kept),
        cmocka_unit_test(frames_may_be_used_by_several_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
