/* SPDX-License-Identifier: MIT */
/* Trade-offs: names, statistics of repeated runs, the Pareto front, and CSV. */
#include "protocol/tradeoff.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/utf8.h"

const char *tradeoff_state_name(int state)
{
    static const char *const names[] = {"queued", "running", "done", "failed", "cancelled"};
    return state >= 0 && state <= TRADEOFF_CANCELLED ? names[state] : NULL;
}

const char *tradeoff_stage_name(int stage)
{
    static const char *const names[] = {"waiting", "probe", "reference",
                                        "errors",  "times", "ended"};
    return stage >= 0 && stage <= TRADEOFF_STAGE_ENDED ? names[stage] : NULL;
}

void tradeoff_finish(struct tradeoff *tradeoff)
{
    json_decref(tradeoff->request);
    *tradeoff = (struct tradeoff){0};
}

/* ---- repeated runs ---- */

static int compare_numbers(const void *left, const void *right)
{
    const double *a = left, *b = right;
    return (*a > *b) - (*a < *b);
}

static double median(double *numbers, int count)
{
    if (count == 0)
        return 0;
    qsort(numbers, (size_t)count, sizeof *numbers, compare_numbers);
    return count % 2 ? numbers[count / 2] : (numbers[count / 2 - 1] + numbers[count / 2]) / 2;
}

double tradeoff_times_median(const struct tradeoff_times *times)
{
    struct tradeoff_times sorted = *times;
    return median(sorted.ms, sorted.count);
}

double tradeoff_times_spread(const struct tradeoff_times *times)
{
    struct tradeoff_times away = *times;
    double middle = tradeoff_times_median(times);
    for (int i = 0; i < away.count; i++)
        away.ms[i] = fabs(away.ms[i] - middle);
    return median(away.ms, away.count);
}

double tradeoff_times_max(const struct tradeoff_times *times)
{
    double max = 0;
    for (int i = 0; i < times->count; i++)
        max = fmax(max, times->ms[i]);
    return max;
}

/* ---- lists ---- */

void tradeoff_skip(struct tradeoff *tradeoff, const char *what, const char *format, ...)
{
    if (tradeoff->skip_count == TRADEOFF_SKIPS_MAX)
        return;
    struct tradeoff_skip *skip = &tradeoff->skips[tradeoff->skip_count++];
    utf8_copy(skip->what, sizeof skip->what, what);
    va_list args;
    va_start(args, format);
    int length = vsnprintf(skip->because, sizeof skip->because, format, args);
    va_end(args);
    utf8_sanitize(skip->because, length >= (int)sizeof skip->because);
}

void tradeoff_warn(struct tradeoff *tradeoff, const char *format, ...)
{
    if (tradeoff->warning_count == TRADEOFF_WARNINGS_MAX)
        return;
    char *text = tradeoff->warnings[tradeoff->warning_count++];
    va_list args;
    va_start(args, format);
    int length = vsnprintf(text, TRADEOFF_TEXT_BYTES, format, args);
    va_end(args);
    utf8_sanitize(text, length >= TRADEOFF_TEXT_BYTES);
}

const char *tradeoff_method(const struct quality_setting *setting)
{
    bool has_one = setting->transparency != TRANSPARENCY_AUTO;
    return has_one ? transparency_name((int)setting->transparency) : NULL;
}

void tradeoff_extras_label(const struct quality_setting *setting, char label[TRADEOFF_EXTRAS_BYTES])
{
    char map[40] = "", error[16] = "", rays[16] = "";
    const char *method = tradeoff_method(setting);
    if (setting->shadow_resolution)
        snprintf(map, sizeof map, " %d, %d tap%s", setting->shadow_resolution, setting->shadow_taps,
                 setting->shadow_taps == 1 ? "" : "s");
    if (setting->shadow_compression > 0)
        snprintf(error, sizeof error, ", e %.3g", setting->shadow_compression);
    if (setting->shadow_prefilter > 1)
        snprintf(rays, sizeof rays, ", k %d", setting->shadow_prefilter);
    snprintf(label, TRADEOFF_EXTRAS_BYTES, "%s%s%s%s%s", map, rays, error, method ? ", " : "",
             method ? method : "");
}

