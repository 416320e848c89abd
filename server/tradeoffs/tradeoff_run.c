/* SPDX-License-Identifier: MIT */
/* How a trade-off is measured: a probe, the reference band by band, one frame of each setting
 * against it, and rounds of timed frames over all settings (specs: interleaved, so that a machine
 * that slows down slows all of them). Settings without room get the time that is left then. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "server/tradeoffs/tradeoff_sweep.h"
#include "protocol/quality_defaults.h"
#include "server/tradeoffs/tradeoff_step.h"

#define NEEDED_LIMIT_MS 300000 /* of steps that all others need: the first compiles the shaders */
#define BAND_MS 250.           /* of the reference: what others may have to wait for */
#define BAND_BUILDS 2.         /* or this many times what ray tracing needs to get ready */
#define REFERENCE_SHARE .5     /* of the time budget */
#define SAVE_EVERY_S 1.        /* of results so far: two files are synced */
#define FRAME_MS_MAX 10000.    /* of a setting that is worth timing */
#define RUN_FRAMES 2.3         /* a cold and a warm frame, in frames as measured for the error */
#define SETTLE_FRAMES 1.       /* before the first of them */
#define RUN_SCALE_LEAST .05    /* runs are not expected to be quicker than that */
#define PROGRESS_REFERENCE .3
#define PROGRESS_ERRORS (3 / 7.)     /* of what is left after the reference */
#define IMAGES_BYTES_MAX (64u << 20) /* of one trade-off: an HTML page can still hold them */

struct run {
    struct tradeoffs *tradeoffs;
    struct tradeoff_entry *entry;
    struct render_request request; /* shallow copy, whose quality is set for each step */
    struct tradeoff_options options;
    double saved_s; /* of the monotonic clock */
    int reference_fd;
    int height;
    int max_samples;
    bool has_grids;                     /* of the scene */
    bool has_layers;                    /* transparent surfaces are in the picture */
    unsigned layer_needs;               /* enum transparency_can, of them */
    double traced_ms;                   /* the whole reference */
    double frame_ms[TRADEOFF_ROWS_MAX]; /* of each row */
    int timed_rows;                     /* that have had their runs */
    double run_scale; /* what runs took, over what frames measured for the error forecast */
    struct quality_setting settings[TRADEOFF_ROWS_MAX];
    bool is_open[TRADEOFF_ROWS_MAX];    /* of a setting: neither measured nor skipped */
    double known_ms[TRADEOFF_ROWS_MAX]; /* of a setting: what its frame took; 0: not known */
    int planned;                        /* settings */
    uint64_t images_bytes;
    struct error problem; /* why it fails */
};

static double elapsed_s(const struct run *run)
{
    return tradeoffs_clock_s() - run->entry->started_s;
}

static void set_setting(struct run *run, const struct quality_setting *setting)
{
    struct request_quality *quality = &run->request.quality;
    quality->shadows = setting->shadows;
    quality->shadow_resolution = quality_or(setting->shadow_resolution, SHADOW_RESOLUTION_DEFAULT);
    quality->shadow_taps = shadow_technique_taps(setting->shadows, setting->shadow_taps);
    quality->samples = setting->samples;
    quality->shadow_compression = setting->shadow_compression;
    quality->shadow_prefilter = setting->shadow_prefilter ? setting->shadow_prefilter : 1;
    quality->shadow_fallback = 0;
    quality->transparency = run->entry->request.render.quality.transparency;
    if (setting->transparency != TRANSPARENCY_AUTO)
        quality->transparency = setting->transparency;
    quality->reference = false;
    quality->atmosphere_samples = setting->atmosphere_samples;
    quality->area_samples = run->entry->request.render.quality.area_samples;
}

static void set_reference(struct run *run)
{
    set_setting(run, &(struct quality_setting){.shadows = SHADOWS_RAYTRACED,
                                               .samples = run->options.reference_samples});
    run->request.quality.reference = true;
    run->request.quality.area_samples = 0;
}

