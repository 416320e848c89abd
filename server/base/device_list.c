/* SPDX-License-Identifier: MIT */
/* Entries between commas; names of render nodes are read from their folder. */
#include "server/base/device_list.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
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

static int is_node(const struct dirent *entry)
{
    const char *name = entry->d_name;
    return strncmp(name, "renderD", 7) == 0 && name[7] &&
           name[7 + strspn(name + 7, "0123456789")] == '\0';
}

bool device_list_of_nodes(const char *folder, const struct device_list_limits *limits, char *list,
                          struct error *err)
{
    struct dirent **nodes = NULL;
    int count = scandir(folder, &nodes, is_node, versionsort);
    size_t length = 0;
    bool fits = count <= limits->most;
    for (int i = 0; i < count; i++) {
        if (fits && length < limits->bytes)
            length += (size_t)snprintf(list + length, limits->bytes - length, "%s%s/%s",
                                       i > 0 ? "," : "", folder, nodes[i]->d_name);
        free(nodes[i]);
    }
    free(nodes);
    if (count <= 0)
        return error_set(err, ERROR_INVALID_REQUEST, "no render node in %s", folder);
    return (fits && length < limits->bytes) ||
           error_set(err, ERROR_INVALID_REQUEST, "more than %d render nodes or %zu bytes in %s",
                     limits->most, limits->bytes - 1, folder);
}
