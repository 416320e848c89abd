// SPDX-License-Identifier: MIT
// Products of transmittances and sums of light and of optical depth over ten thousand layers: what
// f32 rounds away at each of them would be seen. A wide number is an f64, or with WIDE_PAIRS the
// unevaluated sum of two f32, hi + lo, for devices on which f64 is slow or emulated; the host
// chooses by measurement (renderer/gl/wide_floats.h). docs/reference/accuracy.md, "Arithmetic of
// layers", has the bounds.
//   two_sum         Knuth 1969, "The Art of Computer Programming" 2, 4.2.2, theorem B
//   fast_sum        Dekker 1971, "A floating-point technique for extending the available precision"
//   product_error   by fma, or with WIDE_SPLIT, where fma rounds twice, Dekker's product of halves
//   wide_add        algorithm 4 of Joldes, Muller, Popescu 2017, "Tight and rigorous error bounds
//                   for basic building blocks of double-word arithmetic"
//   share_filter    algorithms 9 and 12 there, which leave lo * lo out
//   light_add       Ogita, Rump, Oishi 2005, "Accurate sum and dot product", algorithm 4.4: errors
//                   are summed beside, so that an infinite sum stays infinite
// A share is the product of transmittances from the eye or the light on. Pairs carry it times 2^64:
// the errors of products stay above what devices flush to zero as long as the share is an f32.
#ifndef WIDE_PAIRS
#define wide double
#define wide3 dvec3
#define wide_size3 dvec3

wide wide_product(float a, float b)
{
    return double(a) * double(b);
}

wide3 wide_of(vec3 a)
{
    return dvec3(a);
}

vec3 wide_round(wide3 a)
{
    return vec3(a);
}

wide3 wide_one_minus(vec3 a)
{
    return 1.0LF - dvec3(a);
}

// Two f32 that keep it (48 of its bits), and what they keep.
vec3 wide_high(wide3 a)
{
    return vec3(a);
}

vec3 wide_low(wide3 a)
{
    vec3 rest = vec3(a - dvec3(vec3(a)));
    return mix(rest, vec3(0.0), isnan(rest)); // infinite
}

wide3 wide_join(vec3 high, vec3 low)
{
    return dvec3(high) + dvec3(low);
}

wide3 wide_mix(wide3 a, wide3 b, bvec3 takes_b)
{
    return mix(a, b, takes_b);
}

wide3 wide_positive(wide3 a)
{
    return max(a, dvec3(0.0LF));
}

wide3 wide_add(wide3 a, vec3 b)
{
    return a + dvec3(b);
}

wide_size3 wide_size(wide3 a)
{
    return a;
}

bvec3 wide_is_above(wide3 a, wide_size3 least)
{
    return greaterThan(abs(a), least);
}

wide3 depth_add(wide3 tau, wide3 sigma, wide way)
{
    return tau + sigma * way;
}

wide3 depth_add(wide3 tau, wide3 sigma, float way)
{
    return tau + sigma * double(way);
}

wide3 share_all()
{
    return dvec3(1.0LF);
}

wide3 share_filter(wide3 share, wide3 t)
{
    return share * t;
}

wide3 share_filter(wide3 share, vec3 t)
{
    return share * dvec3(t);
}

// Of what one lets through of what the other does.
wide3 share_join(wide3 a, wide3 b)
{
    return a * b;
}

vec3 share_round(wide3 share)
{
    return vec3(share);
}

wide3 light_add(wide3 light, wide3 share, vec3 layer)
{
    return light + share * dvec3(layer);
}
#else
struct wide {
    float hi, lo;
};

struct wide3 {
    vec3 hi, lo;
};
#define wide_size3 vec3

const float SHARE_ALL = 1.8446744073709552e19, SHARE_UNIT = 5.421010862427522e-20; // 2^64, 2^-64

// a + b, exactly.
wide3 two_sum(vec3 a, vec3 b)
{
    precise vec3 s = a + b;
    precise vec3 t = s - a;
    precise vec3 e = (a - (s - t)) + (b - t);
    return wide3(s, e);
}

// The same where b is not the larger one, or a is 0.
wide3 fast_sum(vec3 a, vec3 b)
{
    precise vec3 s = a + b;
    precise vec3 e = b - (s - a);
    return wide3(s, e);
}

