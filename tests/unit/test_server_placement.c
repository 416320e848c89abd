/* SPDX-License-Identifier: MIT */
/* Which worker gets which task, over slots that are filled by hand. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/front/placement.h"

enum { WORKERS = 2, DEPTH = 3, TASKS_MAX = 16 };

struct farm {
    struct worker_slot *slots;
    struct render_task *made[TASKS_MAX];
    int made_count;
};

static int set_up(void **state)
{
    struct farm *farm = calloc(1, sizeof *farm);
    farm->slots = calloc(WORKERS, sizeof *farm->slots);
    for (int i = 0; i < WORKERS; i++) {
        assert_true(worker_slot_init(&farm->slots[i], i + 1, false));
        farm->slots[i].state = WORKER_READY;
        farm->slots[i].jobs.depth = DEPTH;
    }
    *state = farm;
    return 0;
}

static int tear_down(void **state)
{
    struct farm *farm = *state;
    for (int i = 0; i < farm->made_count; i++)
        render_task_destroy(farm->made[i]);
    for (int i = 0; i < WORKERS; i++)
        worker_slot_finish(&farm->slots[i]);
    free(farm->slots);
    free(farm);
    return 0;
}

static struct render_task *make(struct farm *farm, const char *scene, enum render_priority priority)
{
    struct render_task *task = render_task_create();
    assert_true(farm->made_count < TASKS_MAX);
    farm->made[farm->made_count++] = task;
    task->ticket = (uint64_t)farm->made_count;
    task->priority = priority;
    strcpy(task->scene, scene);
    return task;
}

/* Gives a task away as the supervisor does; the index of its worker, -1: it waits. */
static int place(struct farm *farm, struct render_task *task)
{
    int chosen = placement_choose(farm->slots, WORKERS, task);
    if (chosen >= 0) {
        worker_jobs_add(&farm->slots[chosen].jobs, task, 0);
        worker_slot_note_sent(&farm->slots[chosen], task->scene);
    }
    return chosen;
}

static int place_new(struct farm *farm, const char *scene, enum render_priority priority)
{
    return place(farm, make(farm, scene, priority));
}

static void scenes_spread_over_workers(void **state)
{
    struct farm *farm = *state;
    const char *const scenes[] = {"a", "b", "c", "d"};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(i % 2, place_new(farm, scenes[i], RENDER_NORMAL));
        farm->slots[i % 2].jobs.count = 0;
    }
}

static void a_task_goes_where_its_scene_is(void **state)
{
    struct farm *farm = *state;
    worker_slot_note_sent(&farm->slots[1], "a");
    assert_int_equal(1, place_new(farm, "a", RENDER_NORMAL));
    assert_int_equal(1, place_new(farm, "a", RENDER_NORMAL)); /* behind one: no reason to load it */
    worker_slot_forget(&farm->slots[1], "a");
    assert_int_equal(0, place_new(farm, "a", RENDER_NORMAL));
}

static void a_scene_is_loaded_elsewhere_where_its_queue_is_longer_by_two(void **state)
{
    struct farm *farm = *state;
    const int expected[] = {0, 0, 1, 1, 0, 1, -1};
    for (size_t i = 0; i < sizeof expected / sizeof expected[0]; i++)
        assert_int_equal(expected[i], place_new(farm, "a", RENDER_BATCH));
}

static void what_is_encoded_is_no_load(void **state)
{
    struct farm *farm = *state;
    assert_int_equal(0, place_new(farm, "a", RENDER_BATCH));
    assert_int_equal(0, place_new(farm, "a", RENDER_BATCH));
    farm->slots[0].jobs.list[0].state = JOB_ENCODING;
    assert_int_equal(0, place_new(farm, "a", RENDER_BATCH));
}

static void urgent_tasks_are_no_matter_of_jobs_where_their_scene_is(void **state)
{
    struct farm *farm = *state;
    for (int i = 0; i < DEPTH; i++) {
        worker_jobs_add(&farm->slots[0].jobs, make(farm, "film", RENDER_BATCH), 0);
        worker_slot_note_sent(&farm->slots[0], "film");
    }
    assert_int_equal(0, place_new(farm, "film", RENDER_INTERACTIVE));  /* it makes them pause */
    assert_int_equal(1, place_new(farm, "other", RENDER_INTERACTIVE)); /* it would wait for them */
    assert_int_equal(1, place_new(farm, "film", RENDER_BATCH));
}

