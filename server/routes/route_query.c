/* SPDX-License-Identifier: MIT */
/* Strict reading of the members of a query. */
#include "server/routes/route_query.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool query_number(const struct http_exchange *exchange, const char *name, double min, double max,
                  double *out, struct error *err)
{
    const char *text = http_request_query(exchange, name);
    char *end;
    if (!text)
        return true;
    double number = strtod(text, &end);
    bool is_decimal = *text && !text[strspn(text, "0123456789+-.eE")]; /* no blanks, hex or names */
    if (!is_decimal || *end || !(number >= min && number <= max))
        return error_set(err, ERROR_INVALID_REQUEST, "?%s=%.40s is not a number from %.9g to %.9g",
                         name, text, min, max);
    *out = number;
    return true;
}

bool query_int(const struct http_exchange *exchange, const char *name, int min, int max, int *out,
               struct error *err)
{
    double number = *out;
    if (!query_number(exchange, name, min, max, &number, err))
        return false;
    if (number != floor(number))
        return error_set(err, ERROR_INVALID_REQUEST, "?%s=%.40s is not a whole number", name,
                         http_request_query(exchange, name));
    *out = (int)number;
    return true;
}

bool query_flag(const struct http_exchange *exchange, const char *name, bool *is_true,
                struct error *err)
{
    const char *const known[] = {name, NULL};
    const char *text = http_request_query(exchange, name);
    *is_true = text && strcmp(text, "true") == 0;
    return http_request_check_query(exchange, known, err) &&
           (!text || *is_true || strcmp(text, "false") == 0 ||
            error_set(err, ERROR_INVALID_REQUEST, "?%s=%.40s is neither true nor false", name,
                      text));
}
