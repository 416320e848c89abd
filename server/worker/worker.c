/* SPDX-License-Identifier: MIT */
/* The worker: it takes messages, has the renderer draw, and hands frames to the encode pool. */
#include "server/worker/worker.h"

#include <pthread.h>
#include <malloc.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "renderer/base/processors.h"
#include "server/base/build_id.h"
#include "server/base/clock.h"
#include "server/base/ipc.h"
#include "server/mapping/device_messages.h"
#include "server/mapping/questions.h"
#include "server/mapping/view_mapping.h"
#include "server/worker/chooser.h"
#include "server/worker/encoder.h"
#include "server/worker/explain.h"
#include "server/worker/idle_timing.h"
#include "server/worker/inbox.h"
#include "server/worker/message_files.h"
#include "server/worker/measure.h"
#include "server/worker/pick.h"
#include "server/worker/warm_up_step.h"
#include "server/worker/worker_device.h"

enum {
    ENCODE_THREADS_MAX = 4,
    URGENT_US = 60000,      /* urgent frames that arrive within it preempt a long frame, ... */
    LOOK_MS = 1,            /* for messages, while the device is waited for */
    SLICE_US = 10000,       /* ... which then runs for half of their time, and at least so long */
    TELL_FIRST_US = 500000, /* before the first message about a frame's progress, ... */
    TELL_EVERY_US = 250000, /* ... and between two of them */
    MEASURE_IDLE_MS = 1000, /* after which the device's speed is measured: a client that opens a
                               scene at once goes before */
    STILL_MS = 100,         /* without a frame of a view in motion, after which none moves */
};

/* A view that the renderer borrows until its frame is retired. */
struct submitted_view {
    struct view view;
    struct view_storage storage;
    struct auto_choice choice;
};

struct worker {
    int socket;
    struct inbox *inbox;
    struct yield_point yield;
    struct frame_progress progress;
    uint64_t reported;             /* the frame that progress is of */
    atomic_int_least64_t tell_us;  /* when the next message is due */
    bool is_paused, is_lost;       /* a frame is preempted; the GL context is lost */
    bool is_in_motion;             /* the last frame was one of a view in motion */
    uint64_t current;              /* the frame that may be paused */
    struct encode_task *in_flight; /* whose frame is in flight; or NULL */
    struct submitted_view *in_flight_view;
    struct frame_completion completion;
    int64_t slice_until_us;     /* before it the frame that may be paused does not yield */
    unsigned urgent_arrivals;   /* at the time when no waiting frame could be served */
    json_t *forgotten;          /* ids of what is to be forgotten between frames */
    pthread_mutex_t send_mutex; /* the GL thread and the encode pool both send */
    struct renderer *renderer;
    struct renderer_info info;
    struct message_files files;
    struct encoder *encoder;
    struct worker_device device;
    struct idle_timing timing;
    struct time_estimator *estimator; /* of frames that were chosen */
    struct gl_device_list devices;    /* that may not be taken, and why */
    struct gl_device tried;           /* the last one */
};

/* Takes the reference. A front that is gone is noticed by the next receive. */
static void send_message(struct worker *worker, json_t *json, const int *fds, int fd_count)
{
    struct error problem = {0};
    if (!json)
        return;
    pthread_mutex_lock(&worker->send_mutex);
    if (!ipc_send(worker->socket, json, fds, fd_count, &problem))
        shutdown(worker->socket, SHUT_RDWR);
    pthread_mutex_unlock(&worker->send_mutex);
    json_decref(json);
}

static void send_progress(struct worker *worker, const char *op, uint64_t id)
{
    send_message(worker, json_pack("{s:s,s:I}", "op", op, "id", (json_int_t)id), NULL, 0);
}

static void send_error(struct worker *worker, const char *op, uint64_t id,
                       const struct error *problem)
{
    send_message(worker,
                 json_pack("{s:s,s:I,s:o}", "op", op, "id", (json_int_t)id, "error",
                           ipc_error_to_json(problem)),
                 NULL, 0);
}

