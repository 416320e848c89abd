// SPDX-License-Identifier: MIT
// Does a device end loops before their test does? (renderer/gl/loop_probe.c)
#include "shared/bindings.h"

layout(local_size_x = 1) in;
layout(std430, binding = BIND_STATISTICS) buffer probe_results {
    uint steps; // taken
    uint word;  // computed by them one from the other, so that no compiler does without the loop
};
uniform uint u_steps; // to take

void main()
{
    uint count = 0u, state = u_steps;
    while (count < u_steps) {
        state = state * 1664525u + 1013904223u;
        count++;
    }
    steps = count;
    word = state;
}
