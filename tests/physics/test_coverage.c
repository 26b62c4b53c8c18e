/* SPDX-License-Identifier: GPL-3.0-or-later
 * time_step_error tells at least as much as is off, in a few scenes; test_coverage_long.c takes
 * more of them. */
#include "coverage.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

#define EQUILIBRIUM "'initial': 'equilibrium'"
#define STATICS                                                                                    \
    "'observables': {'density': {'bins': 10}, 'energy': {}, 'contact_density': {'bins': 5, "       \
    "'gap': 0.05}}"

static const struct coverage_scene scenes[] = {
    {"medium", "'particles': 8, 'length': 10, 'diameter': 0.8, 'potential': {'type': 'cosine', "
               "'amplitude': 6}, " EQUILIBRIUM ", " STATICS, 2},
    {"free", "'particles': 8, 'length': 10, 'diameter': 0.8, " EQUILIBRIUM
             ", 'observables': {'msd': {'first': 0.1, 'last': 2, 'points': 8}}", 3},
    {"pressed", "'particles': 3, 'length': 4, 'diameter': 0.5, 'boundary': 'walls', 'force': 4, "
                EQUILIBRIUM ", 'observables': {'density': {'bins': 10}}", 2},
    {"tilted", "'particles': 1, 'length': 1, 'potential': {'type': 'cosine', 'amplitude': 4}, "
               "'force': 8, 'equilibration_time': 1, 'observables': {'current': {}}", 20},
};

static void test_error_bars_hold(void **state)
{
    (void)state;
    static const char *const methods[] = {"strang", "elastic", "bcd"};
    struct coverage c = {0};
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++)
        for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
            coverage_add(&c, &scenes[s], methods[m], m == 0 ? 2 : 8, 64);
    printf("# %zu of %zu covered; %zu of %zu that are off\n", c.covered, c.values, c.caught,
           c.resolved);
    assert_true(c.values > 50 && c.resolved > 15); /* the steps are coarse enough to matter */
    assert_true((double)c.covered >= 0.95 * (double)c.values);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_error_bars_hold),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
