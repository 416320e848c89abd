/* SPDX-License-Identifier: MIT */
/* Runs the metrics of renderer/accuracy over a pair of inputs. */
#include "clients/compare/measure.h"

#include <math.h>
#include <string.h>

enum metric {
    METRIC_RMSE,
    METRIC_MAE,
    METRIC_P999,
    METRIC_MAX,
    METRIC_ENERGY,
    METRIC_DIFFERING,
    METRIC_FLIP,
    METRIC_FLIP_P99,
    METRIC_HDR_FLIP,
    METRIC_HDR_FLIP_P99,
    METRIC_EDGE,
    METRIC_EDGE_MEAN,
    METRIC_RELATIVE,
    METRIC_TAU,
    METRIC_COUNT
};

static const char *const metric_names[METRIC_COUNT] = {
    "rmse",     "mae",      "p999",         "max",  "energy",    "differing", "flip",
    "flip_p99", "hdr_flip", "hdr_flip_p99", "edge", "edge_mean", "relative",  "tau",
};

static enum metric metric_of(const char *name)
{
    int i = 0;
    if (!name)
        return METRIC_RMSE;
    while (i < METRIC_COUNT && strcmp(metric_names[i], name) != 0)
        i++;
    return (enum metric)i;
}

bool compare_options_check(const struct compare_options *options, struct failure *failure)
{
    enum metric metric = metric_of(options->metric);
    bool needs_flip = metric >= METRIC_FLIP && metric <= METRIC_HDR_FLIP_P99;
    bool needs_edge = metric == METRIC_EDGE || metric == METRIC_EDGE_MEAN;
    const char *map = options->map ? options->map : "flip";
    if (metric == METRIC_COUNT)
        return fail(failure, EXIT_CODE_USAGE,
                    "--metric: '%s' is none of rmse, mae, p999, max, energy, differing, flip, "
                    "flip_p99, hdr_flip, hdr_flip_p99, edge, edge_mean, relative, tau",
                    options->metric);
    if (options->metric && !options->max_error.is_given)
        return fail(failure, EXIT_CODE_USAGE, "--metric needs --max-error");
    if (options->max_error.value < 0)
        return fail(failure, EXIT_CODE_USAGE, "--max-error: an error, from 0");
    if (strcmp(map, "flip") != 0 && strcmp(map, "absolute") != 0 && strcmp(map, "signed") != 0)
        return fail(failure, EXIT_CODE_USAGE, "--map: '%s' is none of flip, absolute, signed", map);
    if ((options->map || options->scale.is_given) && !options->output_file)
        return fail(failure, EXIT_CODE_USAGE, "--map and --scale need a picture: -o FILE.png");
    if (options->scale.is_given && !(options->scale.value > 0))
        return fail(failure, EXIT_CODE_USAGE, "--scale: a difference above 0");
    if (options->pixels_per_degree.is_given &&
        !(options->pixels_per_degree.value >= 1 && options->pixels_per_degree.value <= 1000))
        return fail(failure, EXIT_CODE_USAGE, "--ppd: pixels per degree, from 1 to 1000");
    if (options->no_flip && (needs_flip || (options->output_file && !strcmp(map, "flip"))))
        return fail(failure, EXIT_CODE_USAGE,
                    "--no-flip leaves out what --metric or --map asks for");
    if (options->edge_level.is_given && options->edge_level.value == 0)
        return fail(failure, EXIT_CODE_USAGE, "--edge-level: a luminance, not 0");
    if (needs_edge && !options->edge_level.is_given)
        return fail(failure, EXIT_CODE_USAGE, "--metric %s needs --edge-level", options->metric);
    return true;
}

/* ---- the pair ---- */

static bool fail_refused(struct failure *failure, const struct error *err)
{
    int code = err->code == ERROR_NO_MEMORY ? EXIT_CODE_OS_ERROR : EXIT_CODE_REFUSED;
    return fail(failure, code, "the images cannot be compared: %s", err->message);
}

