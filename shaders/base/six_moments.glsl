// SPDX-License-Identifier: MIT
// What absorbs in front of a depth, told from six power moments of the absorbance over depth: as
// moments.glsl, whose functions it provides, with two moments more. So the distribution with as
// much as can be at the depth itself has three more depths: roots of a cubic polynomial, by
// trigonometric functions, whose errors on devices do not show.
// Provides: moments, moments_clear, moments_add, moments_normalize, masses_at.

const float MOMENT_BIAS = 5e-6; // the authors' for six power moments in f32, towards
const float MOMENT_2 = 0.48, MOMENT_4 = 0.451, MOMENT_6 = 0.45; // these, and 0 of odd order
const float DIAGONAL_LEAST = 1e-9; // what rounding leaves of the least diagonal of one depth
const float THIRD_OF_CIRCLE = 2.0943951;

struct moments {
    vec3 m0, m1, m2, m3, m4, m5, m6; // by channel
};

void moments_clear(out moments m)
{
    m = moments(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
}

void moments_add(inout moments m, vec3 tau, float z)
{
    float z2 = z * z;
    m.m0 += tau;
    m.m1 += tau * z;
    m.m2 += tau * z2;
    m.m3 += tau * (z2 * z);
    m.m4 += tau * (z2 * z2);
    m.m5 += tau * (z2 * z2 * z);
    m.m6 += tau * (z2 * z2 * z2);
}

// Of mass 1, biased.
moments moments_normalize(moments m)
{
    vec3 unit = 1.0 / max(m.m0, 1e-30);
    return moments(m.m0, mix(m.m1 * unit, vec3(0.0), MOMENT_BIAS),
                   mix(m.m2 * unit, vec3(MOMENT_2), MOMENT_BIAS),
                   mix(m.m3 * unit, vec3(0.0), MOMENT_BIAS),
                   mix(m.m4 * unit, vec3(MOMENT_4), MOMENT_BIAS),
                   mix(m.m5 * unit, vec3(0.0), MOMENT_BIAS),
                   mix(m.m6 * unit, vec3(MOMENT_6), MOMENT_BIAS));
}

// The three real roots of c0 + c1 x + c2 x^2 + c3 x^3.
void cubic_roots(vec3 c0, vec3 c1, vec3 c2, vec3 c3, out vec3 root[3])
{
    c3 = mix(c3, vec3(1e-20), lessThan(abs(c3), vec3(1e-20)));
    vec3 a = c2 / c3 / 3.0, b = c1 / c3 / 3.0, c = c0 / c3;
    vec3 s = sqrt(max(a * a - b, 0.0)); // of t^3 - 3 s^2 t + q with x = t - a
    vec3 q = 2.0 * a * a * a - 3.0 * a * b + c;
    vec3 angle = acos(clamp(-0.5 * q / max(s * s * s, 1e-30), -1.0, 1.0)) / 3.0;
    for (int k = 0; k < 3; k++)
        root[k] = 2.0 * s * cos(angle + float(k) * THIRD_OF_CIRCLE) - a;
}

// The mass at x, by the polynomial that is 1 there and 0 at the three others; 0 where x is not in
// front of z.
vec3 mass_in_front(moments m, vec3 x, vec3 z, vec3 a, vec3 b)
{
    vec3 sum = z + a + b, pairs = z * (a + b) + a * b, product = z * a * b;
    vec3 mass = (m.m3 - sum * m.m2 + pairs * m.m1 - product) / ((x - z) * (x - a) * (x - b));
    bvec3 counts = lessThan(x, z);
    return mix(vec3(0.0), mix(mass, vec3(0.0), isnan(mass)), counts);
}

// The share of all mass that is in front of z, where as much as can be is at z, and that much.
void masses_at(moments m, float z, out vec3 front, out vec3 at)
{
    // H c = (1, z, z^2, z^3), where H has the moments 0 to 6, by H = L D L^T
    vec3 d1 = max(m.m2 - m.m1 * m.m1, DIAGONAL_LEAST);
    vec3 l21 = (m.m3 - m.m2 * m.m1) / d1, l31 = (m.m4 - m.m3 * m.m1) / d1;
    vec3 d2 = max(m.m4 - m.m2 * m.m2 - l21 * l21 * d1, DIAGONAL_LEAST);
    vec3 l32 = (m.m5 - m.m3 * m.m2 - l31 * l21 * d1) / d2;
    vec3 d3 = max(m.m6 - m.m3 * m.m3 - l31 * l31 * d1 - l32 * l32 * d2, DIAGONAL_LEAST);
    vec3 y1 = z - m.m1;
    vec3 y2 = z * z - m.m2 - l21 * y1;
    vec3 y3 = z * z * z - m.m3 - l31 * y1 - l32 * y2;
    vec3 c3 = y3 / d3;
    vec3 c2 = y2 / d2 - l32 * c3;
    vec3 c1 = y1 / d1 - l21 * c2 - l31 * c3;
    vec3 c0 = 1.0 - m.m1 * c1 - m.m2 * c2 - m.m3 * c3;
    vec3 root[3];
    at = 1.0 / (1.0 + y1 * y1 / d1 + y2 * y2 / d2 + y3 * y3 / d3);
    cubic_roots(c0, c1, c2, c3, root);
    front = mass_in_front(m, root[0], vec3(z), root[1], root[2]) +
            mass_in_front(m, root[1], vec3(z), root[0], root[2]) +
            mass_in_front(m, root[2], vec3(z), root[0], root[1]);
    front = clamp(front, vec3(0.0), 1.0 - at);
}
