/* SPDX-License-Identifier: MIT */
/* Jobs in flight: room for urgent ones, pauses, which job is charged with a crash, and deadlines.
 * And the inbox at its end, where urgent messages overtake and renders are cancelled. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/front/worker_jobs.h"
#include "server/worker/inbox.h"

enum { LIMIT_MS = 1000 };

static struct worker_job *send_job(struct worker_jobs *jobs, uint64_t ticket,
                                   enum render_priority priority, int64_t now_ms)
{
    struct render_task *task = render_task_create();
    task->ticket = ticket;
    task->priority = priority;
    worker_jobs_add(jobs, task, now_ms);
    return &jobs->list[jobs->count - 1];
}

static void remove_all(struct worker_jobs *jobs)
{
    while (jobs->count > 0) {
        render_task_destroy(jobs->list[0].task);
        worker_jobs_remove(jobs, 0);
    }
}

static void urgent_jobs_have_room_of_their_own(void **state)
{
    (void)state;
    struct worker_jobs jobs = {.depth = 2};
    for (uint64_t i = 1; i <= 2; i++) {
        assert_true(worker_jobs_have_room(&jobs, RENDER_BATCH));
        send_job(&jobs, i, i == 1 ? RENDER_NORMAL : RENDER_BATCH, 0);
    }
    assert_false(worker_jobs_have_room(&jobs, RENDER_NORMAL));
    for (uint64_t i = 3; i <= 4; i++) {
        assert_true(worker_jobs_have_room(&jobs, RENDER_INTERACTIVE));
        send_job(&jobs, i, RENDER_INTERACTIVE, 0);
    }
    assert_false(worker_jobs_have_room(&jobs, RENDER_INTERACTIVE));
    assert_int_equal(2, worker_jobs_find(&jobs, 3));
    assert_int_equal(-1, worker_jobs_find(&jobs, 5));
    remove_all(&jobs);
    assert_true(worker_jobs_have_room(&jobs, RENDER_NORMAL));
}

static void what_is_left_of_a_stage_follows_from_its_pace(void **state)
{
    (void)state;
    struct job_progress progress = {0};
    job_progress_note(&progress, "shadows", 0.2, 1000);
    assert_true(progress.left_s < 0);
    job_progress_note(&progress, "shadows", 0.3, 1250);
    assert_true(progress.left_s < 0); /* too early to tell */
    job_progress_note(&progress, "shadows", 0.6, 2000);
    assert_float_equal(1.0, progress.left_s, 1e-9); /* 0.4 in a second, 0.4 are left */
    job_progress_note(&progress, "shading", 0.1, 2500);
    assert_string_equal("shading", progress.stage);
    assert_true(progress.left_s < 0);
    job_progress_note(&progress, "shading", 0.6, 3500);
    assert_float_equal(0.8, progress.left_s, 1e-9);
    job_progress_note(&progress, "shading", 0.5, 3600); /* a window comes again */
    assert_true(progress.left_s < 0);
    assert_float_equal(0.5, progress.share, 1e-9);
}

static void a_pause_does_not_count_against_a_frame(void **state)
{
    (void)state;
    struct worker_jobs jobs = {.depth = 2};
    struct worker_job *slow = send_job(&jobs, 1, RENDER_NORMAL, 0);
    assert_true(worker_job_note(slow, "begin", 100));
    assert_int_equal(1100, worker_jobs_deadline(&jobs, LIMIT_MS, 100));
    struct worker_job *urgent = send_job(&jobs, 2, RENDER_INTERACTIVE, 300);
    assert_int_equal(1100, worker_jobs_deadline(&jobs, LIMIT_MS, 300)); /* it waits for the other */
    assert_true(worker_job_note(slow, "paused", 400));
    assert_int_equal(1400, worker_jobs_deadline(&jobs, LIMIT_MS, 400));
    assert_int_equal(0, worker_jobs_culprit(&jobs, false));
    assert_true(worker_job_note(urgent, "begin", 410));
    assert_int_equal(1410, worker_jobs_deadline(&jobs, LIMIT_MS, 410));
    /* Not the one that was begun before it. */
    assert_int_equal(1, worker_jobs_culprit(&jobs, false));
    assert_true(worker_job_note(urgent, "rendered", 900));
    assert_int_equal(0, worker_jobs_culprit(&jobs, false));
    assert_true(worker_job_note(slow, "resumed", 900));
    assert_int_equal(1600, worker_jobs_deadline(&jobs, LIMIT_MS, 900)); /* 300 ms of it are used */
    assert_false(worker_job_note(slow, "done", 950));
    remove_all(&jobs);
    assert_int_equal(-1, worker_jobs_culprit(&jobs, false));
    assert_true(worker_jobs_deadline(&jobs, LIMIT_MS, 0) == INT64_MAX);
}

