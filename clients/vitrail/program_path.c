/* SPDX-License-Identifier: MIT */
/* Looks beside /proc/self/exe first, so that programs of one build find each other. */
#include "clients/vitrail/program_path.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* malloc'ed path of `name` in `folder` of `length` bytes if it can be executed there, else NULL. */
static char *path_in(const char *folder, size_t length, const char *name)
{
    char *path;

    if (asprintf(&path, "%.*s/%s", length ? (int)length : 1, length ? folder : ".", name) < 0)
        return NULL;
    if (access(path, X_OK) == 0)
        return path;
    free(path);
    return NULL;
}

char *program_path_find(const char *name)
{
    char self[PATH_MAX];
    ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    const char *folder = getenv("PATH");
    char *path = NULL;

    if (length > 0) {
        self[length] = '\0';
        path = path_in(self, (size_t)(strrchr(self, '/') - self), name);
    }
    while (!path && folder) {
        size_t n = strcspn(folder, ":");
        path = path_in(folder, n, name);
        folder = folder[n] ? folder + n + 1 : NULL;
    }
    return path;
}
