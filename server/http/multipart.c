/* SPDX-License-Identifier: MIT */
/* multipart/form-data as a state machine over single bytes, with the boundary matched by a small
 * automaton. */
#include "server/http/multipart.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum {
    BOUNDARY_BYTES = 70, /* RFC 2046 5.1.1 */
    /* Room for the longest file name, every byte escaped, in name and in filename. */
    HEADER_LINE_BYTES = 4096,
    HEADER_LINES_MAX = 16,
    NAME_BYTES = 1600, /* longer names are cut here and refused by the upload, whose limit is 512 */
};

enum state {
    STATE_PREAMBLE,       /* before the first boundary */
    STATE_AFTER_BOUNDARY, /* a boundary was matched: CRLF opens a part, "--" closes the body */
    STATE_HEADERS,
    STATE_DATA,
    STATE_EPILOGUE,
};

struct multipart {
    struct multipart_events events;
    enum state state;
    char delimiter[BOUNDARY_BYTES + 5]; /* CRLF--boundary */
    size_t delimiter_length;
    size_t fail[BOUNDARY_BYTES + 5]; /* Knuth, Morris, Pratt 1977: longest border of each prefix */
    size_t matched;                  /* bytes of the delimiter matched so far */
    size_t borrowed; /* how many of those belong to the header before, not to the data */
    char line[HEADER_LINE_BYTES];
    size_t line_length;
    int line_count;
    bool has_disposition;
    char name[NAME_BYTES], filename[NAME_BYTES];
    char tail[2]; /* the two bytes after a boundary */
    size_t tail_length;
};

/* Copies the value of `key=` from a header's parameters; quoted strings keep their semicolons.
 * Backslash escapes a quote (curl), %22 %0D %0A stand for what they encode (browsers,
 * HTML 4.10.21.8); all else is literal. */
static bool parameter_get(const char *text, const char *key, char *value, size_t capacity)
{
    size_t key_length = strlen(key);
    const char *at = strchr(text, ';');
    while (at) {
        at++;
        while (*at == ' ' || *at == '\t')
            at++;
        bool is_it = strncasecmp(at, key, key_length) == 0 && at[key_length] == '=';
        const char *from = strpbrk(at, "=;");
        if (!from || *from == ';') {
            at = from;
            continue;
        }
        from++;
        bool is_quoted = *from == '"';
        from += is_quoted;
        size_t length = 0;
        for (; *from && !(is_quoted ? *from == '"' : *from == ';' || *from == ' '); from++) {
            char byte = *from;
            if (is_quoted && byte == '\\' && (from[1] == '"' || from[1] == '\\'))
                byte = *++from;
            else if (is_quoted &&
                     (strncasecmp(from, "%22", 3) == 0 || strncasecmp(from, "%0D", 3) == 0 ||
                      strncasecmp(from, "%0A", 3) == 0)) {
                byte = from[1] == '2' ? '"' : tolower((unsigned char)from[2]) == 'd' ? '\r' : '\n';
                from += 2;
            }
            if (is_it && length + 1 < capacity)
                value[length++] = byte;
        }
        if (is_it) {
            value[length] = '\0';
            return true;
        }
        at = strchr(from, ';');
    }
    return false;
}

static void prepare_delimiter(struct multipart *multipart, const char *boundary)
{
    multipart->delimiter_length = strlen(boundary) + 4;
    memcpy(multipart->delimiter, "\r\n--", 4);
    memcpy(multipart->delimiter + 4, boundary, strlen(boundary) + 1);
    size_t border = 0;
    for (size_t i = 1; i < multipart->delimiter_length; i++) {
        while (border > 0 && multipart->delimiter[i] != multipart->delimiter[border])
            border = multipart->fail[border - 1];
        border += multipart->delimiter[i] == multipart->delimiter[border];
        multipart->fail[i] = border;
    }
    multipart->matched = 2; /* the first boundary needs no CRLF before it */
}

struct multipart *multipart_create(const char *content_type, const struct multipart_events *events,
                                   struct error *err)
{
    char boundary[BOUNDARY_BYTES + 2];
    if (!parameter_get(content_type, "boundary", boundary, sizeof boundary) || !boundary[0]) {
        error_set(err, ERROR_INVALID_REQUEST,
                  "Content-Type: multipart/form-data without a boundary");
        return NULL;
    }
    if (strlen(boundary) > BOUNDARY_BYTES || strpbrk(boundary, "\r\n")) {
        error_set(err, ERROR_INVALID_REQUEST,
                  "Content-Type: a boundary has at most %d characters on one line", BOUNDARY_BYTES);
        return NULL;
    }
    struct multipart *multipart = calloc(1, sizeof *multipart);
    if (!multipart) {
        error_set(err, ERROR_NO_MEMORY, "multipart parser");
        return NULL;
    }
    multipart->events = *events;
    prepare_delimiter(multipart, boundary);
    return multipart;
}

void multipart_destroy(struct multipart *multipart)
{
    free(multipart);
}

static bool header_line(struct multipart *multipart, struct error *err)
{
    multipart->line[multipart->line_length] = '\0';
    if (strlen(multipart->line) != multipart->line_length)
        return error_set(err, ERROR_INVALID_REQUEST, "multipart: NUL in the header of a part");
    if (++multipart->line_count > HEADER_LINES_MAX)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "multipart: a part has more than %d header lines", HEADER_LINES_MAX);
    if (strncasecmp(multipart->line, "Content-Disposition:", 20) != 0)
        return true;
    if (multipart->has_disposition)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "multipart: a part has two Content-Disposition headers");
    multipart->has_disposition = true;
    const char *value = multipart->line + 20;
    value += strspn(value, " \t");
    if (strncasecmp(value, "form-data", 9) != 0)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "multipart: Content-Disposition is not form-data");
    if (!parameter_get(value, "name", multipart->name, sizeof multipart->name))
        multipart->name[0] = '\0';
    if (!parameter_get(value, "filename", multipart->filename, sizeof multipart->filename))
        multipart->filename[0] = '\0';
    return true;
}