static void a_view_stays_on_its_worker_until_that_ends(void **state)
{
    struct farm *farm = *state;
    worker_slot_note_sent(&farm->slots[1], "a");
    for (int i = 0; i < DEPTH + 1; i++) {
        struct render_task *task = make(farm, "a", RENDER_INTERACTIVE);
        task->home = 1;
        assert_int_equal(i < DEPTH ? 0 : -1, place(farm, task)); /* it waits for that one */
    }
    farm->slots[0].jobs.count = 0;
    worker_slot_note_end(&farm->slots[0]);
    struct render_task *task = make(farm, "a", RENDER_INTERACTIVE);
    task->home = 1;
    assert_int_equal(1, place(farm, task));
}

static void workers_that_do_not_serve_get_nothing(void **state)
{
    struct farm *farm = *state;
    worker_slot_note_sent(&farm->slots[0], "a");
    farm->slots[0].is_deaf = true;
    assert_int_equal(1, place_new(farm, "a", RENDER_NORMAL));
    farm->slots[1].state = WORKER_STARTING;
    assert_int_equal(-1, place_new(farm, "a", RENDER_NORMAL));
}

static uint64_t take(struct farm *farm, struct render_queue *queue, int count)
{
    int chosen;
    struct render_task *task = placement_take(queue, farm->slots, count, &chosen);
    if (task)
        worker_jobs_add(&farm->slots[chosen].jobs, task, 0);
    return task ? task->ticket : 0;
}

static void no_question_is_begun_while_urgent_tasks_wait(void **state)
{
    struct farm *farm = *state;
    struct render_queue queue = {0};
    struct render_task *question = make(farm, "a", RENDER_NORMAL); /* ticket 1 */
    question->question = json_object();
    farm->slots[0].jobs.depth = 1;
    worker_jobs_add(&farm->slots[0].jobs, make(farm, "a", RENDER_INTERACTIVE), 0);
    assert_true(render_queue_push(&queue, question, 9));
    assert_true(render_queue_push(&queue, make(farm, "a", RENDER_BATCH), 9));       /* 3 */
    assert_true(render_queue_push(&queue, make(farm, "a", RENDER_INTERACTIVE), 9)); /* 4 */
    assert_int_equal(0, take(farm, &queue, 1));
    worker_jobs_remove(&farm->slots[0].jobs, 0);
    assert_int_equal(4, take(farm, &queue, 1));
    assert_int_equal(1, take(farm, &queue, 1));
    assert_int_equal(0, take(farm, &queue, 1));
    farm->slots[0].jobs.count = 0;
    assert_int_equal(3, take(farm, &queue, 1));
    assert_int_equal(0, queue.count);
}

static void one_that_waits_for_its_worker_keeps_no_other_waiting(void **state)
{
    struct farm *farm = *state;
    struct render_queue queue = {0};
    for (int i = 0; i < DEPTH; i++)
        worker_jobs_add(&farm->slots[0].jobs, make(farm, "a", RENDER_INTERACTIVE), 0);
    struct render_task *of_view = make(farm, "a", RENDER_INTERACTIVE); /* 4 */
    of_view->home = 1;
    assert_true(render_queue_push(&queue, of_view, 9));
    assert_true(render_queue_push(&queue, make(farm, "b", RENDER_INTERACTIVE), 9)); /* 5 */
    assert_int_equal(5, take(farm, &queue, WORKERS));
    assert_int_equal(0, take(farm, &queue, WORKERS));
    farm->slots[0].jobs.count = 0;
    assert_int_equal(4, take(farm, &queue, WORKERS));
}

static void a_slot_remembers_the_scenes_that_were_sent_last(void **state)
{
    struct worker_slot *slot = &((struct farm *)*state)->slots[0];
    char id[DIGEST_TEXT_BYTES];
    for (int i = 0; i <= WORKER_SCENES_MAX; i++) {
        snprintf(id, sizeof id, "scene %d", i);
        worker_slot_note_sent(slot, id);
        worker_slot_note_sent(slot, "scene 0");
    }
    assert_true(worker_slot_has_scene(slot, "scene 0"));
    assert_false(worker_slot_has_scene(slot, "scene 1"));
    assert_true(worker_slot_has_scene(slot, id));
    worker_slot_note_end(slot);
    assert_false(worker_slot_has_scene(slot, id));
}

#define TEST(claim) cmocka_unit_test_setup_teardown(claim, set_up, tear_down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(scenes_spread_over_workers),
        TEST(a_task_goes_where_its_scene_is),
        TEST(a_scene_is_loaded_elsewhere_where_its_queue_is_longer_by_two),
        TEST(what_is_encoded_is_no_load),
        TEST(urgent_tasks_are_no_matter_of_jobs_where_their_scene_is),
        TEST(a_view_stays_on_its_worker_until_that_ends),
        TEST(workers_that_do_not_serve_get_nothing),
        TEST(no_question_is_begun_while_urgent_tasks_wait),
        TEST(one_that_waits_for_its_worker_keeps_no_other_waiting),
        TEST(a_slot_remembers_the_scenes_that_were_sent_last),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
