// SPDX-License-Identifier: MIT
// What light loses, in octaves, as half floats are to hold it: a channel that nothing passes loses
// 24, which leaves the smallest half float.
float volume_octaves(int log2, int stops)
{
    return float(log2) / 1048576.0 + 24.0 * float(stops);
}
