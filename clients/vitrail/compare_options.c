/* SPDX-License-Identifier: MIT */
/* Options and help of `vitrail compare`. */
#include "clients/vitrail/compare.h"

#define AT(member) offsetof(struct compare_options, member)

const struct option COMPARE_OPTIONS[] = {
    {OPTION_TEXT, "output", 0, "NAME",
     "which output (layer) of an EXR: color, depth, normal, ...;\ndefault: color, else the only "
     "one",
     AT(layer)},
    {OPTION_TEXT, "output-file", 'o', "FILE",
     "draw the difference; .png .jpg .webp, - is stdout (PNG)", AT(output_file)},
    {OPTION_TEXT, "map", 0, "KIND", "of the picture: flip (default), absolute, signed", AT(map)},
    {OPTION_NUMBER, "scale", 0, "V",
     "difference at the end of the picture's colours;\ndefault: the largest there is, 1 for flip",
     AT(scale)},
    {OPTION_NUMBER, "ppd", 0, "N", "pixels per degree of sight, for FLIP; default 67.02",
     AT(pixels_per_degree)},
    {OPTION_FLAG, "no-flip", 0, NULL, "leave FLIP out: ten times faster", AT(no_flip)},
    {OPTION_NUMBER, "edge-level", 0, "L",
     "also measure how far the contours at luminance L are apart", AT(edge_level)},
    {OPTION_NUMBER, "max-error", 0, "E",
     "exit with code 3 when the metric is above E,\nor a value is not finite in one image only",
     AT(max_error)},
    {OPTION_TEXT, "metric", 0, "NAME",
     "what --max-error is about: rmse (default), mae, p999,\n"
     "max, energy, differing, flip, flip_p99, hdr_flip,\nhdr_flip_p99, edge, edge_mean, relative, "
     "tau",
     AT(metric)},
    {OPTION_FLAG, "json", 0, NULL, "results on stdout and errors on stderr as JSON",
     AT(common.json)},
    {OPTION_FLAG, "quiet", 'q', NULL, "print nothing; the exit code and the picture tell",
     AT(common.quiet)},
    {0},
};

const char COMPARE_DETAILS[] =
    "Needs no server. Differences are IMAGE - REFERENCE in linear light: EXR as it is, PNG,\n"
    "JPEG and WebP decoded from sRGB. One of the two may be - for stdin.";