void tradeoff_media_label(const struct quality_setting *setting, char label[TRADEOFF_MEDIA_BYTES])
{
    label[0] = 0;
    if (setting->atmosphere_samples)
        snprintf(label, TRADEOFF_MEDIA_BYTES, ", media %d", setting->atmosphere_samples);
}

void tradeoff_setting_label(const struct quality_setting *setting, char label[TRADEOFF_LABEL_BYTES])
{
    char extras[TRADEOFF_EXTRAS_BYTES], media[TRADEOFF_MEDIA_BYTES];
    tradeoff_extras_label(setting, extras);
    tradeoff_media_label(setting, media);
    snprintf(label, TRADEOFF_LABEL_BYTES, "%s%s, %d sample%s%s",
             shadow_technique_name((int)setting->shadows), extras, setting->samples,
             setting->samples == 1 ? "" : "s", media);
}

static bool is_beaten(const struct tradeoff *tradeoff, const struct tradeoff_row *row)
{
    double ms = tradeoff_times_median(&row->warm);
    for (int i = 0; i < tradeoff->row_count; i++) {
        const struct tradeoff_row *other = &tradeoff->rows[i];
        if (other == row || other->warm.count == 0)
            continue;
        double other_ms = tradeoff_times_median(&other->warm);
        bool is_as_good = other_ms <= ms && other->rmse <= row->rmse;
        bool is_better = other_ms < ms || other->rmse < row->rmse;
        if (is_as_good && (is_better || other < row)) /* of equals the first stays */
            return true;
    }
    return false;
}

void tradeoff_mark_front(struct tradeoff *tradeoff)
{
    for (int i = 0; i < tradeoff->row_count; i++) {
        struct tradeoff_row *row = &tradeoff->rows[i];
        row->is_on_front = row->warm.count > 0 && !is_beaten(tradeoff, row);
    }
}

/* ---- CSV (RFC 4180); no cell needs quotes ---- */

static void write_csv_row(FILE *out, const struct tradeoff_row *row)
{
    const struct quality_setting *setting = &row->setting;
    fprintf(out, "%s,", shadow_technique_name((int)setting->shadows));
    if (setting->shadow_resolution)
        fprintf(out, "%d,%d,", setting->shadow_resolution, setting->shadow_taps);
    else
        fputs(",,", out);
    fprintf(out, "%d,", setting->samples);
    const struct tradeoff_times *const lists[] = {&row->warm, &row->cold};
    for (int i = 0; i < 2; i++) {
        if (lists[i]->count)
            fprintf(out, "%.3f,%.3f,%.3f,%d,", tradeoff_times_median(lists[i]),
                    tradeoff_times_spread(lists[i]), tradeoff_times_max(lists[i]), lists[i]->count);
        else
            fputs(",,,0,", out);
    }
    fprintf(out, "%.9g,%.9g,%.9g,", row->rmse, row->p999, row->max);
    if (row->flip >= 0)
        fprintf(out, "%.9g", row->flip);
    fprintf(out, ",%llu,%s,", (unsigned long long)row->bytes, row->is_on_front ? "true" : "false");
    if (setting->shadow_compression > 0)
        fprintf(out, "%.9g", setting->shadow_compression);
    fputc(',', out);
    if (setting->shadow_prefilter > 1)
        fprintf(out, "%d", setting->shadow_prefilter);
    fputc(',', out);
    if (setting->atmosphere_samples)
        fprintf(out, "%d", setting->atmosphere_samples);
    const char *method = tradeoff_method(setting);
    fprintf(out, ",%s\r\n", method ? method : "");
}

char *tradeoff_to_csv(const struct tradeoff *tradeoff)
{
    char *text = NULL;
    size_t size_bytes = 0;
    FILE *out = open_memstream(&text, &size_bytes);
    if (!out)
        return NULL;
    fputs("shadows,shadow_resolution,shadow_taps,samples,warm_ms_median,warm_ms_spread,"
          "warm_ms_max,warm_runs,cold_ms_median,cold_ms_spread,cold_ms_max,cold_runs,"
          "rmse,p999,max,flip,bytes,on_front,shadow_compression,shadow_prefilter,"
          "atmosphere_samples,transparency\r\n",
          out);
    for (int i = 0; i < tradeoff->row_count; i++)
        write_csv_row(out, &tradeoff->rows[i]);
    if (fclose(out) == 0)
        return text;
    free(text);
    return NULL;
}
