/* SPDX-License-Identifier: MIT */
/* What the service says about itself: health, metrics, totals, capabilities and its API. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "protocol/capabilities.h"
#include "renderer/import/extensions.h"
#include "server/base/embedded.h"
#include "server/routes/router.h"

static double uptime_s(const struct service *service)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)(now.tv_sec - service->started.tv_sec) +
           1e-9 * (double)(now.tv_nsec - service->started.tv_nsec);
}

/* Answers that the front runs. A hung worker is the supervisor's affair, and no reason to restart
 * the front. */
static void run_alive(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service, (void)id;
    reply_json(exchange, 200, json_pack("{s:s}", "status", "ok"));
}

static void run_ready(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct error problem = {0};
    struct device_capabilities device;
    struct worker_status workers[CONFIG_WORKERS_MAX];
    int count = supervisor_get_workers(service->supervisor, workers);
    int ready = 0;
    for (int i = 0; i < count; i++)
        ready += workers[i].is_ready;
    json_t *served = json_pack("{s:i,s:i}", "ready", ready, "configured", count);
    if (!supervisor_is_ready(service->supervisor, &problem))
        http_reply_error(exchange, &problem);
    else if (supervisor_get_device(service->supervisor, &device))
        reply_json(exchange, 200,
                   json_pack("{s:s,s:O*,s:s*,s:o*}", "status", "ready", "workers", served,
                             "warning", *device.warning ? device.warning : NULL, "passed_over",
                             device.passed_over ? device_passed_over_to_json(&device) : NULL));
    else
        reply_json(exchange, 200, json_pack("{s:s,s:O*}", "status", "ready", "workers", served));
    json_decref(served);
}

static void run_openapi(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service, (void)id;
    http_reply_header(exchange, "Cache-Control", "private, max-age=300");
    http_reply_bytes(exchange, 200, "application/json", embedded_openapi_json,
                     embedded_openapi_json_bytes);
}

static void run_capabilities(struct service *service, struct http_exchange *exchange,
                             const char *id)
{
    (void)id;
    struct device_capabilities device;
    bool has_device = supervisor_get_device(service->supervisor, &device);
    reply_json(exchange, 200,
               capabilities_to_json(
                   &(struct capabilities){.version = VITRAIL_VERSION,
                                          .device = has_device ? &device : NULL,
                                          .max_upload_bytes = service->config->max_upload_bytes,
                                          .extensions = scene_import_extensions()}));
}

/* ---- totals ---- */

static json_t *integer(uint64_t value)
{
    return json_integer((json_int_t)value);
}

static json_t *renders_json(const struct supervisor_totals *totals)
{
    return json_pack("{s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:f}", "rendered", integer(totals->rendered),
                     "overlapped", integer(totals->overlapped), "ahead", integer(totals->ahead),
                     "failed", integer(totals->failed), "cancelled", integer(totals->cancelled),
                     "retried", integer(totals->retried), "waiting", integer(totals->waiting),
                     "in_flight", integer(totals->in_flight), "oldest_wait_s",
                     totals->oldest_wait_s);
}

static json_t *worker_json(const struct service *service, const struct supervisor_totals *totals)
{
    return json_pack(
        "{s:b,s:o,s:o,s:o,s:o,s:o,s:o}", "ready", supervisor_is_ready(service->supervisor, NULL),
        "pid", totals->workers.pid ? json_integer(totals->workers.pid) : json_null(), "starts",
        integer(totals->workers.starts), "crashes", integer(totals->workers.crashes), "timeouts",
        integer(totals->workers.timeouts), "quarantined_scenes", integer(totals->quarantined),
        "gpu_used_bytes", integer(totals->workers.gpu_used_bytes));
}

static json_t *one_worker_json(const struct worker_status *worker)
{
    const struct worker_totals *totals = &worker->totals;
    const char *problem = worker->problem.code != ERROR_NONE ? worker->problem.message : NULL;
    return json_pack("{s:i,s:s,s:b,s:o,s:i,s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:s*}", "worker",
                     worker->number, "device", worker->device, "ready", worker->is_ready, "pid",
                     totals->pid ? json_integer(totals->pid) : json_null(), "in_flight",
                     worker->in_flight, "rendered", integer(totals->rendered), "starts",
                     integer(totals->starts), "crashes", integer(totals->crashes), "timeouts",
                     integer(totals->timeouts), "scenes", integer(totals->cache_scenes),
                     "cache_misses", integer(totals->cache_misses), "gpu_used_bytes",
                     integer(totals->gpu_used_bytes), "problem", problem);
}

