/* SPDX-License-Identifier: MIT */
/* Filling a frame report within its fixed capacities. */
#include "renderer/frame_report.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* because NULL: whatever the reason. */
static struct report_pass *line_of(struct frame_report *report, const char *pass,
                                   const char *because, const char *technique)
{
    for (int i = 0; i < report->pass_count; i++) {
        struct report_pass *line = &report->passes[i];
        if (!strcmp(line->pass, pass) && !strcmp(line->technique, technique) &&
            (!because || !strcmp(line->because, because)))
            return line;
    }
    return NULL;
}

void report_order_pass(struct frame_report *report, const char *pass)
{
    if (report->order_count < REPORT_PASSES_MAX)
        snprintf(report->order[report->order_count++], REPORT_NAME_BYTES, "%s", pass);
}

static int place_of(const struct frame_report *report, const char *pass)
{
    int place = 0;
    while (place < report->order_count && strcmp(report->order[place], pass) != 0)
        place++;
    return place;
}

/* A line after all that do not come later. */
static struct report_pass *insert_line(struct frame_report *report, const char *pass)
{
    int place = place_of(report, pass), at = report->pass_count++;
    for (; at > 0 && place_of(report, report->passes[at - 1].pass) > place; at--)
        report->passes[at] = report->passes[at - 1];
    return &report->passes[at];
}

void report_add_pass(struct frame_report *report, const char *pass, const char *because,
                     const char *technique, double ms, enum report_stage stage)
{
    report->stage_ms[stage] += ms;
    bool is_full = report->pass_count >= REPORT_PASSES_MAX / 2; /* many windows, of one pass each */
    struct report_pass *known = line_of(report, pass, is_full ? NULL : because, technique);
    if (known) {
        known->ms += ms;
        return;
    }
    if (report->pass_count == REPORT_PASSES_MAX) {
        struct report_pass *last = &report->passes[REPORT_PASSES_MAX - 1];
        snprintf(last->pass, sizeof last->pass, "more");
        snprintf(last->because, sizeof last->because, "the plan has more passes than lines");
        last->ms += ms;
        return;
    }
    struct report_pass *line = insert_line(report, pass);
    snprintf(line->pass, sizeof line->pass, "%s", pass);
    snprintf(line->because, sizeof line->because, "%s", because);
    snprintf(line->technique, sizeof line->technique, "%s", technique);
    line->ms = ms;
}

/* The structure's entry, made where it is absent; NULL when there is no room. */
static struct report_bytes *bytes_of(struct frame_report *report, const char *structure)
{
    for (int i = 0; i < report->byte_count; i++)
        if (!strcmp(report->bytes[i].structure, structure))
            return &report->bytes[i];
    if (report->byte_count == REPORT_BYTES_MAX)
        return NULL;
    struct report_bytes *entry = &report->bytes[report->byte_count++];
    *entry = (struct report_bytes){.bytes = 0};
    snprintf(entry->structure, sizeof entry->structure, "%s", structure);
    return entry;
}

void report_add_bytes(struct frame_report *report, const char *structure, uint64_t bytes)
{
    struct report_bytes *entry = bytes_of(report, structure);
    if (entry)
        entry->bytes += bytes;
}

void report_raise_bytes(struct frame_report *report, const char *structure, uint64_t bytes)
{
    struct report_bytes *entry = bytes ? bytes_of(report, structure) : NULL;
    if (entry && entry->bytes < bytes)
        entry->bytes = bytes;
}

void report_add_reused(struct frame_report *report, const char *what)
{
    for (int i = 0; i < report->reused_count; i++)
        if (!strcmp(report->reused[i], what))
            return;
    if (report->reused_count < REPORT_REUSED_MAX)
        snprintf(report->reused[report->reused_count++], REPORT_NAME_BYTES, "%s", what);
}

void report_add_partitions(struct frame_report *report, const struct report_partitions *added)
{
    struct report_partitions *all = &report->partitions;
    all->lights += added->lights;
    all->merged += added->merged;
    all->crossed += added->crossed;
    all->most = added->most > all->most ? added->most : all->most;
    all->most_crossed =
        added->most_crossed > all->most_crossed ? added->most_crossed : all->most_crossed;
}

void report_warn(struct frame_report *report, const char *format, ...)
{
    char text[REPORT_TEXT_BYTES];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    for (int i = 0; i < report->warning_count; i++)
        if (!strcmp(report->warnings[i], text))
            return;
    if (report->warning_count == REPORT_WARNINGS_MAX) {
        snprintf(report->warnings[REPORT_WARNINGS_MAX - 1], REPORT_TEXT_BYTES,
                 "more warnings were dropped");
        return;
    }
    memcpy(report->warnings[report->warning_count++], text, sizeof text);
}