static void save(struct run *run)
{
    struct error problem = {0};
    run->saved_s = tradeoffs_clock_s();
    struct tradeoff *copy = tradeoffs_get(run->tradeoffs, run->entry->document.id, &problem);
    if (copy && !tradeoff_store_save(run->tradeoffs->store, copy, &problem))
        log_write(run->tradeoffs->desc.log, LOG_WARNING, "trade-off %s: %s", copy->id,
                  problem.message);
    if (copy)
        tradeoff_finish(copy);
    free(copy);
}

/* Saves regularly, so that a killed daemon loses little. */
static void save_now_and_then(struct run *run)
{
    if (tradeoffs_clock_s() - run->saved_s >= SAVE_EVERY_S)
        save(run);
}

/* The progress never goes back. */
static void tell(struct run *run, enum tradeoff_stage stage, double progress)
{
    struct tradeoff *document = &run->entry->document;
    pthread_mutex_lock(&run->tradeoffs->mutex);
    if (!tradeoff_has_ended(document)) {
        document->stage = stage;
        document->progress = fmax(document->progress, fmin(progress, 1));
        document->elapsed_s = elapsed_s(run);
    }
    pthread_mutex_unlock(&run->tradeoffs->mutex);
    save_now_and_then(run);
}

/* limit_ms: 0: that of steps. */
static enum step_outcome run_within(struct run *run, json_t *measure, int limit_ms,
                                    struct step_result *result)
{
    return step_run(run->tradeoffs, run->entry,
                    &(struct step_desc){.request = &run->request,
                                        .measure = measure,
                                        .reference_fd = run->reference_fd,
                                        .limit_ms = limit_ms},
                    result);
}

static enum step_outcome run_step(struct run *run, json_t *measure, struct step_result *result)
{
    return run_within(run, measure, 0, result);
}

/* A step without which nothing can be measured. */
static bool must_step(struct run *run, json_t *measure, struct step_result *result)
{
    enum step_outcome outcome = run_within(run, measure, NEEDED_LIMIT_MS, result);
    if (outcome == STEP_FAILED)
        run->problem = result->problem;
    return outcome == STEP_DONE;
}

static double number(const struct step_result *result, const char *key)
{
    return json_number_value(json_object_get(result->measured, key));
}

static uint64_t count(const struct step_result *result, const char *key)
{
    return (uint64_t)json_integer_value(json_object_get(result->measured, key));
}

/* ---- probe ---- */

static bool probe_by(struct run *run, enum shadow_technique shadows, struct step_result *result)
{
    set_setting(run,
                &(struct quality_setting){
                    .shadows = shadows, .shadow_resolution = 256, .shadow_taps = 1, .samples = 1});
    return must_step(run, json_pack("{s:s}", "step", "probe"), result);
}

/* Deep maps tell whether transparent things cast shadows. Scenes with more density grids than the
 * rasteriser draws have rays alone, which need not know. */
static bool probe(struct run *run)
{
    struct step_result result;
    struct tradeoff *document = &run->entry->document;
    struct request_resources resources;
    (void)!render_request_resources(&run->entry->request.render, &resources); /* it was checked */
    run->has_grids = tradeoffs_has_grids(run->tradeoffs, document->scene, &resources);
    tell(run, TRADEOFF_STAGE_PROBE, 0);
    bool is_good = probe_by(run, SHADOWS_RASTER_DEFAULT, &result);
    if (!is_good && run->has_grids) {
        step_result_finish(&result);
        is_good = probe_by(run, SHADOWS_RAYTRACED, &result);
    }
    if (is_good) {
        run->problem = (struct error){0};
        char device[TRADEOFF_DEVICE_BYTES] = "";
        tradeoffs_device_name(run->tradeoffs, device);
        pthread_mutex_lock(&run->tradeoffs->mutex);
        memcpy(document->device, device, sizeof device);
        document->lights = count(&result, "lights");
        document->shadowed_lights = count(&result, "shadowed_lights");
        document->triangles = count(&result, "triangles");
        document->has_transparent_casters =
            json_is_true(json_object_get(result.measured, "transparent_casters"));
        pthread_mutex_unlock(&run->tradeoffs->mutex);
        run->max_samples = (int)count(&result, "max_samples");
        run->has_layers = json_is_true(json_object_get(result.measured, "layers"));
        run->layer_needs = (unsigned)count(&result, "layer_needs");
    }
    step_result_finish(&result);
    return is_good;
}

