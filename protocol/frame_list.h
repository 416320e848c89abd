/* SPDX-License-Identifier: MIT */
/* Lists of frame numbers, as "1-100,120-140x2": numbers and ranges with a step, as render farms
 * write them. Thread: any. */
#ifndef VITRAIL_PROTOCOL_FRAME_LIST_H
#define VITRAIL_PROTOCOL_FRAME_LIST_H

#include <stddef.h>

#include "protocol/error.h"

enum {
    FRAME_NUMBER_MAX = 99999999,
    FRAME_LIST_TEXT_BYTES = 4096, /* with its NUL */
};

/* Zeroed = no frames. */
struct frame_list {
    int *numbers; /* owned; in the order of the list, each once, [0, FRAME_NUMBER_MAX] */
    size_t count;
};

/* Reads a list: items "N", "N-M" or "N-MxSTEP" with N <= M, between commas, which spaces may
 * follow. Refuses more than max_count frames before any is stored, and a frame that is listed
 * twice; err names the item. On failure the list is zeroed. */
MUST_CHECK bool frame_list_parse(const char *text, size_t max_count, struct frame_list *list,
                                 struct error *err);
void frame_list_finish(struct frame_list *list); /* accepts zeroed; zeroes */

#endif
