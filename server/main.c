/* SPDX-License-Identifier: MIT */
/* vitraild: chooses the role, reads the configuration, serves until it is asked to stop. */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include "server/base/child.h"
#include "server/base/config.h"
#include "server/decoder/decoder.h"
#include "server/assembler/assembler.h"
#include "server/jobs/job_backup.h"
#include "server/routes/service.h"
#include "server/worker/worker.h"

enum { EXIT_BAD_CONFIG = 2 };

static sigset_t stop_signals(void)
{
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGINT);
    return set;
}

/* A second signal while the first is obeyed. */
static bool is_told_again(void)
{
    sigset_t set = stop_signals();
    return sigtimedwait(&set, NULL, &(struct timespec){0}) > 0;
}

/* Each waiting upload and each connection holds a descriptor: take what we are allowed to. */
static void raise_file_limit(void)
{
    struct rlimit files;
    if (getrlimit(RLIMIT_NOFILE, &files) == 0 && files.rlim_cur < files.rlim_max) {
        files.rlim_cur = files.rlim_max < 65536 ? files.rlim_max : 65536;
        setrlimit(RLIMIT_NOFILE, &files);
    }
}

static void announce(const struct config *config, int port)
{
    bool is_v6 = strchr(config->listen_host, ':') != NULL;
    printf("listening on http://%s%s%s:%d\n", is_v6 ? "[" : "", config->listen_host,
           is_v6 ? "]" : "", port);
    fflush(stdout);
}

static int serve(const struct config *config)
{
    struct log log;
    struct error problem = {0};
    sigset_t set = stop_signals();
    log_init(&log, "front", config->log_level);
    signal(SIGPIPE, SIG_IGN);
    sigprocmask(SIG_BLOCK, &set, NULL); /* before any thread, so that all inherit it */
    raise_file_limit();
    struct service *service = service_create(config, &log, &problem);
    if (!service) {
        fprintf(stderr, "vitraild: %s\n", problem.message);
        return EXIT_FAILURE;
    }
    announce(config, service_port(service));
    service_warm_up(service);
    int signal_number = 0;
    while (sigwait(&set, &signal_number) != 0)
        continue;
    bool is_hopeless = service_hopeless(service) != NULL;
    char *why = is_hopeless ? strdup(service_hopeless(service)) : NULL;
    if (!is_hopeless)
        log_write(&log, LOG_INFO, "stopping on %s", strsignal(signal_number));
    service_destroy(service, is_told_again);
    log_write(&log, LOG_INFO, "stopped");
    if (is_hopeless) /* the last words, which the command line tells of a private server */
        fprintf(stderr, "vitraild: %s\n", why ? why : "no device is left");
    free(why);
    return is_hopeless ? EXIT_FAILURE : EXIT_SUCCESS;
}

static int back_up(const struct config *config)
{
    struct error problem = {0};
    struct job_backup backup = {0};
    if (!job_backup_write(config->state_dir, config->backup_file, &backup, &problem)) {
        fprintf(stderr, "vitraild: --backup: %s\n", problem.message);
        return EXIT_FAILURE;
    }
    printf("%s: %lld jobs, %lld bytes\n", config->backup_file, (long long)backup.jobs,
           (long long)backup.size_bytes);
    return EXIT_SUCCESS;
}

static int act(const struct config *config)
{
    switch (config->action) {
    case CONFIG_HELP:
        config_print_help(stdout);
        return EXIT_SUCCESS;
    case CONFIG_VERSION:
        printf("vitraild %s\n", VITRAIL_VERSION);
        return EXIT_SUCCESS;
    case CONFIG_PRINT:
        config_print(config, stdout);
        return EXIT_SUCCESS;
    case CONFIG_CHECK:
        printf("the configuration is good\n");
        return EXIT_SUCCESS;
    case CONFIG_BACKUP:
        return back_up(config);
    case CONFIG_SERVE:
        break;
    }
    return serve(config);
}

int main(int argc, char **argv)
{
    if (argc == 2 && strncmp(argv[1], "--role=", 7) == 0) {
        signal(SIGINT, SIG_IGN);  /* a terminal or a service manager may tell the whole group: */
        signal(SIGTERM, SIG_IGN); /* the front decides when its children end */
        if (!child_tie_to_parent())
            return EXIT_FAILURE;
        if (strcmp(argv[1] + 7, "assembler") == 0)
            return assembler_main(CHILD_SOCKET_FD);
        return strcmp(argv[1] + 7, "worker") == 0 ? worker_main(CHILD_SOCKET_FD)
                                                  : decoder_main(CHILD_SOCKET_FD);
    }
    struct error problem = {0};
    struct config *config = calloc(1, sizeof *config);
    if (!config || !config_load(config, argc, argv, environ, &problem)) {
        fprintf(stderr, "vitraild: %s\n", config ? problem.message : "out of memory");
        free(config);
        return EXIT_BAD_CONFIG;
    }
    int status = act(config);
    free(config);
    return status;
}
