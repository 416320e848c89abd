/* SPDX-License-Identifier: MIT */
/* Crossings of sixteen rays are put in the order that each ray has by itself, or a ray is left out,
 * and what one lane holds, be it infinite or no number, changes nothing in the other fifteen. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/raytrace/rt_crossing.h"
#include "tests/support/light_scene.h"

enum { ROUNDS = 400 };

static const double APART_M = 1e-3;

struct subject {
    struct rt_crossings crossings;
    double t_min[RT_LANES], t_max[RT_LANES];
};

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* Sheets one behind the other, some of them near to the next one, and some not in each ray. */
static void make(struct subject *s, uint64_t *seed)
{
    memset(s, 0, sizeof *s);
    s->crossings.count = (int)random_uniform(seed, 0, RT_CROSSINGS_MAX + 0.99);
    for (int i = 0; i < RT_LANES; i++) {
        s->t_min[i] = 0.1;
        s->t_max[i] = random_uniform(seed, 0, 1) < 0.3 ? INFINITY : random_uniform(seed, 0.2, 14);
    }
    for (int c = 0; c < s->crossings.count; c++) {
        struct rt_crossing *to = &s->crossings.crossings[c];
        const double place = (c * 5 + 3) % RT_CROSSINGS_MAX + random_uniform(seed, 0.2, 0.5);
        to->least = UINT32_MAX;
        for (int i = 0; i < RT_LANES; i++) {
            const double lean = random_uniform(seed, 0, 1) < 0.06 ? 1 : 0.001 * i;
            const bool crosses = random_uniform(seed, 0, 1) < 0.8;
            to->t[i] = crosses ? (float)(place + lean) : INFINITY;
            to->meets[i] = random_uniform(seed, 0, 1) < 0.01 ? RT_MEETS_STEEP : RT_MEETS_CLEARLY;
            to->least = bits_of(to->t[i]) < to->least ? bits_of(to->t[i]) : to->least;
        }
    }
}

/* Whether the lane's crossings come clearly one after the other, and which lie before its end. */
static bool expect(const struct subject *s, int lane, uint32_t is_before[RT_CROSSINGS_MAX])
{
    double before = s->t_min[lane];
    bool is_clear = true;
    for (int c = 0; c < s->crossings.count; c++) {
        const struct rt_crossing *from = &s->crossings.crossings[s->crossings.order[c]];
        const double t = (double)from->t[lane], end = s->t_max[lane];
        is_before[s->crossings.order[c]] = t < INFINITY && t < end;
        if (!(t < INFINITY))
            continue;
        is_clear &= (from->meets[lane] & RT_MEETS_CLEARLY) == RT_MEETS_CLEARLY;
        if (t < end) {
            is_clear &= t - before > APART_M + 1e-5 * before;
            before = t;
        } else {
            is_clear &= t - end > APART_M + 1e-5 * end;
        }
    }
    return is_clear && s->t_max[lane] - before > APART_M + 1e-5 * before;
}

static void each_ray_has_its_own_order(void **state)
{
    (void)state;
    uint64_t seed = 9;
    int clear = 0, unclear = 0;
    for (int round = 0; round < ROUNDS; round++) {
        struct subject s;
        make(&s, &seed);
        const uint32_t lanes = rt_crossings_order(&s.crossings, APART_M, s.t_min, s.t_max);
        for (int i = 0; i < RT_LANES; i++) {
            uint32_t is_before[RT_CROSSINGS_MAX];
            const bool is_clear = expect(&s, i, is_before);
            assert_int_equal(lanes >> i & 1, is_clear);
            clear += is_clear;
            unclear += !is_clear;
            for (int c = 0; c < s.crossings.count; c++)
                assert_int_equal(s.crossings.crossings[c].is_before[i], is_before[c]);
        }
    }
    assert_true(clear > ROUNDS && unclear > ROUNDS);
}

static void odd_values_of_one_ray_change_no_other(void **state)
{
    (void)state;
    static const float odd[] = {NAN, INFINITY, -INFINITY, 0, -1, 1e-42f, 3e38f};
    uint64_t seed = 21;
    for (int round = 0; round < ROUNDS; round++) {
        struct subject s, other;
        const int lane = round % RT_LANES;
        make(&s, &seed);
        memcpy(&other, &s, sizeof s);
        for (int c = 0; c < s.crossings.count; c++)
            other.crossings.crossings[c].t[lane] = odd[(round + c) % 7];
        other.t_max[lane] = (double)odd[round % 5];
        const uint32_t lanes = rt_crossings_order(&s.crossings, APART_M, s.t_min, s.t_max);
        const uint32_t others =
            rt_crossings_order(&other.crossings, APART_M, other.t_min, other.t_max);
        assert_int_equal((lanes ^ others) & ~(1u << lane), 0);
        for (int c = 0; c < s.crossings.count; c++)
            for (int i = 0; i < RT_LANES; i++)
                if (i != lane)
                    assert_int_equal(s.crossings.crossings[c].is_before[i],
                                     other.crossings.crossings[c].is_before[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_ray_has_its_own_order),
        cmocka_unit_test(odd_values_of_one_ray_change_no_other),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