/* On a thread of the encode pool. */
static void encoded(void *context, struct encode_task *task, const struct error *problem)
{
    struct worker *worker = context;
    struct error failure = *problem;
    int image_fd = -1;
    if (failure.code == ERROR_NONE)
        image_fd = ipc_memfd_create("vitrail-image", task->bytes, task->size_bytes, &failure);
    json_t *stats = image_fd >= 0 ? frame_stats_to_json(&task->stats) : NULL;
    if (image_fd >= 0 && !stats)
        error_set(&failure, ERROR_NO_MEMORY, "stats of the frame");
    if (failure.code == ERROR_NONE)
        send_message(worker,
                     json_pack("{s:s,s:I,s:o,s:s}", "op", "done", "id", (json_int_t)task->id,
                               "stats", stats, "drawn", task->drawn),
                     &image_fd, 1);
    else
        send_error(worker, "error", task->id, &failure);
    if (image_fd >= 0)
        close(image_fd);
}

/* Sends the totals for /metrics, from the GL thread, which alone may ask the renderer. */
static void send_totals(struct worker *worker)
{
    struct mapped_scenes_totals totals = mapped_scenes_get_totals(worker->files.scenes);
    worker_device_keep_observations(&worker->device, worker->is_in_motion);
    renderer_get_info(worker->renderer, &worker->info);
    send_message(
        worker,
        json_pack("{s:s,s:o*,s:o*,s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:I}",
                  "op", "totals", "lessons", worker_device_take_lessons(&worker->device), "times",
                  time_estimator_take_lessons(worker->estimator), "timed",
                  (json_int_t)worker->timing.timed, "timings_stopped",
                  (json_int_t)worker->timing.stopped, "learned",
                  (json_int_t)worker_device_learned(&worker->device), "learned_kept",
                  (json_int_t)worker->device.observations_print, "programs_built",
                  (json_int_t)worker->info.programs_built, "programs_reused",
                  (json_int_t)worker->info.programs_reused, "programs_loaded",
                  (json_int_t)worker->info.programs_loaded, "programs_kept",
                  (json_int_t)worker->info.programs_kept, "programs_kept_bytes",
                  (json_int_t)worker->info.programs_kept_bytes, "gpu_used_bytes",
                  (json_int_t)worker->info.used_bytes, "cache_bytes", (json_int_t)totals.bytes,
                  "cache_scenes", (json_int_t)totals.scenes, "cache_hits", (json_int_t)totals.hits,
                  "cache_misses", (json_int_t)totals.misses, "cache_evictions",
                  (json_int_t)totals.evictions),
        NULL, 0);
}

/* The frame is finished: takes the task. */
static void pass_on(struct worker *worker, struct encode_task *task)
{
    metering_report(&task->metering, &task->frame.report);
    frame_stats_from_report(&task->request, &task->frame.report, worker->info.renderer,
                            &task->stats);
    metering_tell(&task->request, task->format, &task->stats);
    chooser_judge(worker->estimator, &task->promise, &task->stats);
    send_progress(worker, "rendered", task->id);
    send_totals(worker);
    encoder_submit(worker->encoder, task);
}

/* Notes whether the context is lost: then the worker must end. */
static void say_failed(struct worker *worker, uint64_t id, const struct error *problem)
{
    bool is_lost = problem->code == ERROR_NO_DEVICE;
    send_error(worker, is_lost ? "lost" : "error", id, problem);
    worker->is_lost |= is_lost;
}

/* Accepts NULL. */
static void submitted_view_destroy(struct submitted_view *submitted)
{
    if (submitted)
        view_storage_finish(&submitted->storage);
    free(submitted);
}

/* Waits for the frame in flight, if any, and hands it on. */
static void retire(void *context)
{
    struct worker *worker = context;
    struct encode_task *task = worker->in_flight;
    struct submitted_view *submitted = worker->in_flight_view;
    struct error problem = {0};
    worker->in_flight = NULL;
    worker->in_flight_view = NULL;
    if (task && renderer_collect(worker->renderer, &problem)) {
        pass_on(worker, task);
    } else if (task) {
        say_failed(worker, task->id, &problem);
        encode_task_destroy(task);
    }
    submitted_view_destroy(submitted);
}

