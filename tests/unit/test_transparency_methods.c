/* SPDX-License-Identifier: MIT */
/* The table of transparency methods: each row has functions, and what each says of itself. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/transparency/method.h"

static bool lights_by_one_of_its_passes(const struct transparency_method *method)
{
    for (const struct transparency_pass *pass = method->passes; pass->name; pass++)
        if (pass->is_of_light && !strcmp(pass->name, method->surfaces->pass))
            return true;
    return false;
}

static void every_row_has_functions(void **state)
{
    (void)state;
    for (int i = 0; i < TRANSPARENCIES_COUNT; i++) {
        const struct transparency_method *method = transparency_method_of((enum transparency)i);
        assert_non_null(method);
        assert_int_equal(method->id, i == TRANSPARENCY_AUTO ? TRANSPARENCY_LISTS : i);
        assert_true(method->surfaces && method->compositing);
        assert_non_null(method->passes[0].name);
        assert_false(method->passes[0].is_conditional); /* the one that counts */
        assert_true(lights_by_one_of_its_passes(method));
        assert_true(method->list_programs && method->count && method->find);
        assert_true(method->light && method->count_sets);
        assert_true(method->bind && method->report && method->clear && method->finish &&
                    method->size_bytes);
    }
}

static void what_auto_takes_goes_with_everything(void **state)
{
    (void)state;
    const struct transparency_method *method = transparency_method_of(TRANSPARENCY_AUTO);
    assert_int_equal(transparency_method_lacks(method, TRANSPARENCY_CAN_ALL), 0);
    assert_int_equal(transparency_method_lacks(method, TRANSPARENCY_CAN_ALL + 1u),
                     TRANSPARENCY_CAN_ALL + 1u); /* a bit that no row has */
}

static void layers_of_no_method_hold_nothing(void **state)
{
    (void)state;
    struct layers layers = {.method = NULL};
    layers_clear(&layers);
    assert_int_equal(layers_size_bytes(&layers), 0);
    layers_finish(&layers);
    assert_null(layers.method);
}

static void layers_keep_their_method_and_what_they_may_take(void **state)
{
    (void)state;
    const struct transparency_method *lists = transparency_method_of(TRANSPARENCY_LISTS);
    struct layers layers = {.most_bytes = 5};
    assert_true(layers_change_method(&layers, lists));
    assert_false(layers_change_method(&layers, lists));
    assert_int_equal(layers.most_bytes, 5);
    layers_clear(&layers);
    assert_true(layers.method == lists);
}

static bool add_surfaces(void *context, const struct surface_set *set, struct error *err)
{
    uint64_t *surfaces = context;
    (void)err;
    assert_ptr_equal(set->kind, transparency_method_of(TRANSPARENCY_LISTS)->surfaces);
    *surfaces += set->count;
    return set->count != 9;
}

static void lists_are_lit_at_once(void **state)
{
    (void)state;
    const struct transparency_method *lists = transparency_method_of(TRANSPARENCY_LISTS);
    const struct window_frame frame = {.programs = NULL};
    struct layers layers = {.method = lists};
    struct error err = {0};
    uint64_t surfaces = 0;
    const struct surface_lighter lighter = {.context = &surfaces, .light = add_surfaces};
    assert_int_equal(lists->count_sets(&layers), 0);
    assert_true(lists->light(&layers, &frame, NULL, &lighter, &err));
    assert_int_equal(surfaces, 0);
    layers.layer_count = 7;
    assert_int_equal(lists->count_sets(&layers), 1);
    assert_true(lists->light(&layers, &frame, NULL, &lighter, &err));
    assert_int_equal(surfaces, 7);
    layers.layer_count = 9; /* a lighter that fails */
    assert_false(lists->light(&layers, &frame, NULL, &lighter, &err));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_row_has_functions),
        cmocka_unit_test(what_auto_takes_goes_with_everything),
        cmocka_unit_test(layers_of_no_method_hold_nothing),
        cmocka_unit_test(layers_keep_their_method_and_what_they_may_take),
        cmocka_unit_test(lists_are_lit_at_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