static bool has_alpha(const struct compare_input *input)
{
    int last = input->image.channels - 1;
    return compare_input_is_color(input) && last > 0 &&
           !strcmp(compare_input_channel(input, last), "A");
}

static bool match(struct comparison *c, struct failure *failure)
{
    struct error err = {0};
    if (strcmp(c->image.layer, c->reference.layer) != 0)
        return fail(failure, EXIT_CODE_REFUSED,
                    "the images cannot be compared: '%s' holds %s, '%s' holds %s", c->image.file,
                    c->image.layer, c->reference.file, c->reference.layer);
    struct compare_input *both[] = {&c->image, &c->reference};
    for (int i = 0; i < 2; i++)
        if (has_alpha(both[i]) && !has_alpha(both[1 - i]) &&
            !compare_input_cut(both[i], both[i]->image.channels - 1, failure))
            return false;
    c->color_channels = c->image.image.channels - has_alpha(&c->image);
    if (!image_pair_check(&c->image.image, &c->reference.image, &err))
        return fail_refused(failure, &err);
    return true;
}

/* ---- metrics ---- */

static bool measure_plain(struct comparison *c, struct failure *failure)
{
    struct error err = {0};
    struct image_metrics_desc desc = {.image = &c->image.image,
                                      .reference = &c->reference.image,
                                      .channels = (uint32_t)((1ull << c->color_channels) - 1)};
    struct image_metrics alpha;
    if (!image_metrics_measure(&desc, &c->plain, &err))
        return fail_refused(failure, &err);
    if (c->color_channels < c->image.image.channels) {
        desc.channels = 1u << c->color_channels;
        if (!image_metrics_measure(&desc, &alpha, &err))
            return fail_refused(failure, &err);
        c->plain.channel[c->color_channels] = alpha.channel[c->color_channels];
        c->plain.nonfinite_image += alpha.nonfinite_image;
        c->plain.nonfinite_reference += alpha.nonfinite_reference;
        c->plain.nonfinite_mismatch += alpha.nonfinite_mismatch;
    }
    const struct metric_values *all = &c->plain.overall;
    double pixels = (double)c->image.image.width_px * c->image.image.height_px;
    c->differing = (double)all->differing / (pixels * c->color_channels);
    if (all->mean_image != all->mean_reference)
        c->energy = all->mean_image / all->mean_reference - 1;
    return true;
}

static bool measure_flip(struct comparison *c, double pixels_per_degree, struct failure *failure)
{
    struct error err = {0};
    struct flip_desc desc = {.image = &c->image.image,
                             .reference = &c->reference.image,
                             .pixels_per_degree = pixels_per_degree};
    if (!flip_measure(&desc, &c->flip, &c->flip_map, &err))
        return fail_refused(failure, &err);
    c->has_flip = true;
    if (c->image.is_display || c->reference.is_display)
        return true; /* nothing above 1, and exposures mean nothing */
    desc.is_hdr = true;
    image_finish(&c->flip_map);
    if (!flip_measure(&desc, &c->hdr_flip, &c->flip_map, &err))
        return fail_refused(failure, &err);
    c->has_hdr_flip = true;
    return true;
}

/* Rec.709 luminance of a color layer with three channels, else its first channel. */
static bool luminance_of(const struct compare_input *input, int color_channels, struct image *out,
                         struct error *err)
{
    const struct image *image = &input->image;
    if (!image_init(out, image->width_px, image->height_px, 1, IMAGE_F32, err))
        return false;
    bool is_rgb = compare_input_is_color(input) && color_channels >= 3;
    size_t pixels = (size_t)image->width_px * (size_t)image->height_px;
    const float *in = image->pixels;
    float *to = out->pixels;
    for (size_t i = 0; i < pixels; i++, in += image->channels)
        to[i] = is_rgb ? 0.2126f * in[0] + 0.7152f * in[1] + 0.0722f * in[2] : in[0];
    return true;
}

