/* SPDX-License-Identifier: MIT */
/* One object: the key, the factors with their covariance, and the views. */
#include "server/mapping/observations_file.h"

#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KEY_TEXT_BYTES = 17, FILE_BYTES_MAX = 1 << 20 };

/* ---- reading ---- */

static bool read_numbers(const json_t *array, double *numbers, size_t count)
{
    bool is_good = json_array_size(array) == count;
    for (size_t i = 0; is_good && i < count; i++) {
        const json_t *number = json_array_get(array, i);
        is_good = json_is_number(number);
        numbers[i] = json_number_value(number);
    }
    return is_good;
}

/* [count, passed]; what does not fit is left to learning_is_sound. */
static void read_run(const json_t *json, size_t at, struct learning_run *run)
{
    json_int_t count = json_integer_value(json_array_get(json, at));
    json_int_t passed = json_integer_value(json_array_get(json, at + 1));
    *run =
        (struct learning_run){count >= INT16_MIN && count <= INT16_MAX ? (int32_t)count : INT16_MAX,
                              passed == 0 || passed == 1 ? (int32_t)passed : INT16_MAX};
}

/* [key, off, clock, count, and the run; 1 where the view is drawn so] */
static bool read_view(const json_t *json, struct learning_view *view)
{
    const char *key = json_string_value(json_array_get(json, 0));
    json_int_t clock = json_integer_value(json_array_get(json, 2));
    json_int_t count = json_integer_value(json_array_get(json, 3));
    char *end = NULL;
    if (!key || strlen(key) != KEY_TEXT_BYTES - 1 || clock < 0 || count < 0 ||
        count > (json_int_t)UINT32_MAX || !json_is_number(json_array_get(json, 1)))
        return false;
    view->key = strtoull(key, &end, 16);
    view->off = json_number_value(json_array_get(json, 1));
    view->clock = (uint64_t)clock;
    view->count = (uint32_t)count;
    read_run(json, 4, &view->run);
    view->is_shown = json_integer_value(json_array_get(json, 6)) == 1;
    return !*end && view->key;
}

static bool read(const json_t *json, struct learning *learned)
{
    const json_t *doubt = json_object_get(json, "doubt"), *views = json_object_get(json, "views");
    json_int_t clock = json_integer_value(json_object_get(json, "observations"));
    size_t count = json_array_size(views);
    bool is_good = clock > 0 && json_array_size(doubt) == LEARNING_STATES && json_is_array(views) &&
                   count <= LEARNING_VIEWS_MAX &&
                   read_numbers(json_object_get(json, "factor"), learned->factor, LEARNING_STATES);
    for (size_t i = 0; i < LEARNING_FAMILIES; i++)
        read_run(json_object_get(json, "run"), 2 * i, &learned->run[i]);
    for (size_t i = 0; is_good && i < LEARNING_STATES; i++)
        is_good = read_numbers(json_array_get(doubt, i), learned->doubt[i], LEARNING_STATES);
    for (size_t i = 0; is_good && i < count; i++)
        is_good = read_view(json_array_get(views, i), &learned->views[i]);
    learned->clock = is_good ? (uint64_t)clock : 0;
    return is_good && learning_is_sound(learned);
}

/* No more than could have been written. */
static json_t *load(const char *path)
{
    FILE *file = fopen(path, "re");
    char *text = file ? malloc(FILE_BYTES_MAX) : NULL;
    size_t size = text ? fread(text, 1, FILE_BYTES_MAX, file) : 0;
    json_t *json = size && size < FILE_BYTES_MAX ? json_loadb(text, size, 0, NULL) : NULL;
    free(text);
    if (file)
        fclose(file);
    return json;
}

bool observations_file_load(struct learning *learned, const char *path, const char *key)
{
    json_t *json = load(path);
    const char *stored = json_string_value(json_object_get(json, "key"));
    learning_init(learned);
    bool is_good = stored && strcmp(stored, key) == 0 && read(json, learned);
    if (!is_good)
        learning_init(learned);
    json_decref(json);
    return is_good;
}

/* ---- writing ---- */

static json_t *write_numbers(const double *numbers, size_t count)
{
    json_t *array = json_array();
    for (size_t i = 0; i < count; i++)
        json_array_append_new(array, json_real(numbers[i]));
    return array;
}

static json_t *write_views(const struct learning *learned)
{
    json_t *array = json_array();
    for (int i = 0; i < LEARNING_VIEWS_MAX; i++) {
        const struct learning_view *view = &learned->views[i];
        char key[KEY_TEXT_BYTES];
        snprintf(key, sizeof key, "%016" PRIx64, view->key);
        if (view->key)
            json_array_append_new(array, json_pack("[s,f,I,I,i,i,i]", key, view->off,
                                                   (json_int_t)view->clock, (json_int_t)view->count,
                                                   (int)view->run.count, (int)view->run.passed,
                                                   (int)view->is_shown));
    }
    return array;
}

bool observations_file_save(const struct learning *learned, const char *path, const char *key,
                            struct error *err)
{
    char draft[4096 + 16];
    json_t *doubt = json_array(), *runs = json_array();
    for (int i = 0; i < LEARNING_STATES; i++)
        json_array_append_new(doubt, write_numbers(learned->doubt[i], LEARNING_STATES));
    for (int i = 0; i < LEARNING_FAMILIES; i++)
        for (int k = 0; k < 2; k++)
            json_array_append_new(runs,
                                  json_integer(k ? learned->run[i].passed : learned->run[i].count));
    json_t *json = json_pack("{s:s,s:I,s:o,s:o,s:o,s:o}", "key", key, "observations",
                             (json_int_t)learned->clock, "factor",
                             write_numbers(learned->factor, LEARNING_STATES), "run", runs, "doubt",
                             doubt, "views", write_views(learned));
    snprintf(draft, sizeof draft, "%s.draft", path);
    bool is_good =
        json && json_dump_file(json, draft, JSON_COMPACT) == 0 && rename(draft, path) == 0;
    json_decref(json);
    return is_good ||
           error_set(err, ERROR_INTERNAL, "'%s' cannot be written: %s", path, strerror(errno));
}
