/* SPDX-License-Identifier: MIT */
/* Two deaths in a row, or one hang: then a device is passed over. */
#include "server/front/device_trials.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/utf8.h"

static const char *const step_names[] = {[GL_DEVICE_OPENING] = "opening",
                                         [GL_DEVICE_TESTING] = "self-test",
                                         [GL_DEVICE_MEASURING] = "measurement"};
enum { STEPS = sizeof step_names / sizeof *step_names };

/* ---- messages ---- */

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

/* ---- the decision ---- */

/* -1: there is no room for it. */
static int find_or_add(struct gl_device_list *devices, const struct gl_device *device)
{
    for (int i = 0; i < devices->count; i++)
        if (gl_device_is_same(&devices->items[i], device))
            return i;
    if (devices->count == GL_DEVICES_MAX)
        return -1;
    devices->items[devices->count] = *device;
    return devices->count++;
}

void device_trials_begin(struct device_trials *trials, const json_t *message)
{
    struct gl_device device;
    const char *step = json_string_value(json_object_get(message, "step"));
    trials->current = 0;
    read_device(json_object_get(message, "device"), &device);
    device.reason[0] = 0;
    for (int i = 0; step && i < STEPS; i++) {
        if (strcmp(step, step_names[i]) != 0)
            continue;
        trials->step = (enum gl_device_step)i;
        trials->current = find_or_add(&trials->devices, &device) + 1;
    }
}

void device_trials_succeed(struct device_trials *trials)
{
    if (trials->current)
        trials->deaths[trials->current - 1] = 0;
    trials->current = 0;
}

void device_trials_abandon(struct device_trials *trials)
{
    trials->current = 0;
}

static void write_reason(enum gl_device_step step, const char *how, bool is_hang,
                         char reason[GL_DEVICE_TEXT_BYTES])
{
    const char *did = is_hang ? "did not come back" : "crashed twice";
    const char *when = step == GL_DEVICE_OPENING   ? "when it was opened"
                       : step == GL_DEVICE_TESTING ? "in the self-test"
                                                   : "when its speed was measured";
    snprintf(reason, GL_DEVICE_TEXT_BYTES, "its driver %s %s: %.100s", did, when, how);
}

const struct gl_device *device_trials_end(struct device_trials *trials, const char *how,
                                          bool is_hang)
{
    int index = trials->current - 1;
    trials->current = 0;
    if (index < 0)
        return NULL;
    struct gl_device *device = &trials->devices.items[index];
    if (++trials->deaths[index] >= DEVICE_TRIAL_DEATHS || is_hang)
        write_reason(trials->step, how, is_hang, device->reason);
    return device;
}

int device_trials_passed_over(const struct device_trials *trials)
{
    int count = 0;
    for (int i = 0; i < trials->devices.count; i++)
        count += *trials->devices.items[i].reason != 0;
    return count;
}
