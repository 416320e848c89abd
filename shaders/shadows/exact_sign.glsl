// SPDX-License-Identifier: MIT
// Signs without error, of sums and products of floats. A sum or a product of two is a pair, its
// rounded value and what rounding left: Knuth 1969, "The Art of Computer Programming" 2, 4.2.2, and
// Dekker 1971, "A Floating-Point Technique for Extending the Available Precision". Many of them are
// summed to floats that do not overlap: Shewchuk 1997, "Adaptive Precision Floating-Point
// Arithmetic and Fast Robust Geometric Predicates", section 2. Nothing may overflow, or be lost
// below the least float.

vec2 exact_sum(float a, float b)
{
    precise float sum = a + b;
    precise float of_b = sum - a;
    precise float rest = (a - (sum - of_b)) + (b - of_b);
    return vec2(sum, rest);
}

// The upper half of its bits.
float exact_half(float a)
{
    precise float more = 4097.0 * a;
    precise float upper = more - (more - a);
    return upper;
}

vec2 exact_product(float a, float b)
{
    precise float product = a * b;
    float ah = exact_half(a), bh = exact_half(b);
    precise float al = a - ah;
    precise float bl = b - bh;
    precise float rest = al * bl - (((product - ah * bh) - al * bh) - ah * bl);
    return vec2(product, rest);
}

// Of ab - cd. Rounding keeps the order of what it does not make equal.
int exact_sign_of_difference(float a, float b, float c, float d)
{
    vec2 x = exact_product(a, b), y = exact_product(c, d);
    float more = x.x != y.x ? x.x : x.y, less = x.x != y.x ? y.x : y.y;
    return more > less ? 1 : more < less ? -1 : 0;
}

// ---- determinants of four points ----

const int EXACT_PARTS = 96; // 24 products of three floats, four parts each

// Of the determinant of homogeneous points whose w is 0, 1 or -1, product by product. Coordinates
// may differ by 2^48: the largest is brought to 2^30.
int exact_sign_of_products(vec4 p[4])
{
    vec4 largest = max(max(abs(p[0]), abs(p[1])), max(abs(p[2]), abs(p[3])));
    int exponent;
    frexp(max(largest.x, max(largest.y, largest.z)), exponent);
    float parts[EXACT_PARTS];
    parts[0] = 0.0;
    int count = 0;
    for (int i = 0; i < 24; i++) {
        int without = i / 6, order = i % 6; // the point whose w counts; places of x, y, z
        int a = order % 3, b = (a + 1 + order / 3) % 3, c = 3 - a - b;
        bool is_negative = (without % 2 == 0) != (order >= 3);
        float x = ldexp(p[without == 0 ? 1 : 0][a], 30 - exponent) * p[without].w;
        float y = ldexp(p[without <= 1 ? 2 : 1][b], 30 - exponent);
        float z = ldexp(p[without <= 2 ? 3 : 2][c], 30 - exponent);
        vec2 xy = exact_product(is_negative ? -x : x, y);
        vec4 sums = vec4(exact_product(xy.y, z).yx, exact_product(xy.x, z).yx);
        for (int k = 0; k < 4; k++) {
            float carry = sums[k];
            int kept = 0;
            for (int j = 0; j < count; j++) {
                vec2 sum = exact_sum(carry, parts[j]);
                carry = sum.x;
                if (sum.y != 0.0)
                    parts[kept++] = sum.y;
            }
            if (carry != 0.0)
                parts[kept++] = carry;
            count = kept;
        }
    }
    float first = count > 0 ? parts[count - 1] : 0.0;
    return first > 0.0 ? 1 : first < 0.0 ? -1 : 0;
}
