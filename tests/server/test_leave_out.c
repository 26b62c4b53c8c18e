/* SPDX-License-Identifier: GPL-3.0-or-later
 * The loops written by hand do what whole runs do, to the last bit, so that bench compares like
 * with like; and memory is what the scene needs, to the byte. */
#include "cli_bench_leave_out.h"
#include "support/experiment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { RODS = 30, TICKS = 4000, BINS = 50 };

static struct bcd_scene *scene_of(size_t which, bool strang, unsigned features)
{
    char more[256];
    double step = features & BCD_BASELINE_STICKY ? 1e-5 : 1e-4;
    snprintf(more, sizeof more,
             ",\"time\":%.17g,\"observables\":{\"trajectory\":{\"every\":%.17g}%s}",
             TICKS * step, 1000 * step,
             features & BCD_BASELINE_DENSITY ? ",\"density\":{\"bins\":50}" : "");
    char *job = leave_out_job(which, strang, RODS, more);
    assert_non_null(job);
    struct bcd_scene *scene = experiment_scene("%s", job);
    free(job);
    return scene;
}

/* Positions at the end, bit for bit; the density, whose counts both have, to rounding. */
static void compare(size_t which, bool strang, unsigned features)
{
    struct experiment e = experiment_run(scene_of(which, strang, features), 0);
    struct bcd_baseline *loop = NULL;
    assert_int_equal(
        bcd_baseline_create(&loop, features, strang ? BCD_BASELINE_STRANG : BCD_BASELINE_BCD, RODS),
        BCD_OK);
    bcd_baseline_advance(loop, TICKS);
    struct bcd_table *path = experiment_table(&e, "trajectory");
    const double *x = column_of(path, BCD_ROLE_VALUE);
    double by_hand[RODS];
    bcd_baseline_positions(loop, by_hand);
    size_t points = path->rows / RODS, moved = 0;
    for (size_t i = 0; i < RODS; i++) {
        if (x[i * points + points - 1] != by_hand[i])
            fail_msg("%s, %s: rod %zu is at %.17g and %.17g", bcd_baseline_name(which, &features),
                     strang ? "strang" : "bcd", i, x[i * points + points - 1],
                     by_hand[i]);
        moved += x[i * points + points - 1] != x[i * points];
    }
    assert_int_equal(moved, RODS);
    bcd_table_free(path);
    if (features & BCD_BASELINE_DENSITY) {
        struct bcd_table *density = experiment_table(&e, "density");
        const int64_t *counts = bcd_baseline_counts(loop);
        double all = 0, sum = 0;
        for (size_t i = 0; i < BINS; i++) {
            all += (double)counts[i];
            sum += column_of(density, BCD_ROLE_VALUE)[i];
        }
        assert_true(all == RODS * TICKS / 20.0);
        for (size_t i = 0; i < BINS; i++)
            assert_within(column_of(density, BCD_ROLE_VALUE)[i] / sum, (double)counts[i] / all, 0,
                          0, 0.02);
        bcd_table_free(density);
    }
    bcd_baseline_free(loop);
    experiment_end(&e);
}

static void test_same_positions(void **state)
{
    (void)state;
    unsigned features;
    for (size_t s = 0; bcd_baseline_name(s, &features); s++)
        for (int strang = 0; strang < 2; strang++)
            compare(s, strang == 1, features);
}

/* Bytes for each further rod of a run in motion, without its checkpoint: y, and what the method
 * works in. */
#define ASKS_DENSITY ",\"time\":10,\"observables\":{\"density\":{\"bins\":50}}"
#define ASKS_CURRENT ",\"time\":10,\"observables\":{\"current\":{}}"
static double bytes_per_rod(size_t which, bool strang, const char *asks)
{
    double bytes[2];
    for (int k = 0; k < 2; k++) {
        const int64_t n = k ? 10240 : 5120; /* both whole cache lines */
        char *job = leave_out_job(which, strang, n, asks);
        struct bcd_scene *scene = experiment_scene("%s", job);
        struct bcd_estimate estimate;
        struct bcd_run *run = NULL;
        bcd_scene_estimate(scene, &estimate);
        assert_int_equal(bcd_run_create(&run, scene, 0, NULL), BCD_OK);
        bytes[k] = estimate.run_bytes - (double)bcd_run_checkpoint_size(run);
        bcd_run_free(run);
        bcd_scene_free(scene);
        free(job);
    }
    return (bytes[1] - bytes[0]) / 5120;
}

/* bcd: y, half a block of 40 bytes, where rods were as far as pairs need it. strang: y and the
 * sort's scratch; half a block where a drift varies in space, half way where no exact flow is
 * known, the view where density is asked for and not exact anyway. Nothing else grows with the
 * rods, as long as they are too few for several hands (engine/sharing.h): a fortieth of a byte. */
static void test_memory(void **state)
{
    (void)state;
    unsigned features;
    for (size_t s = 0; bcd_baseline_name(s, &features); s++) {
        bool varies = features & (BCD_BASELINE_FIELD | BCD_BASELINE_STICKY);
        double drift = varies ? 20 : 0, view = varies ? 8 : 0;
        double middle = features & BCD_BASELINE_STICKY ? 8 : 0, old = middle;
        assert_true(bytes_per_rod(s, false, ASKS_DENSITY) == 8 + old + 20);
        assert_true(bytes_per_rod(s, true, ASKS_DENSITY) == 8 + 8 + drift + middle + view);
        assert_true(bytes_per_rod(s, true, ASKS_CURRENT) == 8 + 8 + drift + middle);
    }
}

/* What is not asked for is not there: 3 numbers of a tally and a counter for each bin, in both
 * views; nothing of it without the observable. */
static void test_memory_of_an_observable(void **state)
{
    (void)state;
    double bytes[2];
    for (int k = 0; k < 2; k++) {
        char *job = leave_out_job(0, false, RODS,
                                  k ? ",\"time\":10,\"observables\":{\"density\":{\"bins\":1000}}"
                                    : ",\"time\":10,\"observables\":{\"density\":{\"bins\":200}}");
        struct bcd_scene *scene = experiment_scene("%s", job);
        struct bcd_estimate estimate;
        bcd_scene_estimate(scene, &estimate);
        bytes[k] = estimate.run_bytes;
        bcd_scene_free(scene);
        free(job);
    }
    /* counter, tally; both again in the checkpoint; the values of an ending block */
    assert_true(bytes[1] - bytes[0] == 800 * (2 * (8 + 3 * 8) + 8));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_positions),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_memory_of_an_observable),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