/* ---- reference ---- */

/* False when the reference will not be there within its share of the time budget. */
static bool check_share(struct run *run, int rows, double spent_s)
{
    double share_s = REFERENCE_SHARE * run->options.time_budget_s;
    double whole_s = spent_s * run->height / rows;
    bool is_hopeless = spent_s > share_s / 8 && whole_s > 4 * share_s;
    if (rows == run->height || (spent_s <= share_s && !is_hopeless))
        return true;
    return error_set(&run->problem, ERROR_TIMEOUT,
                     "the reference of %d samples per pixel was at row %d of %d after %.1f s and "
                     "would take about %.1f s; half of time_budget_s, %.1f s, is for it: ask for a "
                     "smaller image or more time",
                     run->options.reference_samples, rows, run->height, spent_s, whole_s, share_s);
}

static void add_image(struct run *run, struct step_result *result, uint64_t *offset,
                      uint64_t *bytes)
{
    struct error problem = {0};
    uint64_t at = 0, size = 0;
    if (result->image_fd < 0)
        return;
    if (!tradeoff_store_add_image(run->tradeoffs->store, run->entry->document.id, result->image_fd,
                                  &at, &size, &problem)) {
        log_write(run->tradeoffs->desc.log, LOG_WARNING, "trade-off: %s", problem.message);
        return;
    }
    run->images_bytes += size;
    pthread_mutex_lock(&run->tradeoffs->mutex);
    *offset = at;
    *bytes = size;
    pthread_mutex_unlock(&run->tradeoffs->mutex);
}

static bool show_reference(struct run *run)
{
    struct step_result result;
    struct tradeoff *document = &run->entry->document;
    if (run->options.drops_images)
        return true;
    bool is_good = must_step(run, json_pack("{s:s}", "step", "show"), &result);
    if (is_good)
        add_image(run, &result, &document->reference_offset, &document->reference_bytes);
    step_result_finish(&result);
    return is_good;
}

/* Rows of the next band, from what the last one took. */
static int next_band(int rows, double build_ms, double trace_ms)
{
    double target_ms = fmax(BAND_MS, BAND_BUILDS * build_ms);
    double next = rows * target_ms / fmax(trace_ms, 1e-3);
    return (int)fmin(fmax(next, 1), 4. * rows);
}

static bool trace_reference(struct run *run)
{
    struct tradeoff *document = &run->entry->document;
    off_t size = (off_t)run->request.width * run->request.height * 4 * (off_t)sizeof(float);
    run->reference_fd = memfd_create("vitrail-reference", MFD_CLOEXEC);
    if (run->reference_fd < 0 || ftruncate(run->reference_fd, size) != 0)
        return error_set(&run->problem, ERROR_NO_MEMORY, "reference: %s", strerror(errno));
    set_reference(run);
    double begun_s = elapsed_s(run);
    int band = 1;
    for (int row = 0; row < run->height;) {
        struct step_result result;
        int rows = band < run->height - row ? band : run->height - row;
        if (!must_step(run,
                       json_pack("{s:s,s:i,s:i}", "step", "reference", "first_row", row,
                                 "row_count", rows),
                       &result)) {
            step_result_finish(&result);
            return false;
        }
        double build_ms = number(&result, "build_ms"), trace_ms = number(&result, "trace_ms");
        step_result_finish(&result);
        row += rows;
        run->traced_ms += trace_ms;
        band = next_band(rows, build_ms, trace_ms);
        pthread_mutex_lock(&run->tradeoffs->mutex);
        document->reference_rows = row;
        document->reference_ms = run->traced_ms;
        pthread_mutex_unlock(&run->tradeoffs->mutex);
        tell(run, TRADEOFF_STAGE_REFERENCE, PROGRESS_REFERENCE * row / run->height);
        if (!check_share(run, row, elapsed_s(run) - begun_s))
            return false;
    }
    if (!show_reference(run))
        return false;
    save(run);
    return true;
}

