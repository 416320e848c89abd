/* SPDX-License-Identifier: MIT */
/* Loading the image module, once a process. */
#include "renderer/image/image_library.h"

#include <dlfcn.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const char module_name[] = "vitrail-images.so";

/* The one state of its kind: a loaded library is a property of the process, and stays. */
static struct {
    pthread_once_t once;
    const struct oiio_functions *functions;
    char problem[256];
} library = {.once = PTHREAD_ONCE_INIT};

static void load(void)
{
    char path[PATH_MAX + sizeof module_name];
    ssize_t length = readlink("/proc/self/exe", path, PATH_MAX);
    char *slash = length > 0 ? memrchr(path, '/', (size_t)length) : NULL;
    if (!slash) {
        snprintf(library.problem, sizeof library.problem, "the program has no path");
        return;
    }
    memcpy(slash + 1, module_name, sizeof module_name);
    void *module = dlopen(path, RTLD_LAZY | RTLD_LOCAL);
    const struct oiio_functions *(*get)(void) = NULL;
    if (module)
        *(void **)&get = dlsym(module, "oiio_get_functions");
    if (get)
        library.functions = get();
    else
        snprintf(library.problem, sizeof library.problem, "%s", dlerror());
}

const struct oiio_functions *image_library(struct error *err)
{
    pthread_once(&library.once, load);
    if (!library.functions)
        error_set(err, ERROR_INTERNAL, "the image library does not load: %s", library.problem);
    return library.functions;
}
