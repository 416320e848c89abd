/* SPDX-License-Identifier: MIT */
/* Reading the body of POST /v1/tradeoffs: a render request with one more member. */
#include "protocol/limits.h"
#include "protocol/request_parts.h"
#include "protocol/tradeoff.h"

enum {
    TIME_BUDGET_S = 480, /* with a last step under ten minutes, and enough for the demo scene */
    TIME_BUDGET_MAX_S = 3600,
    REPEATS = 3, /* the fewest with a median and a spread */
    MAX_SETTINGS = 32,
    MAX_SETTINGS_MAX = 128,
    REFERENCE_SAMPLES = 16, /* its own noise is below the error of every setting with 4 */
};

static bool read_options(const struct json_node *node, struct tradeoff_options *options)
{
    static const char *const known[] = {"time_budget_s",     "repeats",     "max_settings",
                                        "reference_samples", "keep_images", NULL};
    *options = (struct tradeoff_options){.time_budget_s = TIME_BUDGET_S,
                                         .repeats = REPEATS,
                                         .max_settings = MAX_SETTINGS,
                                         .reference_samples = REFERENCE_SAMPLES};
    if (!node->value)
        return true;
    if (!json_expect_object(node, known))
        return false;
    struct json_node budget = json_member(node, "time_budget_s");
    struct json_node repeats = json_member(node, "repeats");
    struct json_node settings = json_member(node, "max_settings");
    struct json_node samples = json_member(node, "reference_samples");
    struct json_node images = json_member(node, "keep_images");
    bool keeps_images = true;
    if (!json_read_int(&budget, 1, TIME_BUDGET_MAX_S, &options->time_budget_s) ||
        !json_read_int(&repeats, 1, TRADEOFF_REPEATS_MAX, &options->repeats) ||
        !json_read_int(&settings, 1, MAX_SETTINGS_MAX, &options->max_settings) ||
        !json_read_int(&samples, 16, 256, &options->reference_samples) ||
        !json_read_bool(&images, &keeps_images))
        return false;
    int n = options->reference_samples;
    if (n != 16 && n != 64 && n != 256)
        return json_refuse(&samples, ERROR_INVALID_REQUEST, "must be 16, 64 or 256");
    options->drops_images = !keeps_images;
    return true;
}

/* What a render may say and a measurement may not. */
static bool check_render(const struct json_node *root, struct tradeoff_request *request)
{
    static const char *const unused[] = {"format", "quality_percent", "provenance"};
    struct request_quality *quality = &request->render.quality;
    struct json_node quality_node = json_member(root, "quality");
    struct json_node error = json_member(&quality_node, "max_error");
    struct json_node budget = json_member(&quality_node, "budget_ms");
    struct json_node samples = json_member(&quality_node, "samples");
    struct json_node resolution = json_member(&quality_node, "shadow_resolution");
    struct json_node taps = json_member(&quality_node, "shadow_taps");
    struct json_node reference = json_member(&quality_node, "reference");
    struct json_node tile = json_member(root, "tile");
    struct json_node output = json_member(root, "output"), outputs = json_member(root, "outputs");
    quality->says_shadow_resolution = resolution.value;
    quality->says_shadow_taps = taps.value;
    if (error.value || budget.value)
        return json_refuse(error.value ? &error : &budget, ERROR_INVALID_REQUEST,
                           "but a trade-off measures all settings and chooses none");
    if (request->render.tile.is_given)
        return json_refuse(&tile, ERROR_INVALID_REQUEST, "but a trade-off measures whole pictures");
    if (quality->reference)
        return json_refuse(&reference, ERROR_INVALID_REQUEST,
                           "but the reference is what settings are measured against");
    if (request->render.outputs != 1u << REQUEST_OUTPUT_COLOR)
        return json_refuse(output.value ? &output : &outputs, ERROR_INVALID_REQUEST,
                           "but only color has an error to measure");
    for (size_t i = 0; i < sizeof unused / sizeof unused[0]; i++) {
        struct json_node node = json_member(root, unused[i]);
        if (node.value)
            return json_refuse(&node, ERROR_INVALID_REQUEST,
                               "but a trade-off answers with numbers: ask GET for json, csv, svg "
                               "or html");
    }
    if (quality->samples > 4 && quality->samples >= request->options.reference_samples)
        return json_refuse(&samples, ERROR_INVALID_REQUEST,
                           "as good as the reference: ask for reference_samples above it");
    return true;
}

bool tradeoff_request_parse(const char *json, size_t length, struct tradeoff_request *request,
                            struct error *err)
{
    *request = (struct tradeoff_request){0};
    json_t *value = json_load_checked(json, length, LIMIT_REQUEST_JSON_BYTES, err);
    if (!value)
        return false;
    struct json_node root = json_root(value, err);
    bool is_good = json_expect_object(&root, NULL);
    if (is_good) {
        struct json_node options = json_member(&root, "tradeoff");
        is_good = read_options(&options, &request->options);
        json_object_del(value, "tradeoff");
    }
    if (is_good && request_read_root(&root, &request->render) && !check_render(&root, request))
        tradeoff_request_finish(request);
    is_good = request->render.width > 0;
    json_decref(value);
    return is_good;
}

void tradeoff_request_finish(struct tradeoff_request *request)
{
    render_request_finish(&request->render);
    *request = (struct tradeoff_request){0};
}