/* ---- errors ---- */

/* Frames that the runs of a setting take. */
static double frames_of_runs(const struct run *run)
{
    return run->options.repeats * RUN_FRAMES + SETTLE_FRAMES;
}

/* Whether a setting whose frame takes so long leaves room to time it and those before it. */
static bool has_room(const struct run *run, double frame_ms)
{
    double timed_ms = frame_ms;
    for (int i = run->timed_rows; i < run->entry->document.row_count; i++)
        timed_ms += run->frame_ms[i];
    double needed_ms = frame_ms + run->run_scale * frames_of_runs(run) * timed_ms;
    return elapsed_s(run) + 1e-3 * needed_ms <= run->options.time_budget_s;
}

/* A setting of the sweep that is missing; what the sweep itself leaves out is no loss. */
static void skip(struct run *run, const struct quality_setting *setting, const char *because)
{
    char label[TRADEOFF_LABEL_BYTES];
    tradeoff_setting_label(setting, label);
    pthread_mutex_lock(&run->tradeoffs->mutex);
    tradeoff_skip(&run->entry->document, label, "%s", because);
    run->entry->document.is_partial = true;
    pthread_mutex_unlock(&run->tradeoffs->mutex);
}

static void close_slow(struct run *run, int index, const char *because)
{
    run->is_open[index] = false;
    skip(run, &run->settings[index], because);
}

/* Others see the row when its image is stored. */
static void add_row(struct run *run, const struct quality_setting *setting,
                    struct step_result *result)
{
    struct tradeoff *document = &run->entry->document;
    const json_t *flip = json_object_get(result->measured, "flip");
    struct tradeoff_row row = {
        .setting = *setting,
        .rmse = number(result, "rmse"),
        .p999 = number(result, "p999"),
        .max = number(result, "max"),
        .flip = flip ? json_number_value(flip) : -1,
        .bytes = count(result, "bytes"),
    };
    add_image(run, result, &row.image_offset, &row.image_bytes);
    pthread_mutex_lock(&run->tradeoffs->mutex);
    document->rows[document->row_count] = row;
    run->frame_ms[document->row_count++] = number(result, "ms");
    pthread_mutex_unlock(&run->tradeoffs->mutex);
}

/* must_keep: with however little time; else what there is no room for stays open. False when the
 * run ends. */
static bool measure_error(struct run *run, int index, bool must_keep)
{
    const struct quality_setting *setting = &run->settings[index];
    struct step_result result;
    char because[96];
    bool keeps = !run->options.drops_images && run->images_bytes < IMAGES_BYTES_MAX;
    set_setting(run, setting);
    enum step_outcome outcome =
        run_step(run, json_pack("{s:s,s:b}", "step", "error", "keep_image", keeps), &result);
    double ms = number(&result, "ms");
    if (outcome == STEP_DONE)
        run->known_ms[index] = ms;
    run->is_open[index] = outcome == STEP_DONE && !must_keep && !has_room(run, ms);
    snprintf(because, sizeof because, "a frame took %.1f s, and others would wait for each",
             1e-3 * ms);
    if (outcome == STEP_FAILED)
        skip(run, setting, result.problem.message);
    else if (outcome == STEP_DONE && !must_keep && ms > FRAME_MS_MAX)
        close_slow(run, index, because);
    else if (outcome == STEP_DONE && !run->is_open[index])
        add_row(run, setting, &result);
    step_result_finish(&result);
    return outcome != STEP_INTERRUPTED;
}

