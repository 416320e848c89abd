/* SPDX-License-Identifier: MIT */
/* Headless OpenGL 4.5 core: the first device that can be had, its limits, its loss. */
#include "renderer/gl/context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/display.h"

struct gl_context {
    struct gl_display display;
    struct gl_device_selector selector;
    struct gl_device_list devices;
    char warning[GL_DEVICE_TEXT_BYTES];
    struct gl_limits limits;
    bool is_strict;
};

static void GLAPIENTRY on_debug_message(GLenum source, GLenum type, GLuint id, GLenum severity,
                                        GLsizei length, const GLchar *message, const void *user)
{
    (void)source, (void)id, (void)length, (void)user;
    bool is_error = type == GL_DEBUG_TYPE_ERROR || type == GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR;
    if (!is_error && severity != GL_DEBUG_SEVERITY_HIGH)
        return;
    fprintf(stderr, "<4>gl: %s\n", message);
    if (is_error)
        abort();
}

static void copy_string(char *out, size_t size, GLenum name)
{
    const char *text = (const char *)glGetString(name);
    snprintf(out, size, "%s", text ? text : "?");
}

static bool draws_in_software(void)
{
    static const char *const names[] = {"llvmpipe", "softpipe", "SWR"};
    const char *renderer = (const char *)glGetString(GL_RENDERER);
    for (size_t i = 0; renderer && i < sizeof names / sizeof *names; i++)
        if (strstr(renderer, names[i]))
            return true;
    return false;
}

static void read_limits(struct gl_limits *limits)
{
    GLint texels = 0;
    copy_string(limits->vendor, sizeof limits->vendor, GL_VENDOR);
    copy_string(limits->renderer, sizeof limits->renderer, GL_RENDERER);
    copy_string(limits->version, sizeof limits->version, GL_VERSION);
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limits->max_texture_size);
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &limits->max_texture_layers);
    glGetIntegerv(GL_MAX_SAMPLES, &limits->max_samples);
    glGetIntegerv(GL_MAX_INTEGER_SAMPLES, &limits->max_integer_samples);
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limits->max_storage_block_bytes);
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
    limits->max_texture_buffer_texels = texels;
    glGetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &limits->program_formats);
    glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 0, &limits->max_compute_groups);
    glGetIntegerv(GL_MAX_GEOMETRY_SHADER_STORAGE_BLOCKS, &limits->max_geometry_blocks);
    glGetIntegerv(GL_MAX_TESS_CONTROL_SHADER_STORAGE_BLOCKS, &limits->max_tessellation_blocks);
    limits->has_post_depth_coverage = epoxy_has_gl_extension("GL_ARB_post_depth_coverage");
    limits->is_software = draws_in_software();
    bool tells_the_least = limits->max_storage_block_bytes == 1 << 27;
    limits->max_whole_block_bytes = limits->is_software && tells_the_least
                                        ? ((int64_t)1 << 31) - (1 << 20)
                                        : limits->max_storage_block_bytes;
    limits->has_vertex_layer = epoxy_has_gl_extension("GL_ARB_shader_viewport_layer_array") ||
                               epoxy_has_gl_extension("GL_AMD_vertex_shader_layer");
}

static void set_fixed_state(bool is_strict)
{
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glDisable(GL_DITHER);
    glDisable(GL_DEBUG_OUTPUT); /* drivers that thread their work give it up to report in order */
    if (!is_strict)
        return;
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(on_debug_message, NULL);
}

/* A driver of hardware that draws on the processor all the same is passed over, where others may
 * be tried. */
static bool open_device(struct gl_context *context, struct gl_device *device)
{
    bool is_asked = context->selector.ask != GL_DEVICE_ANY;
    if (!gl_display_open(&context->display, device, context->is_strict))
        return false;
    device->is_taken = is_asked || device->is_software || !device->number || !draws_in_software();
    if (device->is_taken)
        return true;
    snprintf(device->reason, sizeof device->reason, "its driver draws in software");
    gl_display_close(&context->display);
    return false;
}

static bool refuse_devices(const struct gl_context *context, const char *asked, int tried,
                           struct error *err)
{
    const struct gl_device_list *list = &context->devices;
    char text[GL_DEVICE_TEXT_BYTES] = "";
    if (!tried) {
        gl_device_list_names(list, text);
        return error_set(err, ERROR_NO_DEVICE, "device '%s' is not there; EGL has: %s",
                         asked ? asked : "0", text);
    }
    for (int i = 0; i < list->count && !*text; i++)
        if (*list->items[i].reason)
            gl_device_describe(&list->items[i], text);
    return error_set(err, ERROR_NO_DEVICE, "no device can be taken: %s", text);
}

static void copy_reasons(struct gl_device_list *list, const struct gl_device_list *passed_over)
{
    for (int i = 0; i < list->count; i++)
        for (int j = 0; j < passed_over->count; j++)
            if (gl_device_is_same(&list->items[i], &passed_over->items[j]))
                memcpy(list->items[i].reason, passed_over->items[j].reason,
                       sizeof list->items[i].reason);
}

static void tell(const struct gl_device_watch *watch, const struct gl_device *device,
                 enum gl_device_step step)
{
    if (watch)
        watch->tell(watch->context, device, step);
}

