/* SPDX-License-Identifier: MIT */
/* vitrail farm: hands the frames of 'vitrail render' to an engine of a farm. The engine schedules;
 * this writes the task that it runs, and watches. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "clients/vitrail/commands.h"
#include "clients/vitrail/frame_run.h"
#include "clients/vitrail/interrupt.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/numbered_path.h"
#include "clients/vitrail/program_path.h"
#include "clients/vitrail/progress.h"
#include "clients/vitrail/request_json.h"
#include "clients/vitrail/scene_source.h"

enum { POLL_MS = 2000, CHUNKS_DEFAULT = 10, CHUNKS_MAX = 1000000, ID_BYTES = 32 };

struct farm_options {
    struct common_options common;
    struct request_options request;
    struct file_options file;
    struct frame_options frame;
    const char *output, *name;
    struct text_list sbatch;
    bool slurm, watch, strict;
};

/* ---- the task ---- */

/* Options of this command that the task does not have. */
static const struct {
    const char *name;
    bool has_value;
} OWN[] = {{"--slurm", false}, {"--watch", false},  {"--job-name", true}, {"--sbatch", true},
           {"--chunks", true}, {"--timeout", true}, {"--json", false},    {"--quiet", false},
           {"-q", false},      {"--progress", true}};

/* How many words of the command line belong to the own option that begins there; 0: to none. */
static int own_words(const char *word)
{
    for (size_t i = 0; i < sizeof OWN / sizeof *OWN; i++) {
        size_t length = strlen(OWN[i].name);
        if (strncmp(word, OWN[i].name, length) != 0)
            continue;
        if (word[length] == '=' && OWN[i].has_value)
            return 1;
        if (word[length] == '\0')
            return OWN[i].has_value ? 2 : 1;
    }
    return 0;
}

/* A word as a shell reads it back. */
static void put_word(FILE *out, const char *word)
{
    fputs(" '", out);
    for (; *word; word++)
        if (*word == '\'')
            fputs("'\\''", out);
        else
            fputc(*word, out);
    fputc('\'', out);
}

static void put_command(FILE *out, const struct farm_options *options, int chunks)
{
    char *program = program_path_find("vitrail");
    bool has_submit = false;
    put_word(out, program ? program : "vitrail");
    fputs(" render", out);
    for (char **word = options->common.arguments + 1; *word; word++) {
        int own = own_words(*word);
        if (!has_submit && !strcmp(*word, "submit"))
            has_submit = true;
        else if (own > 0)
            word += own - 1;
        else
            put_word(out, *word);
    }
    if (!options->common.server && !options->common.spawn && !getenv("VITRAIL_SERVER"))
        fputs(" --spawn", out);
    if (!options->frame.skip_existing)
        fputs(" --skip-existing", out);
    fprintf(out, " --chunks %d --progress plain\n", chunks);
    free(program);
}

/* A task that fails for now is queued again by itself. */
static void put_script(FILE *out, const struct farm_options *options, int chunks)
{
    char here[4096];
    fputs("#!/bin/sh\n#SBATCH --requeue\ncd", out);
    put_word(out, getcwd(here, sizeof here) ? here : ".");
    fputs(" || exit 73\n", out);
    put_command(out, options, chunks);
    fputs("code=$?\n"
          "[ $code -ne 75 ] || scontrol requeue \"${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID\"\n"
          "exit $code\n",
          out);
}

/* ---- Slurm ---- */

