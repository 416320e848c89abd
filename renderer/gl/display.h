/* SPDX-License-Identifier: MIT */
/* The devices that EGL lists, and a context on one of them: current, with all that the renderer
 * needs, or closed again. Thread: the one that renders. */
#ifndef VITRAIL_RENDERER_GL_DISPLAY_H
#define VITRAIL_RENDERER_GL_DISPLAY_H

#include "renderer/base/device_choice.h"

struct gl_display {          /* zeroed = closed */
    void *display, *context; /* EGL's */
    const char *platform;    /* "device", "surfaceless" */
    bool is_robust;          /* the context reports resets */
};

/* Lists the devices of the device platform, and the surfaceless one. */
MUST_CHECK bool gl_display_list(struct gl_device_list *list, struct error *err);
/* On failure device->reason says why. is_strict: a debug context. */
MUST_CHECK bool gl_display_open(struct gl_display *display, struct gl_device *device,
                                bool is_strict);
void gl_display_close(struct gl_display *display);

#endif
