/* SPDX-License-Identifier: MIT */
/* Metrics: names and buckets follow the Prometheus guide to naming; labels never hold what clients
 * choose. */
#include "server/front/metrics.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROUTES_MAX = 32, BUCKETS = 15, STAGES = FRAME_TIMING_COUNT, RATIOS = 9, TECHNIQUES = 8 };

static const double bounds_s[BUCKETS] = {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25,
                                         0.5,   1,      2.5,   5,    10,    30,   60};

/* The statuses that we answer; the last slot counts all others and clients that left. */
static const int statuses[] = {101, 200, 201, 202, 204, 304, 400, 404, 405, 406, 409,
                               412, 413, 415, 422, 429, 500, 503, 504, 507, 0};
enum { STATUSES = sizeof statuses / sizeof statuses[0] };

struct histogram {
    uint64_t counts[BUCKETS + 1];
    double sum_s;
};

struct route_metrics {
    const char *route;
    uint64_t requests[HTTP_METHOD_COUNT][STATUSES];
    struct histogram duration;
};

/* Bounds of the time that frames took over the expected one. */
static const double bounds_ratio[RATIOS] = {0.5, 0.67, 0.8, 0.9, 1.1, 1.25, 1.5, 2, 3};

struct forecasts { /* of one technique */
    char shadows[FRAME_STATS_NAME_BYTES];
    uint64_t counts[RATIOS + 1], missed;
    double sum;
};

struct metrics {
    pthread_mutex_t mutex;
    struct forecasts forecasts[TECHNIQUES];  /* in the order of their first frames */
    struct route_metrics routes[ROUTES_MAX]; /* the last one takes what finds no place */
    struct histogram stages[STAGES];
    struct metrics_totals totals;
};

struct metrics *metrics_create(struct error *err)
{
    struct metrics *metrics = calloc(1, sizeof *metrics);
    if (!metrics)
        error_set(err, ERROR_NO_MEMORY, "metrics");
    else
        pthread_mutex_init(&metrics->mutex, NULL);
    return metrics;
}

void metrics_destroy(struct metrics *metrics)
{
    if (metrics)
        pthread_mutex_destroy(&metrics->mutex);
    free(metrics);
}

static void observe(struct histogram *histogram, double seconds)
{
    int bucket = 0;
    while (bucket < BUCKETS && seconds > bounds_s[bucket])
        bucket++;
    histogram->counts[bucket]++;
    histogram->sum_s += seconds;
}

static struct route_metrics *find_route(struct metrics *metrics, const char *route)
{
    for (int i = 0; i < ROUTES_MAX - 1; i++) {
        if (!metrics->routes[i].route)
            metrics->routes[i].route = route;
        if (strcmp(metrics->routes[i].route, route) == 0)
            return &metrics->routes[i];
    }
    metrics->routes[ROUTES_MAX - 1].route = "other";
    return &metrics->routes[ROUTES_MAX - 1];
}

void metrics_count_request(struct metrics *metrics, const char *route, enum http_method method,
                           int status, double seconds)
{
    int slot = 0;
    while (slot < STATUSES - 1 && statuses[slot] != status)
        slot++;
    pthread_mutex_lock(&metrics->mutex);
    struct route_metrics *of_route = find_route(metrics, route);
    of_route->requests[method][slot]++;
    observe(&of_route->duration, seconds);
    metrics->totals.requests++;
    pthread_mutex_unlock(&metrics->mutex);
}

static void observe_forecast(struct metrics *metrics, const struct frame_stats_chosen *chosen)
{
    int bucket = 0, at = 0;
    if (!(chosen->expected_ms > 0) || !(chosen->took_ms > 0))
        return;
    while (at < TECHNIQUES && metrics->forecasts[at].shadows[0] &&
           strcmp(metrics->forecasts[at].shadows, chosen->shadows) != 0)
        at++;
    if (at == TECHNIQUES)
        return;
    struct forecasts *forecasts = &metrics->forecasts[at];
    double ratio = chosen->took_ms / chosen->expected_ms;
    while (bucket < RATIOS && ratio > bounds_ratio[bucket])
        bucket++;
    memcpy(forecasts->shadows, chosen->shadows, sizeof forecasts->shadows);
    forecasts->counts[bucket]++;
    forecasts->sum += ratio;
    forecasts->missed += chosen->missed[0] != '\0';
}

void metrics_count_frame(struct metrics *metrics, const struct frame_stats *stats)
{
    pthread_mutex_lock(&metrics->mutex);
    for (int i = 0; i < STAGES; i++)
        observe(&metrics->stages[i], 1e-3 * stats->timings_ms[i]);
    observe_forecast(metrics, &stats->chosen);
    pthread_mutex_unlock(&metrics->mutex);
}

void metrics_count_upload(struct metrics *metrics, uint64_t bytes)
{
    pthread_mutex_lock(&metrics->mutex);
    metrics->totals.upload_bytes += bytes;
    pthread_mutex_unlock(&metrics->mutex);
}