static bool is_at_hand(void *context, const json_t *message)
{
    const struct worker *worker = context;
    return message_files_are_at_hand(&worker->files, message);
}

/* Reads the request and makes its scene ready. */
static bool read_request(struct worker *worker, const struct ipc_message *message,
                         struct render_request *request, struct error *err)
{
    struct ipc_mapping text = {0};
    bool is_good = ipc_mapping_init(&text, message->fd_count > 0 ? message->fds[0] : -1, err) &&
                   render_request_parse(text.bytes, text.size_bytes, request, err);
    if (is_good && !is_at_hand(worker, message->json)) /* uploading a scene may take long */
        retire(worker);
    is_good = is_good && message_files_attach(&worker->files, message, request, err);
    ipc_mapping_finish(&text);
    return is_good;
}

static bool read_format(const json_t *message, enum image_format *format, struct error *err)
{
    const char *name = json_string_value(json_object_get(message, "format"));
    return (name && image_format_from_name(name, format)) ||
           error_set(err, ERROR_INTERNAL, "worker: no image format in the message");
}

/* Chooses what the request leaves open, from what came with its message. */
static bool choose(struct worker *worker, const struct ipc_message *message,
                   struct render_request *request, struct frame_promise *promise, struct error *err)
{
    return chooser_choose(
        &(struct chooser_desc){.estimator = worker->estimator,
                               .automatic = &worker->device.automatic,
                               .info = &worker->info,
                               .offer = json_object_get(message->json, "offer"),
                               .is_warm = json_is_true(json_object_get(message->json, "reuse"))},
        request, promise, err);
}

static bool read_chosen(struct worker *worker, const struct ipc_message *message,
                        struct encode_task *task, struct error *err)
{
    if (!read_request(worker, message, &task->request, err))
        return false;
    bool asks = request_quality_asks(&task->request.quality);
    json_t *stated = json_object_get(message->json, "stated_error");
    task->asked_quality = json_incref(json_object_get(message->json, "asked_quality"));
    return choose(worker, message, &task->request, &task->promise, err) &&
           frame_promise_take_error(&task->promise, stated, err) &&
           (!asks || chooser_digest(&task->request, &task->promise, task->drawn, err));
}

/* Submits a frame. If it is in flight afterwards, is_done is false and the renderer borrows the
 * view until the frame is retired. */
static bool draw(struct worker *worker, struct ipc_message *message, struct encode_task *task,
                 struct submitted_view *submitted, bool *is_done, struct error *err)
{
    struct view *view = &submitted->view;
    if (!read_chosen(worker, message, task, err) ||
        !read_format(message->json, &task->format, err) ||
        !view_from_request(&task->request, &submitted->storage, view, err))
        return false;
    view->quality.expects_reuse = json_is_true(json_object_get(message->json, "reuse"));
    view->quality.may_be_coarse = json_is_true(json_object_get(message->json, "coarse"));
    worker->is_in_motion = view->quality.may_be_coarse;
    if (!chooser_choose_technique(worker->renderer, task->request.scene, view, &submitted->choice,
                                  err) ||
        !metering_resolve(worker->renderer, view, task->format, &task->request, &task->metering,
                          err))
        return false;
    view->screen = view_screen_from_request(&task->request, task->format);
    return renderer_submit(worker->renderer, task->request.scene, view, &task->frame, is_done, err);
}

static bool is_urgent(const struct ipc_message *message)
{
    return json_is_true(json_object_get(message->json, "urgent"));
}

static void begin_yielding(struct worker *worker, uint64_t id)
{
    worker->current = id;
    worker->slice_until_us = now_us() + SLICE_US;
    inbox_set_current(worker->inbox, id);
    renderer_set_yield_point(worker->renderer, &worker->yield);
}

