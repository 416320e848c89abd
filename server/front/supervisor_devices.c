/* SPDX-License-Identifier: MIT */
/* Decides about devices whose drivers crash workers, and about the daemon when none is left. */
#include <stdio.h>
#include <stdlib.h>

#include "server/base/clock.h"
#include "server/front/supervisor_internal.h"
#include "server/mapping/device_messages.h"

/* No worker is started in the slot any more; ends what waits where that was the last one. Takes the
 * text, which may be NULL. Under the mutex. */
static void give_up(struct supervisor *supervisor, struct worker_slot *slot, char *why)
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
        give_up(supervisor, slot, why);
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
        give_up(supervisor, slot, why);
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
