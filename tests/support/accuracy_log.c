/* SPDX-License-Identifier: MIT */
/* The log of measured errors. */
#include "tests/support/accuracy_log.h"

#include <fcntl.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static json_t *number_or_null(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

static json_t *text_or_null(const char *text)
{
    return text ? json_string(text) : json_null();
}

static char *write_line(const struct accuracy_result *r)
{
    json_t *object = json_pack(
        "{s:s, s:s, s:s, s:s, s:o, s:o, s:o, s:b, s:o, s:o}", "suite", r->suite, "scene", r->scene,
        "technique", r->technique, "metric", r->metric, "error", number_or_null(r->error),
        "tolerance", number_or_null(r->tolerance), "ms", number_or_null(r->ms), "pass", r->is_pass,
        "image", text_or_null(r->image), "difference", text_or_null(r->difference));
    char *line = object ? json_dumps(object, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL;
    size_t length = line ? strlen(line) : 0;
    char *grown = line ? realloc(line, length + 2) : NULL;
    if (grown)
        memcpy(grown + length, "\n", 2);
    else
        free(line);
    json_decref(object);
    return grown;
}

void accuracy_log(const struct accuracy_result *result)
{
    mkdir(VITRAIL_BINARY_DIR "/accuracy", 0777);
    char *line = write_line(result);
    int file = open(VITRAIL_BINARY_DIR "/accuracy/results.jsonl",
                    O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
    ssize_t length = line ? (ssize_t)strlen(line) : -1;
    /* One write: whole. */
    if (length < 0 || file < 0 || write(file, line, (size_t)length) != length)
        fprintf(stderr, "accuracy_log: '%s' of '%s' is not written\n", result->metric,
                result->scene);
    if (file >= 0)
        close(file);
    free(line);
}
