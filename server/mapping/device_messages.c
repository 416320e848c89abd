/* SPDX-License-Identifier: MIT */
/* Devices as JSON. */
#include "server/mapping/device_messages.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/utf8.h"

static const char *const step_names[] = {[GL_DEVICE_OPENING] = "opening",
                                         [GL_DEVICE_TESTING] = "self-test",
                                         [GL_DEVICE_MEASURING] = "measurement"};
enum { STEPS = sizeof step_names / sizeof *step_names };

static void read_name(const json_t *json, const char *member, char name[GL_DEVICE_NAME_BYTES])
{
    const char *text = json_string_value(json_object_get(json, member));
    utf8_copy(name, GL_DEVICE_NAME_BYTES, text ? text : "");
}

static void read_device(const json_t *json, struct gl_device *device)
{
    const char *reason = json_string_value(json_object_get(json, "reason"));
    *device =
        (struct gl_device){.number = (int)json_integer_value(json_object_get(json, "number"))};
    read_name(json, "node", device->node);
    read_name(json, "pci", device->pci);
    utf8_copy(device->reason, sizeof device->reason, reason ? reason : "");
}

static json_t *write_device(const struct gl_device *device)
{
    return json_pack("{s:i,s:s,s:s,s:s}", "number", device->number, "node", device->node, "pci",
                     device->pci, "reason", device->reason);
}

json_t *device_trials_message(const struct gl_device *device, enum gl_device_step step)
{
    return json_pack("{s:s,s:s,s:o}", "op", "trying", "step", step_names[step], "device",
                     write_device(device));
}

bool device_trials_read(const json_t *message, struct gl_device *device, enum gl_device_step *step)
{
    const char *name = json_string_value(json_object_get(message, "step"));
    read_device(json_object_get(message, "device"), device);
    device->reason[0] = 0;
    for (int i = 0; name && i < STEPS; i++) {
        if (strcmp(name, step_names[i]) != 0)
            continue;
        *step = (enum gl_device_step)i;
        return true;
    }
    return false;
}

json_t *device_reasons_to_json(const struct gl_device_list *devices)
{
    json_t *array = json_array();
    for (int i = 0; i < devices->count; i++)
        if (*devices->items[i].reason)
            json_array_append_new(array, write_device(&devices->items[i]));
    return array;
}

void device_reasons_from_json(const json_t *json, struct gl_device_list *devices)
{
    const json_t *device;
    size_t i;
    devices->count = 0;
    json_array_foreach(json, i, device)
    {
        if (devices->count < GL_DEVICES_MAX)
            read_device(device, &devices->items[devices->count++]);
    }
}

json_t *device_lines_to_json(const struct gl_device_list *devices)
{
    json_t *array = json_array();
    for (int i = 0; i < devices->count; i++) {
        char text[GL_DEVICE_TEXT_BYTES];
        gl_device_describe(&devices->items[i], text);
        json_array_append_new(array, json_string(text));
    }
    return array;
}

char *device_lines_join(const json_t *lines)
{
    const json_t *line;
    size_t i, size = 1;
    json_array_foreach(lines, i, line) size += json_string_length(line) + 2;
    char *text = calloc(1, size);
    if (!text)
        return NULL;
    json_array_foreach(lines, i, line)
    {
        const char *part = json_string_value(line);
        size_t used = strlen(text);
        snprintf(text + used, size - used, "%s%s", used ? "; " : "", part ? part : "");
    }
    return text;
}
