/* SPDX-License-Identifier: MIT */
/* Finds, starts and ends the private vitraild. */
#include "clients/vitrail/spawn.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "clients/vitrail/keeper.h"
#include "clients/vitrail/program_path.h"

enum {
    POLL_MS = 20,
    START_S = 120,             /* a cold software rasteriser compiles its self-test first */
    LOG_HEAD_BYTES = 64 << 10, /* of the daemon's words, where its address is looked for */
    LOG_TAIL_BYTES = 4096,     /* and where the reason is when it dies */
};

static const char LISTENING[] = "listening on http://";

static char *daemon_find(struct failure *failure)
{
    char *path = program_path_find("vitraild");

    if (!path)
        fail(failure, EXIT_CODE_UNAVAILABLE,
             "--spawn: no vitraild beside this program, and none in PATH");
    return path;
}

/* Makes the temporary folder, and in it the log. */
static char *make_folder(struct spawned_server *server, struct failure *failure)
{
    const char *base = getenv("TMPDIR");
    char *folder, *log = NULL;

    if (asprintf(&folder, "%s/vitrail-XXXXXX", base && *base ? base : "/tmp") < 0) {
        fail_no_memory(failure);
        return NULL;
    }
    if (mkdtemp(folder)) {
        if (asprintf(&log, "%s/vitraild.log", folder) >= 0)
            server->log = open(log, O_RDWR | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0600);
        free(log);
        if (server->log >= 0)
            return folder;
        rmdir(folder);
    }
    fail(failure, EXIT_CODE_CANT_CREATE, "--spawn: cannot make the folder '%s': %s", folder,
         strerror(errno));
    free(folder);
    return NULL;
}

/* Forks the keeper; on failure the temporary folder is gone. */
static bool fork_keeper(struct spawned_server *server, const struct spawn_desc *desc,
                        const char *program, const char *folder, struct failure *failure)
{
    int ends[2];
    char *state_dir = NULL;

    if (desc->state_dir ? asprintf(&state_dir, "%s", desc->state_dir) < 0
                        : asprintf(&state_dir, "%s/state", folder) < 0)
        return fail_no_memory(failure);
    if ((mkdir(state_dir, 0700) != 0 && errno != EEXIST) || pipe2(ends, O_CLOEXEC) != 0) {
        fail(failure, EXIT_CODE_CANT_CREATE, "--spawn: cannot use the state folder '%s': %s",
             state_dir, strerror(errno));
        free(state_dir);
        return false;
    }
    fflush(NULL);
    server->keeper = fork();
    if (server->keeper == 0) {
        char *argv[] = {strdup(program),       strdup("--listen"), strdup("127.0.0.1:0"),
                        strdup("--state-dir"), state_dir,          NULL};
        close(ends[1]);
        keeper_run(&(struct keeper_desc){.argv = argv,
                                         .lifeline = ends[0],
                                         .log = server->log,
                                         .child_mask = &desc->interrupt->mask_before,
                                         .temporary_dir = folder});
    }
    close(ends[0]);
    free(state_dir);
    server->lifeline = ends[1];
    if (server->keeper < 0)
        return fail(failure, EXIT_CODE_OS_ERROR, "--spawn: %s", strerror(errno));
    return true;
}

/* Looks in the log for the line that names the address. */
static bool find_url(struct spawned_server *server)
{
    char text[LOG_HEAD_BYTES + 1];
    ssize_t length = pread(server->log, text, LOG_HEAD_BYTES, 0);
    const char *line;
    size_t n;

    if (length <= 0)
        return false;
    text[length] = '\0';
    line = strstr(text, LISTENING);
    if (!line)
        return false;
    line += strlen("listening on ");
    n = strcspn(line, " \t\r\n");
    if (!line[n] || n >= sizeof server->url) /* the line is not finished yet */
        return false;
    while (line[n - 1] == '/')
        n--;
    memcpy(server->url, line, n);
    server->url[n] = '\0';
    return true;
}

/* The last line of the log that is not empty, in `tail`. */
static const char *last_words(const struct spawned_server *server, char *tail, size_t capacity)
{
    off_t size = lseek(server->log, 0, SEEK_END);
    off_t from = size > (off_t)capacity - 1 ? size - (off_t)capacity + 1 : 0;
    ssize_t length = pread(server->log, tail, capacity - 1, from);
    char *line;

    if (length < 0)
        length = 0;
    while (length > 0 && (tail[length - 1] == '\n' || tail[length - 1] == ' '))
        length--;
    tail[length] = '\0';
    line = strrchr(tail, '\n');
    return length == 0 ? "it said nothing" : line ? line + 1 : tail;
}

bool spawned_server_check(struct spawned_server *server, struct failure *failure)
{
    char tail[LOG_TAIL_BYTES];
    int status;

    if (server->keeper <= 0 || waitpid(server->keeper, &status, WNOHANG) != server->keeper)
        return true;
    server->keeper = 0;
    return fail(failure, EXIT_CODE_UNAVAILABLE, "the private vitraild ended with status %d: %.600s",
                WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
                last_words(server, tail, sizeof tail));
}

static bool wait_until_listening(struct spawned_server *server, const struct spawn_desc *desc,
                                 struct failure *failure)
{
    double deadline_s = desc->deadline_s > 0 ? desc->deadline_s : clock_s() + START_S;
    char tail[LOG_TAIL_BYTES];

    while (!find_url(server)) {
        progress_show(desc->progress, PROGRESS_STAGE_START, 0, 0);
        if (!spawned_server_check(server, failure))
            return false;
        if (clock_s() >= deadline_s)
            return fail(failure, desc->deadline_s > 0 ? EXIT_CODE_TEMPORARY : EXIT_CODE_UNAVAILABLE,
                        "the private vitraild did not start in time: %.600s",
                        last_words(server, tail, sizeof tail));
        if (!interrupt_sleep(desc->interrupt, POLL_MS, failure))
            return false;
    }
    return true;
}

bool spawned_server_start(struct spawned_server *server, const struct spawn_desc *desc,
                          struct failure *failure)
{
    char *program, *folder = NULL;
    bool is_ok = false;

    *server = (struct spawned_server){.lifeline = -1, .log = -1};
    program = daemon_find(failure);
    if (program)
        folder = make_folder(server, failure);
    if (folder) {
        is_ok = fork_keeper(server, desc, program, folder, failure);
        if (!is_ok)
            folder_remove(folder);
        else
            is_ok = wait_until_listening(server, desc, failure);
    }
    free(folder);
    free(program);
    if (!is_ok)
        spawned_server_stop(server);
    return is_ok;
}

void spawned_server_stop(struct spawned_server *server)
{
    if (server->lifeline > 0)
        close(server->lifeline);
    if (server->keeper > 0)
        while (waitpid(server->keeper, NULL, 0) < 0 && errno == EINTR)
            continue;
    if (server->log > 0)
        close(server->log);
    *server = (struct spawned_server){0};
}
