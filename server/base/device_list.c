/* SPDX-License-Identifier: MIT */
/* Entries between commas. */
#include "server/base/device_list.h"

#include <stdio.h>
#include <string.h>

#include "renderer/base/device_choice.h"

int device_list_count(const char *list)
{
    int count = 1;
    for (const char *at = list; (at = strchr(at, ',')); at++)
        count++;
    return count;
}

void device_list_get(const char *list, int index, char *device, size_t device_bytes)
{
    const char *at = list;
    for (; index > 0 && strchr(at, ','); index--)
        at = strchr(at, ',') + 1;
    snprintf(device, device_bytes, "%.*s", (int)strcspn(at, ","), at);
}

bool device_list_check(const char *list, const struct device_list_limits *limits, struct error *err)
{
    char device[GL_DEVICE_TEXT_BYTES];
    int count = device_list_count(list);
    if (count > limits->most || strlen(list) >= limits->bytes)
        return error_set(err, ERROR_INVALID_REQUEST, "more than %d devices or %zu bytes",
                         limits->most, limits->bytes - 1);
    for (int i = 0; i < count; i++) {
        device_list_get(list, i, device, sizeof device);
        if (count > 1 && !*device)
            return error_set(err, ERROR_INVALID_REQUEST, "device %d of '%.100s' is empty", i + 1,
                             list);
        if (!gl_device_parse(device, &(struct gl_device_selector){0}, err))
            return count > 1 ? error_wrap(err, "device %d of '%.100s'", i + 1, list) : false;
    }
    return true;
}
