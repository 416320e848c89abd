/* SPDX-License-Identifier: MIT */
/* One error type for the whole program: a code, a sentence for the client, and where it was. */
#ifndef VITRAIL_PROTOCOL_ERROR_H
#define VITRAIL_PROTOCOL_ERROR_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Whose fault it is follows from the HTTP status in the table of error.c: 4xx the caller, 503/504
 * load, 500 us. */
enum error_code {
    ERROR_NONE = 0,
    ERROR_INVALID_REQUEST,        /* 400: syntax, type, range or unknown field of a request */
    ERROR_NOT_FOUND,              /* 404: no such route, scene, frame, node, material ... */
    ERROR_METHOD_NOT_ALLOWED,     /* 405 */
    ERROR_NOT_ACCEPTABLE,         /* 406: none of the accepted formats can be produced */
    ERROR_CONFLICT,               /* 409 */
    ERROR_PRECONDITION_FAILED,    /* 412: If-Match names another revision */
    ERROR_TOO_LARGE,              /* 413: over a named limit */
    ERROR_UNSUPPORTED_MEDIA_TYPE, /* 415 */
    ERROR_RANGE,                  /* 416: the Range header asks for bytes that are not there */
    ERROR_INVALID_SCENE,          /* 422: the scene is broken; names file, element and limit */
    ERROR_INVALID_ENVIRONMENT,    /* 422: the environment map is broken; names texel and limit */
    ERROR_UNSUPPORTED,            /* 422: valid, but this build or device cannot do it */
    ERROR_TOO_MANY_REQUESTS,      /* 429 */
    ERROR_INTERNAL,               /* 500: our fault */
    ERROR_RENDER_FAILED,          /* 500: the worker died or overran on this request, twice */
    ERROR_IO,                     /* 500: a file of the state directory failed to read or write */
    ERROR_OVERLOADED,             /* 503: queue full or draining */
    ERROR_INTERRUPTED,            /* 503: the server ended before the work did */
    ERROR_NO_DEVICE,              /* 503: no usable GL device, or its self-test failed */
    ERROR_NO_MEMORY,              /* 503: an allocation failed */
    ERROR_TIMEOUT,                /* 504: the deadline passed */
    ERROR_OVER_BUDGET,            /* 507: exact result needs more memory than the budget allows */
    ERROR_CODE_COUNT
};

enum { ERROR_MESSAGE_BYTES = 640, ERROR_POINTER_BYTES = 128 };

/* Zeroed = no error. Caller owns it. The first error wins; error_wrap adds context in front. Texts
 * are always NUL-terminated. */
struct error {
    enum error_code code;
    char message[ERROR_MESSAGE_BYTES]; /* for the client: what, where, which limit; UTF-8 */
    char pointer[ERROR_POINTER_BYTES]; /* RFC 6901 JSON pointer into the request body, or "" */
};

#define MUST_CHECK __attribute__((warn_unused_result))

/* Sets code and message unless err already holds an error; err may be NULL. Always returns false,
 * so that `return error_set(...)` reads well. Truncates long messages at a UTF-8 boundary. */
bool error_set(struct error *err, enum error_code code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* As error_set, and also records the JSON pointer of the offending member. */
bool error_set_at(struct error *err, enum error_code code, const char *pointer, const char *format,
                  ...) __attribute__((format(printf, 4, 5)));

/* As error_set, with code and message of another error, which is set. */
bool error_pass(struct error *err, const struct error *other);

/* Puts "context: " in front of the message of a set error. Always returns false. */
bool error_wrap(struct error *err, const char *format, ...) __attribute__((format(printf, 2, 3)));

#ifdef __clang_analyzer__ /* looks at one file at a time: tell it what error.c always returns */
#define error_set(...) (error_set(__VA_ARGS__), false)
#define error_set_at(...) (error_set_at(__VA_ARGS__), false)
#define error_pass(...) (error_pass(__VA_ARGS__), false)
#define error_wrap(...) (error_wrap(__VA_ARGS__), false)
#endif

const char *error_code_name(enum error_code code);  /* e.g. "invalid_scene"; never NULL */
int error_code_http_status(enum error_code code);   /* e.g. 422 */
const char *error_code_title(enum error_code code); /* short human title for problem+json */
enum error_code error_code_from_name(const char *wire_name); /* ERROR_INTERNAL when unknown */

#ifdef __cplusplus
}
#endif
#endif
