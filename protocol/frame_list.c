/* SPDX-License-Identifier: MIT */
/* A list is read twice: the first pass counts, so that a short text cannot ask for much memory. */
#include "protocol/frame_list.h"

#include <stdlib.h>
#include <string.h>

struct range {
    int first, last, step;
};

static size_t range_count(const struct range *range)
{
    return (size_t)((range->last - range->first) / range->step) + 1;
}

/* Reads digits; false: there are none, or the number is too large. */
static bool read_number(const char **at, int *number)
{
    const char *begin = *at;
    *number = 0;
    for (; **at >= '0' && **at <= '9'; (*at)++) {
        *number = 10 * *number + (**at - '0');
        if (*number > FRAME_NUMBER_MAX)
            return false;
    }
    return *at > begin;
}

/* Reads the item that ends at `end`. */
static bool read_item(const char *at, const char *end, struct range *range, struct error *err)
{
    const char *item = at;
    int length = (int)(end - at);
    bool is_good = read_number(&at, &range->first);
    range->last = range->first;
    range->step = 1;
    if (is_good && *at == '-') {
        at++;
        is_good = read_number(&at, &range->last);
        if (is_good && *at == 'x') {
            at++;
            is_good = read_number(&at, &range->step) && range->step > 0;
        }
    }
    if (!is_good || at != end)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "frames: '%.*s' is no frame (12), range (1-100) or range with a step "
                         "(1-100x2) of numbers from 0 to %d",
                         length < 40 ? length : 40, item, FRAME_NUMBER_MAX);
    return range->first <= range->last ||
           error_set(err, ERROR_INVALID_REQUEST, "frames: '%.*s' ends before it begins", length,
                     item);
}

/* Calls take with every range. */
static bool for_each_item(const char *text, void *context,
                          bool (*take)(void *context, const struct range *range, struct error *err),
                          struct error *err)
{
    for (const char *at = text;; at++) {
        struct range range;
        at += strspn(at, " ");
        const char *end = at + strcspn(at, ", ");
        if (!read_item(at, end, &range, err) || !take(context, &range, err))
            return false;
        at = end + strspn(end, " ");
        if (!*at)
            return true;
        if (*at != ',')
            return error_set(err, ERROR_INVALID_REQUEST, "frames: no comma before '%.40s'", at);
    }
}

struct counting {
    size_t count, max_count;
};

static bool count_range(void *context, const struct range *range, struct error *err)
{
    struct counting *counting = context;
    counting->count += range_count(range);
    return counting->count <= counting->max_count ||
           error_set(err, ERROR_TOO_LARGE, "frames: more than %zu frames, which is the limit",
                     counting->max_count);
}

static bool append_range(void *context, const struct range *range, struct error *err)
{
    struct frame_list *list = context;
    (void)err;
    for (size_t i = 0, count = range_count(range); i < count; i++)
        list->numbers[list->count++] = range->first + (int)i * range->step;
    return true;
}

static int compare_numbers(const void *left, const void *right)
{
    const int *a = left, *b = right;
    return (*a > *b) - (*a < *b);
}

static bool check_unique(const struct frame_list *list, struct error *err)
{
    int *sorted = malloc(list->count * sizeof *sorted);
    if (!sorted)
        return error_set(err, ERROR_NO_MEMORY, "list of frames");
    memcpy(sorted, list->numbers, list->count * sizeof *sorted);
    qsort(sorted, list->count, sizeof *sorted, compare_numbers);
    bool is_good = true;
    for (size_t i = 1; i < list->count && is_good; i++)
        if (sorted[i] == sorted[i - 1])
            is_good = error_set(err, ERROR_INVALID_REQUEST, "frames: frame %d is listed twice",
                                sorted[i]);
    free(sorted);
    return is_good;
}

bool frame_list_parse(const char *text, size_t max_count, struct frame_list *list,
                      struct error *err)
{
    struct counting counting = {.max_count = max_count};
    *list = (struct frame_list){0};
    if (strlen(text) >= FRAME_LIST_TEXT_BYTES)
        return error_set(err, ERROR_TOO_LARGE, "frames: the list is longer than %d bytes",
                         FRAME_LIST_TEXT_BYTES - 1);
    if (!for_each_item(text, &counting, count_range, err))
        return false;
    list->numbers = malloc(counting.count * sizeof *list->numbers);
    if (!list->numbers)
        return error_set(err, ERROR_NO_MEMORY, "list of frames");
    if (for_each_item(text, list, append_range, err) && check_unique(list, err))
        return true;
    frame_list_finish(list);
    return false;
}

void frame_list_finish(struct frame_list *list)
{
    free(list->numbers);
    *list = (struct frame_list){0};
}