static void plan_settings(struct run *run)
{
    struct tradeoff *document = &run->entry->document;
    pthread_mutex_lock(&run->tradeoffs->mutex);
    run->planned = tradeoff_sweep(
        &(struct sweep_desc){.fixed = &run->entry->request.render.quality,
                             .has_shadows = document->shadowed_lights > 0,
                             .has_transparent_casters = document->has_transparent_casters,
                             .has_lights = document->lights > 0,
                             .needs = render_request_needs(&run->entry->request.render) |
                                      (run->has_grids ? SHADOW_CAN_GRIDS : 0u),
                             .has_layers = run->has_layers,
                             .layer_needs = run->layer_needs,
                             .max_samples = run->max_samples,
                             .reference_samples = run->options.reference_samples,
                             .max_settings = run->options.max_settings},
        run->settings, document);
    pthread_mutex_unlock(&run->tradeoffs->mutex);
    for (int i = 0; i < run->planned; i++)
        run->is_open[i] = true;
}

static int count_open(const struct run *run)
{
    int open = 0;
    for (int i = 0; i < run->planned; i++)
        open += run->is_open[i];
    return open;
}

static void tell_left_out(struct run *run)
{
    int left_out = count_open(run);
    struct tradeoff *document = &run->entry->document;
    char what[64];
    if (left_out == 0)
        return;
    snprintf(what, sizeof what, "%d more setting%s", left_out, left_out == 1 ? "" : "s");
    pthread_mutex_lock(&run->tradeoffs->mutex);
    tradeoff_skip(document, what, "time_budget_s of %d leaves no room", run->options.time_budget_s);
    document->is_partial = true;
    pthread_mutex_unlock(&run->tradeoffs->mutex);
}

/* Settings whose times are alike: pictures with maps and pictures without are one family here. */
static enum shadow_family family_of(const struct quality_setting *setting)
{
    enum shadow_family family = shadow_technique_family(setting->shadows);
    return family == SHADOW_FAMILY_NONE ? SHADOW_FAMILY_MAPS : family;
}

/* How much the time of one says of that of another: 0: nothing. */
static int likeness(const struct quality_setting *one, const struct quality_setting *other)
{
    if (family_of(one) != family_of(other))
        return 0;
    return 1 + 2 * (one->shadows == other->shadows) +
           (one->atmosphere_samples == other->atmosphere_samples);
}

/* Finds the setting's measured frame, else the last one of those most like it; -1: none. */
static int find_known(const struct run *run, int index)
{
    int found = -1, most = 1;
    if (run->known_ms[index] > 0)
        return index;
    for (int i = 0; i < run->planned; i++) {
        int like = likeness(&run->settings[i], &run->settings[index]);
        if (run->known_ms[i] <= 0 || like < most)
            continue;
        found = i;
        most = like;
    }
    return found;
}

/* Rays of a map and what does not grow with it, as so many rays more: chosen. */
static double map_work(const struct quality_setting *setting)
{
    double rays = (double)setting->shadow_resolution * fmax(1, setting->shadow_prefilter);
    return rays * rays + 512. * 512.;
}

/* The expected time of a setting; 0: nothing is known of its kind. */
static double expected_ms(const struct run *run, int index)
{
    const struct quality_setting *setting = &run->settings[index];
    int at = find_known(run, index);
    const struct quality_setting *known = at >= 0 ? &run->settings[at] : NULL;
    double ms = known ? run->known_ms[at] : 0;
    if (family_of(setting) == SHADOW_FAMILY_RAYS)
        return known ? ms * setting->samples / known->samples
                     : run->traced_ms * setting->samples / run->options.reference_samples;
    if (family_of(setting) == SHADOW_FAMILY_POINTS) /* its surfaces, and their rays */
        return known ? ms : run->traced_ms / run->options.reference_samples;
    return known ? ms * map_work(setting) / map_work(known) : 0;
}

