/* SPDX-License-Identifier: MIT */
/* Displays and contexts of EGL devices, and where the system has these devices. */
#include "renderer/gl/display.h"

#include <assert.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <errno.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#ifndef EGL_DRM_RENDER_NODE_FILE_EXT /* of EGL_EXT_device_drm_render_node; old headers lack it */
#define EGL_DRM_RENDER_NODE_FILE_EXT 0x3377
#endif

static bool has_extension(const char *list, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = list; at && (at = strstr(at, name)); at += length)
        if ((at == list || at[-1] == ' ') && (at[length] == ' ' || !at[length]))
            return true;
    return false;
}

static const char *client_extensions(void)
{
    return eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
}

/* ---- which there are ---- */

static int query_devices(EGLDeviceEXT devices[GL_DEVICES_MAX])
{
    const char *client = client_extensions();
    EGLint count = 0;
    if (!has_extension(client, "EGL_EXT_platform_device") ||
        (!has_extension(client, "EGL_EXT_device_enumeration") &&
         !has_extension(client, "EGL_EXT_device_base")))
        return 0;
    return eglQueryDevicesEXT(GL_DEVICES_MAX - 1, devices, &count) ? count : 0;
}

static void copy_node(EGLDeviceEXT device, EGLint name, char node[GL_DEVICE_NAME_BYTES])
{
    const char *text = eglQueryDeviceStringEXT(device, name);
    if (text && strlen(text) < GL_DEVICE_NAME_BYTES)
        snprintf(node, GL_DEVICE_NAME_BYTES, "%s", text);
}

/* /sys/class/drm/renderD128/device leads to a folder that is named by the address. */
static void find_pci(const char *node, char pci[GL_DEVICE_NAME_BYTES])
{
    char path[128], target[PATH_MAX];
    const char *name = strrchr(node, '/');
    if (!name)
        return;
    snprintf(path, sizeof path, "/sys/class/drm%s/device", name);
    ssize_t length = readlink(path, target, sizeof target - 1);
    if (length <= 0)
        return;
    target[length] = 0;
    const char *address = strrchr(target, '/');
    address = address ? address + 1 : target;
    struct gl_device_selector is;
    struct error ignored = {0};
    if (gl_device_parse(address, &is, &ignored) && is.ask == GL_DEVICE_PCI)
        snprintf(pci, GL_DEVICE_NAME_BYTES, "%s", is.name);
}

static void describe_device(EGLDeviceEXT handle, struct gl_device *device)
{
    const char *extensions = eglQueryDeviceStringEXT(handle, EGL_EXTENSIONS);
    device->is_software = has_extension(extensions, "EGL_MESA_device_software");
    if (has_extension(extensions, "EGL_EXT_device_drm_render_node"))
        copy_node(handle, EGL_DRM_RENDER_NODE_FILE_EXT, device->node);
    if (!*device->node && has_extension(extensions, "EGL_EXT_device_drm"))
        copy_node(handle, EGL_DRM_DEVICE_FILE_EXT, device->node);
    find_pci(device->node, device->pci);
}

bool gl_display_list(struct gl_device_list *list, struct error *err)
{
    EGLDeviceEXT handles[GL_DEVICES_MAX];
    *list = (struct gl_device_list){0};
    if (!has_extension(client_extensions(), "EGL_EXT_platform_base"))
        return error_set(err, ERROR_NO_DEVICE, "EGL has no EGL_EXT_platform_base");
    int count = query_devices(handles);
    for (int i = 0; i < count; i++) {
        struct gl_device *device = &list->items[list->count++];
        device->number = i + 1;
        describe_device(handles[i], device);
    }
    if (has_extension(client_extensions(), "EGL_MESA_platform_surfaceless"))
        list->count++;
    return true;
}

/* ---- opening one ---- */

__attribute__((format(printf, 2, 3))) static bool refuse(struct gl_device *device,
                                                         const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(device->reason, sizeof device->reason, format, arguments);
    va_end(arguments);
    return false;
}