/* On any thread of the renderer, often. */
static void tell_progress(void *context, enum frame_stage stage, double share)
{
    static const char *const stages[FRAME_STAGE_COUNT] = {
        [FRAME_STAGE_SHADOWS] = "shadows",
        [FRAME_STAGE_RAYS] = "rays",
        [FRAME_STAGE_SHADING] = "shading",
    };
    struct worker *worker = context;
    int_least64_t due_us = atomic_load(&worker->tell_us), us = now_us();
    if (us >= due_us &&
        atomic_compare_exchange_strong(&worker->tell_us, &due_us, us + TELL_EVERY_US))
        send_message(worker,
                     json_pack("{s:s,s:I,s:s,s:f}", "op", "progress", "id",
                               (json_int_t)worker->reported, "stage", stages[stage], "share",
                               share),
                     NULL, 0);
}

/* Renders yield to urgent ones; urgent renders are drawn without a yield point. */
static void begin_render(struct worker *worker, const struct ipc_message *message, uint64_t id)
{
    send_progress(worker, "begin", id);
    if (worker->is_paused)
        return;
    worker->reported = id;
    atomic_store(&worker->tell_us, now_us() + TELL_FIRST_US);
    renderer_set_progress(worker->renderer, &worker->progress);
    if (!is_urgent(message))
        begin_yielding(worker, id);
}

static void end_render(struct worker *worker)
{
    if (worker->is_paused)
        return;
    inbox_set_current(worker->inbox, 0);
    renderer_set_yield_point(worker->renderer, NULL);
    renderer_set_progress(worker->renderer, NULL);
}

static void submit(struct worker *worker, struct encode_task *task,
                   struct submitted_view *submitted)
{
    worker->in_flight = task;
    worker->in_flight_view = submitted;
    send_progress(worker, "submitted", task->id);
}

/* False when the context is lost and the worker must end. */
static bool serve_render(struct worker *worker, struct ipc_message *message)
{
    struct error problem = {0};
    uint64_t id = (uint64_t)json_integer_value(json_object_get(message->json, "id"));
    bool is_done = true;
    begin_render(worker, message, id);
    struct encode_task *task = calloc(1, sizeof *task);
    struct submitted_view *submitted = calloc(1, sizeof *submitted);
    if (!task || !submitted)
        error_set(&problem, ERROR_NO_MEMORY, "frame");
    else
        task->id = id;
    bool is_good = task && submitted &&
                   !(worker->current == id && inbox_is_cancelled(worker->inbox)) &&
                   draw(worker, message, task, submitted, &is_done, &problem);
    end_render(worker);
    if (is_good && !is_done)
        submit(worker, task, submitted);
    else
        submitted_view_destroy(submitted);
    if (is_good && is_done)
        pass_on(worker, task);
    if (is_good)
        return !worker->is_lost;
    encode_task_destroy(task);
    if (problem.code == ERROR_NO_DEVICE) /* the frame in flight may have lost the context */
        retire(worker);
    if (worker->is_lost)
        return false;
    if (problem.code == ERROR_NONE)
        error_set(&problem, ERROR_OVERLOADED, "the frame is not wanted any more");
    say_failed(worker, id, &problem);
    return !worker->is_lost;
}

static bool has_messages(void *context)
{
    struct worker *worker = context;
    return inbox_has_messages(worker->inbox);
}

/* The libraries of other formats last: the next image is a PNG most likely. */
static json_t *warm_up(struct worker *worker, const struct render_request *request,
                       const json_t *question, struct error *err)
{
    json_t *answer = warm_up_step(&(struct warm_up_step_desc){.renderer = worker->renderer,
                                                              .request = request,
                                                              .question = question,
                                                              .shall_stop = has_messages,
                                                              .context = worker},
                                  err);
    if (answer && !json_object_get(answer, "left")) {
        time_estimator_note_warm(worker->estimator, request->scene);
        encoder_warm_up(worker->encoder);
    }
    return answer;
}

