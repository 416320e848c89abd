/* SPDX-License-Identifier: MIT */
/* Decides about devices whose drivers crash workers, and about the daemon when none is left. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/base/clock.h"
#include "server/front/supervisor_internal.h"
#include "server/mapping/device_messages.h"

void supervisor_give_up(struct supervisor *supervisor, struct worker_slot *slot, char *why)
{
    slot->start_error = (struct error){0};
    error_set(&slot->start_error, ERROR_NO_DEVICE, "%.230s", why ? why : "no device is left");
    free(slot->hopeless);
    slot->hopeless = why;
    slot->is_hopeless = true;
    const struct error *problem = supervisor_start_problem(supervisor);
    if (problem)
        supervisor_refuse_waiting(supervisor, problem);
    else
        log_write(supervisor->desc.log, LOG_ERROR, "%s is not started any more: %s", slot->name,
                  slot->start_error.message);
}

const struct worker_slot *supervisor_keeper(const struct supervisor *supervisor)
{
    for (int i = 0; i < supervisor->slot_count; i++)
        if (supervisor->slots[i].state != WORKER_NONE && supervisor->slots[i].is_keeper)
            return &supervisor->slots[i];
    return NULL;
}

static bool is_same_speed(const struct device_auto *a, const struct device_auto *b)
{
    return strcmp(a->policy, b->policy) == 0 && a->is_pending == b->is_pending &&
           a->frame_ms == b->frame_ms && a->shade == b->shade && a->maps == b->maps &&
           a->trace == b->trace && a->build == b->build;
}

bool supervisor_check_device(const struct supervisor *supervisor, const struct worker_slot *slot,
                             const struct device_capabilities *device, struct error *err)
{
    const struct device_capabilities *known = &supervisor->device;
    bool is_alone = true;
    for (int i = 0; i < supervisor->slot_count; i++)
        is_alone = is_alone &&
                   (&supervisor->slots[i] == slot || supervisor->slots[i].state != WORKER_READY);
    if (is_alone)
        return true;
    if (strcmp(known->vendor, device->vendor) != 0 ||
        strcmp(known->renderer, device->renderer) != 0 ||
        strcmp(known->version, device->version) != 0)
        return error_set(err, ERROR_NO_DEVICE,
                         "its device is %.60s, %.30s, that of the others %.60s, %.30s: pictures "
                         "would differ",
                         device->renderer, device->version, known->renderer, known->version);
    if (known->gpu_budget_bytes != device->gpu_budget_bytes ||
        known->blocks.from_levels != device->blocks.from_levels ||
        strcmp(known->wide_floats, device->wide_floats) != 0 ||
        !is_same_speed(&known->automatic, &device->automatic))
        return error_set(err, ERROR_NO_DEVICE,
                         "it does not go by what the others know of the device: pictures would "
                         "differ");
    return true;
}

static bool is_asked_for(const struct worker_slot *slot)
{
    struct gl_device_selector selector;
    struct error ignored = {0};
    return gl_device_parse(slot->device, &selector, &ignored) && selector.ask != GL_DEVICE_ANY;
}

void supervisor_try_device(struct supervisor *supervisor, struct worker_slot *slot,
                           const json_t *message)
{
    pthread_mutex_lock(&supervisor->mutex);
    device_trials_begin(&slot->trials, message);
    slot->state_ms = now_ms();
    pthread_mutex_unlock(&supervisor->mutex);
}

bool supervisor_blame_device(struct supervisor *supervisor, struct worker_slot *slot,
                             const char *how, bool is_hang)
{
    char name[GL_DEVICE_TEXT_BYTES], *why = NULL;
    const struct gl_device *device = device_trials_end(&slot->trials, how, is_hang);
    if (!device)
        return false;
    gl_device_name(device, name);
    if (!*device->reason) {
        log_write(supervisor->desc.log, LOG_WARNING, "%s is tried once more", name);
    } else if (!is_asked_for(slot)) {
        log_write(supervisor->desc.log, LOG_WARNING, "a device is passed over: %s: %s", name,
                  device->reason);
    } else {
        if (asprintf(&why, "device '%s', which was asked for, cannot be taken: %s: %s",
                     slot->device, name, device->reason) < 0)
            why = NULL;
        supervisor_give_up(supervisor, slot, why);
    }
    return true;
}

void supervisor_note_no_device(struct supervisor *supervisor, struct worker_slot *slot,
                               const json_t *message)
{
    char *lines = device_lines_join(json_object_get(message, "devices")), *why = NULL;
    pthread_mutex_lock(&supervisor->mutex);
    device_trials_abandon(&slot->trials);
    if (device_trials_passed_over(&slot->trials)) {
        if (asprintf(&why, "no device is left: %s", lines ? lines : "out of memory") < 0)
            why = NULL;
        supervisor_give_up(supervisor, slot, why);
    }
    pthread_mutex_unlock(&supervisor->mutex);
    free(lines);
}

void supervisor_tell_hopeless(struct supervisor *supervisor)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool is_due = !supervisor->is_hopeless_reported;
    for (int i = 0; i < supervisor->slot_count; i++)
        is_due = is_due && supervisor->slots[i].is_hopeless;
    supervisor->is_hopeless_reported |= is_due;
    pthread_mutex_unlock(&supervisor->mutex);
    const char *why = supervisor->slots[0].hopeless;
    if (is_due && supervisor->desc.on_hopeless)
        supervisor->desc.on_hopeless(supervisor->desc.context, why ? why : "no device is left");
}
