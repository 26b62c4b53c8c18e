/* SPDX-License-Identifier: GPL-3.0-or-later
 * time_step_error over all methods and many scenes with exact results, at the automatic step and at
 * longer ones: |value - exact| <= time_step_error + 2 standard errors in at least 95 %. */
#include "bcd.h"
#include "coverage.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define EQUILIBRIUM "'initial': 'equilibrium'"
#define COSINE(amplitude) "'potential': {'type': 'cosine', 'amplitude': " #amplitude "}, "
#define STATICS                                                                                    \
    "'observables': {'density': {'bins': 20}, 'energy': {}, 'contact_density': {'bins': 5, "       \
    "'gap': 0.05}, 'pair_distribution': {'bins': 20, 'last': 2}}"

static const struct coverage_scene scenes[] = {
    {"sparse", "'particles': 8, 'length': 16, 'diameter': 0.5, " COSINE(6) EQUILIBRIUM ", " STATICS,
     4},
    {"medium", "'particles': 8, 'length': 10, 'diameter': 0.8, " COSINE(6) EQUILIBRIUM ", " STATICS,
     4},
    {"dense", "'particles': 10, 'length': 10, 'diameter': 0.9, " COSINE(6) EQUILIBRIUM ", "
              "'observables': {'density': {'bins': 20}, 'energy': {}}", 2},
    {"stiff", "'particles': 6, 'length': 12, 'diameter': 0.5, " COSINE(20) EQUILIBRIUM ", "
              "'observables': {'density': {'bins': 20}, 'energy': {}}", 2},
    {"sticky", "'particles': 8, 'length': 16, 'diameter': 0.5, " COSINE(3) EQUILIBRIUM ", "
               "'interaction': {'type': 'sticky', 'strength': 0.3, 'range': 0.2}, 'observables': "
               "{'density': {'bins': 20}, 'energy': {}, 'pair_distribution': {'bins': 20, 'last': "
               "2}}", 2},
    {"free", "'particles': 8, 'length': 10, 'diameter': 0.8, " EQUILIBRIUM
             ", 'observables': {'msd': {'first': 0.1, 'last': 2, 'points': 8}}", 3},
    {"tilted", "'particles': 1, 'length': 1, " COSINE(4) "'force': 8, 'equilibration_time': 1, "
               "'observables': {'current': {}}", 20},
    {"pressed", "'particles': 3, 'length': 4, 'diameter': 0.5, 'boundary': 'walls', 'force': 4, "
                EQUILIBRIUM ", 'observables': {'density': {'bins': 20}}", 4},
    {"ramp", "'particles': 2, 'length': 3, 'diameter': 0.2, 'boundary': 'walls', 'potential': "
             "{'type': 'expression', 'energy': '-5*x'}, " EQUILIBRIUM
             ", 'observables': {'density': {'bins': 15}, 'energy': {}}", 4},
    {"contact", "'particles': 8, 'length': 10, 'diameter': 0.8, " COSINE(4) EQUILIBRIUM ", "
                "'observables': {'contact_density': {'bins': 5, 'gap': 0.01}}", 4},
    {"cold", "'particles': 8, 'length': 16, 'diameter': 0.5, 'temperature': 0.5, 'mobility': 2, "
             COSINE(4) EQUILIBRIUM ", " STATICS, 2},
};

static const char *method_name(size_t index)
{
    const struct bcd_param *row = bcd_job_params();
    while (strcmp(row->name, "method") != 0)
        row++;
    return row->choice(index);
}

/* "auto" is one of the others, and the published forms of bcd are the same map. */
static bool stands_for_itself(const char *method)
{
    return strcmp(method, "auto") != 0 && strncmp(method, "bcd_", 4) != 0;
}

static void test_error_bars_hold(void **state)
{
    (void)state;
    static const double factors[] = {1, 2, 4, 16};
    struct coverage all = {0};
    for (size_t m = 0; method_name(m); m++) {
        struct coverage c = {0};
        if (!stands_for_itself(method_name(m)))
            continue;
        for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++)
            for (size_t f = 0; f < sizeof factors / sizeof *factors; f++)
                coverage_add(&c, &scenes[s], method_name(m), factors[f], 48);
        printf("# %s: %zu of %zu covered, %.1f %%; %zu of %zu that are off\n", method_name(m),
               c.covered, c.values, 100 * (double)c.covered / (double)c.values, c.caught,
               c.resolved);
        assert_true(c.values > 0);
        assert_true((double)c.covered >= 0.95 * (double)c.values);
        all.values += c.values, all.covered += c.covered;
        all.resolved += c.resolved, all.caught += c.caught;
    }
    printf("# all: %zu of %zu covered; %zu of %zu that are off\n", all.covered, all.values,
           all.caught, all.resolved);
    assert_true(all.resolved > 100); /* the steps are coarse enough to matter */
    assert_true((double)all.covered >= 0.95 * (double)all.values);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_error_bars_hold),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
