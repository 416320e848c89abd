/* SPDX-License-Identifier: MIT */
/* The body of POST /v1/renders, put together from a base file, options and single settings. */
#ifndef VITRAIL_CLIENTS_VITRAIL_REQUEST_JSON_H
#define VITRAIL_CLIENTS_VITRAIL_REQUEST_JSON_H

#include <jansson.h>
#include <stdbool.h>

#include "clients/vitrail/failure.h"
#include "clients/vitrail/options.h"

/* The options of `vitrail render` that say what to render; NULL or zero: not given, so left to base
 * and server. */
struct request_options {
    const char *base_path; /* --request */
    const char *size, *camera, *background, *environment, *format;
    const char *shadows, *transparency, *light_lists, *blend_filter, *tone_mapping;
    struct option_number shadow_resolution, samples, area_samples, max_error, budget_ms,
        exposure_ev;
    struct text_list lights, outputs, settings;
    bool no_scene_lights, reference;
};

/* New reference, without "scene". Base first, then the options over it (lights are added to those
 * of the base), then
 * --set in the order given. Only what was given is in it: defaults are the server's. */
json_t *request_json_build(const struct request_options *options, struct failure *failure);

/* Sets what the RFC 6901 pointer of "POINTER=JSON" names; objects on the way are made, "-" appends
 * to an array. */
bool request_json_set(json_t *root, const char *setting, struct failure *failure);

#endif
