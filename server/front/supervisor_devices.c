/* SPDX-License-Identifier: MIT */
/* Decides about devices whose drivers crash workers, and about the daemon when none is left. */
#include <stdio.h>
#include <stdlib.h>

#include "server/base/clock.h"
#include "server/front/supervisor_internal.h"
#include "server/mapping/device_messages.h"

/* Ends what waits; no worker is started any more. Takes the text, which may be NULL. */
static void give_up(struct supervisor *supervisor, char *why)
{
    supervisor->start_error = (struct error){0};
    error_set(&supervisor->start_error, ERROR_NO_DEVICE, "%.230s", why ? why : "no device is left");
    supervisor_refuse_waiting(supervisor, &supervisor->start_error);
    free(supervisor->hopeless);
    supervisor->hopeless = why;
    supervisor->is_hopeless = true;
}

static bool is_asked_for(const struct supervisor *supervisor)
{
    struct gl_device_selector selector;
    struct error ignored = {0};
    return gl_device_parse(supervisor->desc.config->device, &selector, &ignored) &&
           selector.ask != GL_DEVICE_ANY;
}

void supervisor_try_device(struct supervisor *supervisor, const json_t *message)
{
    pthread_mutex_lock(&supervisor->mutex);
    device_trials_begin(&supervisor->trials, message);
    supervisor->state_ms = now_ms();
    pthread_mutex_unlock(&supervisor->mutex);
}

bool supervisor_blame_device(struct supervisor *supervisor, const char *how, bool is_hang)
{
    char name[GL_DEVICE_TEXT_BYTES], *why = NULL;
    const struct gl_device *device = device_trials_end(&supervisor->trials, how, is_hang);
    if (!device)
        return false;
    gl_device_name(device, name);
    if (!*device->reason) {
        log_write(supervisor->desc.log, LOG_WARNING, "%s is tried once more", name);
    } else if (!is_asked_for(supervisor)) {
        log_write(supervisor->desc.log, LOG_WARNING, "a device is passed over: %s: %s", name,
                  device->reason);
    } else {
        if (asprintf(&why, "device '%s', which was asked for, cannot be taken: %s: %s",
                     supervisor->desc.config->device, name, device->reason) < 0)
            why = NULL;
        give_up(supervisor, why);
    }
    return true;
}

void supervisor_note_no_device(struct supervisor *supervisor, const json_t *message)
{
    char *lines = device_lines_join(json_object_get(message, "devices")), *why = NULL;
    pthread_mutex_lock(&supervisor->mutex);
    device_trials_abandon(&supervisor->trials);
    if (device_trials_passed_over(&supervisor->trials)) {
        if (asprintf(&why, "no device is left: %s", lines ? lines : "out of memory") < 0)
            why = NULL;
        give_up(supervisor, why);
    }
    pthread_mutex_unlock(&supervisor->mutex);
    free(lines);
}

void supervisor_tell_hopeless(struct supervisor *supervisor)
{
    pthread_mutex_lock(&supervisor->mutex);
    bool is_due = supervisor->is_hopeless && !supervisor->is_hopeless_reported;
    supervisor->is_hopeless_reported |= is_due;
    pthread_mutex_unlock(&supervisor->mutex);
    if (is_due && supervisor->desc.on_hopeless)
        supervisor->desc.on_hopeless(supervisor->desc.context, supervisor->hopeless
                                                                   ? supervisor->hopeless
                                                                   : "no device is left");
}
