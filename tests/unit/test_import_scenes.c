/* SPDX-License-Identifier: MIT */
/* Files with several scenes: which one is imported, and what is told of them. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/import_support.h"

#define FILE_OF(scenes) \
    "{'asset':{'version':'2.0'},'nodes':[{'name':'A'},{'name':'B'},{'name':'C'}]" scenes "}"
#define THREE \
    ",'scene':1,'scenes':[{'name':'Day','nodes':[0]},{'name':'Night','nodes':[1]},{'nodes':[2]}]"

struct told {
    char names[64]; /* each with a blank, and a star behind the one that is shown */
};

static bool tell(void *context, const char *name, bool is_shown, struct error *err)
{
    struct told *told = context;
    size_t length = strlen(told->names);
    (void)err;
    snprintf(told->names + length, sizeof told->names - length, "%s%s ", name, is_shown ? "*" : "");
    return true;
}

/* The name of the first node, in new memory; NULL with err set. */
static char *import(const char *json, const char *scene, struct told *told, struct error *err)
{
    size_t size;
    void *blob, *glb = glb_make(json, NULL, 0, &size);
    struct scene_file file = {"", glb, size};
    struct scene opened;
    *told = (struct told){""};
    bool is_done = scene_import(&(struct scene_import_desc){.files = &file,
                                                            .file_count = 1,
                                                            .scene = scene,
                                                            .tell_scene = tell,
                                                            .context = told},
                                &blob, &size, err) &&
                   scene_open(&opened, blob, size, err);
    char *name = is_done ? strdup(opened.strings + opened.nodes[0].name) : NULL;
    free(blob);
    free(glb);
    return name;
}

static void the_scene_that_is_asked_for_is_imported(void **state)
{
    (void)state;
    static const struct {
        const char *json, *scene, *node, *told;
    } cases[] = {
        {FILE_OF(THREE), NULL, "B", "Day Night*  "},
        {FILE_OF(THREE), "Day", "A", "Day* Night  "},
        {FILE_OF(THREE), "#0", "A", "Day* Night  "},
        {FILE_OF(THREE), "#2", "C", "Day Night * "},
        {FILE_OF(",'scenes':[{'name':'#1','nodes':[0]},{'nodes':[1]}]"), "#1", "A", "#1*  "},
        {FILE_OF(",'scene':9,'scenes':[{'name':'Day','nodes':[0]}]"), "Day", "A", "Day* "},
        {FILE_OF(""), NULL, "A", ""},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct told told;
        struct error err = {0};
        char *node = import(cases[i].json, cases[i].scene, &told, &err);
        if (!node)
            fail_msg("%zu: %s", i, err.message);
        assert_string_equal(node, cases[i].node);
        assert_string_equal(told.names, cases[i].told);
        free(node);
    }
}

static void a_scene_that_is_not_there_is_refused(void **state)
{
    (void)state;
    static const char *const scenes[] = {"Dusk", "day", "#3", "#", "#-1", "#0x1", "# 1", "1"};
    struct told told;
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
        struct error err = {0};
        assert_null(import(FILE_OF(THREE), scenes[i], &told, &err));
        assert_int_equal(err.code, ERROR_INVALID_REQUEST);
        assert_non_null(strstr(err.message, "among its 3: 'Day', 'Night', ''"));
    }
    struct error none = {0}, broken = {0};
    assert_null(import(FILE_OF(""), "#0", &told, &none));
    assert_int_equal(none.code, ERROR_INVALID_REQUEST);
    assert_null(import(FILE_OF(",'scene':9,'scenes':[{'nodes':[0]}]"), NULL, &told, &broken));
    assert_int_equal(broken.code, ERROR_INVALID_SCENE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_scene_that_is_asked_for_is_imported),
        cmocka_unit_test(a_scene_that_is_not_there_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