static bool measure_edges(struct comparison *c, double level, struct failure *failure)
{
    struct error err = {0};
    struct image image = {0}, reference = {0};
    struct edge_distance_desc desc = {.image = &image, .reference = &reference, .level = level};
    bool is_ok = luminance_of(&c->image, c->color_channels, &image, &err) &&
                 luminance_of(&c->reference, c->color_channels, &reference, &err) &&
                 edge_distance_measure(&desc, &c->edges, &err);
    image_finish(&image);
    image_finish(&reference);
    c->has_edges = is_ok;
    return is_ok || fail_refused(failure, &err);
}

/* A ratio means something for what light is left of, where a difference hides behind the darkness.
 */
static bool measure_transmittance(struct comparison *c, struct failure *failure)
{
    struct error err = {0};
    if (strcmp(c->image.layer, "transmittance") != 0)
        return true;
    c->has_transmittance = image_transmittance_measure(
        &(struct image_metrics_desc){.image = &c->image.image, .reference = &c->reference.image},
        &c->transmittance, &err);
    return c->has_transmittance || fail_refused(failure, &err);
}

bool comparison_measure(struct comparison *c, const struct compare_options *options,
                        struct failure *failure)
{
    double value;
    if (!match(c, failure) || !measure_plain(c, failure) || !measure_transmittance(c, failure))
        return false;
    if (!options->no_flip && compare_input_is_color(&c->image) &&
        !measure_flip(c, options->pixels_per_degree.value, failure))
        return false;
    if (options->edge_level.is_given && !measure_edges(c, options->edge_level.value, failure))
        return false;
    if (options->metric && !comparison_value(c, options->metric, &value))
        return fail(failure, EXIT_CODE_REFUSED,
                    "--metric %s: there is none of these images (%s, %s and %s)", options->metric,
                    c->image.layer, c->image.format, c->reference.format);
    return true;
}

void comparison_finish(struct comparison *c)
{
    compare_input_finish(&c->image);
    compare_input_finish(&c->reference);
    image_finish(&c->flip_map);
}

bool comparison_value(const struct comparison *c, const char *metric, double *value)
{
    const struct metric_values *all = &c->plain.overall;
    const struct {
        bool is_there;
        double value;
    } values[METRIC_COUNT] = {
        [METRIC_RMSE] = {true, all->rmse},
        [METRIC_MAE] = {true, all->mae},
        [METRIC_P999] = {true, all->p999},
        [METRIC_MAX] = {true, all->max},
        [METRIC_ENERGY] = {true, fabs(c->energy)},
        [METRIC_DIFFERING] = {true, c->differing},
        [METRIC_FLIP] = {c->has_flip, c->flip.mean},
        [METRIC_FLIP_P99] = {c->has_flip, c->flip.p99},
        [METRIC_HDR_FLIP] = {c->has_hdr_flip, c->hdr_flip.mean},
        [METRIC_HDR_FLIP_P99] = {c->has_hdr_flip, c->hdr_flip.p99},
        [METRIC_EDGE] = {c->has_edges, c->edges.hausdorff_px},
        [METRIC_EDGE_MEAN] = {c->has_edges, c->edges.mean_px},
        [METRIC_RELATIVE] = {c->has_transmittance, c->transmittance.max_relative},
        [METRIC_TAU] = {c->has_transmittance,
                        c->transmittance.opaque_mismatch ? INFINITY : c->transmittance.max_tau},
    };
    *value = values[metric_of(metric)].value;
    return values[metric_of(metric)].is_there;
}

bool comparison_passes(const struct comparison *c, const struct compare_options *options)
{
    double value;
    if (!options->max_error.is_given)
        return true;
    return comparison_value(c, options->metric, &value) && value <= options->max_error.value &&
           !c->plain.nonfinite_mismatch;
}