/* The first line of what a command prints; false: it failed. Its errors go to our stderr. */
static bool ask(const char *command, char *line, int capacity)
{
    FILE *pipe = popen(command, "re");
    if (!pipe)
        return false;
    line[0] = '\0';
    if (fgets(line, capacity, pipe))
        line[strcspn(line, "\n")] = '\0';
    while (fgetc(pipe) != EOF)
        continue;
    int status = pclose(pipe);
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

/* Submits the script by its path; the id of the array goes into `id`. */
static bool submit_script(const struct farm_options *options, const char *script, int chunks,
                          char id[ID_BYTES], struct failure *failure)
{
    char *command = NULL;
    size_t size_bytes;
    FILE *out = open_memstream(&command, &size_bytes);
    if (!out)
        return fail_no_memory(failure);
    fprintf(out, "sbatch --parsable --array=0-%d --job-name", chunks - 1);
    put_word(out, options->name ? options->name : "vitrail");
    for (size_t i = 0; i < options->sbatch.count; i++)
        put_word(out, options->sbatch.items[i]);
    put_word(out, script);
    fclose(out);
    bool is_ok = ask(command, id, ID_BYTES) && strspn(id, "0123456789") > 0;
    free(command);
    id[strspn(id, "0123456789")] = '\0'; /* ";CLUSTER" may follow */
    return is_ok || fail(failure, EXIT_CODE_TEMPORARY, "Slurm did not take the array: see above");
}

static bool submit(const struct farm_options *options, int chunks, char id[ID_BYTES],
                   struct failure *failure)
{
    const char *folder = getenv("TMPDIR");
    char *path = NULL;
    if (asprintf(&path, "%s/vitrail-farm-XXXXXX", folder && *folder ? folder : "/tmp") < 0)
        return fail_no_memory(failure);
    int fd = mkstemp(path);
    FILE *script = fd >= 0 ? fdopen(fd, "w") : NULL;
    bool is_ok = script != NULL;
    if (script) {
        put_script(script, options, chunks);
        is_ok = fclose(script) == 0;
    } else if (fd >= 0) {
        close(fd);
    }
    if (!is_ok)
        fail(failure, EXIT_CODE_CANT_CREATE, "cannot write '%s'", path);
    is_ok = is_ok && submit_script(options, path, chunks, id, failure);
    if (fd >= 0)
        unlink(path); /* Slurm keeps a copy */
    free(path);
    return is_ok;
}

/* ---- watching ---- */

static size_t count_images(const struct farm_options *options, const struct frame_run *run)
{
    size_t count = 0;
    for (size_t i = 0; i < run->list.count; i++) {
        struct stat status;
        char *path = numbered_path_make(options->output, run->list.numbers[i]);
        count += path && stat(path, &status) == 0;
        free(path);
    }
    return count;
}

/* Whether Slurm still has tasks of the array. */
static bool is_queued(const char *id)
{
    char command[96], line[64];
    snprintf(command, sizeof command, "squeue --noheader --jobs=%s --format=%%T 2>/dev/null", id);
    return ask(command, line, sizeof line) && line[0];
}

static bool watch(const struct farm_options *options, const struct frame_run *run, const char *id,
                  struct failure *failure)
{
    struct interrupt interrupt = {0};
    struct progress progress;
    bool is_ok = interrupt_init(&interrupt, failure);
    progress_init(&progress, options->common.quiet ? PROGRESS_NONE : options->common.progress_kind);
    bool is_there = true;
    while (is_ok && is_there) {
        is_there = is_queued(id);
        progress_show(&progress, PROGRESS_STAGE_FRAMES, count_images(options, run),
                      run->list.count);
        is_ok = !is_there || interrupt_sleep(&interrupt, POLL_MS, failure);
    }
    progress_hide(&progress);
    interrupt_finish(&interrupt);
    size_t count = count_images(options, run);
    if (is_ok && count < run->list.count)
        return fail(failure, EXIT_CODE_TEMPORARY,
                    "array %s has ended, and %zu of %zu images are missing: the same call again "
                    "makes them",
                    id, run->list.count - count, run->list.count);
    if (is_ok && !options->common.quiet && !options->common.json)
        printf("%zu images\n", count);
    return is_ok;
}

/* ---- the command ---- */

static bool check(const struct farm_options *options, const struct text_list *operands,
                  struct frame_run *run, int *chunks, struct failure *failure)
{
    const struct option_number *count = &options->frame.chunks;
    struct frame_options frame = options->frame;
    if (strcmp(operands->items[0], "submit") != 0 || operands->count != 2)
        return fail(failure, EXIT_CODE_USAGE, "farm takes 'submit' and one FILE or SCENE");
    if (!options->slurm)
        return fail(failure, EXIT_CODE_USAGE, "which engine? --slurm is the one that there is");
    if (!options->output || !options->frame.frames)
        return fail(failure, EXIT_CODE_USAGE,
                    "farm submit needs -o FILE and --frames LIST, as 'vitrail render'");
    if (frame.chunk.is_given)
        return fail(failure, EXIT_CODE_USAGE, "--chunk is what each task finds out by itself");
    frame.chunks.is_given = false;
    if (!frame_run_init(run, &frame, options->output, failure))
        return false;
    run->options = &options->frame;
    *chunks = run->list.count < CHUNKS_DEFAULT ? (int)run->list.count : CHUNKS_DEFAULT;
    if (count->is_given) {
        if (count->value < 1 || count->value > CHUNKS_MAX || count->value != floor(count->value))
            return fail(failure, EXIT_CODE_USAGE, "--chunks: %g is not a whole number from 1 to %d",
                        count->value, CHUNKS_MAX);
        *chunks = (int)count->value;
    }
    json_t *request = request_json_build(&options->request, failure);
    bool is_ok =
        request && scene_source_check_all(operands->items[1], &options->file, request, failure);
    json_decref(request);
    return is_ok;
}

static bool farm_run(void *context, const struct text_list *operands, struct failure *failure)
{
    const struct farm_options *options = context;
    struct frame_run run = {0};
    char id[ID_BYTES] = "";
    int chunks = 1;
    bool is_ok =
        check(options, operands, &run, &chunks, failure) && submit(options, chunks, id, failure);
    if (is_ok && options->common.json)
        printf("{\"engine\":\"slurm\",\"job\":\"%s\",\"tasks\":%d,\"frames\":%zu}\n", id, chunks,
               run.list.count);
    else if (is_ok)
        puts(id);
    fflush(stdout);
    is_ok = is_ok && (!options->watch || watch(options, &run, id, failure));
    frame_run_finish(&run);
    return is_ok;
}

#define AT(member) offsetof(struct farm_options, member)

static const struct option OPTIONS[] = {
    {OPTION_FLAG, "slurm", 0, NULL, "a job array of Slurm", AT(slurm)},
    {OPTION_LIST, "sbatch", 0, "OPTION", "one more option of sbatch, such as --gres=gpu:1",
     AT(sbatch)},
    {OPTION_TEXT, "job-name", 0, "TEXT", "what Slurm calls the array; default vitrail", AT(name)},
    {OPTION_FLAG, "watch", 0, NULL, "stay until the array has ended, and count its images",
     AT(watch)},
    {OPTION_TEXT, "output-file", 'o', "FILE",
     "where the images go, with a %d or %04d; a folder that all nodes\nshare", AT(output)},
    {OPTION_TEXT, "format", 0, "NAME", "png, jpeg, webp, exr or exr-deep, whatever FILE is called",
     AT(request.format)},
    FRAME_OPTIONS(struct farm_options),
    SCENE_FILE_OPTIONS(struct farm_options),
    REQUEST_OPTIONS(struct farm_options),
    {OPTION_FLAG, "strict", 0, NULL,
     "a warning of scene or frame is a failure: no image is written", AT(strict)},
    {0},
};

const struct command COMMAND_FARM = {
    .name = "farm",
    .synopsis = "submit FILE|SCENE -o OUT --frames LIST --slurm",
    .summary = "Hand the frames of a render to the engine of a farm",
    .details =
        "Each task of the array runs 'vitrail render' for its share of the frames, with\n"
        "--skip-existing, and with --spawn unless a server is named. A task that fails for\n"
        "now (75) or whose node is lost is queued again. Submitted again, the call makes what\n"
        "is missing. --chunks says how many tasks there are; default 10.\n" REQUEST_HELP,
    .options = OPTIONS,
    .is_remote = true,
    .operands_min = 2,
    .operands_max = 2,
    .options_bytes = sizeof(struct farm_options),
    .run = farm_run,
};