/* The one that is expected to be the fastest, of one sample where that is open; -1 where each was
 * tried. */
static int find_quickest(const struct run *run)
{
    int quickest = -1;
    double least_ms = INFINITY;
    for (int i = 0; i < run->planned; i++) {
        const struct quality_setting *setting = &run->settings[i];
        double ms = expected_ms(run, i);
        if (!run->is_open[i])
            continue;
        if (ms <= 0) /* nothing is known: a raster of few texels before one of many */
            ms = run->traced_ms + setting->shadow_resolution + setting->samples;
        if (ms < least_ms) {
            least_ms = ms;
            quickest = i;
        }
    }
    return quickest;
}

/* Measures one setting even if there is no time for any. */
static bool measure_one(struct run *run)
{
    if (run->planned == 0 || run->entry->document.row_count > 0)
        return true;
    for (int i = find_quickest(run); i >= 0 && run->entry->document.row_count == 0;
         i = find_quickest(run))
        if (!measure_error(run, i, true))
            return false;
    if (run->entry->document.row_count == 0)
        return true;
    pthread_mutex_lock(&run->tradeoffs->mutex);
    tradeoff_warn(&run->entry->document,
                  "no setting fits into time_budget_s of %d: one was measured nevertheless",
                  run->options.time_budget_s);
    run->entry->document.is_partial = true;
    pthread_mutex_unlock(&run->tradeoffs->mutex);
    return true;
}

/* Measures the errors of all open settings that have room. */
static bool measure_errors(struct run *run, double progress, double progress_end)
{
    for (int i = 0; i < run->planned; i++) {
        double ms = expected_ms(run, i);
        char because[96];
        if (!run->is_open[i] || !has_room(run, ms))
            continue;
        snprintf(because, sizeof because, "a frame would take about %.1f s", 1e-3 * ms);
        if (ms > FRAME_MS_MAX)
            close_slow(run, i, because);
        else if (!measure_error(run, i, false))
            return false;
        tell(run, TRADEOFF_STAGE_ERRORS,
             progress + (progress_end - progress) * (i + 1) / run->planned);
    }
    return true;
}

/* ---- times ---- */

/* One cold and one warm frame, after one that settles the driver. A failure costs the row its run,
 * no more. False when the run ends.
 */
static bool measure_time(struct run *run, struct tradeoff_row *row, bool settles)
{
    struct step_result result;
    set_setting(run, &row->setting);
    enum step_outcome outcome =
        run_step(run, json_pack("{s:s,s:b}", "step", "time", "settles", settles), &result);
    pthread_mutex_lock(&run->tradeoffs->mutex);
    if (outcome == STEP_DONE) {
        row->cold.ms[row->cold.count++] = number(&result, "cold_ms");
        row->warm.ms[row->warm.count++] = number(&result, "warm_ms");
        tradeoff_mark_front(&run->entry->document);
    } else if (outcome == STEP_FAILED) {
        tradeoff_warn(&run->entry->document, "a timed run was lost: %s", result.problem.message);
        run->entry->document.is_partial = true;
    }
    pthread_mutex_unlock(&run->tradeoffs->mutex);
    step_result_finish(&result);
    return outcome != STEP_INTERRUPTED;
}

/* Learns from the time of the last runs how many more have room. */
static void learn_scale(struct run *run, double begun_s)
{
    double forecast_ms = 0;
    for (int i = run->timed_rows; i < run->entry->document.row_count; i++)
        forecast_ms += frames_of_runs(run) * run->frame_ms[i];
    if (forecast_ms > 0)
        run->run_scale = fmax(1e3 * (elapsed_s(run) - begun_s) / forecast_ms, RUN_SCALE_LEAST);
}

/* The rows that have no times. Each round begins at another setting, so that none is always the
 * first. */
