/* SPDX-License-Identifier: MIT */
/* The plot of a trade-off: no two techniques look alike, and labels say what a setting is. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/shadow_technique.h"
#include "server/tradeoffs/tradeoff_plot.h"

static char *plot(enum shadow_technique shadows, int taps)
{
    struct tradeoff *tradeoff = calloc(1, sizeof *tradeoff);
    assert_non_null(tradeoff);
    tradeoff->row_count = 1;
    tradeoff->rows[0] = (struct tradeoff_row){
        .setting = {.shadows = shadows,
                    .shadow_resolution = 512,
                    .shadow_taps = taps,
                    .samples = 4},
        .rmse = 0.01,
        .warm = {.ms = {10}, .count = 1},
        .cold = {.ms = {20}, .count = 1},
        .is_on_front = true,
    };
    char *svg = tradeoff_to_svg(tradeoff);
    assert_non_null(svg);
    tradeoff_finish(tradeoff);
    free(tradeoff);
    return svg;
}

/* The mark of the only setting, without its title, as an owned string. */
static char *mark_of(enum shadow_technique shadows)
{
    char *svg = plot(shadows, 4);
    char *group = strstr(svg, "<g id=\"m0\""), *end = group ? strstr(group, "</g>") : NULL;
    char *title = group ? strstr(group, "<title>") : NULL;
    char *shape = title ? strstr(title, "</title>") : NULL;
    assert_true(shape && end && shape < end);
    *title = *end = '\0';
    size_t size = strlen(group) + strlen(shape) + 1;
    char *mark = malloc(size);
    assert_non_null(mark);
    strcpy(mark, group);
    strcat(mark, shape);
    free(svg);
    return mark;
}

static void each_technique_has_a_mark_of_its_own(void **state)
{
    char *marks[SHADOWS_COUNT] = {NULL};
    (void)state;
    for (int i = SHADOWS_AUTO + 1; i < SHADOWS_COUNT; i++) {
        marks[i] = mark_of((enum shadow_technique)i);
        for (int k = SHADOWS_AUTO + 1; k < i; k++)
            if (!strcmp(marks[i], marks[k]))
                fail_msg("%s and %s look alike: %s", shadow_technique_name(k),
                         shadow_technique_name(i), marks[i]);
    }
    for (int i = 0; i < SHADOWS_COUNT; i++)
        free(marks[i]);
}

static void labels_count_in_words(void **state)
{
    (void)state;
    char *one = plot(SHADOWS_DEEP, 1), *four = plot(SHADOWS_DEEP, 4);
    assert_non_null(strstr(one, ">deep 512, 1 tap, ×4<"));
    assert_non_null(strstr(four, ">deep 512, 4 taps, ×4<"));
    free(one);
    free(four);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_technique_has_a_mark_of_its_own),
        cmocka_unit_test(labels_count_in_words),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