static json_t *workers_json(const struct service *service)
{
    struct worker_status workers[CONFIG_WORKERS_MAX];
    int count = supervisor_get_workers(service->supervisor, workers);
    json_t *array = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(array, one_worker_json(&workers[i]));
    return array;
}

static json_t *cache_json(const struct supervisor_totals *totals)
{
    return json_pack("{s:o,s:o,s:o,s:o,s:o}", "bytes", integer(totals->workers.cache_bytes),
                     "scenes", integer(totals->workers.cache_scenes), "hits",
                     integer(totals->workers.cache_hits), "misses",
                     integer(totals->workers.cache_misses), "evictions",
                     integer(totals->workers.cache_evictions));
}

/* Counts where the present worker found its shader programs. */
static json_t *programs_json(const struct supervisor_totals *totals)
{
    return json_pack("{s:o,s:o,s:o,s:o,s:o}", "memory", integer(totals->workers.programs_reused),
                     "disk", integer(totals->workers.programs_loaded), "compiled",
                     integer(totals->workers.programs_built), "kept",
                     integer(totals->workers.programs_kept), "kept_bytes",
                     integer(totals->workers.programs_kept_bytes));
}

/* Counts the work of warm-ups. */
static json_t *warm_ups_json(const struct warm_up_totals *totals)
{
    return json_pack("{s:o,s:o,s:o,s:o,s:o,s:o,s:o}", "done", integer(totals->done), "dropped",
                     integer(totals->dropped), "interrupted", integer(totals->interrupted),
                     "pictures", integer(totals->pictures), "shadow_maps_built",
                     integer(totals->shadow_maps_built), "ray_structures_built",
                     integer(totals->ray_structures_built), "programs_built",
                     integer(totals->programs_built));
}

static json_t *decodes_json(const struct decode_totals *totals)
{
    return json_pack("{s:o,s:o,s:o,s:o}", "decoded", integer(totals->decoded), "refused",
                     integer(totals->refused), "crashes", integer(totals->crashes), "timeouts",
                     integer(totals->timeouts));
}

static json_t *views_json(const struct service *service)
{
    struct views_totals views = views_get_totals(service->views);
    struct view_images_totals images = view_images_get_totals(service->view_images);
    json_t *json = json_pack(
        "{s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:o}", "open", integer(views.views), "watchers",
        integer(views.watchers), "made", integer(views.made), "refused", integer(views.refused),
        "expired", integer(views.expired), "patches", integer(views.patches), "document_bytes",
        integer(views.document_bytes), "not_modified", integer(views.not_modified));
    json_t *frames = json_pack(
        "{s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:o}", "rendered", integer(images.rendered), "shared",
        integer(images.shared), "cached", integer(images.kept), "cached_bytes",
        integer(images.held_bytes), "moving_frames", integer(views.moving_frames), "exact_frames",
        integer(views.exact_frames), "refined_frames", integer(views.refined_frames),
        "failed_frames", integer(views.failed_frames), "sent_frames", integer(views.sent_frames));
    if (json_object_update(json, frames) != 0) {
        json_decref(json);
        json = NULL;
    }
    json_decref(frames);
    return json;
}

static json_t *jobs_json(const struct service *service)
{
    const struct jobs_totals jobs = jobs_get_totals(service->jobs);
    uint64_t forgotten = 0;
    for (int i = 0; i < FORGET_REASON_COUNT; i++)
        forgotten += jobs.forgotten[i];
    return json_pack(
        "{s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:o,s:o}", "waiting", integer(jobs.waiting),
        "queued", integer(jobs.by_state[FARM_JOB_QUEUED]), "running",
        integer(jobs.by_state[FARM_JOB_RUNNING]), "done", integer(jobs.by_state[FARM_JOB_DONE]),
        "failed", integer(jobs.by_state[FARM_JOB_FAILED]), "cancelled",
        integer(jobs.by_state[FARM_JOB_CANCELLED]), "frames_waiting", integer(jobs.frames_waiting),
        "frames_done", integer(jobs.frames_done), "frames_failed", integer(jobs.frames_failed),
        "frames_retried", integer(jobs.frames_retried), "result_bytes", integer(jobs.result_bytes),
        "kept_bytes", integer(jobs.kept_bytes), "forgotten", integer(forgotten));
}