static bool measure_times(struct run *run, double progress, double progress_end)
{
    struct tradeoff *document = &run->entry->document;
    int first = run->timed_rows, rows = document->row_count - first;
    int total = rows * run->options.repeats;
    double begun_s = elapsed_s(run);
    for (int done = 0; done < total; done++) {
        int round = done / rows, row = first + (done + round * (1 + rows / 3)) % rows;
        if (done > 0 && elapsed_s(run) > run->options.time_budget_s) {
            pthread_mutex_lock(&run->tradeoffs->mutex);
            tradeoff_warn(document, "time_budget_s of %d was spent after %d of %d timed runs",
                          run->options.time_budget_s, first * run->options.repeats + done,
                          document->row_count * run->options.repeats);
            document->is_partial = true;
            pthread_mutex_unlock(&run->tradeoffs->mutex);
            break;
        }
        if (!measure_time(run, &document->rows[row], round == 0))
            return false;
        tell(run, TRADEOFF_STAGE_TIMES, progress + (progress_end - progress) * (done + 1) / total);
    }
    learn_scale(run, begun_s);
    run->timed_rows = document->row_count;
    return true;
}

/* Errors, then times; and again for what had no room by the first forecast, while runs turn out to
 * be quicker than that. */
static bool measure_settings(struct run *run)
{
    const struct tradeoff *document = &run->entry->document;
    double progress = PROGRESS_REFERENCE;
    plan_settings(run);
    do {
        double middle = progress + (1 - progress) * PROGRESS_ERRORS;
        if (!measure_errors(run, progress, middle) || !measure_one(run))
            return false;
        if (document->row_count == 0)
            return error_set(&run->problem, ERROR_TIMEOUT,
                             "not one setting could be measured within %d s; 'skipped' says why",
                             run->options.time_budget_s);
        if (document->row_count == run->timed_rows)
            break;
        progress = count_open(run) ? (middle + 1) / 2 : 1;
        if (!measure_times(run, middle, progress))
            return false;
    } while (count_open(run));
    tell_left_out(run);
    return true;
}

/* ---- the whole ---- */

static void end(struct run *run, bool is_good)
{
    struct tradeoff *document = &run->entry->document;
    pthread_mutex_lock(&run->tradeoffs->mutex);
    document->elapsed_s = elapsed_s(run);
    document->stage = TRADEOFF_STAGE_ENDED;
    if (document->state == TRADEOFF_RUNNING) {
        document->state = is_good ? TRADEOFF_DONE : TRADEOFF_FAILED;
        if (is_good)
            document->progress = 1;
        else
            document->is_partial = true;
        if (!is_good && run->problem.code == ERROR_NONE)
            error_set(&run->problem, ERROR_INTERRUPTED, "the server stopped before the end");
        document->problem = run->problem;
    }
    log_write(run->tradeoffs->desc.log, LOG_INFO, "trade-off %s is %s: %d settings in %.1f s",
              document->id, tradeoff_state_name((int)document->state), document->row_count,
              document->elapsed_s);
    pthread_mutex_unlock(&run->tradeoffs->mutex);
    save(run);
}

void tradeoff_run(struct tradeoffs *tradeoffs, struct tradeoff_entry *entry)
{
    struct run *run = calloc(1, sizeof *run);
    if (!run) {
        pthread_mutex_lock(&tradeoffs->mutex);
        entry->document.state = TRADEOFF_FAILED;
        error_set(&entry->document.problem, ERROR_NO_MEMORY, "trade-off");
        pthread_mutex_unlock(&tradeoffs->mutex);
        return;
    }
    run->tradeoffs = tradeoffs;
    run->entry = entry;
    run->request = entry->request.render;
    run->options = entry->request.options;
    run->height = run->request.height;
    run->reference_fd = -1;
    run->run_scale = 1;
    bool is_good = probe(run) && trace_reference(run) && measure_settings(run);
    end(run, is_good);
    if (run->reference_fd >= 0)
        close(run->reference_fd);
    free(run);
}
