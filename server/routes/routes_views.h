/* SPDX-License-Identifier: MIT */
/* Functions that the route files of views share. Thread: those of the HTTP server. */
#ifndef VITRAIL_SERVER_ROUTES_ROUTES_VIEWS_H
#define VITRAIL_SERVER_ROUTES_ROUTES_VIEWS_H

#include "server/routes/router.h"

/* One member of the query as a number in [min, max]; leaves *out as it was when it is absent.
 * ERROR_INVALID_REQUEST names it. */
MUST_CHECK bool query_number(const struct http_exchange *exchange, const char *name, double min,
                             double max, double *out, struct error *err);
MUST_CHECK bool query_int(const struct http_exchange *exchange, const char *name, int min, int max,
                          int *out, struct error *err);

#endif