static bool choose_device(struct gl_context *context, const struct gl_context_desc *desc,
                          struct error *err)
{
    int order[GL_DEVICES_MAX];
    if (!gl_device_parse(desc->device, &context->selector, err) ||
        !gl_display_list(&context->devices, err))
        return false;
    if (desc->devices)
        copy_reasons(&context->devices, desc->devices);
    int count = gl_device_order(&context->devices, &context->selector, order);
    for (int i = 0; i < count; i++) {
        struct gl_device *device = &context->devices.items[order[i]];
        if (*device->reason)
            continue;
        tell(desc->watch, device, GL_DEVICE_OPENING);
        if (open_device(context, device))
            return true;
    }
    if (desc->devices)
        *desc->devices = context->devices;
    return refuse_devices(context, desc->device, count, err);
}

static void note_devices(struct gl_context *context)
{
    struct gl_limits *limits = &context->limits;
    for (int i = 0; i < context->devices.count; i++)
        limits->device_count += context->devices.items[i].number > 0;
    limits->is_robust = context->display.is_robust;
    snprintf(limits->platform, sizeof limits->platform, "%s", context->display.platform);
    gl_device_warning(&context->devices, &context->selector, limits->is_software, context->warning);
}

struct gl_context *gl_context_create(const struct gl_context_desc *desc, struct error *err)
{
    struct gl_context *context = calloc(1, sizeof *context);
    if (!context) {
        error_set(err, ERROR_NO_MEMORY, "GL context");
        return NULL;
    }
    if (eglGetCurrentContext() != EGL_NO_CONTEXT) {
        error_set(err, ERROR_INTERNAL, "this thread has a GL context already: one renderer each");
        goto fail;
    }
    context->is_strict = desc->is_strict;
    if (!choose_device(context, desc, err))
        goto fail;
    read_limits(&context->limits);
    note_devices(context);
    context->limits.has_post_depth_coverage &= !desc->hides_coverage;
    if (desc->hides_multisampling)
        context->limits.max_samples = context->limits.max_integer_samples = 1;
    context->limits.is_software &= !desc->poses_as_hardware;
    context->limits.compiles_in_parallel =
        !context->limits.is_software && (epoxy_has_gl_extension("GL_KHR_parallel_shader_compile") ||
                                         epoxy_has_gl_extension("GL_ARB_parallel_shader_compile"));
    set_fixed_state(context->is_strict);
    return context;

fail:
    gl_context_destroy(context);
    return NULL;
}

void gl_context_destroy(struct gl_context *context)
{
    if (!context)
        return;
    gl_display_close(&context->display);
    free(context);
}

const struct gl_device_list *gl_context_devices(const struct gl_context *context)
{
    return &context->devices;
}

bool gl_context_pass_over(const struct gl_context *context, const char *reason,
                          struct gl_device_list *devices)
{
    *devices = context->devices;
    for (int i = 0; i < devices->count; i++) {
        struct gl_device *device = &devices->items[i];
        if (device->is_taken)
            snprintf(device->reason, sizeof device->reason, "%s", reason);
        device->is_taken = false;
    }
    return context->selector.ask == GL_DEVICE_ANY;
}

void gl_context_tell(const struct gl_context *context, const struct gl_device_watch *watch,
                     enum gl_device_step step)
{
    for (int i = 0; i < context->devices.count; i++)
        if (context->devices.items[i].is_taken)
            tell(watch, &context->devices.items[i], step);
}

const char *gl_context_warning(const struct gl_context *context)
{
    return context->warning;
}

const struct gl_limits *gl_context_limits(const struct gl_context *context)
{
    return &context->limits;
}

void gl_context_set_true_timers(struct gl_context *context, bool has_true_timers)
{
    context->limits.has_true_timers = has_true_timers;
}

bool gl_context_check(struct gl_context *context, const char *doing, struct error *err)
{
    if (context->limits.is_robust) {
        GLenum status = glGetGraphicsResetStatus();
        /* some drivers return garbage here; only the three defined values count */
        if (status == GL_GUILTY_CONTEXT_RESET || status == GL_INNOCENT_CONTEXT_RESET ||
            status == GL_UNKNOWN_CONTEXT_RESET)
            return error_set(err, ERROR_NO_DEVICE, "GL context lost while %s (0x%x)", doing,
                             status);
    }
    GLenum first = glGetError();
    if (first == GL_NO_ERROR)
        return true;
    for (int i = 0; i < 16 && glGetError() != GL_NO_ERROR; i++)
        ;
    if (first == GL_CONTEXT_LOST)
        return error_set(err, ERROR_NO_DEVICE, "GL context lost while %s", doing);
    return error_set(err, first == GL_OUT_OF_MEMORY ? ERROR_NO_MEMORY : ERROR_INTERNAL,
                     "GL error 0x%x while %s", first, doing);
}

void gl_context_blame(struct gl_context *context, const char *doing, struct error *err)
{
    struct error loss = {0};
    if (!gl_context_check(context, doing, &loss) && loss.code == ERROR_NO_DEVICE)
        *err = loss;
}
