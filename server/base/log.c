/* SPDX-License-Identifier: MIT */
/* Log lines: time, level, role, text; control characters of untrusted text are replaced. */
#include "server/base/log.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

enum { LINE_BYTES = 1024 };

void log_init(struct log *log, const char *role, enum log_level threshold)
{
    *log = (struct log){
        .threshold = threshold, .has_journal = getenv("JOURNAL_STREAM") != NULL, .role = role};
}

static int write_prefix(const struct log *log, enum log_level level, char *line)
{
    static const char *const names[] = {"error", "warning", "info", "debug"};
    static const int priorities[] = {3, 4, 6, 7};
    if (log->has_journal)
        return snprintf(line, LINE_BYTES, "<%d>%s: ", priorities[level], log->role);
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    struct tm utc;
    gmtime_r(&now.tv_sec, &utc);
    char when[32];
    strftime(when, sizeof when, "%Y-%m-%dT%H:%M:%S", &utc);
    return snprintf(line, LINE_BYTES, "%s.%03ldZ %s %s: ", when, now.tv_nsec / 1000000,
                    names[level], log->role);
}

void log_write(const struct log *log, enum log_level level, const char *format, ...)
{
    if (level > log->threshold)
        return;
    char line[LINE_BYTES + 1];
    int used = write_prefix(log, level, line);
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(line + used, (size_t)(LINE_BYTES - used), format, arguments);
    va_end(arguments);
    int end = length < LINE_BYTES - used ? used + length : LINE_BYTES - 1;
    for (int i = used; i < end; i++)
        if ((unsigned char)line[i] < 0x20 || line[i] == 0x7f)
            line[i] = '?';
    line[end] = '\n';
    ssize_t ignored = write(STDERR_FILENO, line, (size_t)end + 1);
    (void)ignored; /* nowhere left to say it */
}
