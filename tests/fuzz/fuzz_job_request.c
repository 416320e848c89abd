/* SPDX-License-Identifier: MIT */
/* Any bytes: the parser of jobs refuses with a complete error, or gives a request whose canonical
 * JSON reads back as itself, with frames and file names that stay where they belong. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/job_request.h"
#include "tests/fuzz/expect.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void expect_refusal(const struct error *err)
{
    expect(err->code == ERROR_INVALID_REQUEST || err->code == ERROR_UNSUPPORTED ||
           err->code == ERROR_NOT_FOUND || err->code == ERROR_TOO_LARGE);
    expect_complete(err);
}

static void expect_safe_files(struct job_request *request)
{
    char name[JOB_FILE_BYTES];
    struct error err = {0};
    for (int i = 0; i < request->output_count; i++)
        if (request->outputs[i].format == REQUEST_FORMAT_ANY)
            request->outputs[i].format = REQUEST_FORMAT_EXR;
    if (!job_request_name_files(request, &err)) {
        expect_refusal(&err);
        return;
    }
    for (int i = 0; i < request->output_count; i++) {
        job_file_name(&request->outputs[i], FRAME_NUMBER_MAX, name);
        expect(name[0] && name[0] != '.' && !strchr(name, '/') && !strchr(name, '%'));
    }
    expect(request->directory[0] != '/' && request->directory[0] != '.' &&
           !strstr(request->directory, "/."));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct job_request request, again;
    struct error err = {0};
    if (!job_request_parse((const char *)data, size, &request, &err)) {
        expect_refusal(&err);
        return 0;
    }
    expect(err.code == ERROR_NONE);
    expect(request.frames.count > 0 && request.frames.count <= LIMIT_JOB_FRAMES);
    expect(request.output_count > 0 && request.attempts > 0);
    json_t *first = job_request_to_json(&request);
    char *text = json_dumps(first, JSON_COMPACT | JSON_REAL_PRECISION(17));
    expect(text && job_request_parse(text, strlen(text), &again, &err));
    json_t *second = job_request_to_json(&again);
    char *text_again = json_dumps(second, JSON_COMPACT | JSON_REAL_PRECISION(17));
    expect(text_again && strcmp(text, text_again) == 0);
    expect_safe_files(&request);
    json_decref(first);
    json_decref(second);
    free(text);
    free(text_again);
    job_request_finish(&request);
    job_request_finish(&again);
    return 0;
}
