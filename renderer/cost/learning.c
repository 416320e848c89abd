/* SPDX-License-Identifier: MIT */
/* The filter over the factors, and the views beside it. */
#include "renderer/cost/learning.h"

#include <math.h>

/* Standard deviations of natural logarithms before any observation. MACHINE: of all terms together,
 * a device that is slower than calibration found. TERM: of one term; fits of forecast.c are off by
 * 1.2 to 1.6. FAMILY: what its terms do not tell. */
static const double MACHINE = 0.3, TERM = 0.4, FAMILY = 0.25;
static const double SCENE = 0.35;      /* what one scene is off by itself */
static const double NOISE = 0.12;      /* of one frame's time */
static const double FORGETS = 0.03;    /* each observation adds this deviation to each factor's */
static const double FACTOR_MOST = 2.1; /* a factor of 8 */
/* How far one observation moves an expectation: a quarter up; down 2.4 times, since other processes
 * make frames longer and none makes them shorter. */
static const double LIMIT = 0.223, LIMIT_DOWN = 4;
/* An observation that is longer than that, 1.6 times of a view that was drawn before and else 2.5
 * times, is passed over until another agrees. */
static const double ODD_KNOWN = 0.5, ODD = 0.9;
enum { RUN_MOST = 4 };

static double prior(int i, int k)
{
    bool are_terms = i < FORECAST_TERM_COUNT && k < FORECAST_TERM_COUNT;
    double own = i < FORECAST_TERM_COUNT ? TERM : FAMILY;
    return (are_terms ? MACHINE * MACHINE : 0) + (i == k ? own * own : 0);
}

void learning_init(struct learning *learning)
{
    *learning = (struct learning){.clock = 0};
    for (int i = 0; i < LEARNING_STATES; i++)
        for (int k = 0; k < LEARNING_STATES; k++)
            learning->doubt[i][k] = prior(i, k);
}

/* ---- expectation ---- */

/* Whose factor a technique has: without shadows a picture takes what one with maps does, without
 * their work. */
static enum shadow_family family_of(const struct learning_case *frame)
{
    enum shadow_family family = shadow_technique_family(frame->technique);
    return family == SHADOW_FAMILY_NONE ? SHADOW_FAMILY_MAPS : family;
}

/* The logarithm of the time by the factors alone, its slope over each factor, and the product of
 * the covariance with the slope. */
struct estimate {
    double log_ms, slope[LEARNING_STATES], spread[LEARNING_STATES], variance;
};

static bool estimate(const struct learning *learning, const struct learning_case *frame,
                     struct estimate *e)
{
    double ms = 0;
    int family = FORECAST_TERM_COUNT + (int)family_of(frame);
    *e = (struct estimate){.log_ms = 0};
    for (int i = 0; i < FORECAST_TERM_COUNT; i++) {
        if (!(frame->terms[i] >= 0))
            return false;
        e->slope[i] = frame->terms[i] * exp(learning->factor[i]);
        ms += e->slope[i];
    }
    if (!(ms > 0) || !isfinite(ms))
        return false;
    for (int i = 0; i < FORECAST_TERM_COUNT; i++)
        e->slope[i] /= ms;
    e->slope[family] = 1;
    for (int i = 0; i < LEARNING_STATES; i++)
        for (int k = 0; k < LEARNING_STATES; k++)
            e->spread[i] += learning->doubt[i][k] * e->slope[k];
    for (int i = 0; i < LEARNING_STATES; i++)
        e->variance += e->slope[i] * e->spread[i];
    e->log_ms = log(ms) + learning->factor[family];
    return true;
}

/* A view's key with the technique: mixed by the finaliser of MurmurHash3 (Appleby 2011). */
static uint64_t entry_key(const struct learning_case *frame)
{
    uint64_t key = frame->view + 0x9e3779b97f4a7c15u * (1 + (uint64_t)frame->technique);
    key = (key ^ key >> 33) * 0xff51afd7ed558ccdu;
    key = (key ^ key >> 33) * 0xc4ceb9fe1a85ec53u;
    key ^= key >> 33;
    return frame->view ? key | 1 : 0;
}

static const struct learning_view *find_view(const struct learning *learning, uint64_t key)
{
    for (int i = 0; key && i < LEARNING_VIEWS_MAX; i++)
        if (learning->views[i].key == key)
            return &learning->views[i];
    return NULL;
}

struct learning_answer learning_expect(const struct learning *learning,
                                       const struct learning_case *frame)
{
    struct estimate e;
    const struct learning_view *view = find_view(learning, entry_key(frame));
    if (!estimate(learning, frame, &e))
        return (struct learning_answer){.ms = 0};
    uint32_t observations = view ? view->count : 0;
    double variance = NOISE * NOISE + (observations ? 0 : e.variance + SCENE * SCENE);
    return (struct learning_answer){.ms = exp(e.log_ms + (view ? view->off : 0)),
                                    .doubt = sqrt(fmax(variance, 0)),
                                    .observations = observations,
                                    .is_shown = view && view->is_shown};
}

/* ---- observations ---- */

/* `off` cut to what one observation may move after so many of its kind. odd: what is more is passed
 * over unless the one before was, too. */
static double cut(double off, double odd, struct learning_run *run)
{
    int agreeing = off > 0 ? (run->count > 0 ? run->count : 0) : (run->count < 0 ? -run->count : 0);
    double most = LIMIT * (off < 0 ? LIMIT_DOWN : 1) * (1 << agreeing);
    bool is_passed = off > odd && !run->passed;
    run->passed = off > odd;
    if (is_passed)
        return 0;
    if (fabs(off) <= most) {
        run->count = 0;
        return off;
    }
    agreeing = agreeing < RUN_MOST ? agreeing + 1 : RUN_MOST;
    run->count = off > 0 ? agreeing : -agreeing;
    return copysign(most, off);
}