static void write_histogram(FILE *out, const char *name, const char *label, const char *value,
                            const struct histogram *histogram)
{
    uint64_t total = 0;
    for (int i = 0; i <= BUCKETS; i++) {
        total += histogram->counts[i];
        if (i < BUCKETS)
            fprintf(out, "%s_bucket{%s=\"%s\",le=\"%g\"} %llu\n", name, label, value, bounds_s[i],
                    (unsigned long long)total);
        else
            fprintf(out, "%s_bucket{%s=\"%s\",le=\"+Inf\"} %llu\n", name, label, value,
                    (unsigned long long)total);
    }
    fprintf(out, "%s_sum{%s=\"%s\"} %.9g\n%s_count{%s=\"%s\"} %llu\n", name, label, value,
            histogram->sum_s, name, label, value, (unsigned long long)total);
}

static void write_head(FILE *out, const char *name, const char *help, const char *type)
{
    fprintf(out, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, type);
}

static void write_requests(FILE *out, const struct metrics *metrics)
{
    write_head(out, "vitrail_http_requests_total",
               "Requests answered, by route, method and status.", "counter");
    for (int r = 0; r < ROUTES_MAX; r++)
        for (int m = 0; metrics->routes[r].route && m < HTTP_METHOD_COUNT; m++)
            for (int s = 0; s < STATUSES; s++)
                if (metrics->routes[r].requests[m][s])
                    fprintf(out,
                            "vitrail_http_requests_total{route=\"%s\",method=\"%s\",code=\"%d\"} "
                            "%llu\n",
                            metrics->routes[r].route, http_method_name((enum http_method)m),
                            statuses[s], (unsigned long long)metrics->routes[r].requests[m][s]);
    write_head(out, "vitrail_http_request_duration_seconds",
               "From the head of a request to the end of its reply.", "histogram");
    for (int r = 0; r < ROUTES_MAX && metrics->routes[r].route; r++)
        write_histogram(out, "vitrail_http_request_duration_seconds", "route",
                        metrics->routes[r].route, &metrics->routes[r].duration);
}

static void write_forecasts(FILE *out, const struct metrics *metrics)
{
    static const char name[] = "vitrail_forecast_ratio";
    int count = 0;
    while (count < TECHNIQUES && metrics->forecasts[count].shadows[0])
        count++;
    if (!count)
        return;
    write_head(out, name, "Time of frames over what was expected of them, by technique.",
               "histogram");
    for (int i = 0; i < count; i++) {
        const struct forecasts *f = &metrics->forecasts[i];
        uint64_t total = 0;
        for (int k = 0; k < RATIOS; k++) {
            total += f->counts[k];
            fprintf(out, "%s_bucket{shadows=\"%s\",le=\"%g\"} %llu\n", name, f->shadows,
                    bounds_ratio[k], (unsigned long long)total);
        }
        total += f->counts[RATIOS];
        fprintf(out, "%s_bucket{shadows=\"%s\",le=\"+Inf\"} %llu\n", name, f->shadows,
                (unsigned long long)total);
        fprintf(out, "%s_sum{shadows=\"%s\"} %.9g\n%s_count{shadows=\"%s\"} %llu\n", name,
                f->shadows, f->sum, name, f->shadows, (unsigned long long)total);
    }
    write_head(out, "vitrail_forecast_misses_total",
               "Frames that took over half as long again as was expected and asked for.",
               "counter");
    for (int i = 0; i < count; i++)
        fprintf(out, "vitrail_forecast_misses_total{shadows=\"%s\"} %llu\n",
                metrics->forecasts[i].shadows, (unsigned long long)metrics->forecasts[i].missed);
}

char *metrics_to_text(struct metrics *metrics, const struct metrics_gauge *gauges, size_t count)
{
    char *text = NULL;
    size_t size_bytes;
    FILE *out = open_memstream(&text, &size_bytes);
    if (!out)
        return NULL;
    pthread_mutex_lock(&metrics->mutex);
    write_requests(out, metrics);
    write_head(out, "vitrail_render_stage_duration_seconds", "Time of finished frames, by stage.",
               "histogram");
    for (int i = 0; i < STAGES; i++)
        write_histogram(out, "vitrail_render_stage_duration_seconds", "stage", frame_timing_name(i),
                        &metrics->stages[i]);
    write_forecasts(out, metrics);
    write_head(out, "vitrail_upload_bytes_total", "Bytes of scenes received.", "counter");
    fprintf(out, "vitrail_upload_bytes_total %llu\n",
            (unsigned long long)metrics->totals.upload_bytes);
    pthread_mutex_unlock(&metrics->mutex);
    for (size_t i = 0; i < count; i++) {
        if (i == 0 || strcmp(gauges[i].name, gauges[i - 1].name) != 0)
            write_head(out, gauges[i].name, gauges[i].help,
                       gauges[i].is_counter ? "counter" : "gauge");
        fprintf(out, "%s%s%s%s %.17g\n", gauges[i].name, gauges[i].labels ? "{" : "",
                gauges[i].labels ? gauges[i].labels : "", gauges[i].labels ? "}" : "",
                gauges[i].value);
    }
    if (fclose(out) != 0) {
        free(text);
        return NULL;
    }
    return text;
}

struct metrics_totals metrics_get_totals(struct metrics *metrics)
{
    pthread_mutex_lock(&metrics->mutex);
    struct metrics_totals totals = metrics->totals;
    pthread_mutex_unlock(&metrics->mutex);
    return totals;
}
