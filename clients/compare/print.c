/* SPDX-License-Identifier: MIT */
/* A table with as many digits as mean something, and JSON with all of them. */
#include "clients/compare/print.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { TEXT_BYTES = 512 };

/* ---- a table ---- */

static void print_input(const char *role, const struct compare_input *input)
{
    char file[TEXT_BYTES];
    text_copy_printable(file, sizeof file, input->file);
    printf("%-10s %s: %d x %d, %s, %s%s, hash %016" PRIx64 "\n", role, file, input->image.width_px,
           input->image.height_px, input->format, input->layer,
           input->is_display ? " (from sRGB)" : "", input->hash);
}

static void print_row(const char *name, const struct metric_values *values, const char *at_channel)
{
    printf("%-10s %-11.4g %-11.4g %-11.4g %-11.4g ", name, values->rmse, values->mae, values->p999,
           values->max);
    if (values->max > 0)
        printf("%d, %d%s%s", values->max_x, values->max_y, at_channel ? " " : "",
               at_channel ? at_channel : "");
    printf("\n");
}

static void print_flip(const char *name, const struct flip *flip)
{
    printf("%-10s mean %.4g, p99 %.4g, max %.4g at %d, %d; %.4g pixels per degree", name,
           flip->mean, flip->p99, flip->max, flip->max_x, flip->max_y, flip->pixels_per_degree);
    if (flip->exposures)
        printf(", %d exposures from %.2f to %.2f EV", flip->exposures, flip->first_exposure_ev,
               flip->last_exposure_ev);
    printf("\n");
}

static void print_verdict(const struct comparison *c, const struct compare_options *options)
{
    double value;
    if (!options->max_error.is_given || !comparison_value(c, options->metric, &value))
        return;
    printf("%-10s %s %.6g, limit %.6g%s\n", comparison_passes(c, options) ? "passed" : "FAILED",
           options->metric ? options->metric : "rmse", value, options->max_error.value,
           c->plain.nonfinite_mismatch ? "; values are not finite in one of the images" : "");
}

static void print_worst(const struct comparison *c, double value, size_t pixel, int channel)
{
    int width = c->image.image.width_px;
    printf("at most %.4g", value);
    if (value > 0)
        printf(" at %d, %d %s", (int)(pixel % (size_t)width), (int)(pixel / (size_t)width),
               compare_input_channel(&c->image, channel));
}

static void print_transmittance(const struct comparison *c)
{
    const struct probe_metrics *t = &c->transmittance;
    printf("%-10s ", "relative");
    print_worst(c, t->max_relative, t->max_relative_point, t->max_relative_channel);
    printf(", of %" PRIu64 " values with T > %g\n", t->relative_compared, PROBE_RELATIVE_MIN);
    printf("%-10s ", "|d ln T|");
    print_worst(c, t->max_tau, t->max_tau_point, t->max_tau_channel);
    if (t->opaque_mismatch)
        printf("; %" PRIu64 " values are 0 in one of the images only", t->opaque_mismatch);
    printf("\n");
}

static void print_tail(const struct comparison *c, const struct compare_picture *picture)
{
    if (c->has_flip)
        print_flip("FLIP", &c->flip);
    if (c->has_hdr_flip)
        print_flip("HDR-FLIP", &c->hdr_flip);
    if (c->has_edges)
        printf("%-10s at most %.4g px apart, %.4g on average; %.1f px long, the reference %.1f\n",
               "edges", c->edges.hausdorff_px, c->edges.mean_px, c->edges.length_image_px,
               c->edges.length_reference_px);
    if (c->has_transmittance)
        print_transmittance(c);
    if (picture->file)
        printf("%-10s %s, colours from %s%.4g\n", "picture", picture->map,
               strcmp(picture->map, "signed") ? "0 to " : "-+ ", picture->scale);
}

void comparison_print(const struct comparison *c, const struct compare_options *options,
                      const struct compare_picture *picture)
{
    const struct metric_values *all = &c->plain.overall;
    print_input("image", &c->image);
    print_input("reference", &c->reference);
    printf("\n%-10s %-11s %-11s %-11s %-11s %s\n", "", "rmse", "mae", "p99.9", "max", "at");
    print_row(c->color_channels > 1 ? "all" : compare_input_channel(&c->image, 0), all,
              c->color_channels > 1 ? compare_input_channel(&c->image, all->max_channel) : NULL);
    for (int i = 0; c->image.image.channels > 1 && i < c->image.image.channels; i++)
        print_row(compare_input_channel(&c->image, i), &c->plain.channel[i], NULL);
    printf("\n%-10s %.6g against %.6g (%+.4g %%)\n", "mean", all->mean_image, all->mean_reference,
           100 * c->energy);
    printf("%-10s %" PRIu64 " of %.0f values (%.4g %%)\n", "differing", all->differing,
           (double)c->image.image.width_px * c->image.image.height_px * c->color_channels,
           100 * c->differing);
    if (c->plain.nonfinite_image || c->plain.nonfinite_reference)
        printf("%-10s %" PRIu64 " values of the image, %" PRIu64 " of the reference, %" PRIu64
               " pairs differ: left out above\n",
               "not finite", c->plain.nonfinite_image, c->plain.nonfinite_reference,
               c->plain.nonfinite_mismatch);
    print_tail(c, picture);
    print_verdict(c, options);
}

/* ---- JSON ---- */

