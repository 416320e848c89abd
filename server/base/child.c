/* SPDX-License-Identifier: MIT */
/* Children by posix_spawn: nothing of this process leaks into them but one socket and stderr. */
#include "server/base/child.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "renderer/base/processors.h"
#include "server/base/ipc.h"

/* Environment of a child: an owned array of owned strings. */
struct environment {
    char **entries;
    size_t count;
};

static bool environment_add(struct environment *environment, const char *name, const char *value)
{
    char **entries = realloc(environment->entries, (environment->count + 2) * sizeof(char *));
    if (!entries)
        return false;
    environment->entries = entries;
    if (asprintf(&entries[environment->count], "%s%s", name, value) < 0)
        return false;
    entries[++environment->count] = NULL;
    return true;
}

static void environment_finish(struct environment *environment)
{
    for (size_t i = 0; i < environment->count; i++)
        free(environment->entries[i]);
    free(environment->entries);
}

/* The environment of a decoder: how it finds libraries, and how sanitizers report. */
static bool environment_init_decoder(struct environment *environment)
{
    static const char *const kept[] = {"LD_LIBRARY_PATH", "ASAN_OPTIONS", "UBSAN_OPTIONS",
                                       "TSAN_OPTIONS"};
    bool is_good = environment_add(environment, "LC_ALL=", "C.UTF-8") &&
                   environment_add(environment, "OPENIMAGEIO_THREADS=", "1") &&
                   environment_add(environment, "MALLOC_ARENA_MAX=", "1");
    for (size_t i = 0; is_good && i < sizeof kept / sizeof kept[0]; i++) {
        const char *value = getenv(kept[i]);
        char name[32];
        snprintf(name, sizeof name, "%s=", kept[i]);
        is_good = !value || environment_add(environment, name, value);
    }
    return is_good;
}

/* Ours, where Mesa's and NVIDIA's drivers put compiled shaders, and how many threads llvmpipe has.
 */
static bool environment_init_worker(struct environment *environment, const struct child_desc *desc)
{
    const char *cache_dir = desc->cache_dir;
    char threads[16];
    bool is_good = true;
    for (char **entry = environ; is_good && *entry; entry++)
        is_good = environment_add(environment, *entry, "");
    if (is_good && cache_dir && !getenv("MESA_SHADER_CACHE_DIR"))
        is_good = environment_add(environment, "MESA_SHADER_CACHE_DIR=", cache_dir);
    if (is_good && cache_dir && !getenv("MESA_SHADER_CACHE_MAX_SIZE"))
        is_good = environment_add(environment, "MESA_SHADER_CACHE_MAX_SIZE=", "256M");
    if (is_good && cache_dir && !getenv("__GL_SHADER_DISK_CACHE_PATH"))
        is_good = environment_add(environment, "__GL_SHADER_DISK_CACHE_PATH=", cache_dir);
    snprintf(threads, sizeof threads, "%d", desc->threads);
    if (is_good && desc->threads)
        is_good = environment_add(environment, PROCESSORS_VARIABLE "=", threads);
    if (is_good && desc->threads && !getenv("LP_NUM_THREADS"))
        is_good = environment_add(environment, "LP_NUM_THREADS=", threads);
    return is_good;
}

/* Default signals, an empty mask: what a fresh process expects. */
static bool prepare_attributes(posix_spawnattr_t *attributes)
{
    sigset_t defaults, none;
    sigfillset(&defaults);
    sigdelset(&defaults, SIGKILL);
    sigdelset(&defaults, SIGSTOP);
    sigemptyset(&none);
    return posix_spawnattr_setflags(attributes, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK) ==
               0 &&
           posix_spawnattr_setsigdefault(attributes, &defaults) == 0 &&
           posix_spawnattr_setsigmask(attributes, &none) == 0;
}

static bool prepare_files(posix_spawn_file_actions_t *actions, int socket)
{
    return posix_spawn_file_actions_addopen(actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0) == 0 &&
           posix_spawn_file_actions_adddup2(actions, STDERR_FILENO, STDOUT_FILENO) == 0 &&
           posix_spawn_file_actions_adddup2(actions, socket, CHILD_SOCKET_FD) == 0 &&
           posix_spawn_file_actions_addclosefrom_np(actions, CHILD_SOCKET_FD + 1) == 0;
}

/* Answers an errno. */
static int spawn(pid_t *pid, int socket, const char *role, char **environment)
{
    char flag[32], name[] = "vitraild";
    snprintf(flag, sizeof flag, "--role=%s", role);
    char *arguments[] = {name, flag, NULL};
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_t actions;
    posix_spawnattr_init(&attributes);
    posix_spawn_file_actions_init(&actions);
    int failure = ENOMEM;
    if (prepare_attributes(&attributes) && prepare_files(&actions, socket))
        failure = posix_spawn(pid, "/proc/self/exe", &actions, &attributes, arguments, environment);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    return failure;
}

bool child_start(struct child *child, const struct child_desc *desc, struct error *err)
{
    *child = (struct child){0};
    int sockets[2];
    if (!ipc_pair_create(sockets, err))
        return false;
    struct environment environment = {0};
    bool is_prepared = strcmp(desc->role, "decoder") == 0
                           ? environment_init_decoder(&environment)
                           : environment_init_worker(&environment, desc);
    int failure =
        is_prepared ? spawn(&child->pid, sockets[1], desc->role, environment.entries) : ENOMEM;
    environment_finish(&environment);
    close(sockets[1]);
    child->socket = sockets[0];
    if (failure == 0)
        return true;
    close(sockets[0]);
    *child = (struct child){0};
    return error_set(err, ERROR_INTERNAL, "starting a %s: %s", desc->role, strerror(failure));
}

static void describe_end(int status, char *how, size_t how_bytes)
{
    if (!how)
        return;
    if (WIFSIGNALED(status))
        snprintf(how, how_bytes, "signal %d (%s)", WTERMSIG(status), strsignal(WTERMSIG(status)));
    else
        snprintf(how, how_bytes, "exit status %d", WEXITSTATUS(status));
}

void child_stop(struct child *child, int grace_ms, char *how, size_t how_bytes)
{
    if (child->pid <= 0)
        return;
    int status = 0;
    pid_t reaped = 0;
    if (grace_ms > 0)
        close(child->socket);
    for (int waited = 0; waited < grace_ms && reaped == 0; waited += 2) {
        reaped = waitpid(child->pid, &status, WNOHANG);
        if (reaped == 0)
            nanosleep(&(struct timespec){.tv_nsec = 2000000}, NULL);
    }
    if (reaped == 0) {
        kill(child->pid, SIGKILL);
        while (waitpid(child->pid, &status, 0) < 0 && errno == EINTR)
            continue;
    }
    if (grace_ms <= 0)
        close(child->socket);
    describe_end(status, how, how_bytes);
    *child = (struct child){0};
}

bool child_tie_to_parent(void)
{
    return prctl(PR_SET_PDEATHSIG, SIGKILL) == 0 && getppid() != 1;
}
