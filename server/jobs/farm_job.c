/* SPDX-License-Identifier: MIT */
/* One job: made from its text, and the request of each of its frames. */
#include <stdlib.h>
#include <string.h>

#include "renderer/image/image_join.h"
#include "server/front/task_resources.h"
#include "server/jobs/jobs_internal.h"
#include "server/mapping/format_mapping.h"

/* ---- outputs ---- */

static enum image_format image_format_of(enum request_format format)
{
    const struct render_request request = {.format = format};
    return image_format_from_request(&request);
}

/* PNG where that holds what the output is of, else EXR. */
static bool choose_format(struct job_output *output, int index, struct error *err)
{
    char pointer[32];
    unsigned formats = frame_image_formats(output->outputs);
    if (output->format == REQUEST_FORMAT_ANY)
        output->format = formats & 1u << IMAGE_FORMAT_PNG ? REQUEST_FORMAT_PNG : REQUEST_FORMAT_EXR;
    if (formats & 1u << image_format_of(output->format))
        return true;
    snprintf(pointer, sizeof pointer, "/outputs/%d", index);
    return error_set_at(err, ERROR_UNSUPPORTED, pointer,
                        "%s: %s cannot hold what '%s' is of; use exr%s", pointer,
                        request_format_name((int)output->format), output->name,
                        formats & 1u << IMAGE_FORMAT_PNG ? " or png" : "");
}

static bool check_deep(const struct job_request *request, int index, struct error *err)
{
    const struct job_output *output = &request->outputs[index];
    char pointer[32], why[DEEP_FAULT_BYTES];
    snprintf(pointer, sizeof pointer, "/outputs/%d", index);
    if (output->format != REQUEST_FORMAT_EXR_DEEP)
        return true;
    if (render_request_deep_fault(&request->render, output->outputs, why))
        return error_set_at(err, ERROR_UNSUPPORTED, pointer, "%s is %s, %s", pointer,
                            request_format_name((int)output->format), why);
    return !request->tile_width ||
           error_set_at(err, ERROR_UNSUPPORTED, pointer,
                        "%s: pictures in tiles cannot be %s: use png, jpeg, webp or exr", pointer,
                        request_format_name((int)output->format));
}

/* Pictures in tiles are larger than some formats hold. */
static bool check_sides(const struct job_request *request, int index, struct error *err)
{
    char pointer[32];
    enum request_format format = request->outputs[index].format;
    int most = image_join_side_max(image_format_of(format));
    if (!request->tile_width || (request->render.width <= most && request->render.height <= most))
        return true;
    snprintf(pointer, sizeof pointer, "/outputs/%d", index);
    return error_set_at(err, ERROR_UNSUPPORTED, pointer,
                        "%s: %s holds %d pixels a side, the picture has %d x %d", pointer,
                        request_format_name((int)format), most, request->render.width,
                        request->render.height);
}

/* ---- the scene ---- */

/* What turntables and the time of frames depend on. */
static void read_summary(struct farm_job *job, const json_t *summary)
{
    const struct render_request *render = &job->request.render;
    job->is_animated = json_integer_value(json_object_get(summary, "animation_count")) > 0 &&
                       !job->request.is_still;
    job->has_bounds = turntable_init(&job->turntable, summary, render->width, render->height);
}

static bool check_scene(const struct jobs *jobs, struct farm_job *job, bool is_kept,
                        struct error *err)
{
    const struct resources *resources = jobs->desc.resources;
    struct error problem = {0};
    if (!is_kept && !farm_job_has_resources(jobs, job, err))
        return false;
    json_t *summary =
        resource_store_get_summary(resources->scenes, job->request.render.scene, &problem);
    read_summary(job, summary);
    json_decref(summary);
    return is_kept || !job->request.turntable.is_given || job->has_bounds ||
           error_set_at(err, ERROR_UNSUPPORTED, "/turntable",
                        "/turntable: the scene has nothing to go round");
}

struct farm_job *farm_job_create(const struct jobs *jobs, const char *text, size_t size_bytes,
                                 bool is_kept, struct error *err)
{
    struct farm_job *job = calloc(1, sizeof *job);
    if (!job) {
        error_set(err, ERROR_NO_MEMORY, "job");
        return NULL;
    }
    bool is_good = job_request_parse(text, size_bytes, &job->request, err);
    for (int i = 0; is_good && i < job->request.output_count; i++)
        is_good = choose_format(&job->request.outputs[i], i, err) &&
                  check_deep(&job->request, i, err) && check_sides(&job->request, i, err);
    is_good = is_good && job_request_name_files(&job->request, err) &&
              check_scene(jobs, job, is_kept, err);
    if (is_good) {
        job->tiles = job_request_tiles(&job->request);
        job->frames = calloc(job->request.frames.count, sizeof *job->frames);
        is_good = job->frames || error_set(err, ERROR_NO_MEMORY, "frames of a job");
    }
    if (is_good)
        return job;
    farm_job_destroy(job);
    return NULL;
}

