/* SPDX-License-Identifier: MIT */
/* Counters and histograms, written in the Prometheus text format. Thread: any. */
#ifndef VITRAIL_SERVER_FRONT_METRICS_H
#define VITRAIL_SERVER_FRONT_METRICS_H

#include <stdint.h>

#include "protocol/error.h"
#include "protocol/frame_stats.h"
#include "server/http/http.h"

struct metrics;

struct metrics *metrics_create(struct error *err);
void metrics_destroy(struct metrics *metrics); /* accepts NULL */

/* route: the template of a route ("/v1/scenes/{id}"), static; status 0: the client left. */
void metrics_count_request(struct metrics *metrics, const char *route, enum http_method method,
                           int status, double seconds);
void metrics_count_frame(struct metrics *metrics, const struct frame_stats *stats);
void metrics_count_upload(struct metrics *metrics, uint64_t bytes);

/* One value that is kept elsewhere. */
struct metrics_gauge {
    const char *name, *help;
    bool is_counter;
    const char *labels; /* "state=\"ready\"", or NULL */
    double value;
};

/* malloc'ed text; NULL: no memory. */
char *metrics_to_text(struct metrics *metrics, const struct metrics_gauge *gauges, size_t count);

struct metrics_totals {
    uint64_t requests, upload_bytes;
};
struct metrics_totals metrics_get_totals(struct metrics *metrics);

#endif
