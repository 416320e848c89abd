/* SPDX-License-Identifier: MIT */
/* Translates from the renderer to the wire: frame reports to stats, scenes to summaries, devices to
 * capabilities. */
#include <assert.h>
#include <math.h>
#include <string.h>

#include "protocol/utf8.h"
#include "protocol/quality_defaults.h"
#include "renderer/base/processor_forms.h"
#include "server/mapping/view_mapping.h"

static_assert((int)FRAME_STATS_PASSES_MAX >= (int)REPORT_PASSES_MAX, "passes do not fit");
static_assert((int)FRAME_STATS_BYTES_MAX >= (int)REPORT_BYTES_MAX, "bytes do not fit");
static_assert((int)FRAME_STATS_REUSED_MAX >= (int)REPORT_REUSED_MAX, "reused does not fit");
static_assert((int)FRAME_STATS_WARNINGS_MAX >= (int)REPORT_WARNINGS_MAX + 4, "warnings do not fit");

/* ---- frame report ---- */

static void copy_plan(const struct frame_report *report, struct frame_stats *stats)
{
    for (int i = 0; i < report->pass_count; i++) {
        const struct report_pass *from = &report->passes[i];
        struct frame_stats_pass *to = &stats->plan[i];
        utf8_copy(to->pass, sizeof to->pass, from->pass);
        utf8_copy(to->because, sizeof to->because, from->because);
        utf8_copy(to->technique, sizeof to->technique, from->technique);
        to->ms = from->ms;
    }
    stats->plan_count = report->pass_count;
}

static void copy_lists(const struct frame_report *report, struct frame_stats *stats)
{
    for (int i = 0; i < report->byte_count; i++) {
        utf8_copy(stats->bytes[i].structure, sizeof stats->bytes[i].structure,
                  report->bytes[i].structure);
        stats->bytes[i].bytes = report->bytes[i].bytes;
    }
    for (int i = 0; i < report->reused_count; i++)
        utf8_copy(stats->reused[i], sizeof stats->reused[i], report->reused[i]);
    for (int i = 0; i < report->warning_count; i++)
        utf8_copy(stats->warnings[i], sizeof stats->warnings[i], report->warnings[i]);
    stats->byte_count = report->byte_count;
    stats->resident_bytes = report->resident_bytes;
    stats->reused_count = report->reused_count;
    stats->warning_count = report->warning_count;
}

static void copy_chosen(const struct render_request *request, const struct frame_report *report,
                        struct frame_stats_chosen *chosen)
{
    const struct request_quality *quality = &request->quality;
    enum shadow_technique shadows = report->chosen.shadows;
    if (!report->chosen.because[0])
        return;
    bool has_forecast = report->chosen.expected_ms > 0;
    chosen->source = has_forecast ? FRAME_CHOICE_CALIBRATED : FRAME_CHOICE_CONFIGURED;
    utf8_copy(chosen->shadows, sizeof chosen->shadows, shadow_technique_name((int)shadows));
    if (shadow_technique_has(shadows, SHADOW_HAS_MAP)) {
        chosen->shadow_resolution = quality->shadow_resolution;
        chosen->shadow_taps = quality->shadow_taps;
    }
    chosen->samples = quality_or(quality->samples, SAMPLES_DEFAULT);
    chosen->expected_ms = report->chosen.expected_ms;
    utf8_copy(chosen->because, sizeof chosen->because, report->chosen.because);
}

static void copy_times(const struct frame_report *report, double ms[FRAME_TIMING_COUNT])
{
    double passes = 0;
    for (int i = 0; i < REPORT_STAGE_COUNT; i++)
        passes += report->stage_ms[i];
    ms[FRAME_TIMING_PREPARE] = isnan(passes) ? NAN : fmax(report->total_ms - passes, 0);
    ms[FRAME_TIMING_SHADOW] = report->stage_ms[REPORT_SHADOW];
    ms[FRAME_TIMING_LIGHT_LIST] = report->stage_ms[REPORT_LIGHT_LIST];
    ms[FRAME_TIMING_SHADE] = report->stage_ms[REPORT_SHADE];
    ms[FRAME_TIMING_READBACK] = report->stage_ms[REPORT_READBACK];
    ms[FRAME_TIMING_PAUSED] = report->paused_ms;
    ms[FRAME_TIMING_TOTAL] = report->total_ms;
}

