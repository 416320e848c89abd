/* SPDX-License-Identifier: MIT */
/* A share is a run of the list, so that frames of one task follow each other. */
#include "clients/vitrail/frame_run.h"

#include <math.h>
#include <stdlib.h>

#include "clients/vitrail/numbered_path.h"
#include "clients/vitrail/request_json.h"
#include "protocol/limits.h"

enum { CHUNKS_MAX = 1000000 };
static const double FRAME_RATE = 24;

/* ---- the share of this call ---- */

static bool read_whole(const struct option_number *number, const char *name, double least,
                       double most, int *value, struct failure *failure)
{
    if (number->value != floor(number->value) || number->value < least || number->value > most)
        return fail(failure, EXIT_CODE_USAGE, "--%s: %g is not a whole number from %g to %g", name,
                    number->value, least, most);
    *value = (int)number->value;
    return true;
}

/* A whole number of the environment; false: it is not there, or not one. */
static bool read_environment(const char *name, double *value)
{
    const char *text = getenv(name);
    return text && number_parse(text, value) && *value >= 0 && *value == floor(*value);
}

/* Where a farm says which task of an array this is. */
static bool find_chunk(struct option_number *chunk)
{
    double first = 0, step = 1;
    if (read_environment("SLURM_ARRAY_TASK_ID", &chunk->value)) {
        read_environment("SLURM_ARRAY_TASK_MIN", &first);
        if (!read_environment("SLURM_ARRAY_TASK_STEP", &step) || step < 1)
            step = 1;
        chunk->value = (chunk->value - first) / step;
        return true;
    }
    return read_environment("JOB_COMPLETION_INDEX", &chunk->value);
}

static bool take_share(struct frame_run *run, struct failure *failure)
{
    const struct frame_options *options = run->options;
    struct option_number which = options->chunk;
    int chunks = 1, chunk = 0;
    if (options->chunk.is_given && !options->chunks.is_given)
        return fail(failure, EXIT_CODE_USAGE, "--chunk says which of --chunks N");
    if (options->chunks.is_given) {
        if (!read_whole(&options->chunks, "chunks", 1, CHUNKS_MAX, &chunks, failure))
            return false;
        if (!which.is_given && !find_chunk(&which))
            return fail(failure, EXIT_CODE_USAGE,
                        "--chunks %d needs --chunk I, SLURM_ARRAY_TASK_ID or JOB_COMPLETION_INDEX",
                        chunks);
        if (!read_whole(&which, "chunk", 0, chunks - 1, &chunk, failure))
            return false;
    }
    run->first = run->list.count * (size_t)chunk / (size_t)chunks;
    run->end = run->list.count * (size_t)(chunk + 1) / (size_t)chunks;
    return true;
}

static double frame_rate_of(const struct frame_run *run)
{
    const struct option_number *rate = &run->options->frame_rate;
    return rate->is_given ? rate->value : FRAME_RATE;
}

static bool read_path(struct frame_run *run, struct failure *failure)
{
    const char *file = run->options->camera_path;
    struct error problem = {0};
    json_t *keys = file ? json_object_load(file, "camera-path", failure) : NULL;
    bool is_ok =
        keys && camera_path_load(keys, &run->list, frame_rate_of(run), &run->path, &problem);
    json_decref(keys);
    if (keys && !is_ok)
        fail(failure, EXIT_CODE_USAGE, "--camera-path: '%s': %s", file, problem.message);
    return !file || is_ok;
}

bool frame_run_init(struct frame_run *run, const struct frame_options *options, const char *pattern,
                    struct failure *failure)
{
    struct error problem = {0};
    *run = (struct frame_run){.options = options};
    if (!options->frames)
        return !(options->frame_rate.is_given || options->chunk.is_given ||
                 options->chunks.is_given || options->still || options->skip_existing ||
                 options->camera_path) ||
               fail(failure, EXIT_CODE_USAGE,
                    "--frame-rate, --still, --camera-path, --chunk, --chunks and --skip-existing "
                    "go with --frames");
    if (options->frame_rate.is_given && !(options->frame_rate.value > 0))
        return fail(failure, EXIT_CODE_USAGE, "--frame-rate: %g is not above 0",
                    options->frame_rate.value);
    if (!frame_list_parse(options->frames, LIMIT_JOB_FRAMES, &run->list, &problem))
        return fail(failure, EXIT_CODE_USAGE, "--%s", problem.message);
    return numbered_path_check(pattern, failure) && read_path(run, failure) &&
           take_share(run, failure);
}

void frame_run_finish(struct frame_run *run)
{
    frame_list_finish(&run->list);
    camera_path_finish(&run->path);
}

/* ---- time and camera ---- */

void frame_run_note(struct frame_run *run, const json_t *request, const json_t *description)
{
    const json_t *animation = json_object_get(request, "animation");
    run->time_s = json_number_value(json_object_get(animation, "time_s"));
    run->is_animated = !run->options->still &&
                       json_integer_value(json_object_get(description, "animation_count")) > 0;
}

static bool put_time(const struct frame_run *run, size_t index, json_t *request,
                     struct failure *failure)
{
    json_t *animation = json_object_get(request, "animation");
    if (!run->is_animated)
        return true;
    double time_s = run->time_s + run->list.numbers[index] / frame_rate_of(run);
    if (!json_is_object(animation)) {
        animation = json_object();
        if (json_object_set_new(request, "animation", animation) != 0)
            return fail_no_memory(failure);
    }
    return json_object_set_new(animation, "time_s", json_real(time_s)) == 0 ||
           fail_no_memory(failure);
}

static bool put_camera(const struct frame_run *run, size_t index, json_t *request,
                       struct failure *failure)
{
    if (run->path.count == 0)
        return true;
    double moment = camera_path_moment(&run->path, run->list.numbers[index], frame_rate_of(run));
    const struct request_camera camera = camera_path_at(&run->path, moment);
    json_t *json =
        json_pack("{s:[fff],s:[fff],s:[fff],s:f}", "eye", camera.eye[0], camera.eye[1],
                  camera.eye[2], "target", camera.target[0], camera.target[1], camera.target[2],
                  "up", camera.up[0], camera.up[1], camera.up[2], "fov_y_deg", camera.fov_y_deg);
    if (json && camera.ortho_height > 0)
        json_object_set_new(json, "ortho_height", json_real(camera.ortho_height));
    return json_object_set_new(request, "camera", json) == 0 || fail_no_memory(failure);
}

bool frame_run_put_frame(const struct frame_run *run, size_t index, json_t *request,
                         struct failure *failure)
{
    return put_time(run, index, request, failure) && put_camera(run, index, request, failure);
}
