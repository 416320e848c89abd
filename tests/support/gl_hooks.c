/* SPDX-License-Identifier: MIT */
/* Installs the layers between the renderer and GL, and keeps the faults that they find. */
#include "tests/support/gl_hooks.h"

#include <epoxy/egl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "tests/support/gl_layers.h"

enum { FAULTS_MAX = 256, FAULT_BYTES = 1600 };

static struct {
    struct gl_functions device; /* the functions of GL itself */
    bool has_device;
    struct gl_hooks_desc installed;
    char faults[FAULTS_MAX][FAULT_BYTES];
    int counts[FAULTS_MAX], fault_count;
} hooks;

const char *gl_function_name(enum gl_function function)
{
    static const char *const names[] = {
#define HOOKS_NAME(type, name, params, args) "gl" #name,
        GL_TABLE(HOOKS_NAME, HOOKS_NAME)
#undef HOOKS_NAME
    };
    return names[function];
}

/* ---- faults ---- */

void gl_fault(const char *format, ...)
{
    char text[FAULT_BYTES];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    for (int i = 0; i < hooks.fault_count; i++) {
        if (!strcmp(hooks.faults[i], text)) {
            hooks.counts[i]++;
            return;
        }
    }
    if (hooks.fault_count == FAULTS_MAX)
        return;
    fprintf(stderr, "gl fault: %s\n", text);
    hooks.counts[hooks.fault_count] = 1;
    memcpy(hooks.faults[hooks.fault_count++], text, sizeof text);
}

int gl_faults_take(char *text, size_t size)
{
    int count = hooks.fault_count;
    snprintf(text, size, "%s", count ? hooks.faults[0] : "");
    hooks.fault_count = 0;
    return count;
}

static void at_end(void)
{
    if (hooks.installed.prints && hooks.installed.counts)
        gl_counts_print();
    if (hooks.installed.prints && hooks.installed.reorders)
        gl_order_print();
    if (!hooks.fault_count)
        return;
    fprintf(stderr, "gl faults: %d distinct\n", hooks.fault_count);
    for (int i = 0; i < hooks.fault_count; i++)
        fprintf(stderr, "gl fault, %d times: %s\n", hooks.counts[i], hooks.faults[i]);
    fflush(NULL);
    _exit(1); /* the status that exit() was called with cannot be changed any more */
}

/* ---- what to install ---- */

static bool parse_hostility(const char *name, struct gl_hostility *hostility)
{
    const struct {
        const char *name;
        bool *flag;
    } flags[] = {
        {"names-reused", &hostility->reuses_names},
        {"small-blocks", &hostility->has_small_blocks},
        {"small-texels", &hostility->has_small_texels},
        {"no-post-depth-coverage", &hostility->lacks_post_coverage},
        {"not-software", &hostility->is_not_software},
    };
    for (size_t i = 0; i < sizeof flags / sizeof *flags; i++)
        if (!strcmp(name, flags[i].name))
            return *flags[i].flag = true;
    if (!strcmp(name, "timers-true"))
        return hostility->timers = GL_TIMERS_TRUE, true;
    if (!strcmp(name, "timers-false"))
        return hostility->timers = GL_TIMERS_FALSE, true;
    if (strncmp(name, "lost-after=", 11) != 0)
        return false;
    char *end;
    hostility->lost_after = strtoull(name + 11, &end, 10);
    return hostility->lost_after > 0 && !*end;
}

static bool parse_item(const char *item, struct gl_hooks_desc *desc)
{
    if (!strcmp(item, "count"))
        return desc->counts = true;
    if (!strcmp(item, "track"))
        return desc->tracks = true;
    if (!strcmp(item, "reorder"))
        return desc->reorders = true;
    return !strncmp(item, "hostile=", 8) && parse_hostility(item + 8, &desc->hostility);
}

bool gl_hooks_parse(const char *text, struct gl_hooks_desc *desc, struct error *err)
{
    char copy[256], *rest = copy;
    *desc = (struct gl_hooks_desc){.prints = true};
    if (strlen(text) >= sizeof copy)
        return error_set(err, ERROR_INTERNAL, "longer than %zu bytes", sizeof copy - 1);
    snprintf(copy, sizeof copy, "%s", text);
    for (char *item; (item = strsep(&rest, ","));)
        if (*item && !parse_item(item, desc))
            return error_set(err, ERROR_INTERNAL, "'%s' is no layer", item);
    return true;
}

/* ---- installation ---- */

static void find_device_functions(struct gl_functions *device)
{
#define HOOKS_FIND(type, name, params, args) \
    device->name = (__typeof__(device->name))eglGetProcAddress("gl" #name);
    GL_TABLE(HOOKS_FIND, HOOKS_FIND)
#undef HOOKS_FIND
}

static void put_in_place(const struct gl_functions *functions)
{
#define HOOKS_PUT(type, name, params, args) epoxy_gl##name = functions->name;
    GL_TABLE(HOOKS_PUT, HOOKS_PUT)
#undef HOOKS_PUT
}

static bool is_hostile(const struct gl_hostility *h)
{
    return h->has_small_blocks || h->has_small_texels || h->lacks_post_coverage ||
           h->is_not_software || h->timers != GL_TIMERS_AS_THEY_ARE || h->lost_after;
}

void gl_hooks_install(const struct gl_hooks_desc *desc)
{
    if (!hooks.has_device)
        find_device_functions(&hooks.device);
    hooks.has_device = true;
    hooks.installed = *desc;
    struct gl_functions functions = hooks.device;
    if (desc->hostility.reuses_names)
        setenv("force_gl_names_reuse", "true", 1); /* Mesa reads it with the first context */
    if (is_hostile(&desc->hostility))
        gl_hostile_install(&functions, &desc->hostility);
    if (desc->reorders)
        gl_order_install(&functions);
    if (desc->tracks)
        gl_access_install(&functions);
    if (desc->tracks || desc->reorders || desc->counts || desc->hostility.has_small_blocks ||
        desc->hostility.has_small_texels)
        gl_mirror_install(&functions);
    if (desc->counts)
        gl_counts_install(&functions);
    put_in_place(&functions);
}

void gl_hooks_find(void)
{
    if (!hooks.has_device)
        gl_hooks_install(&(struct gl_hooks_desc){0});
}

const struct gl_hooks_desc *gl_hooks_installed(void)
{
    return &hooks.installed;
}

__attribute__((constructor)) static void install_from_environment(void)
{
    const char *text = getenv("VITRAIL_TEST_GL");
    struct gl_hooks_desc desc;
    struct error err = {0};
    atexit(at_end);
    if (!text || !*text)
        return;
    if (!gl_hooks_parse(text, &desc, &err)) {
        fprintf(stderr, "VITRAIL_TEST_GL: %s\n", err.message);
        _exit(2);
    }
    gl_hooks_install(&desc);
}
