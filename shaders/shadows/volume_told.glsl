// SPDX-License-Identifier: MIT
// What stages that draw faces of shadow volumes tell fragments: the number of an edge or a
// triangle, and a word: which group is counted, VOLUME_IS_LOST, VOLUME_IS_BEFORE and the kind of
// the face. Sides of a triangle have the kinds 0 to 2.
const uint VOLUME_KIND_EDGE = 3u, VOLUME_KIND_CAP = 4u, VOLUME_KIND_SHIFT = 5u;
const uint VOLUME_GROUP_MASK = 7u;
const uint VOLUME_IS_LOST = 8u;    // the way loses a caster there, where the eye's side is positive
const uint VOLUME_IS_BEFORE = 16u; // that is the eye's side

// Of what a face counts for six groups, one at a time: the group, and whether it is lost.
uint volume_told_at(ivec3 low, ivec3 high, uint quad)
{
    for (uint i = 0u; i < 6u; i++) {
        int count = i < 3u ? low[i] : high[i - 3u];
        if (quad < uint(abs(count)))
            return i | (count < 0 ? VOLUME_IS_LOST : 0u);
        quad -= uint(abs(count));
    }
    return 0u;
}
