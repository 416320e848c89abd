/* SPDX-License-Identifier: MIT */
/* Log lines on stderr, one write each. Thread: any. */
#ifndef VITRAIL_SERVER_BASE_LOG_H
#define VITRAIL_SERVER_BASE_LOG_H

#include <stdbool.h>

enum log_level { LOG_ERROR, LOG_WARNING, LOG_INFO, LOG_DEBUG };

/* Zeroed logs errors only. Set once at start, then only read. */
struct log {
    enum log_level threshold;
    bool has_journal; /* lines start with the <N> priority that the systemd journal reads */
    const char *role; /* "front", "worker", "decoder"; static */
};

void log_init(struct log *log, const char *role, enum log_level threshold);
void log_write(const struct log *log, enum log_level level, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#endif
