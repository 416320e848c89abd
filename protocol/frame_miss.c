/* SPDX-License-Identifier: MIT */
/* Frames that took much longer than was expected or asked for, and what is known of why. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "protocol/frame_stats.h"

/* What is within half as much again is no miss; nor is what nobody sees. */
static const double MISS_RATIO = 1.5, MISS_LEAST_MS = 4;

/* `text` grows by a phrase. */
static void add(char text[FRAME_STATS_TEXT_BYTES], uint64_t count, const char *what)
{
    size_t length = strlen(text);
    if (count)
        snprintf(text + length, FRAME_STATS_TEXT_BYTES - length, "%s%llu %s", length ? ", " : "",
                 (unsigned long long)count, what);
}

static void say_why(const struct frame_stats *stats, char why[FRAME_STATS_TEXT_BYTES])
{
    const bool is_warm =
        strstr(stats->chosen.because, "warm") || strstr(stats->chosen.because, "shadows kept");
    why[0] = '\0';
    add(why, stats->counts.programs_built, "programs were compiled");
    add(why, stats->counts.programs_loaded, "programs were read from disk");
    add(why, is_warm ? stats->counts.shadow_maps_built : 0, "shadow maps were made");
    add(why, stats->counts.light_batches > 1 ? stats->counts.light_batches : 0,
        "batches of lights for want of memory");
    add(why, stats->textures.written_bytes, "bytes of textures were written");
    if (!why[0])
        snprintf(why, FRAME_STATS_TEXT_BYTES, "the forecast was off, or the machine busy");
}

void frame_stats_judge(struct frame_stats *stats, double budget_ms)
{
    struct frame_stats_chosen *chosen = &stats->chosen;
    char why[FRAME_STATS_TEXT_BYTES], asked[48] = "";
    chosen->took_ms = stats->timings_ms[FRAME_TIMING_TOTAL];
    chosen->missed[0] = '\0';
    double most = fmax(chosen->expected_ms, budget_ms);
    bool is_over = most > 0 && chosen->took_ms > MISS_RATIO * most;
    if (!chosen->shadows[0] || !is_over || chosen->took_ms < most + MISS_LEAST_MS)
        return;
    say_why(stats, why);
    if (budget_ms > 0)
        snprintf(asked, sizeof asked, "asked for %.4g ms, ", budget_ms);
    snprintf(chosen->missed, sizeof chosen->missed, "%sexpected %.4g, took %.4g: %.110s", asked,
             chosen->expected_ms, chosen->took_ms, why);
}