// a * b - p, exactly, where p is a * b rounded.
vec3 product_error(vec3 a, vec3 b, vec3 p)
{
#ifdef WIDE_SPLIT
    // Halves of 12 bits, whose products are exact.
    vec3 a1 = uintBitsToFloat(floatBitsToUint(a) & 0xfffff000u);
    vec3 b1 = uintBitsToFloat(floatBitsToUint(b) & 0xfffff000u);
    precise vec3 a2 = a - a1;
    precise vec3 b2 = b - b1;
    precise vec3 e = ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2;
#else
    precise vec3 e = fma(a, b, -p);
#endif
    return e;
}

wide wide_product(float a, float b)
{
    precise float p = a * b;
    return wide(p, product_error(vec3(a), vec3(b), vec3(p)).x);
}

wide3 wide_of(vec3 a)
{
    return wide3(a, vec3(0.0));
}

vec3 wide_round(wide3 a)
{
    vec3 sum = a.hi + a.lo;
    return mix(sum, a.hi, isnan(sum)); // infinite: lo means nothing
}

wide3 wide_one_minus(vec3 a)
{
    return fast_sum(vec3(1.0), -a);
}

vec3 wide_high(wide3 a)
{
    return a.hi;
}

vec3 wide_low(wide3 a)
{
    return a.lo;
}

wide3 wide_join(vec3 high, vec3 low)
{
    return wide3(high, low);
}

wide3 wide_mix(wide3 a, wide3 b, bvec3 takes_b)
{
    return wide3(mix(a.hi, b.hi, takes_b), mix(a.lo, b.lo, takes_b));
}

wide3 wide_positive(wide3 a)
{
    return wide_mix(wide3(vec3(0.0), vec3(0.0)), a, greaterThan(a.hi, vec3(0.0)));
}

wide3 wide_add(wide3 a, vec3 b)
{
    wide3 s = two_sum(a.hi, b);
    precise vec3 lo = a.lo + s.lo;
    return fast_sum(s.hi, lo);
}

wide_size3 wide_size(wide3 a)
{
    return a.hi;
}

bvec3 wide_is_above(wide3 a, wide_size3 least)
{
    return greaterThan(abs(a.hi), least);
}

wide3 depth_add(wide3 tau, wide3 sigma, float way)
{
    precise vec3 p = sigma.hi * way;
    precise vec3 e = fma(sigma.lo, vec3(way), product_error(sigma.hi, vec3(way), p));
    wide3 s = two_sum(tau.hi, p);
    precise vec3 lo = tau.lo + (s.lo + e);
    return wide3(s.hi, lo);
}

wide3 depth_add(wide3 tau, wide3 sigma, wide way)
{
    wide3 sum = depth_add(tau, sigma, way.hi);
    precise vec3 lo = fma(sigma.hi, vec3(way.lo), sum.lo);
    return wide3(sum.hi, lo);
}

wide3 share_all()
{
    return wide3(vec3(SHARE_ALL), vec3(0.0));
}

wide3 share_filter(wide3 share, vec3 t)
{
    precise vec3 p = share.hi * t;
    precise vec3 e = fma(share.lo, t, product_error(share.hi, t, p));
    return fast_sum(p, e);
}

wide3 share_filter(wide3 share, wide3 t)
{
    precise vec3 p = share.hi * t.hi;
    precise vec3 e = fma(share.lo, t.hi, product_error(share.hi, t.hi, p));
    precise vec3 lo = fma(share.hi, t.lo, e);
    return fast_sum(p, lo);
}

wide3 share_join(wide3 a, wide3 b)
{
    return share_filter(a, wide3(b.hi * SHARE_UNIT, b.lo * SHARE_UNIT));
}

vec3 share_round(wide3 share)
{
    return share.hi * SHARE_UNIT;
}

wide3 light_add(wide3 light, wide3 share, vec3 layer)
{
    precise vec3 part = share.hi * SHARE_UNIT * layer;
    wide3 s = two_sum(light.hi, part);
    precise vec3 lo = light.lo + s.lo;
    return wide3(s.hi, lo);
}
#endif

// The sum of what begins and ends: what only rounding keeps from zero is zero.
struct wide_balance {
    wide3 sum;
    wide_size3 size; // of all that was added
};

wide_balance balance_of(wide3 begun)
{
    return wide_balance(begun, wide_size(begun));
}

void balance_add(inout wide_balance b, vec3 change)
{
    b.sum = wide_add(b.sum, change);
    b.size += abs(wide_size3(change));
    b.sum = wide_mix(wide_of(vec3(0.0)), b.sum, wide_is_above(b.sum, b.size * 1.5e-11)); // 2^-36
}
