/* SPDX-License-Identifier: MIT */
/* What the front knows of the settings that a request leaves open, sent with the job for the worker
 * to choose from: rows of trade-offs, and counts of the scene for the models. As JSON, for both of
 * them. Thread: any. */
#ifndef VITRAIL_SERVER_MAPPING_CHOICE_OFFER_H
#define VITRAIL_SERVER_MAPPING_CHOICE_OFFER_H

#include <assert.h>
#include <jansson.h>

#include "protocol/error.h"
#include "protocol/tradeoff.h"
#include "renderer/cost/choice.h"

enum { CHOICE_ROWS_MAX = CHOICE_ESTIMATES_MAX };
static_assert((int)CHOICE_ROWS_MAX >= (int)TRADEOFF_ROWS_MAX, "measured rows do not fit");

struct choice_rows { /* zeroed = none */
    struct choice_row rows[CHOICE_ROWS_MAX];
    size_t count;
};

struct choice_offer {
    struct choice_rows view;  /* measured for exactly this view on this device */
    struct choice_rows scene; /* measured for another view of its scene */
    uint64_t triangles;       /* of the scene */
    uint64_t scene_lights;
    bool has_grids; /* density grids, which few techniques draw */
};

/* A new reference; NULL: no memory. Equal offers have equal JSON. */
MUST_CHECK json_t *choice_offer_to_json(const struct choice_offer *offer);

/* ERROR_INTERNAL where the front has sent something else. */
MUST_CHECK bool choice_offer_from_json(const json_t *json, struct choice_offer *offer,
                                       struct error *err);

#endif
