/* SPDX-License-Identifier: MIT */
/* What clients see of jobs and frames. */
#include <math.h>
#include <stdio.h>
#include <time.h>

#include "protocol/json_write.h"
#include "server/base/clock.h"
#include "server/jobs/jobs_internal.h"

enum { PROBLEMS_SHOWN = 20 };

static const char *const job_state_names[] = {[FARM_JOB_QUEUED] = "queued",
                                              [FARM_JOB_RUNNING] = "running",
                                              [FARM_JOB_DONE] = "done",
                                              [FARM_JOB_FAILED] = "failed",
                                              [FARM_JOB_CANCELLED] = "cancelled"};
static const char *const frame_state_names[] = {[FARM_FRAME_QUEUED] = "queued",
                                                [FARM_FRAME_RUNNING] = "running",
                                                [FARM_FRAME_DONE] = "done",
                                                [FARM_FRAME_FAILED] = "failed"};

static json_t *problem_to_object(enum error_code code, const char *detail)
{
    return json_pack("{s:s,s:o}", "code", error_code_name(code), "detail", json_text(detail));
}

static json_t *counts_to_json(const struct farm_job *job)
{
    int count = (int)job->request.frames.count, running = 0;
    for (int i = job->next; i < count && job->pieces > 0; i++)
        running += job->frames[i].state == FARM_FRAME_RUNNING;
    return json_pack("{s:s,s:i,s:i,s:i,s:i,s:i}", "list", job->request.frames_text, "count", count,
                     "done", job->done_count, "failed", job->failed_count, "running", running,
                     "queued", count - job->done_count - job->failed_count - running);
}

/* Likewise at that of the tiles. */
static json_t *remaining_tiles_s(const struct farm_job *job)
{
    double done, all;
    farm_tiles_count(job, &done, &all);
    if (farm_job_has_ended(job) || job->tiles_done == 0 || !(job->tiles_ms > 0))
        return json_null();
    return json_real(round((all - done) * job->tiles_ms / (double)job->tiles_done) / 1e3);
}

static double progress_of(const struct farm_job *job)
{
    double done = job->done_count + job->failed_count, all = (double)job->request.frames.count;
    if (farm_job_has_tiles(job))
        farm_tiles_count(job, &done, &all);
    return done / all;
}

/* null: its pictures are in one piece. */
static json_t *tiles_to_json(const struct farm_job *job)
{
    double done, all;
    if (!farm_job_has_tiles(job))
        return json_null();
    farm_tiles_count(job, &done, &all);
    return json_pack("{s:i,s:i,s:I,s:I}", "columns", job->tiles.columns, "rows", job->tiles.rows,
                     "count", (json_int_t)all, "done", (json_int_t)done);
}

/* What is left at the pace of the frames that are done; null where nothing tells. */
static json_t *remaining_s(const struct farm_job *job)
{
    int left = (int)job->request.frames.count - job->done_count - job->failed_count;
    if (farm_job_has_tiles(job))
        return remaining_tiles_s(job);
    if (farm_job_has_ended(job) || job->done_count == 0)
        return json_null();
    return json_real(round(left * job->busy_ms / job->done_count) / 1e3);
}

static json_t *outputs_to_json(const struct farm_job *job)
{
    json_t *outputs = json_array();
    bool has_failed = !outputs;
    for (int i = 0; outputs && i < job->request.output_count; i++) {
        const struct job_output *output = &job->request.outputs[i];
        json_append(outputs,
                    json_pack("{s:s,s:s,s:s}", "name", output->name, "file", output->file, "format",
                              request_format_name((int)output->format)),
                    &has_failed);
    }
    return json_take_unless(outputs, has_failed);
}

static json_t *problems_to_json(const struct farm_job *job)
{
    json_t *problems = json_array();
    bool has_failed = !problems;
    int shown = 0;
    for (size_t i = 0; problems && job->failed_count > 0 && i < job->request.frames.count; i++) {
        const struct farm_frame *frame = &job->frames[i];
        if (frame->state != FARM_FRAME_FAILED || shown++ >= PROBLEMS_SHOWN)
            continue;
        json_append(problems,
                    json_pack("{s:i,s:i,s:o}", "frame", job->request.frames.numbers[i], "attempts",
                              frame->attempts, "problem",
                              problem_to_object(frame->code, frame->problem)),
                    &has_failed);
    }
    return json_take_unless(problems, has_failed);
}