/* A step of a trade-off makes way as a render does. */
static json_t *measure(struct worker *worker, const struct ipc_message *message,
                       const struct render_request *request, int *fd, struct error *err)
{
    if (!worker->is_paused)
        begin_yielding(worker, (uint64_t)json_integer_value(json_object_get(message->json, "id")));
    json_t *result =
        measure_step(&(struct measure_desc){.renderer = worker->renderer,
                                            .request = request,
                                            .step = json_object_get(message->json, "question"),
                                            .reference_fd = message_files_reference(message)},
                     fd, err);
    end_render(worker);
    return result;
}

/* The answer to a question, or NULL. */
static json_t *answer(struct worker *worker, const struct ipc_message *message,
                      struct render_request *request, int *fd, struct error *err)
{
    const json_t *question = json_object_get(message->json, "question");
    struct frame_promise unused;
    if (json_object_get(question, "explain"))
        return !choose(worker, message, request, &unused, err)
                   ? NULL
                   : explain_frame(&(struct explain_desc){.renderer = worker->renderer,
                                                          .device = worker->info.renderer,
                                                          .request = request,
                                                          .question = question},
                                   fd, err);
    if (warm_up_is_step(question))
        return warm_up(worker, request, question, err);
    if (pick_is_step(question))
        return pick_step(&(struct pick_step_desc){.renderer = worker->renderer,
                                                  .request = request,
                                                  .step = question},
                         fd, err);
    return measure(worker, message, request, fd, err);
}

/* False when the context is lost and the worker must end. */
static bool serve_question(struct worker *worker, struct ipc_message *message)
{
    struct error problem = {0};
    struct render_request request = {0};
    uint64_t id = (uint64_t)json_integer_value(json_object_get(message->json, "id"));
    int fd = -1;
    json_t *result = NULL;
    retire(worker);
    if (worker->is_lost)
        return false;
    send_progress(worker, "begin", id);
    if (json_object_get(json_object_get(message->json, "question"), "speed"))
        result = json_object(); /* it is known now */
    else if (read_request(worker, message, &request, &problem))
        result = answer(worker, message, &request, &fd, &problem);
    render_request_finish(&request);
    send_totals(worker);
    if (worker->is_lost) /* by one that went before the rest of it, which has reported it */
        json_decref(result);
    else if (result)
        send_message(
            worker,
            json_pack("{s:s,s:I,s:o}", "op", "answer", "id", (json_int_t)id, "result", result), &fd,
            fd >= 0 ? 1 : 0);
    else
        say_failed(worker, id, &problem);
    if (fd >= 0)
        close(fd);
    return !worker->is_lost;
}

static int encode_threads(void)
{
    int cores = processors_usable();
    return cores < 4 ? 1 : cores / 2 > ENCODE_THREADS_MAX ? ENCODE_THREADS_MAX : cores / 2;
}

/* Before each step with a device: the front knows of it when this process ends meanwhile. */
static void tell_trial(void *context, const struct gl_device *device, enum gl_device_step step)
{
    struct worker *worker = context;
    worker->tried = *device;
    send_message(worker, device_trials_message(device, step), NULL, 0);
}