/* One byte of a part's header. */
static bool header_byte(struct multipart *multipart, char byte, struct error *err)
{
    if (byte != '\n') {
        if (multipart->line_length + 1 >= sizeof multipart->line)
            return error_set(err, ERROR_INVALID_REQUEST, "multipart: header line over %d bytes",
                             HEADER_LINE_BYTES - 1);
        multipart->line[multipart->line_length++] = byte;
        return true;
    }
    if (multipart->line_length == 0 || multipart->line[multipart->line_length - 1] != '\r')
        return error_set(err, ERROR_INVALID_REQUEST, "multipart: header line does not end in CRLF");
    multipart->line_length--;
    if (multipart->line_length > 0) {
        bool is_good = header_line(multipart, err);
        multipart->line_length = 0;
        return is_good;
    }
    if (!multipart->has_disposition)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "multipart: a part has no Content-Disposition");
    multipart->state = STATE_DATA;
    /* An empty part may close with the CRLF of its header. */
    multipart->matched = multipart->borrowed = 2;
    return multipart->events.begin_part(
        multipart->events.context, &(struct multipart_part){multipart->name, multipart->filename},
        err);
}

static void headers_begin(struct multipart *multipart)
{
    multipart->state = STATE_HEADERS;
    multipart->line_length = 0;
    multipart->line_count = 0;
    multipart->has_disposition = false;
}

/* The bytes behind a boundary: "--" ends the body, CRLF (after optional blanks) begins a part. */
static bool tail_byte(struct multipart *multipart, char byte, struct error *err)
{
    if (multipart->tail_length == 0 && (byte == ' ' || byte == '\t'))
        return true;
    multipart->tail[multipart->tail_length++] = byte;
    if (multipart->tail_length < 2)
        return true;
    multipart->tail_length = 0;
    if (memcmp(multipart->tail, "--", 2) == 0)
        multipart->state = STATE_EPILOGUE;
    else if (memcmp(multipart->tail, "\r\n", 2) == 0)
        headers_begin(multipart);
    else
        return error_set(err, ERROR_INVALID_REQUEST,
                         "multipart: a boundary is followed by neither CRLF nor \"--\"");
    return true;
}

/* Gives out all bytes seen except those that still match: first the held ones, which equal the
 * delimiter's start, then those of this piece. The borrowed ones are the oldest and are no data. */
static bool give_data(struct multipart *multipart, size_t held, const char *piece,
                      size_t piece_length, struct error *err)
{
    size_t out = held + piece_length - multipart->matched;
    size_t skip = multipart->borrowed < out ? multipart->borrowed : out;
    multipart->borrowed -= skip;
    if (skip < held && skip < out) {
        size_t end = out < held ? out : held;
        if (!multipart->events.data(multipart->events.context, multipart->delimiter + skip,
                                    end - skip, err))
            return false;
    }
    size_t from = skip > held ? skip - held : 0;
    size_t to = out > held ? out - held : 0;
    return to <= from ||
           multipart->events.data(multipart->events.context, piece + from, to - from, err);
}

/* Searches for the delimiter from *at on; passes what precedes it to the part. Leaves *at behind
 * what was used. */
static bool scan_data(struct multipart *multipart, const char *bytes, size_t size_bytes, size_t *at,
                      struct error *err)
{
    size_t start = *at, held = multipart->matched, i = start;
    while (i < size_bytes && multipart->matched < multipart->delimiter_length) {
        while (multipart->matched > 0 && bytes[i] != multipart->delimiter[multipart->matched])
            multipart->matched = multipart->fail[multipart->matched - 1];
        multipart->matched += bytes[i] == multipart->delimiter[multipart->matched];
        i++;
    }
    *at = i;
    bool is_part = multipart->state == STATE_DATA;
    if (is_part && !give_data(multipart, held, bytes + start, i - start, err))
        return false;
    if (multipart->matched < multipart->delimiter_length)
        return true;
    multipart->matched = 0;
    multipart->tail_length = 0;
    multipart->state = STATE_AFTER_BOUNDARY;
    return !is_part || multipart->events.end_part(multipart->events.context, err);
}

bool multipart_write(struct multipart *multipart, const void *bytes, size_t size_bytes,
                     struct error *err)
{
    const char *text = bytes;
    size_t at = 0;
    while (at < size_bytes) {
        bool is_good = true;
        switch (multipart->state) {
        case STATE_PREAMBLE:
        case STATE_DATA:
            is_good = scan_data(multipart, text, size_bytes, &at, err);
            break;
        case STATE_AFTER_BOUNDARY:
            is_good = tail_byte(multipart, text[at++], err);
            break;
        case STATE_HEADERS:
            is_good = header_byte(multipart, text[at++], err);
            break;
        case STATE_EPILOGUE:
            return true;
        }
        if (!is_good)
            return false;
    }
    return true;
}

bool multipart_end(struct multipart *multipart, struct error *err)
{
    if (multipart->state != STATE_EPILOGUE)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "multipart: the body ends before its closing boundary");
    return true;
}
