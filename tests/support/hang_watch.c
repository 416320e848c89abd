/* SPDX-License-Identifier: MIT */
/* A test program that hangs says where. With VITRAIL_TEST_SECONDS, which ctest sets, a thread waits
 * that long; then every thread of the program prints its stack, and the program ends with a failure
 * before ctest kills it without a word. */
#include <dirent.h>
#include <execinfo.h>
#include <pthread.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

enum { FRAMES_MOST = 64, PRINTING_NS = 200000000 };

extern const int hang_watch_installed; /* the linker is asked for it, and so takes this file */
const int hang_watch_installed = 1;

static void print_stack(int signal_number)
{
    void *frames[FRAMES_MOST];
    (void)signal_number;
    backtrace_symbols_fd(frames, backtrace(frames, FRAMES_MOST), STDERR_FILENO);
}

/* A driver's threads let no signal in, and only show what proc(5) tells: after the name, whether
 * the thread runs or sleeps, and as the 14th number the time that it took. */
static void print_thread(pid_t thread)
{
    char path[64], line[512] = "\n";
    snprintf(path, sizeof path, "/proc/self/task/%d/stat", (int)thread);
    FILE *file = fopen(path, "r");
    if (file) {
        if (!fgets(line, sizeof line, file))
            snprintf(line, sizeof line, "\n");
        fclose(file);
    }
    fprintf(stderr, "thread %s", line);
    tgkill(getpid(), thread, SIGUSR2);
    nanosleep(&(struct timespec){.tv_nsec = PRINTING_NS}, NULL);
}

static void print_threads(void)
{
    DIR *tasks = opendir("/proc/self/task");
    const struct dirent *task;
    while (tasks && (task = readdir(tasks)) != NULL) {
        pid_t thread = (pid_t)strtol(task->d_name, NULL, 10);
        if (thread > 0 && thread != gettid())
            print_thread(thread);
    }
    if (tasks)
        closedir(tasks);
}

static void *watch(void *argument)
{
    long seconds = (long)(intptr_t)argument;
    struct timespec left = {.tv_sec = seconds};
    while (nanosleep(&left, &left) != 0)
        continue;
    fprintf(stderr, "the program still runs after %ld s; its threads:\n", seconds);
    print_threads();
    _exit(EXIT_FAILURE);
}

__attribute__((constructor)) static void watch_from_start(void)
{
    const char *text = getenv("VITRAIL_TEST_SECONDS");
    long seconds = text ? strtol(text, NULL, 10) : 0;
    sigset_t all, before;
    pthread_t thread;
    void *frame;
    if (seconds <= 0)
        return;
    backtrace(&frame, 1); /* the first call loads a library */
    sigaction(SIGUSR2, &(struct sigaction){.sa_handler = print_stack}, NULL);
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    if (pthread_create(&thread, NULL, watch, (void *)(intptr_t)seconds) == 0)
        pthread_detach(thread);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
}