static bool start(struct worker *worker, const json_t *settings, struct error *err)
{
    const struct gl_device_watch watch = {worker, tell_trial};
    const char *dump_dir = json_string_value(json_object_get(settings, "dump_shaders"));
    const char *programs = json_string_value(json_object_get(settings, "program_folder"));
    bool tests_all = json_integer_value(json_object_get(settings, "self_test"));
    char build[BUILD_ID_BYTES];
    build_id_get(build);
    device_reasons_from_json(json_object_get(settings, "passed_over"), &worker->devices);
    worker->renderer = renderer_create(
        &(struct renderer_desc){
            .device = json_string_value(json_object_get(settings, "device")),
            .devices = &worker->devices,
            .watch = &watch,
            .shader_dump_dir = dump_dir && *dump_dir ? dump_dir : NULL,
            .learns_nothing = !json_is_true(json_object_get(settings, "keeps")),
            .gpu_sharers = (int)json_integer_value(json_object_get(settings, "sharers")),
            .self_test = tests_all ? RENDERER_SELFTEST_ALWAYS : RENDERER_SELFTEST_KEPT,
            .proof_file = json_string_value(json_object_get(settings, "proof_file")),
            .build = build,
            .program_folder = programs && *programs ? programs : NULL,
            .program_budget_bytes =
                (uint64_t)json_integer_value(json_object_get(settings, "program_budget_bytes")),
            .gpu_budget_bytes =
                (uint64_t)json_integer_value(json_object_get(settings, "gpu_budget_bytes")),
            .texture_budget_bytes =
                (uint64_t)json_integer_value(json_object_get(settings, "texture_budget_bytes")),
            .texture_upload_bytes =
                (uint64_t)json_integer_value(json_object_get(settings, "texture_upload_bytes")),
            .texture_upload_ms =
                (double)json_integer_value(json_object_get(settings, "texture_upload_ms"))},
        err);
    if (!worker->renderer)
        return false;
    tell_trial(worker, &worker->tried, GL_DEVICE_MEASURING);
    worker_device_init(&worker->device, worker->renderer, settings);
    worker->files.scenes = mapped_scenes_create(
        worker->renderer, (uint64_t)json_integer_value(json_object_get(settings, "cache_bytes")),
        err);
    worker->files.environments = mapped_environments_create(worker->renderer, err);
    worker->encoder = encoder_create(&(struct encoder_desc){.thread_count = encode_threads(),
                                                            .context = worker,
                                                            .done = encoded},
                                     err);
    if (!worker->files.scenes || !worker->files.environments || !worker->encoder)
        return false;
    worker->forgotten = json_array();
    renderer_get_info(worker->renderer, &worker->info);
    worker->estimator = chooser_open_estimator(
        &worker->info, json_string_value(json_object_get(settings, "budgets_file")), err);
    if (!worker->estimator)
        return false;
    if (!worker->device.keeps)
        time_estimator_only_read(worker->estimator);
    if (!worker->forgotten)
        return error_set(err, ERROR_NO_MEMORY, "worker");
    worker->inbox = inbox_create(worker->socket, err);
    return worker->inbox;
}

static json_t *device_json(struct worker *worker)
{
    struct device_capabilities device;
    renderer_get_info(worker->renderer, &worker->info);
    device_capabilities_from_info(&worker->info, &device);
    worker_device_describe(&worker->device, &device);
    return device_capabilities_to_json(&device);
}

/* Measures the device's speed, which is pending. */
static void measure_device(struct worker *worker)
{
    retire(worker);
    tell_trial(worker, &worker->tried, GL_DEVICE_MEASURING);
    worker_device_measure(&worker->device);
    send_message(worker, json_pack("{s:s,s:o}", "op", "measured", "device", device_json(worker)),
                 NULL, 0);
}

static bool asks_for_auto(const struct ipc_message *message)
{
    struct ipc_mapping text = {0};
    struct render_request request = {0};
    struct error ignored = {0}; /* whoever reads it next tells */
    bool is_auto =
        ipc_mapping_init(&text, message->fd_count > 0 ? message->fds[0] : -1, &ignored) &&
        render_request_parse(text.bytes, text.size_bytes, &request, &ignored) &&
        request.quality.shadows == SHADOWS_AUTO;
    render_request_finish(&request);
    ipc_mapping_finish(&text);
    return is_auto;
}

/* Before a picture that goes by the device's speed, and before all questions; but not within a
 * frame: what goes before the rest of it is rasterised until then. */
static void measure_for(struct worker *worker, const struct ipc_message *message)
{
    const char *op = json_string_value(json_object_get(message->json, "op"));
    if (!worker->device.is_pending || worker->is_paused || !op)
        return;
    if (strcmp(op, "ask") == 0 || (strcmp(op, "render") == 0 && asks_for_auto(message)))
        measure_device(worker);
}

