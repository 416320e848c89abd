/* SPDX-License-Identifier: MIT */
/* The one table from error code to wire name, HTTP status and title, and how messages are made. */
#undef __clang_analyzer__ /* what error.h tells the analyzer is defined here */
#include "protocol/error.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "protocol/utf8.h"

struct code_info {
    const char *name;
    const char *title;
    int http_status;
};

static const struct code_info code_table[ERROR_CODE_COUNT] = {
    [ERROR_NONE] = {"none", "No error", 200},
    [ERROR_INVALID_REQUEST] = {"invalid_request", "The request is not valid", 400},
    [ERROR_NOT_FOUND] = {"not_found", "There is no such thing", 404},
    [ERROR_METHOD_NOT_ALLOWED] = {"method_not_allowed", "The route does not take this method", 405},
    [ERROR_NOT_ACCEPTABLE] = {"not_acceptable", "None of the accepted formats can be made", 406},
    [ERROR_CONFLICT] = {"conflict", "The request conflicts with the present state", 409},
    [ERROR_PRECONDITION_FAILED] = {"precondition_failed", "The view has changed meanwhile", 412},
    [ERROR_TOO_LARGE] = {"too_large", "The request is over a limit", 413},
    [ERROR_UNSUPPORTED_MEDIA_TYPE] = {"unsupported_media_type", "This media type is not taken",
                                      415},
    [ERROR_RANGE] = {"range_not_satisfiable", "The range is outside of the file", 416},
    [ERROR_INVALID_SCENE] = {"invalid_scene", "The scene is broken", 422},
    [ERROR_INVALID_ENVIRONMENT] = {"invalid_environment", "The environment map is broken", 422},
    [ERROR_UNSUPPORTED] = {"unsupported", "This build or device cannot do that", 422},
    [ERROR_TOO_MANY_REQUESTS] = {"too_many_requests", "Too many requests", 429},
    [ERROR_INTERNAL] = {"internal", "Something went wrong on our side", 500},
    [ERROR_RENDER_FAILED] = {"render_failed", "The render failed, twice", 500},
    [ERROR_IO] = {"io", "A file of the service could not be read or written", 500},
    [ERROR_OVERLOADED] = {"overloaded", "The service is busy or draining", 503},
    [ERROR_INTERRUPTED] = {"interrupted", "The server ended before the work did", 503},
    [ERROR_NO_DEVICE] = {"no_device", "There is no usable graphics device", 503},
    [ERROR_NO_MEMORY] = {"no_memory", "There is not enough memory", 503},
    [ERROR_TIMEOUT] = {"timeout", "The deadline passed", 504},
    [ERROR_OVER_BUDGET] = {"over_budget", "The memory budget is too small for this", 507},
};

static void message_print(char *message, const char *format, va_list args)
{
    int length = vsnprintf(message, ERROR_MESSAGE_BYTES, format, args);
    if (length < 0)
        message[0] = '\0';
    utf8_sanitize(message, length >= ERROR_MESSAGE_BYTES);
}

/* A pointer that does not fit keeps its leading members: it names an enclosing object, never a
 * wrong one. */
static void pointer_copy(char *pointer, const char *source)
{
    size_t length = strlen(source);
    if (length >= ERROR_POINTER_BYTES) {
        length = ERROR_POINTER_BYTES - 1;
        while (length > 0 && source[length] != '/')
            length--;
    }
    memcpy(pointer, source, length);
    pointer[length] = '\0';
    utf8_sanitize(pointer, false);
}

bool error_set(struct error *err, enum error_code code, const char *format, ...)
{
    if (!err || err->code != ERROR_NONE)
        return false;
    va_list args;
    va_start(args, format);
    message_print(err->message, format, args);
    va_end(args);
    err->code = code;
    err->pointer[0] = '\0';
    return false;
}

bool error_set_at(struct error *err, enum error_code code, const char *pointer, const char *format,
                  ...)
{
    if (!err || err->code != ERROR_NONE)
        return false;
    va_list args;
    va_start(args, format);
    message_print(err->message, format, args);
    va_end(args);
    err->code = code;
    pointer_copy(err->pointer, pointer);
    return false;
}

bool error_pass(struct error *err, const struct error *other)
{
    return error_set(err, other->code, "%s", other->message);
}

bool error_wrap(struct error *err, const char *format, ...)
{
    if (!err || err->code == ERROR_NONE)
        return false;
    char inner[ERROR_MESSAGE_BYTES];
    memcpy(inner, err->message, sizeof inner);
    va_list args;
    va_start(args, format);
    message_print(err->message, format, args);
    va_end(args);

    /* Context may take at most half, so that the cause is never pushed out. */
    enum { CONTEXT_MAX = ERROR_MESSAGE_BYTES / 2 };
    size_t length = utf8_prefix_bytes(err->message, CONTEXT_MAX);
    int written = snprintf(err->message + length, sizeof err->message - length, ": %s", inner);
    utf8_sanitize(err->message, written >= (int)(sizeof err->message - length));
    return false;
}

static const struct code_info *code_find(enum error_code code)
{
    return (unsigned)code < ERROR_CODE_COUNT ? &code_table[code] : &code_table[ERROR_INTERNAL];
}

const char *error_code_name(enum error_code code)
{
    return code_find(code)->name;
}

int error_code_http_status(enum error_code code)
{
    return code_find(code)->http_status;
}

const char *error_code_title(enum error_code code)
{
    return code_find(code)->title;
}

enum error_code error_code_from_name(const char *wire_name)
{
    for (int code = 0; wire_name && code < ERROR_CODE_COUNT; code++)
        if (strcmp(code_table[code].name, wire_name) == 0)
            return (enum error_code)code;
    return ERROR_INTERNAL;
}
