/* SPDX-License-Identifier: MIT */
/* The value of --device: what gl_device_parse takes, several of that with commas between them, or
 * "all", which stands for the render nodes of the machine. Thread: any. */
#ifndef VITRAIL_SERVER_BASE_DEVICE_LIST_H
#define VITRAIL_SERVER_BASE_DEVICE_LIST_H

#include <stddef.h>

#include "protocol/error.h"

struct device_list_limits {
    int most;     /* entries */
    size_t bytes; /* of the text, with its NUL */
};
/* ERROR_INVALID_REQUEST names what is wrong with which entry. */
MUST_CHECK bool device_list_check(const char *list, const struct device_list_limits *limits,
                                  struct error *err);

/* The render nodes (renderD128 and so on) of a folder, `/dev/dri`, in the order of their numbers,
 * as a list of --device. ERROR_INVALID_REQUEST where there is none, or more than the limits take.
 */
MUST_CHECK bool device_list_of_nodes(const char *folder, const struct device_list_limits *limits,
                                     char *list, struct error *err);

int device_list_count(const char *list); /* of entries; 1 for "" */

/* The entry; device holds as many bytes as the list. */
void device_list_get(const char *list, int index, char *device, size_t device_bytes);

#endif
