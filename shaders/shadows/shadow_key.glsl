// SPDX-License-Identifier: MIT
// The depth of an event in steps, for searching: monotonous, so that a smaller key means a smaller
// depth, and nothing more. Negative depths and those beyond the last step share a key.
uint shadow_key(float depth, float keys_per_m)
{
    return uint(clamp(depth * keys_per_m, 0.0, float(SHADOW_KEY_MOST)));
}