/* JSON has no infinity: null says that no number tells the distance. */
static json_t *number(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

static json_t *input_json(const struct compare_input *input)
{
    char file[TEXT_BYTES], hash[20];
    text_copy_printable(file, sizeof file, input->file);
    snprintf(hash, sizeof hash, "%016" PRIx64, input->hash);
    return json_pack("{s:s, s:i, s:i, s:s, s:s, s:s}", "file", file, "width", input->image.width_px,
                     "height", input->image.height_px, "format", input->format, "output",
                     input->layer, "hash", hash);
}

static json_t *values_json(const struct comparison *c, const struct metric_values *values)
{
    return json_pack("{s:o, s:o, s:o, s:o, s:{s:i, s:i, s:s}, s:o, s:o, s:I, s:I}", "rmse",
                     number(values->rmse), "mae", number(values->mae), "p999", number(values->p999),
                     "max", number(values->max), "max_at", "x", values->max_x, "y", values->max_y,
                     "channel", compare_input_channel(&c->image, values->max_channel), "mean_image",
                     number(values->mean_image), "mean_reference", number(values->mean_reference),
                     "compared", (json_int_t)values->compared, "differing",
                     (json_int_t)values->differing);
}

static json_t *channels_json(const struct comparison *c)
{
    json_t *channels = json_object();
    for (int i = 0; i < c->image.image.channels; i++)
        json_object_set_new(channels, compare_input_channel(&c->image, i),
                            values_json(c, &c->plain.channel[i]));
    return channels;
}

static json_t *flip_json(const struct flip *flip)
{
    json_t *json =
        json_pack("{s:o, s:o, s:o, s:{s:i, s:i}, s:o, s:I}", "mean", number(flip->mean), "p99",
                  number(flip->p99), "max", number(flip->max), "max_at", "x", flip->max_x, "y",
                  flip->max_y, "pixels_per_degree", number(flip->pixels_per_degree),
                  "nonfinite_pixels", (json_int_t)flip->nonfinite_pixels);
    if (flip->exposures) {
        json_object_set_new(json, "exposures", json_integer(flip->exposures));
        json_object_set_new(json, "first_exposure_ev", number(flip->first_exposure_ev));
        json_object_set_new(json, "last_exposure_ev", number(flip->last_exposure_ev));
    }
    return json;
}

static json_t *edges_json(const struct edge_distance *edges)
{
    return json_pack("{s:o, s:o, s:o, s:o}", "hausdorff_px", number(edges->hausdorff_px), "mean_px",
                     number(edges->mean_px), "length_image_px", number(edges->length_image_px),
                     "length_reference_px", number(edges->length_reference_px));
}

static json_t *worst_json(const struct comparison *c, size_t pixel, int channel)
{
    json_int_t width = c->image.image.width_px;
    return json_pack("{s:I, s:I, s:s}", "x", (json_int_t)pixel % width, "y",
                     (json_int_t)pixel / width, "channel",
                     compare_input_channel(&c->image, channel));
}

static json_t *transmittance_json(const struct comparison *c)
{
    const struct probe_metrics *t = &c->transmittance;
    return json_pack(
        "{s:o, s:o, s:I, s:o, s:o, s:I}", "max_relative", number(t->max_relative),
        "max_relative_at", worst_json(c, t->max_relative_point, t->max_relative_channel),
        "relative_compared", (json_int_t)t->relative_compared, "max_tau", number(t->max_tau),
        "max_tau_at", worst_json(c, t->max_tau_point, t->max_tau_channel), "opaque_mismatch",
        (json_int_t)t->opaque_mismatch);
}

static json_t *verdict_json(const struct comparison *c, const struct compare_options *options)
{
    double value = 0;
    comparison_value(c, options->metric, &value);
    return json_pack("{s:s, s:o, s:o, s:b}", "metric", options->metric ? options->metric : "rmse",
                     "value", number(value), "max_error", number(options->max_error.value),
                     "passed", comparison_passes(c, options));
}

json_t *comparison_json(const struct comparison *c, const struct compare_options *options,
                        const struct compare_picture *picture)
{
    json_t *json = values_json(c, &c->plain.overall);
    if (!json)
        return NULL;
    json_object_set_new(json, "image", input_json(&c->image));
    json_object_set_new(json, "reference", input_json(&c->reference));
    json_object_set_new(json, "energy", number(c->energy));
    json_object_set_new(json, "differing_share", number(c->differing));
    json_object_set_new(json, "channels", channels_json(c));
    json_object_set_new(json, "nonfinite",
                        json_pack("{s:I, s:I, s:I}", "image", (json_int_t)c->plain.nonfinite_image,
                                  "reference", (json_int_t)c->plain.nonfinite_reference, "mismatch",
                                  (json_int_t)c->plain.nonfinite_mismatch));
    json_object_set_new(json, "flip", c->has_flip ? flip_json(&c->flip) : json_null());
    json_object_set_new(json, "hdr_flip", c->has_hdr_flip ? flip_json(&c->hdr_flip) : json_null());
    json_object_set_new(json, "edges", c->has_edges ? edges_json(&c->edges) : json_null());
    json_object_set_new(json, "transmittance",
                        c->has_transmittance ? transmittance_json(c) : json_null());
    if (picture->file)
        json_object_set_new(json, "picture",
                            json_pack("{s:s, s:s, s:o}", "file", picture->file, "map", picture->map,
                                      "scale", number(picture->scale)));
    if (options->max_error.is_given)
        json_object_set_new(json, "verdict", verdict_json(c, options));
    return json;
}
