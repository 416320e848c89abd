/* SPDX-License-Identifier: MIT */
/* Failures: from problem+json (RFC 9457) or our own words to an exit code and one printed sentence.
 */
#include "clients/vitrail/failure.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <jansson.h>

#include "protocol/error.h"

/* Length of the UTF-8 sequence at `text` if it is a control character (C0, DEL or C1), else 0. */
static size_t control_length(const unsigned char *text)
{
    if (text[0] < 0x20 || text[0] == 0x7f)
        return 1;
    if (text[0] == 0xc2 && text[1] >= 0x80 && text[1] <= 0x9f)
        return 2;
    return 0;
}

void text_copy_printable(char *out, size_t capacity, const char *text)
{
    size_t used = 0;
    const unsigned char *in = (const unsigned char *)text;

    while (*in && used + 1 < capacity) {
        size_t control = control_length(in);
        out[used++] = control ? '?' : (char)*in;
        in += control ? control : 1;
    }
    if (*in) /* cut: drop a sequence that lost its tail */
        while (used > 0 && ((unsigned char)out[used - 1] & 0x80))
            used--;
    out[used] = '\0';
}

bool fail(struct failure *failure, int exit_code, const char *format, ...)
{
    char text[FAILURE_MESSAGE_BYTES];
    va_list arguments;

    if (failure->exit_code)
        return false;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    failure->exit_code = exit_code;
    text_copy_printable(failure->message, sizeof failure->message, text);
    return false;
}

bool fail_no_memory(struct failure *failure)
{
    return fail(failure, EXIT_CODE_OS_ERROR, "out of memory");
}

/* What the caller should do follows from the server's code where it has one, else from the status.
 */
static int exit_code_for(int status, const char *code)
{
    if (!strcmp(code, error_code_name(ERROR_RENDER_FAILED)) ||
        !strcmp(code, error_code_name(ERROR_IO)))
        return EXIT_CODE_TEMPORARY; /* a lost worker or a full disk there: another machine may do it
                                     */
    switch (status) {
    case 408:
    case 425:
    case 429:
    case 502:
    case 503:
    case 504:
        return EXIT_CODE_TEMPORARY;
    default:
        return EXIT_CODE_REFUSED;
    }
}

static const char *member_string(const json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    return text ? text : "";
}

bool fail_from_reply(struct failure *failure, const struct failure_reply *reply)
{
    json_t *problem = json_loadb(reply->body, reply->body_bytes, 0, NULL);
    const json_t *first = json_array_get(json_object_get(problem, "errors"), 0);
    const char *code = member_string(problem, "code");
    const char *pointer = member_string(problem, "pointer");
    const char *detail = member_string(problem, "detail");

    if (failure->exit_code) {
        json_decref(problem);
        return false;
    }
    if (!*pointer)
        pointer = member_string(first, "pointer");
    if (!*detail)
        detail = member_string(first, "detail");
    if (!*detail)
        detail = member_string(problem, "title");
    if (*detail)
        fail(failure, exit_code_for(reply->status, code), "%s %s: %s", reply->task,
             exit_code_for(reply->status, code) == EXIT_CODE_TEMPORARY ? "failed for now"
                                                                       : "was refused",
             detail);
    else
        fail(failure, exit_code_for(reply->status, code),
             "%s was answered with HTTP status %d and no reason; is this a vitrail server?",
             reply->task, reply->status);
    text_copy_printable(failure->code, sizeof failure->code, code);
    text_copy_printable(failure->pointer, sizeof failure->pointer, pointer);
    failure->http_status = reply->status;
    failure->retry_after_s = reply->retry_after_s;
    json_decref(problem);
    return false;
}

static void print_json(const struct failure *failure)
{
    json_t *object =
        json_pack("{s:i, s:s}", "exit_code", failure->exit_code, "detail", failure->message);

    if (object && failure->code[0])
        json_object_set_new(object, "code", json_string(failure->code));
    if (object && failure->pointer[0])
        json_object_set_new(object, "pointer", json_string(failure->pointer));
    if (object && failure->http_status)
        json_object_set_new(object, "status", json_integer(failure->http_status));
    if (object && failure->retry_after_s)
        json_object_set_new(object, "retry_after_s", json_integer(failure->retry_after_s));
    if (!object || json_dumpf(object, stderr, JSON_COMPACT) != 0)
        fprintf(stderr, "{\"exit_code\":%d}", failure->exit_code);
    fputc('\n', stderr);
    json_decref(object);
}

void failure_print(const struct failure *failure, bool as_json)
{
    if (as_json) {
        print_json(failure);
        return;
    }
    fprintf(stderr, "vitrail: %s", failure->message);
    if (failure->code[0] && failure->pointer[0])
        fprintf(stderr, " (%s at %s)", failure->code, failure->pointer);
    else if (failure->code[0])
        fprintf(stderr, " (%s)", failure->code);
    if (failure->retry_after_s)
        fprintf(stderr, "; try again in %d s", failure->retry_after_s);
    fputc('\n', stderr);
}