static void run_stats(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct supervisor_totals renders = supervisor_get_totals(service->supervisor);
    struct decode_totals decodes = decode_pool_get_totals(service->decoders);
    struct resource_store_totals scenes = resource_store_get_totals(service->resources.scenes);
    struct resource_store_totals maps = resource_store_get_totals(service->resources.environments);
    struct http_server_totals http = http_server_get_totals(service->http);
    struct metrics_totals metrics = metrics_get_totals(service->metrics);
    reply_json(
        exchange, 200,
        json_pack("{s:s,s:s,s:f,s:{s:o,s:o,s:o,s:o},s:{s:o,s:o},s:{s:o,s:o},s:o,s:o,s:o,s:o,s:o,"
                  "s:o,s:o,s:o,s:o,s:o}",
                  "version", VITRAIL_VERSION, "build", service->build_id, "uptime_s",
                  uptime_s(service), "http", "requests", integer(metrics.requests), "in_flight",
                  integer(http.requests_in_flight), "connections", integer(http.connections),
                  "upload_bytes", integer(metrics.upload_bytes), "scenes", "stored",
                  integer(scenes.count), "decoded_bytes", integer(scenes.decoded_bytes),
                  "environments", "stored", integer(maps.count), "decoded_bytes",
                  integer(maps.decoded_bytes), "renders", renders_json(&renders), "worker",
                  worker_json(service, &renders), "workers", workers_json(service), "cache",
                  cache_json(&renders), "programs", programs_json(&renders), "warm_ups",
                  warm_ups_json(&renders.warm_ups), "decodes", decodes_json(&decodes), "views",
                  views_json(service), "jobs", jobs_json(service), "frames_kept",
                  integer(frames_count(service->frames))));
}

/* ---- metrics ---- */

static double resident_bytes(void)
{
    unsigned long long total, resident = 0;
    FILE *file = fopen("/proc/self/statm", "re");
    if (!file)
        return 0;
    if (fscanf(file, "%llu %llu", &total, &resident) != 2)
        resident = 0;
    fclose(file);
    return (double)resident * (double)sysconf(_SC_PAGESIZE);
}

/* text: NULL where there was no memory for it. */
static void reply_metrics(struct http_exchange *exchange, const char *text)
{
    if (text)
        http_reply_bytes(exchange, 200, "text/plain; version=0.0.4; charset=utf-8", text,
                         strlen(text));
    else
        http_reply_error(exchange, &(struct error){ERROR_NO_MEMORY, "metrics", ""});
}

enum { MORE_GAUGES = 20 };

/* Of what is stored, of jobs and of the process. */
static void put_more_gauges(const struct service *service, struct metrics_gauge gauges[MORE_GAUGES])
{
    const struct resource_store_totals scenes =
        resource_store_get_totals(service->resources.scenes);
    const struct resource_store_totals maps =
        resource_store_get_totals(service->resources.environments);
    const struct jobs_totals j = jobs_get_totals(service->jobs);
    const char *const jobs = "vitrail_jobs", *const job_frames = "vitrail_job_frames_total",
                      *const forgotten = "vitrail_jobs_forgotten_total";
    const struct metrics_gauge made[MORE_GAUGES] = {
        {"vitrail_scenes", "Scenes stored.", false, NULL, (double)scenes.count},
        {"vitrail_scenes_bytes", "Their decoded size.", false, NULL, (double)scenes.decoded_bytes},
        {"vitrail_environments", "Environment maps stored.", false, NULL, (double)maps.count},
        {"vitrail_environments_bytes", "Their decoded size.", false, NULL,
         (double)maps.decoded_bytes},
        {jobs, "Jobs kept, by state.", false, "state=\"queued\"",
         (double)j.by_state[FARM_JOB_QUEUED]},
        {jobs, "", false, "state=\"waiting\"", (double)j.waiting},
        {jobs, "", false, "state=\"running\"", (double)j.by_state[FARM_JOB_RUNNING]},
        {jobs, "", false, "state=\"done\"", (double)j.by_state[FARM_JOB_DONE]},
        {jobs, "", false, "state=\"failed\"", (double)j.by_state[FARM_JOB_FAILED]},
        {jobs, "", false, "state=\"cancelled\"", (double)j.by_state[FARM_JOB_CANCELLED]},
        {job_frames, "Frames of jobs that ended an attempt, by result.", true, "result=\"done\"",
         (double)j.frames_done},
        {job_frames, "", true, "result=\"failed\"", (double)j.frames_failed},
        {job_frames, "", true, "result=\"retried\"", (double)j.frames_retried},
        {"vitrail_job_frames_waiting", "Frames of jobs that have not ended.", false, NULL,
         (double)j.frames_waiting},
        {"vitrail_job_result_bytes", "Files of jobs.", false, NULL, (double)j.result_bytes},
        {"vitrail_job_results_kept_bytes", "Files of jobs in the state directory.", false, NULL,
         (double)j.kept_bytes},
        {forgotten, "Jobs that were forgotten, by reason.", true, "reason=\"asked\"",
         (double)j.forgotten[FORGET_ASKED]},
        {forgotten, "", true, "reason=\"age\"", (double)j.forgotten[FORGET_AGE]},
        {forgotten, "", true, "reason=\"bytes\"", (double)j.forgotten[FORGET_BYTES]},
        {"process_resident_memory_bytes", "Resident memory of the front.", false, NULL,
         resident_bytes()},
    };
    memcpy(gauges, made, sizeof made);
}