void farm_job_destroy(struct farm_job *job)
{
    if (!job)
        return;
    for (size_t i = 0; job->frames && i < job->request.frames.count; i++) {
        free(job->frames[i].problem);
        free(job->frames[i].files);
        free(job->frames[i].tiles);
    }
    free(job->frames);
    free(job->chosen);
    json_decref(job->chosen_json);
    job_request_finish(&job->request);
    free(job);
}

/* ---- what the server chooses ---- */

bool farm_job_is_open(const struct farm_job *job)
{
    const struct request_quality *quality = &job->request.render.quality;
    return !job->chosen && !quality->reference &&
           (quality->shadows == SHADOWS_AUTO || request_quality_asks(quality));
}

void farm_job_set_chosen(struct farm_job *job, char *chosen)
{
    json_t *json = chosen && !job->chosen ? json_loads(chosen, 0, NULL) : NULL;
    if (!json) {
        free(chosen);
        return;
    }
    job->chosen = chosen;
    job->chosen_json = json;
    job->record.chosen = chosen;
}

/* All frames of a shot have the settings of its first one: they would flicker otherwise. */
static void apply_chosen(const struct farm_job *job, struct request_quality *quality)
{
    const json_t *chosen = json_object_get(job->chosen_json, "chosen");
    const struct quality_setting setting = tradeoff_setting_from_json(chosen);
    if (setting.shadows != SHADOWS_COUNT)
        request_quality_set(quality, &setting);
}

/* ---- frames ---- */

static struct request_camera turntable_camera(const struct farm_job *job, int position)
{
    const struct job_turntable *asked = &job->request.turntable;
    struct request_camera camera = {.kind = REQUEST_CAMERA_LOOK_AT,
                                    .fov_y_deg = TURNTABLE_FOV_Y_DEG};
    memcpy(camera.target, job->turntable.center, sizeof camera.target);
    turntable_eye(&job->turntable, asked->elevation_deg,
                  asked->turns * position / (double)job->request.frames.count, camera.eye);
    return camera;
}

static struct request_camera path_camera(const struct farm_job *job, int position)
{
    const struct camera_path *path = &job->request.camera_path;
    int frame = job->request.frames.numbers[position];
    return camera_path_at(path, camera_path_moment(path, frame, job->request.frame_rate));
}

struct render_request farm_job_render(const struct farm_job *job, int position, int output)
{
    const struct job_output *wanted = &job->request.outputs[output];
    struct render_request render = job->request.render;
    render.outputs = wanted->outputs;
    render.format = wanted->format;
    render.quality_percent = wanted->quality_percent;
    if (job->is_animated) {
        render.animation.is_given = true;
        render.animation.time_s += job->request.frames.numbers[position] / job->request.frame_rate;
    }
    if (job->chosen)
        apply_chosen(job, &render.quality);
    if (job->request.turntable.is_given)
        render.camera = turntable_camera(job, position);
    if (job->request.camera_path.count > 0)
        render.camera = path_camera(job, position);
    return render;
}

bool farm_job_has_ended(const struct farm_job *job)
{
    return job->record.state != FARM_JOB_QUEUED && job->record.state != FARM_JOB_RUNNING;
}

struct job_place farm_job_place(const struct farm_job *job)
{
    return (struct job_place){.id = job->record.id,
                              .directory = job->request.directory,
                              .makes_directory = job->makes_directory};
}

void farm_job_set_frame(struct farm_job *job, int position, enum farm_frame_state state)
{
    struct farm_frame *frame = &job->frames[position];
    job->done_count += (state == FARM_FRAME_DONE) - (frame->state == FARM_FRAME_DONE);
    job->failed_count += (state == FARM_FRAME_FAILED) - (frame->state == FARM_FRAME_FAILED);
    if (frame->state == FARM_FRAME_FAILED && state == FARM_FRAME_QUEUED)
        farm_tiles_forget_attempts(job, frame);
    frame->state = state;
    bool has_ended = state == FARM_FRAME_DONE || state == FARM_FRAME_FAILED;
    if (!has_ended && position < job->next)
        job->next = position;
    int count = (int)job->request.frames.count;
    while (job->next < count && (job->frames[job->next].state == FARM_FRAME_DONE ||
                                 job->frames[job->next].state == FARM_FRAME_FAILED))
        job->next++;
}
