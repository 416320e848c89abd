/* SPDX-License-Identifier: MIT */
/* Suite `scaling`: how times grow with the number of layers, quads, texels, lights and objects, as
 * exponents of power laws. The cases are those of other suites; plot_scaling.py draws the series.
 */
#include "tests/bench/bench.h"

bool suite_scaling(struct bench *bench, struct error *err)
{
    return scale_layers(bench, err) && scale_maps(bench, err) && scale_lights(bench, err) &&
           suite_draws(bench, err);
}
