/* SPDX-License-Identifier: GPL-3.0-or-later
 * Error bars against what they stand for: the spread of the same job's results over many seeds. */
#include "support/experiment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

enum { SEEDS = 1500, VALUES_MAX = 8 };

/* Of one number of a result over seeds: how its error bars compare with its spread. */
struct spread {
    double n, mean, square, variance; /* variance: sum of squared standard errors */
};

static void spread_add(struct spread *s, double value, double error)
{
    s->n += 1;
    double off = value - s->mean;
    s->mean += off / s->n;
    s->square += off * (value - s->mean);
    s->variance += error * error;
}

/* Root mean square of the error bars over the spread: 1 when they tell the truth. Known to
 * 1/sqrt(2 SEEDS) = 2 % from the spread. */
static double spread_ratio(const struct spread *s)
{
    return sqrt(s->variance / s->n / (s->square / (s->n - 1)));
}

static void assert_ratio(const struct spread *s, double least, double most)
{
    double ratio = spread_ratio(s);
    if (ratio < least || ratio > most)
        fail_msg("error bars are %.3f of the spread over seeds", ratio);
}

static void measure(struct spread *spreads, const char *observable, const char *job)
{
    for (int seed = 1; seed <= SEEDS; seed++) {
        struct experiment e = {.scene = experiment_scene("{'seed': %d, %s", seed, job)};
        assert_int_equal(bcd_tally_create(&e.tally, e.scene), BCD_OK);
        for (int64_t chunk = 0; chunk < bcd_scene_chunks(e.scene); chunk++) {
            struct bcd_run *run = NULL;
            assert_int_equal(bcd_run_create(&run, e.scene, chunk, NULL), BCD_OK);
            assert_int_equal(bcd_run_advance(run, bcd_run_ticks_total(run), NULL), BCD_OK);
            bcd_tally_merge(e.tally, bcd_run_tally(run));
            bcd_run_free(run);
        }
        struct bcd_table *t = experiment_table(&e, observable);
        assert_true(t->rows <= VALUES_MAX);
        for (size_t i = 0; i < t->rows; i++)
            spread_add(&spreads[i], column_of(t, BCD_ROLE_VALUE)[i],
                       column_of(t, BCD_ROLE_STDERR)[i]);
        bcd_table_free(t);
        experiment_end(&e);
    }
}

#define WELL                                                                                       \
    "'particles': 1, 'length': 1, 'potential': {'type': 'cosine', 'amplitude': 6}, 'time_step': "  \
    "1e-3, 'sample_every': 1e-3, 'equilibration_time': 0.1, 'initial': 'lattice', "

/* A rod in a well forgets its energy within .006; over 64 times that long, blocks must be long
 * enough to be independent. */
static void test_one_realization_in_blocks(void **state)
{
    (void)state;
    struct spread energy[VALUES_MAX] = {0}, density[VALUES_MAX] = {0};
    measure(energy, "energy", WELL "'time': 0.4, 'observables': {'energy': {}}}");
    assert_ratio(&energy[0], 0.8, 1.1);
    measure(density, "density", WELL "'time': 0.4, 'observables': {'density': {'bins': 5}}}");
    for (int i = 1; i < 4; i++) /* the bins at the walls stay empty too often */
        assert_ratio(&density[i], 0.8, 1.1);
}

static void test_realizations(void **state)
{
    (void)state;
    struct spread energy[VALUES_MAX] = {0};
    measure(energy, "energy",
            WELL "'time': 0.01, 'realizations': 8, 'observables': {'energy': {}}}");
    assert_ratio(&energy[0], 0.9, 1.1);
}

/* Lags as long as the blocks are gathered over several of them. */
static void test_long_lags_in_blocks(void **state)
{
    (void)state;
    struct spread msd[VALUES_MAX] = {0};
    measure(msd, "msd",
            "'particles': 2, 'length': 3, 'diameter': 0.5, 'time_step': 1e-3, 'time': "
            "0.64, 'observables': {'msd': {'first': 0.001, 'last': 0.08, 'points': 5}}}");
    for (int i = 0; i < 5; i++)
        assert_ratio(&msd[i], 0.85, 1.1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_realization_in_blocks),
        cmocka_unit_test(test_realizations),
        cmocka_unit_test(test_long_lags_in_blocks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