static void say_hello(struct worker *worker)
{
    /* One on the GL thread, one on the device, one on each encode thread, one waiting so that the
     * GL thread never does. */
    int depth = encode_threads() + 2 + !worker->info.is_software;
    send_message(
        worker,
        json_pack("{s:s,s:o,s:i}", "op", "hello", "device", device_json(worker), "depth", depth),
        NULL, 0);
    send_totals(worker);
}

/* Frees memory when nobody has asked for a while. */
static void rest(struct worker *worker)
{
    retire(worker);
    renderer_trim(worker->renderer);
    time_estimator_forget_memory(worker->estimator);
    malloc_trim(0);
    send_totals(worker);
}

/* Choices go by it from now on. */
static void follow(struct worker *worker)
{
    retire(worker);
    worker_device_follow(&worker->device);
    send_totals(worker);
}

/* Frames of other workers count as its own. */
static void learn(struct worker *worker, const json_t *lessons, const json_t *times)
{
    time_estimator_learn(worker->estimator, times);
    if (!lessons)
        return;
    retire(worker);
    worker_device_learn(&worker->device, lessons);
    send_totals(worker);
}

/* True while the worker shall go on. */
static bool serve(struct worker *worker, struct ipc_message *message)
{
    const char *op = json_string_value(json_object_get(message->json, "op"));
    json_array_extend(worker->forgotten, json_object_get(message->json, "forget"));
    measure_for(worker, message);
    if (op && strcmp(op, "ask") == 0)
        return serve_question(worker, message);
    if (op && strcmp(op, "rest") == 0)
        rest(worker);
    if (op && strcmp(op, "learned") == 0)
        follow(worker);
    if (op && strcmp(op, "lessons") == 0)
        learn(worker, json_object_get(message->json, "lessons"),
              json_object_get(message->json, "times"));
    return !op || strcmp(op, "render") != 0 || serve_render(worker, message);
}

/* Drops deleted scenes and maps, but not while a frame is paused, which may show one of them. */
static void forget(struct worker *worker)
{
    if (json_array_size(worker->forgotten)) /* the frame in flight may have to be drawn again */
        retire(worker);
    message_files_forget(&worker->files, worker->forgotten);
    mapped_environments_sweep(worker->files.environments);
    json_array_clear(worker->forgotten);
}

/* ---- urgent frames ---- */

static bool should_yield(void *context)
{
    const struct worker *worker = context;
    if (inbox_is_cancelled(worker->inbox)) /* which reports it there, too */
        return true;
    return inbox_urgent_count(worker->inbox) > 0 &&
           inbox_urgent_arrivals(worker->inbox) != worker->urgent_arrivals &&
           now_us() >= worker->slice_until_us;
}

static bool is_unwanted(void *context)
{
    const struct worker *worker = context;
    return inbox_is_cancelled(worker->inbox);
}

/* Serves urgent messages for a while; false when the worker must end. */
static bool serve_urgent(struct worker *worker, int64_t until_us)
{
    bool is_good = true;
    while (is_good && now_us() < until_us) {
        struct ipc_message message = {0};
        unsigned arrivals = inbox_urgent_arrivals(worker->inbox);
        /* A scene that is not on the device waits for its turn: its upload could evict the scene of
           the paused frame. */
        if (!inbox_take_urgent(worker->inbox, is_at_hand, worker, &message)) {
            worker->urgent_arrivals = arrivals;
            break;
        }
        if (!worker->is_paused)
            send_progress(worker, "paused", worker->current);
        worker->is_paused = true;
        is_good = serve(worker, &message);
        ipc_message_finish(&message);
    }
    return is_good;
}

/* True while the frame is wanted. */
static bool run_urgent(void *context, struct error *err)
{
    (void)err; /* why a frame is not wanted needs no words */
    struct worker *worker = context;
    int64_t begin_us = now_us();
    if (inbox_is_cancelled(worker->inbox))
        return false;
    worker->is_lost |= !serve_urgent(worker, begin_us + URGENT_US);
    if (worker->is_paused && !worker->is_lost)
        send_progress(worker, "resumed", worker->current);
    worker->is_paused = false;
    int64_t end_us = now_us(), half_us = (end_us - begin_us) / 2;
    worker->slice_until_us = end_us + (half_us > SLICE_US ? half_us : SLICE_US);
    return !worker->is_lost && !inbox_is_cancelled(worker->inbox);
}

