/* SPDX-License-Identifier: MIT */
/* The standard pattern of 4, and what it is shifted by. In sixteenths of a pixel from its centre.
 */
#include "renderer/base/sample_pattern.h"

#include <assert.h>
#include <math.h>

/* Vulkan 1.3, "Multisampling": the standard sample locations, y up. */
static const double standard[SAMPLES_PER_ROUND][2] = {{-2, -6}, {6, -2}, {-6, 2}, {2, 6}};
static const double once[1][2] = {{0, 0}};
static const double twice[2][2] = {{1, 1}, {-1, -1}};
static const double four_times[4][2] = {{-1.875, 0.5}, {0.5, 1.875}, {1.875, -0.5}, {-0.5, -1.875}};
static const double UNIT_PX = 1.0 / 16;

bool sample_pattern_has(int samples)
{
    return samples == 1 || samples == 4 || samples == 8 || samples == 16;
}

/* Of SAMPLES_PER_ROUND samples. */
static const double *shift_of(int rounds, int round)
{
    assert((rounds == 1 || rounds == 2 || rounds == 4) && round >= 0 && round < rounds);
    return rounds == 1 ? once[round] : rounds == 2 ? twice[round] : four_times[round];
}

void sample_pattern_place(int samples, int index, double place[2])
{
    assert(sample_pattern_has(samples) && index >= 0 && index < samples);
    int rounds = samples / SAMPLES_PER_ROUND;
    for (int k = 0; k < 2; k++) {
        double away = 0;
        if (rounds)
            away = standard[index % SAMPLES_PER_ROUND][k] -
                   shift_of(rounds, index / SAMPLES_PER_ROUND)[k];
        place[k] = 0.5 + UNIT_PX * away;
    }
}

void sample_pattern_shift(int device_samples, int rounds, int round, double shift_px[2])
{
    double place[2];
    assert(device_samples == 1 || device_samples == SAMPLES_PER_ROUND);
    if (device_samples == 1)
        sample_pattern_place(rounds, round, place);
    for (int k = 0; k < 2; k++)
        shift_px[k] = device_samples == 1 ? 0.5 - place[k] : UNIT_PX * shift_of(rounds, round)[k];
}

double sample_pattern_reach(int device_samples, int rounds)
{
    double reach = 0, shift[2];
    for (int round = 0; round < rounds; round++) {
        sample_pattern_shift(device_samples, rounds, round, shift);
        reach = fmax(reach, fmax(fabs(shift[0]), fabs(shift[1])));
    }
    return reach;
}
