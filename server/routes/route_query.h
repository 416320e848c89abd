/* SPDX-License-Identifier: MIT */
/* Strict reading of the members of a query. Thread: those of the HTTP server. */
#ifndef VITRAIL_SERVER_ROUTES_ROUTE_QUERY_H
#define VITRAIL_SERVER_ROUTES_ROUTE_QUERY_H

#include "server/http/http.h"

/* One member of the query as a number in [min, max]; leaves *out as it was when it is absent.
 * ERROR_INVALID_REQUEST names it. */
MUST_CHECK bool query_number(const struct http_exchange *exchange, const char *name, double min,
                             double max, double *out, struct error *err);
MUST_CHECK bool query_int(const struct http_exchange *exchange, const char *name, int min, int max,
                          int *out, struct error *err);

/* The query of a DELETE that does more with ?NAME=true, and knows no other member: "forget" what
 * has ended instead of cancelling it, or "force". */
MUST_CHECK bool query_flag(const struct http_exchange *exchange, const char *name, bool *is_true,
                           struct error *err);

#endif