enum { WORKER_GAUGES = 5 };

/* Gauges of each worker, with the labels that they borrow. */
struct worker_gauges {
    struct metrics_gauge gauges[CONFIG_WORKERS_MAX * WORKER_GAUGES];
    char labels[CONFIG_WORKERS_MAX][24];
    size_t count;
};

static void put_worker_gauges(const struct service *service, struct worker_gauges *made)
{
    struct worker_status workers[CONFIG_WORKERS_MAX];
    int count = supervisor_get_workers(service->supervisor, workers);
    made->count = 0;
    for (int i = 0; i < count; i++)
        snprintf(made->labels[i], sizeof made->labels[i], "worker=\"%d\"", workers[i].number);
    for (int name = 0; name < WORKER_GAUGES; name++)
        for (int i = 0; i < count; i++) {
            const struct worker_status *one = &workers[i];
            const char *label = made->labels[i];
            const struct metrics_gauge by_name[WORKER_GAUGES] = {
                {"vitrail_worker_ready", "1: it takes renders.", false, label, one->is_ready},
                {"vitrail_worker_in_flight", "Renders and questions that it has.", false, label,
                 one->in_flight},
                {"vitrail_worker_renders_total", "Renders that it has made.", true, label,
                 (double)one->totals.rendered},
                {"vitrail_worker_ends_total", "Times that it was replaced.", true, label,
                 (double)(one->totals.crashes + one->totals.timeouts)},
                {"vitrail_worker_scenes", "Scenes that it has mapped.", false, label,
                 (double)one->totals.cache_scenes},
            };
            made->gauges[made->count++] = by_name[name];
        }
}

