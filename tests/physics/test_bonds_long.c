/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rods that stick at contact alone in a field: how their errors fall with the time step. */
#include "support/experiment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

struct answer {
    double bonded, bonded_exact, bonded_error; /* fraction of gaps */
    double energy_off, energy_error;
};

static struct answer measure(double strength, double step)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 16, 'length': 20, 'diameter': 0.8, 'initial': "
                         "'equilibrium', 'potential': {'type': 'cosine', 'amplitude': 6}, "
                         "'interaction': {'type': 'sticky', 'strength': %g, 'range': 0}, "
                         "'time_step': %g, 'time': 200, 'realizations': 32, 'observables': "
                         "{'energy': {}, 'contact_density': {'bins': 1, 'gap': 1e-9}}}",
                         strength, step),
        0);
    struct bcd_table *t = experiment_table(&e, "contact_density"),
                     *u = experiment_table(&e, "energy");
    const double per_gap = 1e-9 * 20 / 16;
    struct answer a = {
        .bonded = column_of(t, BCD_ROLE_VALUE)[0] * per_gap,
        .bonded_exact = column_of(t, BCD_ROLE_THEORY)[0] * per_gap,
        .bonded_error = column_of(t, BCD_ROLE_STDERR)[0] * per_gap,
        .energy_off = column_of(u, BCD_ROLE_VALUE)[0] - column_of(u, BCD_ROLE_THEORY)[0],
        .energy_error = column_of(u, BCD_ROLE_STDERR)[0],
    };
    bcd_table_free(t), bcd_table_free(u);
    experiment_end(&e);
    print_message("gamma %g h %g: bonded %.5f %+.5f(%.5f), energy %+.5f(%.5f)\n", strength, step,
                  a.bonded_exact, a.bonded - a.bonded_exact, a.bonded_error, a.energy_off,
                  a.energy_error);
    return a;
}

/* Relative error of the bonds at the longest step below 3.5 %, and below 2 % at a fifth of it. */
static void check_strength(double strength)
{
    struct answer coarse = measure(strength, 5e-3), fine = measure(strength, 1e-3);
    assert_within(coarse.bonded, coarse.bonded_exact, coarse.bonded_error, 5,
                  0.035 * coarse.bonded_exact);
    assert_within(fine.bonded, fine.bonded_exact, fine.bonded_error, 5, 0.02 * fine.bonded_exact);
    assert_within(fine.energy_off, 0, fine.energy_error, 5, 0.01);
}

static void test_strengths_in_a_field(void **state)
{
    (void)state;
    check_strength(0.1);
    check_strength(1);
    check_strength(10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_strengths_in_a_field)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