static void copy_environment(const struct render_request *request,
                             const struct frame_report *report,
                             struct frame_stats_environment *environment)
{
    const struct request_quality *quality = &request->quality;
    utf8_copy(environment->image, sizeof environment->image, report->environment);
    for (int i = 0; environment->image[0] && i < report->pass_count; i++)
        if (!strcmp(report->passes[i].pass, "raytrace.trace") ||
            !strcmp(report->passes[i].pass, "environment.trace"))
            environment->samples =
                quality_or(quality->environment_samples, quality->reference
                                                             ? ENVIRONMENT_SAMPLES_DEFAULT_REFERENCE
                                                             : ENVIRONMENT_SAMPLES_DEFAULT);
}

void frame_stats_from_report(const struct render_request *request,
                             const struct frame_report *report, const char *device,
                             struct frame_stats *stats)
{
    const struct request_tile *tile = &request->tile;
    *stats = (struct frame_stats){.width = tile->is_given ? tile->width : request->width,
                                  .height = tile->is_given ? tile->height : request->height};
    utf8_copy(stats->scene, sizeof stats->scene, request->scene);
    utf8_copy(stats->device, sizeof stats->device, device);
    copy_environment(request, report, &stats->environment);
    copy_plan(report, stats);
    stats->counts = report->counts;
    stats->compression = report->compression;
    stats->textures = report->textures;
    copy_lists(report, stats);
    copy_chosen(request, report, &stats->chosen);
    copy_times(report, stats->timings_ms);
    if (report->error_is_exact) {
        stats->has_error = true;
        stats->error_source = FRAME_ERROR_EXACT;
        utf8_copy(stats->error_metric, sizeof stats->error_metric, "transmittance");
    }
}

/* ---- device ---- */

void device_capabilities_from_info(const struct renderer_info *info,
                                   struct device_capabilities *device)
{
    *device = (struct device_capabilities){
        .device_count = info->device_count,
        .max_texture_size = info->max_texture_size,
        .max_samples = info->max_samples,
        .vector_bits = processor_form_bits(),
        .max_storage_block_bytes = info->max_storage_block_bytes,
        .gpu_budget_bytes = info->budget_bytes,
        .gpu_used_bytes = info->used_bytes,
        .upload_bytes_per_ms = info->upload_bytes_per_ms,
        .compresses_textures = info->compresses_textures,
        .has_true_timers = info->has_true_timers,
        .has_post_depth_coverage = info->has_post_depth_coverage,
        .has_program_binaries = info->program_formats > 0,
        .is_robust = info->is_robust,
        .is_software = info->is_software,
        .pairs_over_f64 = info->wide_floats.pairs_over_f64,
    };
    utf8_copy(device->wide_floats, sizeof device->wide_floats,
              wide_floats_name(info->wide_floats.form));
    utf8_copy(device->vendor, sizeof device->vendor, info->vendor);
    utf8_copy(device->renderer, sizeof device->renderer, info->renderer);
    utf8_copy(device->version, sizeof device->version, info->version);
    utf8_copy(device->driver, sizeof device->driver, info->driver);
    if (info->budget_source)
        utf8_copy(device->gpu_budget_source, sizeof device->gpu_budget_source, info->budget_source);
    utf8_copy(device->warning, sizeof device->warning, info->warning);
    device->passed_over = info->passed_over;
    for (int i = 0; i < CAPABILITIES_DEVICES && i < RENDERER_DEVICES_TOLD; i++)
        utf8_copy(device->devices[i], sizeof device->devices[i], info->devices[i]);
}

/* The numbers alone. */
void device_blocks_from_speed(const struct texture_speed *speed, struct device_blocks *blocks)
{
    blocks->is_measured = texture_speed_is_known(speed);
    blocks->whole_ns = speed->whole_ns;
    blocks->bc1_ns = speed->bc1_ns;
    blocks->bc3_ns = speed->bc3_ns;
    blocks->encode_bytes_per_ms = speed->encode_bytes_per_ms;
}
