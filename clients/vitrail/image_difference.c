/* SPDX-License-Identifier: MIT */
/* Runs vitrail-compare on two files, and reads what it prints as JSON. */
#include "clients/vitrail/image_difference.h"

#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <math.h>
#include <spawn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "clients/vitrail/program_path.h"

extern char **environ;

/* Starts the program with its output in a pipe; its pid, and the end to read from. */
static bool start(const char *program, char *const *arguments, pid_t *pid, int *output,
                  struct failure *failure)
{
    int ends[2];
    posix_spawn_file_actions_t actions;
    if (pipe2(ends, O_CLOEXEC) != 0)
        return fail(failure, EXIT_CODE_OS_ERROR, "no pipe: %s", strerror(errno));
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO); /* errors are JSON, too */
    int problem = posix_spawn(pid, program, &actions, NULL, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    *output = ends[0];
    if (problem == 0)
        return true;
    close(ends[0]);
    return fail(failure, EXIT_CODE_OS_ERROR, "cannot start '%s': %s", program, strerror(problem));
}

/* What the program prints, as JSON; NULL: it printed no JSON. */
static json_t *read_answer(pid_t pid, int output)
{
    json_t *answer = json_loadfd(output, JSON_DISABLE_EOF_CHECK, NULL);
    char rest[256];
    while (read(output, rest, sizeof rest) > 0)
        continue;
    close(output);
    while (waitpid(pid, NULL, 0) < 0 && errno == EINTR)
        continue;
    return answer;
}

static bool measure_one(const char *program, const char *image, const char *reference,
                        const char *output, struct image_difference *difference,
                        struct failure *failure)
{
    const char *const words[] = {
        "vitrail-compare",          image,  reference, "--json", "--no-flip",
        output ? "--output" : NULL, output, NULL};
    char *arguments[sizeof words / sizeof *words];
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        arguments[i] = (char *)(uintptr_t)words[i]; /* execve promises not to write to them */
    pid_t pid;
    int pipe = -1;
    if (!start(program, arguments, &pid, &pipe, failure))
        return false;
    json_t *answer = read_answer(pid, pipe);
    const json_t *share = json_object_get(answer, "differing_share");
    const json_t *rmse = json_object_get(answer, "rmse"), *max = json_object_get(answer, "max");
    const char *detail = json_string_value(json_object_get(answer, "detail"));
    bool is_good = json_is_number(share) ||
                   fail(failure, EXIT_CODE_DIFFERENT, "the images cannot be compared: %s",
                        detail ? detail : "vitrail-compare gave no answer");
    if (is_good && json_number_value(share) >= difference->share)
        *difference = (struct image_difference){
            .share = json_number_value(share),
            .rmse = json_is_number(rmse) ? json_number_value(rmse) : NAN,
            .max = json_is_number(max) ? json_number_value(max) : NAN,
        };
    json_decref(answer);
    return is_good;
}

bool image_difference_measure(const char *image, const char *reference, const char *const *outputs,
                              struct image_difference *difference, struct failure *failure)
{
    char *program = program_path_find("vitrail-compare");
    *difference = (struct image_difference){0};
    bool is_good = program || fail(failure, EXIT_CODE_OS_ERROR,
                                   "no vitrail-compare beside this program, and none in PATH");
    if (is_good && !outputs[0])
        is_good = measure_one(program, image, reference, NULL, difference, failure);
    for (size_t i = 0; is_good && outputs[i]; i++)
        is_good = measure_one(program, image, reference, outputs[i], difference, failure);
    free(program);
    return is_good;
}
