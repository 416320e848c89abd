/* SPDX-License-Identifier: MIT */
/* Which of the devices that EGL lists is opened: what names one, and in which order those that it
 * may be are tried. No GL. Thread: any. */
#ifndef VITRAIL_RENDERER_BASE_DEVICE_CHOICE_H
#define VITRAIL_RENDERER_BASE_DEVICE_CHOICE_H

#include "protocol/error.h"

enum {
    GL_DEVICES_MAX = 32,
    GL_DEVICE_NAME_BYTES = 64,
    GL_DEVICE_TEXT_BYTES = 240,
};

struct gl_device {
    int number; /* EGL's N-th device; 0: the surfaceless platform, whose driver chooses */
    char node[GL_DEVICE_NAME_BYTES]; /* "/dev/dri/renderD128"; "": not known */
    char pci[GL_DEVICE_NAME_BYTES];  /* "0000:65:00.0"; "": not known */
    bool is_software;                /* EGL says that it is no hardware */
    bool is_taken;
    char reason[GL_DEVICE_TEXT_BYTES]; /* why it was passed over, once tried; "": it was not */
};

struct gl_device_list { /* zeroed = empty */
    struct gl_device items[GL_DEVICES_MAX];
    int count;
};

/* Reported before it is done, so that its reader knows what a driver was doing when it ends the
 * process. */
enum gl_device_step {
    GL_DEVICE_OPENING,
    GL_DEVICE_TESTING,
    GL_DEVICE_MEASURING, /* reported by whoever has its speed measured */
};

struct gl_device_watch {
    void *context;
    void (*tell)(void *context, const struct gl_device *device, enum gl_device_step step);
};

enum gl_device_ask {
    GL_DEVICE_ANY, /* the first that can be opened: hardware first, software last */
    GL_DEVICE_NUMBER,
    GL_DEVICE_NODE,
    GL_DEVICE_PCI,
    GL_DEVICE_SOFTWARE,
};

struct gl_device_selector { /* zeroed = any */
    enum gl_device_ask ask;
    int number;
    char name[GL_DEVICE_NAME_BYTES]; /* the node; or the PCI address, whole and in lower case */
};

/* "" and "0" any; "N" the N-th EGL device; a path below /dev/dri; a PCI address with its domain or
 * without; "software". ERROR_INVALID_REQUEST names these. */
MUST_CHECK bool gl_device_parse(const char *text, struct gl_device_selector *selector,
                                struct error *err);

/* By all that names them: numbers change where devices come and go. */
bool gl_device_is_same(const struct gl_device *a, const struct gl_device *b);

/* Indices of the devices to be tried, in their order; their number. */
int gl_device_order(const struct gl_device_list *list, const struct gl_device_selector *selector,
                    int order[GL_DEVICES_MAX]);

/* "EGL device 1, /dev/dri/renderD128, 0000:65:00.0, hardware: taken". */
void gl_device_describe(const struct gl_device *device, char text[GL_DEVICE_TEXT_BYTES]);
/* "EGL device 1, /dev/dri/renderD128, 0000:65:00.0". */
void gl_device_name(const struct gl_device *device, char text[GL_DEVICE_TEXT_BYTES]);
/* "1 (/dev/dri/renderD128, 0000:65:00.0), 2 (software)": what may be asked for. */
void gl_device_list_names(const struct gl_device_list *list, char text[GL_DEVICE_TEXT_BYTES]);
/* What to say where software draws beside hardware that nobody passed over on purpose; else "". */
void gl_device_warning(const struct gl_device_list *list, const struct gl_device_selector *selector,
                       bool is_software, char text[GL_DEVICE_TEXT_BYTES]);

#endif
