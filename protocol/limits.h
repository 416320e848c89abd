/* SPDX-License-Identifier: MIT */
/* Every cap on what a client can make grow, by name, with its reason. */
#ifndef VITRAIL_PROTOCOL_LIMITS_H
#define VITRAIL_PROTOCOL_LIMITS_H

/* Error of a transmittance in a compressed list; below, quantised images show nothing of it. */
#define LIMIT_COMPRESSION_LEAST 0.001
#define LIMIT_COMPRESSION_MOST 0.5

enum limits {
    LIMIT_IMAGE_SIDE_PX = 16384,            /* GL_MAX_TEXTURE_SIZE of the reference device */
    LIMIT_PICTURE_SIDE_PX = 65536,          /* of a picture in tiles: pixels stay exact in f32 */
    LIMIT_SHADOW_RESOLUTION = 16384,        /* texels per side; same reason */
    LIMIT_REQUEST_JSON_BYTES = 32 << 20,    /* holds 65,536 lights written out in full */
    LIMIT_CANONICAL_JSON_BYTES = 256 << 20, /* such a body with all written out */
    LIMIT_REQUEST_LIGHTS = 65536,           /* a city at night; fits the JSON limit above */
    LIMIT_REQUEST_OVERRIDES = 65536, /* nodes, materials or grids overridden in one request */
    LIMIT_PARTS = 256,               /* other scenes in one request */
    LIMIT_PART_SCENES = 16,          /* different ones: each an open file of a message */
    LIMIT_PART_NAME_BYTES = 256,
    LIMIT_CLIP_PLANES = 8,            /* GL_MAX_CLIP_DISTANCES is at least 8 */
    LIMIT_NAME_BYTES = 1024,          /* node, material, camera names in requests */
    LIMIT_UPLOAD_FILES = 1024,        /* parts of one multipart upload */
    LIMIT_FILE_NAME_BYTES = 512,      /* relative path of one uploaded file */
    LIMIT_JSON_DEPTH = 32,            /* nesting of a request body */
    LIMIT_JSON_CONTAINERS = 1 << 20,  /* in a body: 786,440 hold every list above at its cap */
    LIMIT_JSON_VALUES = 6 << 20,      /* in a body: 4.6 Mi hold the same; some 32 bytes each */
    LIMIT_AREA_SAMPLES = 4096,        /* per area light and point: errors below 1e-3 */
    LIMIT_ENVIRONMENT_SAMPLES = 4096, /* towards an environment map per point; same reason */
    LIMIT_ATMOSPHERE_SAMPLES = 4096,  /* slices of haze on the way of a pixel; same reason */
    LIMIT_REFRACTION_SAMPLES = 4096,  /* behind a rough surface per sample; same reason */
    LIMIT_OUTPUTS = 11,               /* outputs of one render */
    LIMIT_FRAMES_KEPT = 1024,         /* frame reports kept for /v1/frames/{id} */
    LIMIT_TRADEOFFS_KEPT = 128,       /* with their rows, some 90 KiB of memory each */
    LIMIT_TRADEOFFS_WAITING = 16,     /* each may take an hour; more are a 503 */
    LIMIT_JOBS_KEPT = 4096,           /* some 16 KiB of memory each, without their frames */
    LIMIT_JOB_FRAMES = 100000,        /* of one job: more than an hour of film at 24 a second */
    LIMIT_JOB_FRAMES_KEPT = 1000000,  /* of all jobs, some 150 bytes of memory each */
    LIMIT_TILE_SIDE_LEAST_PX = 256,   /* of a job: smaller ones cost more than they save */
    LIMIT_PICTURE_TILES = 16384,      /* of a picture of a job, two bytes of memory each */
    LIMIT_CAMERA_KEYS = 10000,        /* of a path, 0.1 KiB of memory each: one every 10 frames */
    LIMIT_JOB_AFTER = 16,             /* jobs that one waits for: a shot and its passes */
    LIMIT_SHADOW_TAPS = 64,           /* texels that a lookup averages: 8 x 8 */
    LIMIT_PREFILTER = 4, /* rays per side of a shadow texel: 16 lists stay in registers */
    LIMIT_TRADEOFF_PIXELS = 9 << 20, /* 4096x2160: the reference takes 16 bytes of each */
    LIMIT_QUEUE_DEPTH = 256,         /* renders waiting for a worker; more are a 503 */
};

enum view_limits {
    LIMIT_VIEW_WATCHERS = 64,             /* streams, events and sockets of one view */
    LIMIT_VIEW_IMAGES_KEPT = 64,          /* encoded images of views, each an open file */
    LIMIT_PICK_PIXELS = 1 << 20,          /* rays of one rectangle: about a second of one core */
    LIMIT_SOCKET_MESSAGE_BYTES = 1 << 20, /* a message of a WebSocket client */
};
#define LIMIT_VIEWS_BYTES (1ull << 30)       /* JSON of all views together */
#define LIMIT_VIEW_IMAGES_BYTES (256u << 20) /* of the encoded images kept */

#define LIMIT_UPLOAD_BYTES (2ull << 30)      /* default of --max-upload-bytes: all files of one */
#define LIMIT_SCENE_BLOB_BYTES (32ull << 30) /* decoded: an upload of JPEG, 16 times as large */
#define LIMIT_COORDINATE 1e12                /* metres; beyond it even f64 loses the millimetre */
#define LIMIT_PATH_MOMENT 1e9                /* frames or seconds; farther than any frame */
#define LIMIT_LIGHT_SIZE_MIN 1e-9            /* metres; a side or radius of an area light */
#define LIMIT_LIGHT_SIZE_MAX 1e9
#define LIMIT_LINE_PX_MIN 0.5           /* width of edges and outlines; thinner ones flicker */
#define LIMIT_LINE_PX_MAX 32            /* each pixel of an outline looks as far as that */
#define LIMIT_ENVIRONMENT_INTENSITY 1e6 /* factor on a map of up to 1e10 nt: below 1e17 */
#define LIMIT_INTENSITY 1e12            /* cd, lx or nt; keeps every product inside f32 */
#define LIMIT_HAZE_DENSITY 1e6          /* 1/m; a micrometre of it dims to 1/e */
#define LIMIT_HAZE_ANISOTROPY 0.95      /* beyond it the peak is narrower than steps find */
#define LIMIT_HAZE_FALLOFF 1e9          /* metres; over any scene even */
#define LIMIT_GRID_FACTOR 1e12          /* density and extinction of grids: as in files */
#define LIMIT_GRID_ANISOTROPY 0.999     /* of grids: as in files */

#endif