/* The jobs that it waits for. */
static json_t *waits_for_to_json(const struct farm_job *job)
{
    json_t *ids = json_array();
    bool has_failed = !ids;
    for (int i = 0; ids && farm_job_is_waiting(job) && i < job->request.after_count; i++)
        if (job->unmet & 1u << i)
            json_append(ids, json_text(job->request.after[i]), &has_failed);
    return json_take_unless(ids, has_failed);
}

static json_t *problem_to_json(const struct farm_job *job)
{
    const struct error *problem = &job->record.problem;
    /* One that does not wait on is cancelled in a moment, and has its problem then. */
    if (problem->code == ERROR_NONE && farm_job_is_waiting(job) && job->broken &&
        job->request.after_failure == JOB_AFTER_FAILURE_WAIT)
        problem = &job->broken_why;
    return problem->code == ERROR_NONE ? json_null()
                                       : problem_to_object(problem->code, problem->message);
}

json_t *farm_job_to_json(const struct jobs *jobs, const struct farm_job *job, bool is_whole)
{
    const struct job_record *record = &job->record;
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "id", record->id);
    json_put_text_or_null(&writer, "name", job->request.name[0] ? job->request.name : NULL);
    json_put_text(&writer, "state",
                  farm_job_is_waiting(job) ? "waiting" : job_state_names[record->state]);
    json_put(&writer, "waits_for", waits_for_to_json(job));
    json_put_bool(&writer, "paused", record->is_paused);
    json_put_text(&writer, "scene", job->request.render.scene);
    json_put_integer(&writer, "priority", (uint64_t)record->priority);
    json_put_integer(&writer, "sequence", record->sequence);
    json_put(&writer, "created", json_time(record->created_s));
    json_put(&writer, "started", json_time(record->started_s));
    json_put(&writer, "ended", json_time(record->ended_s));
    json_put(&writer, "expires", json_time(jobs_expire_s(jobs, job)));
    json_put(&writer, "frames", counts_to_json(job));
    json_put_number(&writer, "progress", progress_of(job));
    json_put(&writer, "tiles", tiles_to_json(job));
    json_put_number(&writer, "busy_s", round(job->busy_ms) / 1e3);
    json_put(&writer, "remaining_s", remaining_s(job));
    json_put(&writer, "problem", problem_to_json(job));
    if (is_whole) {
        const json_t *chosen = json_object_get(job->chosen_json, "chosen");
        const json_t *error = json_object_get(job->chosen_json, "error");
        json_put(&writer, "chosen", chosen ? json_deep_copy(chosen) : json_null());
        json_put(&writer, "error", error ? json_deep_copy(error) : json_null());
        json_put(&writer, "outputs", outputs_to_json(job));
        json_put(&writer, "failures", problems_to_json(job));
        json_put(&writer, "request", job_request_to_json(&job->request));
    }
    return json_writer_take(&writer);
}

static json_t *files_to_json(const struct farm_job *job, int position)
{
    json_t *files = json_array();
    bool has_failed = !files;
    for (int i = 0; files && i < job->request.output_count; i++) {
        const struct farm_frame *frame = &job->frames[position];
        const struct job_output *output = &job->request.outputs[i];
        int number = job->request.frames.numbers[position];
        char name[JOB_FILE_BYTES], path[160];
        if (!frame->files || frame->files[i].size_bytes == 0)
            continue;
        job_file_name(output, number, name);
        snprintf(path, sizeof path, "/v1/jobs/%s/frames/%d/%s", job->record.id, number,
                 output->name);
        json_append(files,
                    json_pack("{s:s,s:s,s:s,s:I,s:s}", "output", output->name, "file", name, "href",
                              path, "bytes", (json_int_t)frame->files[i].size_bytes, "sha256",
                              frame->files[i].digest),
                    &has_failed);
    }
    return json_take_unless(files, has_failed);
}

json_t *farm_frame_to_json(const struct farm_job *job, int position)
{
    const struct farm_frame *frame = &job->frames[position];
    struct json_writer writer = json_writer_begin();
    json_put_integer(&writer, "frame", (uint64_t)job->request.frames.numbers[position]);
    json_put_text(&writer, "state", frame_state_names[frame->state]);
    json_put_integer(&writer, "attempts", (uint64_t)frame->attempts);
    json_put(&writer, "ms",
             frame->ms > 0 ? json_real(round(1000 * (double)frame->ms) / 1000) : json_null());
    json_put(&writer, "problem",
             frame->code == ERROR_NONE ? json_null()
                                       : problem_to_object(frame->code, frame->problem));
    json_put(&writer, "files", files_to_json(job, position));
    return json_writer_take(&writer);
}
