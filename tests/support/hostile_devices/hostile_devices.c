/* SPDX-License-Identifier: MIT */
/* Drivers that end their process, or never come back: HOSTILE_DEVICES holds entries
 * NUMBER:STEP:HOW, separated by commas. NUMBER is that of EGL, 0 the surfaceless platform; or
 * "any". STEP is open, self-test or measure. HOW is segv, abort, exit, hang, or once=PATH, which is
 * a segv where the file is not there yet, and makes it. The linker sends calls of the functions
 * here
 * (--wrap). */
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "renderer/frame/calibrate.h"
#include "renderer/gl/context.h"
#include "renderer/gl/display.h"
#include "renderer/gl/selftest.h"

enum { ENTRY_BYTES = 512, STEP_BYTES = 16 };

bool __real_gl_display_open(struct gl_display *display, struct gl_device *device, bool is_strict);
bool __wrap_gl_display_open(struct gl_display *display, struct gl_device *device, bool is_strict);
bool __real_gl_selftest(struct gl_context *context, struct program_cache *programs,
                        struct error *err);
bool __wrap_gl_selftest(struct gl_context *context, struct program_cache *programs,
                        struct error *err);

bool __real_renderer_calibrate(struct renderer *renderer, struct calibration *calibration,
                               struct error *err);
bool __wrap_renderer_calibrate(struct renderer *renderer, struct calibration *calibration,
                               struct error *err);

static void crash(void)
{
    signal(SIGSEGV, SIG_DFL);
    raise(SIGSEGV);
}

static void crash_once(const char *path)
{
    int fd = open(path, O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd < 0)
        return;
    close(fd);
    crash();
}

static void fall(const char *how)
{
    if (strcmp(how, "segv") == 0)
        crash();
    if (strcmp(how, "abort") == 0)
        abort();
    if (strcmp(how, "exit") == 0)
        _exit(3);
    while (strcmp(how, "hang") == 0)
        pause();
    if (strncmp(how, "once=", 5) == 0)
        crash_once(how + 5);
}

/* Does what the environment has for a device at this step. */
static void meet(int number, const char *step)
{
    const char *entries = getenv("HOSTILE_DEVICES");
    char text[4096], *rest = text;
    snprintf(text, sizeof text, "%s", entries ? entries : "");
    for (char *entry; (entry = strsep(&rest, ","));) {
        char who[STEP_BYTES], when[STEP_BYTES], how[ENTRY_BYTES];
        if (sscanf(entry, "%15[^:]:%15[^:]:%511s", who, when, how) == 3 &&
            strcmp(when, step) == 0 &&
            (strcmp(who, "any") == 0 || (*who >= '0' && *who <= '9' && atoi(who) == number)))
            fall(how);
    }
}

bool __wrap_gl_display_open(struct gl_display *display, struct gl_device *device, bool is_strict)
{
    meet(device->number, "open");
    return __real_gl_display_open(display, device, is_strict);
}

/* Which device it is, the renderer tells by its line alone. */
bool __wrap_renderer_calibrate(struct renderer *renderer, struct calibration *calibration,
                               struct error *err)
{
    struct renderer_info info;
    renderer_get_info(renderer, &info);
    for (int i = 0; i < RENDERER_DEVICES_TOLD; i++) {
        int number = 0; /* the surfaceless platform has none */
        (void)sscanf(info.devices[i], "EGL device %d", &number);
        if (strstr(info.devices[i], ": taken"))
            meet(number, "measure");
    }
    return __real_renderer_calibrate(renderer, calibration, err);
}

bool __wrap_gl_selftest(struct gl_context *context, struct program_cache *programs,
                        struct error *err)
{
    const struct gl_device_list *list = gl_context_devices(context);
    for (int i = 0; i < list->count; i++)
        if (list->items[i].is_taken)
            meet(list->items[i].number, "self-test");
    return __real_gl_selftest(context, programs, err);
}
