/* SPDX-License-Identifier: MIT */
/* Wall and processor time of one frame and of the parts it is made of, as the renderer runs.
 *
 * The program is linked with --wrap for gpu_scope_begin, gpu_scope_end, shadow_system_prepare,
 * light_lists_prepare and shade_window, so that the meter sees them without the renderer knowing.
 * Processor time is that of the whole process: on llvmpipe the device is our own cores, and this is
 * the steady figure on a machine that others use, too. Where GPU timers are honest the renderer
 * does not wait at the end of a pass, so there only the wall times of passes, from the report, mean
 * anything. */
#ifndef VITRAIL_TESTS_BENCH_METER_H
#define VITRAIL_TESTS_BENCH_METER_H

#include "renderer/frame_report.h"
#include "tests/bench/samples.h"

/* Parts that are not passes: everything of a stage, on the CPU and on the device. */
#define PART_SHADOW "= shadow"         /* shadow_system_prepare */
#define PART_LIGHT_LIST "= light_list" /* light_lists_prepare */
#define PART_LOOKUPS "= lookups"       /* of no frame: see meter_ask_lookups */
#define PART_OTHER "= other"           /* the frame less all passes */

enum { PARTS_MAX = 32 };

struct part {
    char name[REPORT_NAME_BYTES];
    double wall_ms, cpu_ms;
};

struct frame_times { /* of one frame */
    double wall_ms, cpu_ms;
    struct part parts[PARTS_MAX];
    int part_count;
    uint64_t lookups; /* those of PART_LOOKUPS */
};

double wall_now_ms(void);
double cpu_now_ms(void);

/* Everything between the two calls counts as one frame. With rebuilds_shadows the shadow system
 * forgets the scene's structures before it prepares them, outside the time of PART_SHADOW: each
 * frame then builds all of them anew in the same memory. */
void meter_begin(bool rebuilds_shadows);
/* Between the two calls: beside what the frame does, its shadow lookups are made once more by
 * themselves (tests/bench/lookups.h). They count as PART_LOOKUPS, not as the frame's time. */
void meter_ask_lookups(void);
void meter_end(struct frame_times *times);
/* Wall times of passes as the renderer reports them: true on every device. */
void frame_times_take_report(struct frame_times *times, const struct frame_report *report);

/* Many frames. Zeroed = empty. */
struct part_series {
    char name[REPORT_NAME_BYTES];
    struct samples wall_ms, cpu_ms;
};

struct measurement {
    struct samples wall_ms, cpu_ms;
    struct part_series parts[PARTS_MAX];
    int part_count;
    struct frame_report report; /* of the last frame, and its lookups made by themselves */
    uint64_t lookups;
};

void measurement_add(struct measurement *measurement, const struct frame_times *times);
void measurement_finish(struct measurement *measurement);
/* NULL when no frame had such a part. */
const struct part_series *measurement_part(const struct measurement *measurement, const char *name);

#endif
