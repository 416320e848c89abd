// SPDX-License-Identifier: MIT
// The transmittance of a word of filter_word.glsl. Needs: wide.glsl.
wide3 filter_unpack(vec3 word)
{
    return wide_mix(wide_one_minus(word), wide_of(-word), lessThan(word, vec3(0.0)));
}
