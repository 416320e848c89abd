/* SPDX-License-Identifier: MIT */
/* Names of devices, and the order of trying them. */
#include "renderer/base/device_choice.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_hex(const char *text, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!isxdigit((unsigned char)text[i]))
            return false;
    return true;
}

/* [dddd:]bb:dd.f, as lspci and /sys/bus/pci/devices have it. */
static bool parse_pci(const char *text, char pci[GL_DEVICE_NAME_BYTES])
{
    size_t length = strlen(text);
    bool has_domain = length == 12;
    const char *bus = has_domain ? text + 5 : text;
    if ((!has_domain && length != 7) || (has_domain && (!is_hex(text, 4) || text[4] != ':')) ||
        !is_hex(bus, 2) || bus[2] != ':' || !is_hex(bus + 3, 2) || bus[5] != '.' || bus[6] < '0' ||
        bus[6] > '7')
        return false;
    snprintf(pci, GL_DEVICE_NAME_BYTES, "%s%s", has_domain ? "" : "0000:", text);
    for (char *at = pci; *at; at++)
        *at = (char)tolower((unsigned char)*at);
    return true;
}

static bool parse_number(const char *text, int *number)
{
    size_t digits = strspn(text, "0123456789");
    if (digits == 0 || digits > 2 || text[digits])
        return false;
    *number = atoi(text);
    return true;
}

bool gl_device_parse(const char *text, struct gl_device_selector *selector, struct error *err)
{
    static const char nodes[] = "/dev/dri/";
    *selector = (struct gl_device_selector){0};
    if (!text || !*text)
        return true;
    if (!strcmp(text, "software")) {
        selector->ask = GL_DEVICE_SOFTWARE;
    } else if (parse_number(text, &selector->number)) {
        selector->ask = selector->number ? GL_DEVICE_NUMBER : GL_DEVICE_ANY;
    } else if (parse_pci(text, selector->name)) {
        selector->ask = GL_DEVICE_PCI;
    } else if (!strncmp(text, nodes, sizeof nodes - 1) && text[sizeof nodes - 1] &&
               strlen(text) < sizeof selector->name) {
        selector->ask = GL_DEVICE_NODE;
        snprintf(selector->name, sizeof selector->name, "%s", text);
    } else {
        return error_set(err, ERROR_INVALID_REQUEST,
                         "device '%.40s': 0 chooses, N is the N-th EGL device up to 99; else a "
                         "render node (/dev/dri/renderD128), a PCI address (0000:65:00.0 or "
                         "65:00.0) or 'software'",
                         text);
    }
    return true;
}

/* The surfaceless platform is software where there is nothing else: between the two. */
static int rank(const struct gl_device *device)
{
    return device->is_software ? 2 : device->number ? 0 : 1;
}

static bool has_hardware(const struct gl_device_list *list)
{
    for (int i = 0; i < list->count; i++)
        if (rank(&list->items[i]) == 0)
            return true;
    return false;
}

static bool fits(const struct gl_device_list *list, const struct gl_device *device,
                 const struct gl_device_selector *selector)
{
    switch (selector->ask) {
    case GL_DEVICE_NUMBER:
        return device->number == selector->number;
    case GL_DEVICE_NODE:
        return !strcmp(device->node, selector->name);
    case GL_DEVICE_PCI:
        return !strcmp(device->pci, selector->name);
    case GL_DEVICE_SOFTWARE:
        return rank(device) == 2 || (rank(device) == 1 && !has_hardware(list));
    default:
        return true;
    }
}

bool gl_device_is_same(const struct gl_device *a, const struct gl_device *b)
{
    return a->number == b->number && !strcmp(a->node, b->node) && !strcmp(a->pci, b->pci);
}

int gl_device_order(const struct gl_device_list *list, const struct gl_device_selector *selector,
                    int order[GL_DEVICES_MAX])
{
    int count = 0;
    for (int r = 0; r < 3; r++)
        for (int i = 0; i < list->count; i++)
            if (rank(&list->items[i]) == r && fits(list, &list->items[i], selector))
                order[count++] = i;
    return count;
}

static void append(char text[GL_DEVICE_TEXT_BYTES], const char *part)
{
    size_t used = strlen(text);
    snprintf(text + used, GL_DEVICE_TEXT_BYTES - used, "%s", part);
}

/* Node, address and kind, each after the separator or nothing. */
static void append_names(const struct gl_device *device, const char *separator,
                         char text[GL_DEVICE_TEXT_BYTES])
{
    const char *const names[] = {device->node, device->pci, device->is_software ? "software" : ""};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        if (!*names[i])
            continue;
        append(text, separator);
        append(text, names[i]);
        separator = ", ";
    }
}

void gl_device_name(const struct gl_device *device, char text[GL_DEVICE_TEXT_BYTES])
{
    if (device->number)
        snprintf(text, GL_DEVICE_TEXT_BYTES, "EGL device %d", device->number);
    else
        snprintf(text, GL_DEVICE_TEXT_BYTES, "EGL's surfaceless platform");
    append_names(device, ", ", text);
}

void gl_device_describe(const struct gl_device *device, char text[GL_DEVICE_TEXT_BYTES])
{
    gl_device_name(device, text);
    append(text, device->is_taken  ? ": taken"
                 : *device->reason ? ": passed over: "
                                   : ": not tried");
    if (!device->is_taken)
        append(text, device->reason);
}

void gl_device_list_names(const struct gl_device_list *list, char text[GL_DEVICE_TEXT_BYTES])
{
    text[0] = 0;
    for (int i = 0; i < list->count; i++) {
        const struct gl_device *device = &list->items[i];
        char number[16];
        if (!device->number)
            continue;
        snprintf(number, sizeof number, "%s%d", *text ? ", " : "", device->number);
        append(text, number);
        if (!*device->node && !*device->pci && !device->is_software)
            continue;
        append_names(device, " (", text);
        append(text, ")");
    }
    if (!*text)
        append(text, "none");
}

void gl_device_warning(const struct gl_device_list *list, const struct gl_device_selector *selector,
                       bool is_software, char text[GL_DEVICE_TEXT_BYTES])
{
    text[0] = 0;
    for (int i = 0; i < list->count && !*text; i++) {
        const struct gl_device *device = &list->items[i];
        if (!is_software || selector->ask != GL_DEVICE_ANY || rank(device) != 0 || device->is_taken)
            continue;
        char name[GL_DEVICE_TEXT_BYTES];
        gl_device_name(device, name);
        snprintf(text, GL_DEVICE_TEXT_BYTES,
                 "software renders, though there is hardware: %.100s: %.90s", name,
                 *device->reason ? device->reason : "not tried");
    }
}
