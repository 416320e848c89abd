/* SPDX-License-Identifier: MIT */
/* /v1/tradeoffs: time against error, measured; as JSON, CSV, a plot or a page. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "protocol/limits.h"
#include "protocol/tradeoff.h"
#include "server/http/negotiate.h"
#include "server/routes/route_query.h"
#include "server/routes/router.h"
#include "server/routes/text_body.h"
#include "server/tradeoffs/tradeoff_plot.h"
#include "server/tradeoffs/tradeoffs.h"

/* ---- POST ---- */

static void open_post(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service, (void)id;
    text_body_open(exchange, "a trade-off", false);
}

static void reply_document(struct service *service, struct http_exchange *exchange, int status,
                           const char *id)
{
    struct error problem = {0};
    struct tradeoff *tradeoff = tradeoffs_get(service->tradeoffs, id, &problem);
    if (!tradeoff) {
        http_reply_error(exchange, &problem);
        return;
    }
    reply_json(exchange, status, tradeoff_to_json(tradeoff));
    tradeoff_finish(tradeoff);
    free(tradeoff);
}

static void run_post(struct service *service, struct http_exchange *exchange, const char *unused)
{
    (void)unused;
    struct error problem = {0};
    struct text_body *body = route_attached(exchange);
    struct tradeoff_request request;
    char id[TRADEOFF_ID_BYTES];
    bool is_good = tradeoff_request_parse(body->text ? body->text : "", body->size_bytes, &request,
                                          &problem) &&
                   tradeoffs_submit(service->tradeoffs, &request, id, &problem);
    tradeoff_request_finish(&request);
    if (!is_good) {
        http_reply_error(exchange, &problem);
        return;
    }
    http_reply_header(exchange, "Location", "/v1/tradeoffs/%s", id);
    reply_document(service, exchange, 202, id);
}

/* ---- GET ---- */

enum form { FORM_JSON, FORM_HTML, FORM_SVG, FORM_CSV, FORM_COUNT };

static const char *const form_types[] = {
    [FORM_JSON] = "application/json", [FORM_HTML] = "text/html", [FORM_SVG] = "image/svg+xml",
    [FORM_CSV] = "text/csv",          [FORM_COUNT] = NULL,
};

static bool choose_form(struct http_exchange *exchange, int *form, struct error *err)
{
    static const char *const names[] = {"json", "html", "svg", "csv"};
    static const char *const known[] = {"format", NULL};
    const char *name = http_request_query(exchange, "format");
    if (!http_request_check_query(exchange, known, err))
        return false;
    if (!name)
        return negotiate_type(http_request_header(exchange, "Accept"), form_types, form, err);
    for (*form = 0; *form < FORM_COUNT; (*form)++)
        if (strcmp(name, names[*form]) == 0)
            return true;
    return error_set(err, ERROR_INVALID_REQUEST, "?format=%.40s is none of json, html, svg and csv",
                     name);
}

static char *write_form(struct service *service, const struct tradeoff *tradeoff, int form)
{
    if (form == FORM_CSV)
        return tradeoff_to_csv(tradeoff);
    if (form == FORM_SVG)
        return tradeoff_to_svg(tradeoff);
    int images_fd = tradeoffs_open_images(service->tradeoffs, tradeoff->id);
    char *text = tradeoff_to_html(tradeoff, images_fd);
    if (images_fd >= 0)
        close(images_fd);
    return text;
}

static void reply_form(struct service *service, struct http_exchange *exchange,
                       const struct tradeoff *tradeoff, int form)
{
    static const char *const media_types[] = {
        [FORM_HTML] = "text/html; charset=utf-8",
        [FORM_SVG] = "image/svg+xml",
        [FORM_CSV] = "text/csv; charset=utf-8",
    };
    char *text = write_form(service, tradeoff, form);
    if (text) {
        http_reply_header(exchange, "Content-Security-Policy",
                          "default-src 'none'; style-src 'unsafe-inline'; img-src data:");
        http_reply_bytes(exchange, 200, media_types[form], text, strlen(text));
    } else {
        http_reply_error(exchange, &(struct error){ERROR_NO_MEMORY, "trade-off", ""});
    }
    free(text);
}

static void run_get(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    int form = FORM_JSON;
    struct tradeoff *tradeoff = tradeoffs_get(service->tradeoffs, id, &problem);
    if (!tradeoff || !choose_form(exchange, &form, &problem)) {
        http_reply_error(exchange, &problem);
    } else {
        http_reply_header(exchange, "Vary", "Accept");
        if (form == FORM_JSON)
            reply_json(exchange, 200, tradeoff_to_json(tradeoff));
        else
            reply_form(service, exchange, tradeoff, form);
    }
    if (tradeoff)
        tradeoff_finish(tradeoff);
    free(tradeoff);
}

static void run_list(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)id;
    json_t *list = tradeoffs_list(service->tradeoffs);
    reply_json(exchange, 200, list ? json_pack("{s:o}", "tradeoffs", list) : NULL);
}

/* ---- DELETE ---- */

/* Cancels; with ?forget=true removes one that has ended. A cancel that comes too late loses
 * nothing. */
static void run_delete(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    bool must_forget = false;
    bool is_good = query_flag(exchange, "forget", &must_forget, &problem) &&
                   (must_forget ? tradeoffs_forget(service->tradeoffs, id, &problem)
                                : tradeoffs_cancel(service->tradeoffs, id, &problem));
    if (!is_good)
        http_reply_error(exchange, &problem);
    else if (must_forget)
        http_reply_empty(exchange, 204);
    else
        reply_document(service, exchange, 200, id);
}

const struct route routes_tradeoffs[] = {
    {"/v1/tradeoffs", {{HTTP_GET, NULL, run_list}, {HTTP_POST, open_post, run_post}}},
    {"/v1/tradeoffs/{id}", {{HTTP_GET, NULL, run_get}, {HTTP_DELETE, NULL, run_delete}}},
    {0},
};