static void run_metrics(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    struct supervisor_totals r = supervisor_get_totals(service->supervisor);
    struct decode_totals d = decode_pool_get_totals(service->decoders);
    struct http_server_totals h = http_server_get_totals(service->http);
    struct views_totals v = views_get_totals(service->views);
    struct view_images_totals i = view_images_get_totals(service->view_images);
    const char *const images = "vitrail_view_images_total", *const frames =
                                                                "vitrail_view_frames_total";
    char build[160];
    snprintf(build, sizeof build, "version=\"%s\",build=\"%s\"", VITRAIL_VERSION,
             service->build_id);
    const char *const timings = "vitrail_idle_timings_total";
    const char *const renders = "vitrail_renders_total", *const resets =
                                                             "vitrail_worker_restarts_total";
    const struct metrics_gauge gauges[] = {
        {"vitrail_build_info", "Always 1; the labels say which build this is.", false, build, 1},
        {"vitrail_uptime_seconds", "Since the daemon started.", false, NULL, uptime_s(service)},
        {"vitrail_http_connections", "Open connections.", false, NULL, (double)h.connections},
        {"vitrail_http_requests_in_flight", "Requests not yet answered.", false, NULL,
         (double)h.requests_in_flight},
        {renders, "Renders ended, by result.", true, "result=\"done\"", (double)r.rendered},
        {renders, "", true, "result=\"failed\"", (double)r.failed},
        {renders, "", true, "result=\"cancelled\"", (double)r.cancelled},
        {"vitrail_render_retries_total", "Renders begun again on a new worker.", true, NULL,
         (double)r.retried},
        {"vitrail_render_queue_depth", "Renders that wait for a worker.", false, NULL,
         (double)r.waiting},
        {"vitrail_render_queue_age_seconds", "Age of the oldest one that waits.", false, NULL,
         r.oldest_wait_s},
        {resets, "Workers replaced, by cause.", true, "cause=\"crash\"", (double)r.workers.crashes},
        {resets, "", true, "cause=\"timeout\"", (double)r.workers.timeouts},
        {"vitrail_worker_starts_total", "Workers started.", true, NULL, (double)r.workers.starts},
        {"vitrail_quarantined_scenes", "Scenes that ended workers and are refused.", false, NULL,
         (double)r.quarantined},
        {"vitrail_gpu_memory_bytes", "GPU memory that scenes and requests take.", false, NULL,
         (double)r.workers.gpu_used_bytes},
        {"vitrail_scene_cache_bytes", "Scenes mapped by workers.", false, NULL,
         (double)r.workers.cache_bytes},
        {"vitrail_scene_cache_entries", "Their number.", false, NULL,
         (double)r.workers.cache_scenes},
        {"vitrail_scene_cache_hits_total", "Renders whose scene was mapped.", true, NULL,
         (double)r.workers.cache_hits},
        {"vitrail_scene_cache_misses_total", "Renders whose scene was not.", true, NULL,
         (double)r.workers.cache_misses},
        {"vitrail_scene_cache_evictions_total", "Scenes let go for others.", true, NULL,
         (double)r.workers.cache_evictions},
        {"vitrail_shader_programs_built_total", "Compiled by the workers that run.", true, NULL,
         (double)r.workers.programs_built},
        {"vitrail_shader_programs_reused_total", "Uses of those it had.", true, NULL,
         (double)r.workers.programs_reused},
        {"vitrail_shader_programs_loaded_total", "Taken from the state directory.", true, NULL,
         (double)r.workers.programs_loaded},
        {"vitrail_shader_programs_kept", "Compiled programs in the state directory.", false, NULL,
         (double)r.workers.programs_kept},
        {"vitrail_shader_programs_kept_bytes", "Their size.", false, NULL,
         (double)r.workers.programs_kept_bytes},
        {"vitrail_warm_ups_total", "Scenes made ready before anyone asked.", true, NULL,
         (double)r.warm_ups.done},
        {timings, "Runners-up of auto drawn while nobody asked, by the workers that run.", true,
         "end=\"finished\"", (double)r.workers.timed},
        {timings, "", true, "end=\"stopped\"", (double)r.workers.timings_stopped},
        {"vitrail_decodes_total", "Uploads decoded, by result.", true, "result=\"done\"",
         (double)d.decoded},
        {"vitrail_decodes_total", "", true, "result=\"refused\"", (double)d.refused},
        {"vitrail_decode_worker_crashes_total", "Decoders that died.", true, NULL,
         (double)d.crashes},
        {"vitrail_decode_worker_timeouts_total", "Decoders that took too long.", true, NULL,
         (double)d.timeouts},
        {"vitrail_views", "Views that exist.", false, NULL, (double)v.views},
        {"vitrail_view_watchers", "Streams, events and sockets open.", false, NULL,
         (double)v.watchers},
        {"vitrail_view_patches_total", "Patches accepted.", true, NULL, (double)v.patches},
        {images, "Images of views, by what they cost.", true, "how=\"rendered\"",
         (double)i.rendered},
        {images, "", true, "how=\"shared\"", (double)i.shared},
        {images, "", true, "how=\"cached\"", (double)i.kept},
        {images, "", true, "how=\"not_modified\"", (double)v.not_modified},
        {frames, "Frames made for watchers, by kind.", true, "kind=\"moving\"",
         (double)v.moving_frames},
        {frames, "", true, "kind=\"exact\"", (double)v.exact_frames},
        {frames, "", true, "kind=\"refined\"", (double)v.refined_frames},
        {"vitrail_view_frames_sent_total", "Frames handed to watchers.", true, NULL,
         (double)v.sent_frames},
    };
    enum { OTHERS = sizeof gauges / sizeof gauges[0] };
    struct worker_gauges by_worker;
    put_worker_gauges(service, &by_worker);
    struct metrics_gauge
        all[OTHERS + MORE_GAUGES + sizeof by_worker.gauges / sizeof *by_worker.gauges];
    memcpy(all, gauges, sizeof gauges);
    put_more_gauges(service, all + OTHERS);
    memcpy(all + OTHERS + MORE_GAUGES, by_worker.gauges,
           by_worker.count * sizeof *by_worker.gauges);
    char *text = metrics_to_text(service->metrics, all, OTHERS + MORE_GAUGES + by_worker.count);
    reply_metrics(exchange, text);
    free(text);
}

const struct route routes_service[] = {
    {"/healthz", {{HTTP_GET, NULL, run_alive}}},
    {"/livez", {{HTTP_GET, NULL, run_alive}}},
    {"/readyz", {{HTTP_GET, NULL, run_ready}}},
    {"/metrics", {{HTTP_GET, NULL, run_metrics}}},
    {"/openapi.json", {{HTTP_GET, NULL, run_openapi}}},
    {"/v1/stats", {{HTTP_GET, NULL, run_stats}}},
    {"/v1/capabilities", {{HTTP_GET, NULL, run_capabilities}}},
    {0},
};