/* ---- life ---- */

/* Uses idle time to measure the second-best technique of `auto`. */
static void time_runner_up(struct worker *worker)
{
    if (idle_timing_run(&worker->timing,
                        &(struct idle_timing_desc){
                            .renderer = worker->renderer,
                            .has_scenes = is_at_hand(worker, idle_timing_message(&worker->timing)),
                            .shall_stop = has_messages,
                            .context = worker}))
        send_totals(worker);
}

/* The next message; waits for it, or for what is on the device as long as there is none. */
static bool next_message(struct worker *worker, struct ipc_message *message)
{
    while (worker->in_flight && !inbox_has_messages(worker->inbox))
        if (renderer_wait(worker->renderer, LOOK_MS))
            retire(worker);
    if (worker->device.is_pending && !worker->is_lost &&
        !inbox_wait(worker->inbox, MEASURE_IDLE_MS))
        measure_device(worker);
    if (worker->device.keeps && worker->is_in_motion && !worker->is_lost &&
        !inbox_wait(worker->inbox, STILL_MS)) {
        worker->is_in_motion = false;
        send_totals(worker); /* keeps what the motion taught */
    }
    if (worker->device.keeps && idle_timing_message(&worker->timing) && !worker->is_lost &&
        !inbox_wait(worker->inbox, IDLE_TIMING_AFTER_MS))
        time_runner_up(worker);
    return !worker->is_lost && inbox_take(worker->inbox, message);
}

static void run(struct worker *worker)
{
    struct ipc_message message = {0};
    bool goes_on = true;
    while (goes_on && next_message(worker, &message)) {
        goes_on = serve(worker, &message);
        idle_timing_note(&worker->timing, &message);
        ipc_message_finish(&message);
        forget(worker);
    }
    retire(worker);
    worker_device_keep_observations(&worker->device, false);
    worker->is_lost |= !goes_on;
}

int worker_main(int socket)
{
    struct error problem = {0};
    struct worker worker = {.socket = socket};
    struct ipc_message message = {0};
    bool is_good = false;
    worker.yield = (struct yield_point){.context = &worker,
                                        .should_yield = should_yield,
                                        .run_urgent = run_urgent,
                                        .is_unwanted = is_unwanted};
    worker.progress = (struct frame_progress){.context = &worker, .tell = tell_progress};
    worker.completion = (struct frame_completion){.context = &worker, .collect = retire};
    pthread_mutex_init(&worker.send_mutex, NULL);
    if (ipc_receive(socket, &message, &problem) == IPC_MESSAGE)
        is_good = start(&worker, message.json, &problem);
    ipc_message_finish(&message);
    if (is_good) {
        say_hello(&worker);
        renderer_set_completion(worker.renderer, &worker.completion);
        run(&worker);
    } else {
        send_message(&worker,
                     json_pack("{s:s,s:o,s:o}", "op", "failed", "error",
                               ipc_error_to_json(&problem), "devices",
                               device_lines_to_json(&worker.devices)),
                     NULL, 0);
    }
    encoder_destroy(worker.encoder); /* what it still has is sent */
    inbox_destroy(worker.inbox);
    idle_timing_finish(&worker.timing);
    mapped_environments_destroy(worker.files.environments);
    mapped_scenes_destroy(worker.files.scenes);
    worker_device_finish(&worker.device);
    time_estimator_destroy(worker.estimator);
    renderer_destroy(worker.renderer);
    json_decref(worker.forgotten);
    pthread_mutex_destroy(&worker.send_mutex);
    return is_good && !worker.is_lost ? EXIT_SUCCESS : EXIT_FAILURE;
}