static void a_task_may_have_a_limit_of_its_own(void **state)
{
    (void)state;
    struct worker_jobs jobs = {.depth = 1};
    struct worker_job *job = send_job(&jobs, 1, RENDER_NORMAL, 0);
    job->task->limit_ms = 50;
    assert_int_equal(1000, worker_jobs_deadline(&jobs, LIMIT_MS, 0));
    worker_job_note(job, "begin", 10);
    assert_int_equal(60, worker_jobs_deadline(&jobs, LIMIT_MS, 10));
    remove_all(&jobs);
}

/* Two are begun: one on the device, and the next, whose own time begins when the device is free. */
static void a_frame_on_the_device_answers_for_itself_alone(void **state)
{
    (void)state;
    struct worker_jobs jobs = {.depth = 3};
    struct worker_job *first = send_job(&jobs, 1, RENDER_NORMAL, 0);
    send_job(&jobs, 2, RENDER_NORMAL, 0);
    send_job(&jobs, 3, RENDER_NORMAL, 0);
    assert_true(worker_job_note(first, "begin", 100));
    assert_true(worker_job_note(first, "submitted", 300));
    assert_int_equal(1100, worker_jobs_deadline(&jobs, LIMIT_MS, 300)); /* of its begin */
    assert_int_equal(0, worker_jobs_culprit(&jobs, false));
    assert_true(worker_job_note(&jobs.list[1], "begin", 310));
    assert_true(worker_jobs_have(&jobs, JOB_ON_DEVICE));
    assert_int_equal(1100, worker_jobs_deadline(&jobs, LIMIT_MS, 310));
    assert_int_equal(1, worker_jobs_culprit(&jobs, false)); /* a crash is of the GL thread */
    assert_int_equal(0, worker_jobs_culprit(&jobs, true));  /* what is late is the device */
    worker_jobs_note_free_device(&jobs, 900);
    assert_true(worker_job_note(first, "rendered", 900));
    assert_int_equal(1900, worker_jobs_deadline(&jobs, LIMIT_MS, 900)); /* not of 310 */
    assert_int_equal(1, worker_jobs_culprit(&jobs, true));
    assert_true(worker_job_note(&jobs.list[1], "submitted", 1000));
    assert_int_equal(1900, worker_jobs_deadline(&jobs, LIMIT_MS, 1000));
    remove_all(&jobs);
}

static void a_lost_context_is_charged_to_who_lost_it(void **state)
{
    (void)state;
    struct worker_jobs jobs = {.depth = 3};
    for (uint64_t i = 1; i <= 2; i++)
        assert_true(worker_job_note(send_job(&jobs, i, RENDER_NORMAL, 0), "begin", (int64_t)i));
    worker_job_note(&jobs.list[0], "submitted", 5);
    worker_jobs_note_lost(&jobs, 0);
    assert_int_equal(0, worker_jobs_culprit(&jobs, false));
    worker_job_note(&jobs.list[1], "begin", 6);
    worker_job_note(&jobs.list[0], "submitted", 7);
    worker_jobs_note_lost(&jobs, 1);
    assert_int_equal(1, worker_jobs_culprit(&jobs, false));
    remove_all(&jobs);
}

/* ---- the inbox ---- */

