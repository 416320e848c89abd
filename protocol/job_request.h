/* SPDX-License-Identifier: MIT */
/* The body of POST /v1/jobs: a view of a scene, a list of frames, and the files to make of each.
 * Thread: any. The manual for clients is docs/reference/jobs.md. */
#ifndef VITRAIL_PROTOCOL_JOB_REQUEST_H
#define VITRAIL_PROTOCOL_JOB_REQUEST_H

#include <jansson.h>
#include <stdbool.h>

#include "protocol/camera_path.h"
#include "protocol/error.h"
#include "protocol/frame_list.h"
#include "protocol/limits.h"
#include "protocol/picture_tiles.h"
#include "protocol/render_request.h"

enum {
    JOB_ID_BYTES = 17, /* 16 hexadecimal digits */
    JOB_NAME_BYTES = 256,
    JOB_OUTPUT_NAME_BYTES = 64,
    JOB_FILE_BYTES = 256,
    JOB_DIRECTORY_BYTES = 1024,
    JOB_PRIORITY_MAX = 100,
    JOB_ATTEMPTS_MAX = 10,
};

/* What a job does where one that it waits for fails, is cancelled or is not there any more. */
enum job_after_failure {
    JOB_AFTER_FAILURE_CANCEL, /* it is cancelled, too */
    JOB_AFTER_FAILURE_RUN,    /* it goes on as if that one were done */
    JOB_AFTER_FAILURE_WAIT,   /* it waits until that one is tried again and done */
    JOB_AFTER_FAILURE_COUNT
};

/* One file of each frame. */
struct job_output {
    char name[JOB_OUTPUT_NAME_BYTES]; /* of letters, digits, '_', '-' and '.'; unique in the job */
    char file[JOB_FILE_BYTES];        /* its name, "beauty.%04d.exr"; "": not named yet */
    uint32_t outputs;                 /* bit set of 1u << enum request_output */
    enum request_format format;       /* ANY: the server's choice */
    int quality_percent;              /* of JPEG and WebP; 0 = 90 */
};

/* A camera that goes round the scene once over the list of frames. */
struct job_turntable {
    bool is_given;
    double elevation_deg; /* [-89, 89]; default 20 */
    double turns;         /* [-100, 100], counter-clockwise from above; default 1 */
};

/* Made by job_request_parse. */
struct job_request {
    char name[JOB_NAME_BYTES];    /* "": none */
    struct render_request render; /* scene and view */
    char frames_text[FRAME_LIST_TEXT_BYTES];
    struct frame_list frames;
    double frame_rate; /* frames per second of the animation, [0.001, 1000]; default 24 */
    bool is_still;     /* the animation's time is the same in each frame */
    struct job_turntable turntable;
    struct camera_path camera_path; /* not beside a turntable */
    /* The largest tile of the pictures, [LIMIT_TILE_SIDE_LEAST_PX, LIMIT_IMAGE_SIDE_PX]; 0: each is
     * rendered in one piece. */
    int tile_width, tile_height;
    struct job_output outputs[LIMIT_OUTPUTS];
    int output_count;
    int priority;        /* [0, 100], higher is sooner; default 50 */
    int attempts;        /* of a frame, [1, 10]; default 3 */
    int frame_timeout_s; /* [1, 86400]; 0: that of the configuration */
    bool is_paused;
    char directory[JOB_DIRECTORY_BYTES]; /* below the one that the configuration allows; "": the
                                            state directory */
    char after[LIMIT_JOB_AFTER][JOB_ID_BYTES]; /* jobs that end before it begins, each once */
    int after_count;
    enum job_after_failure after_failure;
};

/* Reads and checks one JSON text; on failure the request is zeroed and err names the member. */
MUST_CHECK bool job_request_parse(const char *json, size_t length, struct job_request *request,
                                  struct error *err);
void job_request_finish(struct job_request *request); /* accepts zeroed; zeroes */

/* Every member in canonical form; parsing its text gives the same request. New reference; NULL: no
 * memory. */
MUST_CHECK json_t *job_request_to_json(const struct job_request *request);

/* Names the files that are not named, once every output has a format. ERROR_INVALID_REQUEST where
 * two outputs would have the same file. */
MUST_CHECK bool job_request_name_files(struct job_request *request, struct error *err);

/* How its pictures are cut; zeroed: not at all. */
struct picture_tiles job_request_tiles(const struct job_request *request);

/* The file of a frame: the pattern with its number. */
void job_file_name(const struct job_output *output, int frame, char name[JOB_FILE_BYTES]);

#endif