static void forget(struct learning *learning)
{
    for (int i = 0; i < LEARNING_STATES; i++) {
        double grown = learning->doubt[i][i] + FORGETS * FORGETS, most = prior(i, i);
        double scale = grown > most ? sqrt(most / grown) : 1;
        learning->doubt[i][i] = grown;
        for (int k = 0; k < LEARNING_STATES && scale < 1; k++) {
            learning->doubt[i][k] *= scale;
            learning->doubt[k][i] *= scale;
        }
    }
}

/* One step of the filter. Where the observation was cut its noise is taken to be as large as makes
 * the step that of the cut. */
static void correct(struct learning *learning, const struct estimate *e, double noise, double off,
                    double cut_off)
{
    double total = e->variance + noise;
    if (!(fabs(cut_off) > 0)) /* passed over, or just as expected */
        return;
    if (fabs(off) * e->variance > fabs(cut_off) * total)
        total = fabs(off) * e->variance / fabs(cut_off);
    for (int i = 0; i < LEARNING_STATES; i++) {
        double moved = learning->factor[i] + e->spread[i] / total * off;
        learning->factor[i] = fmin(fmax(moved, -FACTOR_MOST), FACTOR_MOST);
    }
    for (int i = 0; i < LEARNING_STATES; i++)
        for (int k = 0; k < LEARNING_STATES; k++)
            learning->doubt[i][k] -= e->spread[i] * e->spread[k] / total;
    forget(learning);
}

static struct learning_view *find_room(struct learning *learning, uint64_t key)
{
    struct learning_view *oldest = &learning->views[0];
    for (int i = 0; i < LEARNING_VIEWS_MAX; i++) {
        if (learning->views[i].key == key)
            return &learning->views[i];
        if (learning->views[i].clock < oldest->clock)
            oldest = &learning->views[i];
    }
    *oldest = (struct learning_view){.key = key};
    return oldest;
}

void learning_teach(struct learning *learning, const struct learning_case *frame, double taken_ms)
{
    struct estimate e;
    if (!(taken_ms > 0) || !isfinite(taken_ms) || !estimate(learning, frame, &e))
        return;
    uint64_t key = entry_key(frame);
    struct learning_view *view = key ? find_room(learning, key) : NULL;
    double known = e.log_ms + (view ? view->off : 0), taken = log(taken_ms);
    double off = taken - e.log_ms;
    learning->clock++;
    /* The more observations of a view, the less each of them tells of others. */
    double noise = NOISE * NOISE + (view ? SCENE * SCENE * (1 + fmin(view->count, 8)) : 0);
    correct(learning, &e, noise, off, cut(off, ODD, &learning->run[family_of(frame)]));
    if (!view)
        return;
    /* The view's own expectation goes to what it took, by no more than the limit; of later
     * observations the mean of about the last three counts. */
    int32_t before = view->run.count;
    double moved = cut(taken - known, view->count ? ODD_KNOWN : ODD, &view->run);
    bool is_on_its_way =
        before > 1 || before < 0 || view->run.count > 1 || view->run.count < 0 || !view->count;
    double weight = is_on_its_way ? 1 : fmax(1. / (view->count + 1), 1. / 3);
    (void)estimate(learning, frame, &e); /* the factors have moved */
    view->off = known + weight * moved - e.log_ms;
    view->off = fmin(fmax(view->off, -FACTOR_MOST), FACTOR_MOST);
    bool is_taken = fabs(moved) > 0 || !view->run.passed;
    view->count += is_taken && view->count < UINT32_MAX;
    view->clock = learning->clock;
}

void learning_show(struct learning *learning, const struct learning_case *frame)
{
    const struct learning_view *shown = find_view(learning, entry_key(frame));
    struct learning_case other = *frame;
    for (int i = 0; shown && i < SHADOWS_COUNT; i++) {
        other.technique = (enum shadow_technique)i;
        const struct learning_view *view = find_view(learning, entry_key(&other));
        if (view)
            learning->views[view - learning->views].is_shown = view == shown;
    }
}

/* ---- soundness ---- */

static bool is_within(double value, double most)
{
    return fabs(value) <= most; /* false of what is no number */
}

static bool is_run(const struct learning_run *run)
{
    return run->count >= -RUN_MOST && run->count <= RUN_MOST && (run->passed & ~1) == 0;
}

bool learning_is_sound(const struct learning *learning)
{
    bool is_sound = true;
    for (int i = 0; i < LEARNING_STATES; i++) {
        const double *row = learning->doubt[i];
        is_sound = is_sound && is_within(learning->factor[i], FACTOR_MOST) && row[i] >= 0 &&
                   row[i] <= prior(i, i) * (1 + 1e-9);
        for (int k = 0; k < LEARNING_STATES; k++) {
            double most = sqrt(fmax(row[i] * learning->doubt[k][k], 0));
            is_sound = is_sound && is_within(row[k], most * (1 + 1e-6) + 1e-9) &&
                       is_within(row[k] - learning->doubt[k][i], 1e-9);
        }
    }
    for (int i = 0; i < LEARNING_FAMILIES; i++)
        is_sound = is_sound && is_run(&learning->run[i]);
    for (int i = 0; i < LEARNING_VIEWS_MAX; i++)
        is_sound = is_sound && is_within(learning->views[i].off, FACTOR_MOST) &&
                   is_run(&learning->views[i].run) && learning->views[i].is_shown <= 1 &&
                   learning->views[i].clock <= learning->clock;
    return is_sound;
}
