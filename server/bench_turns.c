/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bench_turns.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

static const double turn_ns = 5e7; /* of the slower piece, in a turn */

static double now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double bench_median(double *values, size_t count)
{
    qsort(values, count, sizeof *values, by_value);
    return count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
}

/* ns of `ticks` ticks; NaN = failed. */
static double timed(const struct bench_work *work, int64_t ticks)
{
    double start = now_ns();
    return work->advance(work->context, ticks) ? now_ns() - start : NAN;
}

/* ns of a tick, from as few ticks as tell it; warms caches on the way. */
static double estimate(const struct bench_work *work)
{
    int64_t ticks = 1;
    double ns = timed(work, ticks);
    while (ns < turn_ns / 10 && ticks < INT64_C(1) << 40) {
        ticks *= 2;
        ns = timed(work, ticks);
    }
    return ns / (double)ticks;
}

enum bench_outcome bench_turns(const struct bench_work work[2], struct bench_timing *timing)
{
    double step[2][BENCH_TURNS], ratio[BENCH_TURNS];
    double tick = estimate(&work[1]);
    timing->ns[1] = tick;
    if (tick > BENCH_TICK_NS_MAX)
        return BENCH_TOO_SLOW;
    tick = fmax(tick, estimate(&work[0]));
    if (isnan(tick))
        return BENCH_FAILED;
    int64_t ticks = (int64_t)fmax(turn_ns / tick, 1);
    for (int i = 0; i < BENCH_TURNS; i++) {
        for (int k = 0; k < 2; k++)
            step[k][i] = timed(&work[k], ticks) / (double)ticks;
        ratio[i] = step[1][i] / step[0][i];
        if (isnan(ratio[i]))
            return BENCH_FAILED;
    }
    *timing = (struct bench_timing){{bench_median(step[0], BENCH_TURNS),
                                     bench_median(step[1], BENCH_TURNS)},
                                    bench_median(ratio, BENCH_TURNS)};
    return BENCH_DONE;
}
