// SPDX-License-Identifier: MIT
// What absorbs in front of a depth, told from four power moments of the absorbance over depth
// alone: Muenstermann, Krumpen, Klein and Peters 2018, "Moment-Based Order-Independent
// Transparency", after Peters and Klein 2015, "Moment Shadow Mapping". Of all distributions that
// have the moments, the one with as much as can be at the depth itself has two more depths, and
// those in front of it count.
// Depths are from -1 to 1.
// Provides: moments, moments_clear, moments_add, moments_normalize, masses_at.

const float MOMENT_BIAS = 5e-7;     // the paper's for four power moments in f32, towards
const float MOMENT_2 = 0.375, MOMENT_4 = 0.375; // these, and 0 of odd order

struct moments {
    vec3 m0, m1, m2, m3, m4; // by channel
};

void moments_clear(out moments m)
{
    m = moments(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
}

void moments_add(inout moments m, vec3 tau, float z)
{
    m.m0 += tau;
    m.m1 += tau * z;
    m.m2 += tau * (z * z);
    m.m3 += tau * (z * z * z);
    m.m4 += tau * (z * z * z * z);
}

// Of mass 1, biased.
moments moments_normalize(moments m)
{
    vec3 unit = 1.0 / max(m.m0, 1e-30);
    return moments(m.m0, mix(m.m1 * unit, vec3(0.0), MOMENT_BIAS),
                   mix(m.m2 * unit, vec3(MOMENT_2), MOMENT_BIAS),
                   mix(m.m3 * unit, vec3(0.0), MOMENT_BIAS),
                   mix(m.m4 * unit, vec3(MOMENT_4), MOMENT_BIAS));
}

// The share of all mass that is in front of z, where as much as can be is at z, and that much.
void masses_at(moments m, float z, out vec3 front, out vec3 at)
{
    // H c = (1, z, z^2), where H has the moments 0 to 4, by H = L D L^T
    vec3 d1 = m.m2 - m.m1 * m.m1;
    vec3 l21 = (m.m3 - m.m1 * m.m2) / d1;
    vec3 d2 = m.m4 - m.m2 * m.m2 - l21 * l21 * d1;
    vec3 y1 = z - m.m1;
    vec3 y2 = z * z - m.m2 - l21 * y1;
    vec3 c2 = y2 / d2;
    vec3 c1 = y1 / d1 - l21 * c2;
    vec3 c0 = 1.0 - m.m1 * c1 - m.m2 * c2;
    at = 1.0 / (1.0 + y1 * y1 / d1 + y2 * y2 / d2);
    // the two other depths are the roots of c0 + c1 x + c2 x^2
    vec3 root = sqrt(max(c1 * c1 - 4.0 * c0 * c2, 0.0));
    vec3 q = -0.5 * (c1 + mix(root, -root, lessThan(c1, vec3(0.0))));
    vec3 tiny = vec3(1e-20);
    vec3 a = q / mix(c2, tiny, lessThan(abs(c2), tiny));
    vec3 b = c0 / mix(q, tiny, lessThan(abs(q), tiny));
    // their masses, by polynomials that are 1 at one of the three and 0 at the others
    vec3 of_a = (m.m2 - (z + b) * m.m1 + z * b) / ((a - z) * (a - b));
    vec3 of_b = (m.m2 - (z + a) * m.m1 + z * a) / ((b - z) * (b - a));
    front = mix(vec3(0.0), of_a, lessThan(a, vec3(z))) + mix(vec3(0.0), of_b, lessThan(b, vec3(z)));
    front = clamp(mix(front, vec3(0.0), isnan(front)), vec3(0.0), 1.0 - at);
}
