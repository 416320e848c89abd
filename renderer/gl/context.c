/* SPDX-License-Identifier: MIT */
/* Headless OpenGL 4.5 core through EGL: choice of display and device, robust context, limits. */
#include "renderer/gl/context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_DEVICES = 32 };

struct gl_context {
    EGLDisplay display;
    EGLContext context;
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

static bool has_extension(const char *list, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = list; at && (at = strstr(at, name)); at += length)
        if ((at == list || at[-1] == ' ') && (at[length] == ' ' || !at[length]))
            return true;
    return false;
}

static int query_devices(EGLDeviceEXT devices[MAX_DEVICES])
{
    const char *client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    EGLint count = 0;
    if (!has_extension(client, "EGL_EXT_device_enumeration") &&
        !has_extension(client, "EGL_EXT_device_base"))
        return 0;
    return eglQueryDevicesEXT(MAX_DEVICES, devices, &count) ? count : 0;
}

static bool try_display(struct gl_context *context, EGLenum platform, void *native,
                        const char *name)
{
    EGLDisplay display = eglGetPlatformDisplayEXT(platform, native, NULL);
    EGLint major, minor;
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, &major, &minor))
        return false;
    if (!has_extension(eglQueryString(display, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context") ||
        !eglBindAPI(EGL_OPENGL_API)) {
        eglTerminate(display);
        return false;
    }
    context->display = display;
    snprintf(context->limits.platform, sizeof context->limits.platform, "%s", name);
    return true;
}

static bool open_device(struct gl_context *context, int device, const EGLDeviceEXT *devices,
                        int count, bool has_device_platform, struct error *err)
{
    if (device > count || !has_device_platform)
        return error_set(err, ERROR_NO_DEVICE, "device %d asked for, EGL offers %d", device,
                         has_device_platform ? count : 0);
    if (!try_display(context, EGL_PLATFORM_DEVICE_EXT, devices[device - 1], "device"))
        return error_set(err, ERROR_NO_DEVICE, "EGL device %d cannot be initialised (0x%x)", device,
                         (unsigned)eglGetError());
    return true;
}

/* Hardware first: the surfaceless platform of Mesa may be the software rasteriser. */
static bool choose_display(struct gl_context *context, int device, struct error *err)
{
    const char *client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (!has_extension(client, "EGL_EXT_platform_base"))
        return error_set(err, ERROR_NO_DEVICE, "EGL has no EGL_EXT_platform_base");
    EGLDeviceEXT devices[MAX_DEVICES];
    int count = query_devices(devices);
    context->limits.device_count = count;
    bool has_device_platform = has_extension(client, "EGL_EXT_platform_device");
    bool has_surfaceless = has_extension(client, "EGL_MESA_platform_surfaceless");
    if (device > 0)
        return open_device(context, device, devices, count, has_device_platform, err);
    for (int i = 0; has_device_platform && i < count; i++) {
        const char *extensions = eglQueryDeviceStringEXT(devices[i], EGL_EXTENSIONS);
        if (!has_extension(extensions, "EGL_MESA_device_software") &&
            try_display(context, EGL_PLATFORM_DEVICE_EXT, devices[i], "device"))
            return true;
    }
    if (has_surfaceless && try_display(context, EGL_PLATFORM_SURFACELESS_MESA, NULL, "surfaceless"))
        return true;
    for (int i = 0; has_device_platform && i < count; i++)
        if (try_display(context, EGL_PLATFORM_DEVICE_EXT, devices[i], "device"))
            return true;
    return error_set(err, ERROR_NO_DEVICE, "no EGL display: %d devices, surfaceless %s", count,
                     has_surfaceless ? "fails" : "absent");
}

/* Robustness may be refused with any of several errors; then an ordinary context is taken and
 * reported as such. */
static bool create_context(struct gl_context *context, struct error *err)
{
    for (int robust = 1; robust >= 0; robust--) {
        EGLint attributes[24], n = 0;
        attributes[n++] = EGL_CONTEXT_MAJOR_VERSION, attributes[n++] = 4;
        attributes[n++] = EGL_CONTEXT_MINOR_VERSION, attributes[n++] = 5;
        attributes[n++] = EGL_CONTEXT_OPENGL_PROFILE_MASK;
        attributes[n++] = EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT;
        if (context->is_strict)
            attributes[n++] = EGL_CONTEXT_OPENGL_DEBUG, attributes[n++] = EGL_TRUE;
        if (robust) {
            attributes[n++] = EGL_CONTEXT_OPENGL_ROBUST_ACCESS, attributes[n++] = EGL_TRUE;
            attributes[n++] = EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY;
            attributes[n++] = EGL_LOSE_CONTEXT_ON_RESET;
        }
        attributes[n] = EGL_NONE;
        context->context =
            eglCreateContext(context->display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
        if (context->context != EGL_NO_CONTEXT) {
            context->limits.is_robust = robust;
            return true;
        }
    }
    return error_set(err, ERROR_NO_DEVICE, "no OpenGL 4.5 core context (EGL error 0x%x)",
                     (unsigned)eglGetError());
}

static void copy_string(char *out, size_t size, GLenum name)
{
    const char *text = (const char *)glGetString(name);
    snprintf(out, size, "%s", text ? text : "?");
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
    limits->has_post_depth_coverage = epoxy_has_gl_extension("GL_ARB_post_depth_coverage");
    limits->is_software = strstr(limits->renderer, "llvmpipe") ||
                          strstr(limits->renderer, "softpipe") || strstr(limits->renderer, "SWR");
}

static bool check_requirements(struct error *err)
{
    if (epoxy_gl_version() < 45)
        return error_set(err, ERROR_NO_DEVICE, "OpenGL %d.%d found, 4.5 is needed",
                         epoxy_gl_version() / 10, epoxy_gl_version() % 10);
    if (!epoxy_has_gl_extension("GL_ARB_shader_draw_parameters"))
        return error_set(err, ERROR_NO_DEVICE, "GL_ARB_shader_draw_parameters is missing");
    return true;
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
    if (!choose_display(context, desc->device, err) || !create_context(context, err))
        goto fail;
    if (!eglMakeCurrent(context->display, EGL_NO_SURFACE, EGL_NO_SURFACE, context->context)) {
        error_set(err, ERROR_NO_DEVICE, "eglMakeCurrent fails (0x%x)", (unsigned)eglGetError());
        goto fail;
    }
    if (!check_requirements(err))
        goto fail;
    read_limits(&context->limits);
    context->limits.has_post_depth_coverage &= !desc->hides_coverage;
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
    if (context->display) {
        eglMakeCurrent(context->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        if (context->context)
            eglDestroyContext(context->display, context->context);
        eglTerminate(context->display);
    }
    free(context);
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
