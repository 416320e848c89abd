// SPDX-License-Identifier: MIT
// The cells of an axis of a face, by how many points its slots have. Cells are even parts of it,
// but where one of these would hold too large a part of all points: then each has its share of half
// the points and half the axis. A cell's triangles are asked by all of its points, so that time
// goes by the product of both. Counts are zero again afterwards. Needs: AREA_KIND.
#include "shadows/area_grid.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_AREA_COUNTS) buffer count_buffer { uint counts[]; };

const uint EACH = uint(AREA_SLOTS) / 64u, COLUMN = uint(AREA_SLOTS / SIDE);
const uint HOT = 16u; // an even part that has more than a sixteenth of all points
shared uint sums[64], fullest[64];

void main()
{
    uint lane = gl_LocalInvocationIndex;
    uint first = gl_WorkGroupID.x * uint(AREA_SLOTS) + lane * EACH;
    uint own = 0u, column = 0u, most = 0u;
    for (uint i = 0u; i < EACH; i++) {
        uint count = counts[first + i];
        column = i % COLUMN == 0u ? count : column + count;
        most = max(most, column);
        own += count;
    }
    sums[lane] = own;
    fullest[lane] = most;
    barrier();
    uint before = 0u, total = 0u;
    for (uint i = 0u; i < 64u; i++) {
        before += i < lane ? sums[i] : 0u;
        total += sums[i];
        most = max(most, fullest[i]);
    }
    bool is_hot = most > total / HOT;
    for (uint i = 0u; i < EACH; i++) {
        uint slot = lane * EACH + i;
        float share = float(before) / float(max(total, 1u));
        uint shared_cell = uint(float(SIDE / 2) * (share + float(slot) / float(AREA_SLOTS)));
        cells[uint(AREA_BOUND_WORDS) + first + i] =
            is_hot ? min(shared_cell, uint(SIDE) - 1u) : slot / COLUMN;
        before += counts[first + i];
        counts[first + i] = 0u;
    }
}
