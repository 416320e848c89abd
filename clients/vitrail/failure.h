/* SPDX-License-Identifier: MIT */
/* Why a command ended: the exit code that tells scripts and farms what to do, and one sentence for
 * people. */
#ifndef VITRAIL_CLIENTS_VITRAIL_FAILURE_H
#define VITRAIL_CLIENTS_VITRAIL_FAILURE_H

#include <stdbool.h>
#include <stddef.h>

/* Documented in docs/reference/cli.md; numbers from 64 on are those of <sysexits.h>. 128 + N: ended
 * by signal N. */
enum exit_code {
    EXIT_CODE_OK = 0,
    EXIT_CODE_REFUSED = 1,      /* the scene or the render: the same call fails again */
    EXIT_CODE_USAGE = 2,        /* the command line is wrong */
    EXIT_CODE_DIFFERENT = 3,    /* compare: the images differ by more than --max-error */
    EXIT_CODE_NO_INPUT = 66,    /* an input file cannot be read */
    EXIT_CODE_UNAVAILABLE = 69, /* no server there, or the private one does not start */
    EXIT_CODE_OS_ERROR = 71,    /* this machine is out of memory, processes or descriptors */
    EXIT_CODE_CANT_CREATE = 73, /* an output file cannot be written */
    EXIT_CODE_TEMPORARY = 75,   /* load, time-out, lost worker: try again, perhaps elsewhere */
    EXIT_CODE_SIGNAL_BASE = 128,
};

enum {
    FAILURE_MESSAGE_BYTES = 1024, /* the longest of the server, and our words around it */
    FAILURE_CODE_BYTES = 64,
    FAILURE_POINTER_BYTES = 256,
};

/* Zeroed = none. Caller owns it. The first failure wins. */
struct failure {
    int exit_code;                       /* enum exit_code or EXIT_CODE_SIGNAL_BASE + signal */
    char message[FAILURE_MESSAGE_BYTES]; /* one sentence; control characters replaced */
    char code[FAILURE_CODE_BYTES];       /* the server's stable code, or "" */
    char pointer[FAILURE_POINTER_BYTES]; /* JSON pointer into the request body, or "" */
    int http_status;                     /* 0: no answer was involved */
    int retry_after_s;                   /* 0: the server did not say */
};

/* Sets exit code and sentence unless a failure is set already. Always returns false. */
bool fail(struct failure *failure, int exit_code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* fail() for an allocation that failed. Always returns false. */
bool fail_no_memory(struct failure *failure);

struct failure_reply {
    const char *task; /* required; what was asked for: "the render", "the upload of box.glb" */
    int status;       /* required; HTTP status, not 2xx */
    const char *body; /* required; problem+json or anything else; NUL not needed */
    size_t body_bytes;
    int retry_after_s; /* 0 means none */
};

/* Turns an answer that is not a success into a failure. Always returns false. */
bool fail_from_reply(struct failure *failure, const struct failure_reply *reply);

/* Prints it on stderr: one readable sentence, or with `as_json` one line holding one JSON object.
 */
void failure_print(const struct failure *failure, bool as_json);

/* Copies UTF-8 text, at most `capacity` - 1 bytes, with control characters replaced by '?': text of
 * the server or of a file must not drive the terminal. Always terminates. */
void text_copy_printable(char *out, size_t capacity, const char *text);

#endif