/* A driver does not say why it fails; the system often does. */
static bool refuse_display(struct gl_device *device)
{
    unsigned problem = (unsigned)eglGetError();
    if (*device->node && access(device->node, R_OK | W_OK) != 0)
        return refuse(device, "%s: %s%s", device->node, strerror(errno),
                      errno == EACCES ? " (is the user in the group 'render'?)" : "");
    return refuse(device, "its display cannot be initialised (EGL error 0x%x): no driver?",
                  problem);
}

static EGLDisplay find_display(const struct gl_device *device)
{
    EGLDeviceEXT handles[GL_DEVICES_MAX];
    if (!device->number)
        return eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, NULL, NULL);
    return device->number <= query_devices(handles)
               ? eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, handles[device->number - 1],
                                          NULL)
               : EGL_NO_DISPLAY;
}

static bool open_display(struct gl_display *display, struct gl_device *device)
{
    EGLint major, minor;
    EGLDisplay found = find_display(device);
    if (found == EGL_NO_DISPLAY || !eglInitialize(found, &major, &minor))
        return refuse_display(device);
    display->display = found;
    display->platform = device->number ? "device" : "surfaceless";
    if (!has_extension(eglQueryString(found, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context"))
        return refuse(device, "EGL_KHR_surfaceless_context is missing");
    return eglBindAPI(EGL_OPENGL_API) || refuse(device, "it has no OpenGL");
}

/* Robustness may be refused with any of several errors; then an ordinary context is taken and
 * reported as such. */
static bool create_context(struct gl_display *display, struct gl_device *device, bool is_strict)
{
    for (int robust = 1; robust >= 0; robust--) {
        EGLint attributes[24], n = 0;
        attributes[n++] = EGL_CONTEXT_MAJOR_VERSION, attributes[n++] = 4;
        attributes[n++] = EGL_CONTEXT_MINOR_VERSION, attributes[n++] = 5;
        attributes[n++] = EGL_CONTEXT_OPENGL_PROFILE_MASK;
        attributes[n++] = EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT;
        if (is_strict)
            attributes[n++] = EGL_CONTEXT_OPENGL_DEBUG, attributes[n++] = EGL_TRUE;
        if (robust) {
            attributes[n++] = EGL_CONTEXT_OPENGL_ROBUST_ACCESS, attributes[n++] = EGL_TRUE;
            attributes[n++] = EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY;
            attributes[n++] = EGL_LOSE_CONTEXT_ON_RESET;
        }
        attributes[n] = EGL_NONE;
        display->context =
            eglCreateContext(display->display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
        display->is_robust = robust;
        if (display->context != EGL_NO_CONTEXT)
            return true;
    }
    return refuse(device, "no OpenGL 4.5 core context (EGL error 0x%x)", (unsigned)eglGetError());
}

static bool check_context(struct gl_device *device)
{
    if (epoxy_gl_version() < 45)
        return refuse(device, "OpenGL %d.%d found, 4.5 is needed", epoxy_gl_version() / 10,
                      epoxy_gl_version() % 10);
    if (!epoxy_has_gl_extension("GL_ARB_shader_draw_parameters"))
        return refuse(device, "GL_ARB_shader_draw_parameters is missing");
    return true;
}

bool gl_display_open(struct gl_display *display, struct gl_device *device, bool is_strict)
{
    assert(!display->display);
    if (!open_display(display, device) || !create_context(display, device, is_strict))
        goto fail;
    if (!eglMakeCurrent(display->display, EGL_NO_SURFACE, EGL_NO_SURFACE, display->context)) {
        (void)refuse(device, "its context cannot be made current (EGL error 0x%x)",
                     (unsigned)eglGetError());
        goto fail;
    }
    if (check_context(device))
        return true;
fail:
    gl_display_close(display);
    return false;
}

void gl_display_close(struct gl_display *display)
{
    if (display->display) {
        eglMakeCurrent(display->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        if (display->context)
            eglDestroyContext(display->display, display->context);
        eglTerminate(display->display);
    }
    *display = (struct gl_display){0};
}