static void post(int socket, json_t *message)
{
    struct error err = {0};
    assert_true(ipc_send(socket, message, NULL, 0, &err));
    json_decref(message);
}

static bool may_take(void *context, const json_t *message)
{
    return json_integer_value(json_object_get(message, "id")) != *(const int *)context;
}

static void expect(const struct ipc_message *message, int id)
{
    assert_int_equal(id, json_integer_value(json_object_get(message->json, "id")));
}

/* Waits for what another thread is about to do. */
static void wait_for_urgent(const struct inbox *inbox, unsigned arrivals)
{
    for (int i = 0; i < 5000 && inbox_urgent_arrivals(inbox) != arrivals; i++)
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    assert_int_equal(arrivals, inbox_urgent_arrivals(inbox));
}

static void urgent_messages_overtake_and_others_keep_their_order(void **state)
{
    (void)state;
    int sockets[2], not_this = 2;
    struct error err = {0};
    assert_true(ipc_pair_create(sockets, &err));
    struct inbox *inbox = inbox_create(sockets[1], &err);
    assert_non_null(inbox);
    for (int i = 1; i <= 4; i++)
        post(sockets[0], json_pack("{s:s,s:i,s:b}", "op", "render", "id", i, "urgent", i % 2 == 0));
    wait_for_urgent(inbox, 2);
    assert_int_equal(2, inbox_urgent_count(inbox));
    struct ipc_message message = {0};
    assert_true(inbox_take_urgent(inbox, may_take, &not_this, &message));
    expect(&message, 4);
    ipc_message_finish(&message);
    assert_false(inbox_take_urgent(inbox, may_take, &not_this, &message));
    for (int i = 1; i <= 3; i++) {
        assert_true(inbox_take(inbox, &message));
        expect(&message, i);
        ipc_message_finish(&message);
    }
    assert_int_equal(0, inbox_urgent_count(inbox));
    close(sockets[0]);
    assert_false(inbox_take(inbox, &message));
    inbox_destroy(inbox);
    close(sockets[1]);
}

static void a_render_is_cancelled_before_or_while_it_is_current(void **state)
{
    (void)state;
    int sockets[2];
    struct error err = {0};
    assert_true(ipc_pair_create(sockets, &err));
    struct inbox *inbox = inbox_create(sockets[1], &err);
    assert_non_null(inbox);
    inbox_set_current(inbox, 7);
    post(sockets[0], json_pack("{s:s,s:i}", "op", "cancel", "id", 8));
    post(sockets[0], json_pack("{s:s,s:i,s:b}", "op", "render", "id", 9, "urgent", 1));
    wait_for_urgent(inbox, 1);
    assert_false(inbox_is_cancelled(inbox));
    inbox_set_current(inbox, 8);
    assert_true(inbox_is_cancelled(inbox));
    inbox_set_current(inbox, 0);
    assert_false(inbox_is_cancelled(inbox));
    inbox_set_current(inbox, 7);
    post(sockets[0], json_pack("{s:s,s:i}", "op", "cancel", "id", 7));
    post(sockets[0], json_pack("{s:s,s:i,s:b}", "op", "render", "id", 10, "urgent", 1));
    wait_for_urgent(inbox, 2);
    assert_true(inbox_is_cancelled(inbox));
    inbox_destroy(inbox); /* with two messages in it */
    close(sockets[0]);
    close(sockets[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(urgent_jobs_have_room_of_their_own),
        cmocka_unit_test(what_is_left_of_a_stage_follows_from_its_pace),
        cmocka_unit_test(a_pause_does_not_count_against_a_frame),
        cmocka_unit_test(a_task_may_have_a_limit_of_its_own),
        cmocka_unit_test(a_frame_on_the_device_answers_for_itself_alone),
        cmocka_unit_test(a_lost_context_is_charged_to_who_lost_it),
        cmocka_unit_test(urgent_messages_overtake_and_others_keep_their_order),
        cmocka_unit_test(a_render_is_cancelled_before_or_while_it_is_current),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
