/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bench_turns.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

const struct bench_effort bench_usual = {2e7, 7};
const struct bench_effort bench_careful = {5e7, 7};

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

double bench_median_stderr(double *values, size_t count)
{
    /* Of normal deviates the median deviation is sigma / 1.4826 and that of a median's error
     * sqrt(pi / 2) sigma / sqrt(count). */
    double median = bench_median(values, count);
    for (size_t i = 0; i < count; i++)
        values[i] = fabs(values[i] - median);
    return 1.4826 * 1.2533 * bench_median(values, count) / sqrt((double)count);
}

/* ns of `ticks` ticks; NaN = failed. */
static double timed(const struct bench_work *work, int64_t ticks)
{
    double start = now_ns();
    return work->advance(work->context, ticks) ? now_ns() - start : NAN;
}

/* ns of a tick, from as few ticks as tell it; warms caches on the way. */
static double estimate(const struct bench_work *work, const struct bench_effort *effort)
{
    int64_t ticks = 1;
    double ns = timed(work, ticks);
    while (ns < effort->turn_ns / 10 && ticks < INT64_C(1) << 40) {
        ticks *= 2;
        ns = timed(work, ticks);
    }
    return ns / (double)ticks;
}

enum bench_outcome bench_turns(const struct bench_work work[2], const struct bench_effort *effort,
                               struct bench_timing *timing)
{
    const size_t turns = (size_t)effort->turns;
    double step[2][BENCH_TURNS_MAX], ratio[BENCH_TURNS_MAX];
    double tick = estimate(&work[1], effort);
    timing->ns[1] = tick;
    if (tick > BENCH_TICK_NS_MAX)
        return BENCH_TOO_SLOW;
    tick = fmax(tick, estimate(&work[0], effort));
    if (isnan(tick))
        return BENCH_FAILED;
    int64_t ticks = (int64_t)fmax(effort->turn_ns / tick, 1);
    for (size_t i = 0; i < turns; i++) {
        for (int k = 0; k < 2; k++)
            step[k][i] = timed(&work[k], ticks) / (double)ticks;
        ratio[i] = step[1][i] / step[0][i];
        if (isnan(ratio[i]))
            return BENCH_FAILED;
    }
    for (int k = 0; k < 2; k++) {
        timing->ns[k] = bench_median(step[k], turns);
        timing->ns_stderr[k] = bench_median_stderr(step[k], turns);
    }
    timing->ratio = bench_median(ratio, turns);
    timing->ratio_stderr = bench_median_stderr(ratio, turns);
    return BENCH_DONE;
}
