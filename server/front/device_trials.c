/* SPDX-License-Identifier: MIT */
/* Two crashes in a row, or one hang: then a device is passed over. */
#include "server/front/device_trials.h"

#include <stdio.h>

#include "server/mapping/device_messages.h"

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
    trials->current = 0;
    if (device_trials_read(message, &device, &trials->step))
        trials->current = find_or_add(&trials->devices, &device) + 1;
}

void device_trials_succeed(struct device_trials *trials)
{
    if (trials->current)
        trials->crashes[trials->current - 1] = 0;
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
    if (++trials->crashes[index] >= DEVICE_TRIAL_CRASHES || is_hang)
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
