/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rods that stick at contact alone against Baxter's exact limit: any step without a field, small
 * errors in one, the way in which two rods part, and who can run them. */
#include "support/experiment.h"
#include "support/two_sticky_rods.h"
#include "scene_json.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static void check_table(const struct experiment *e, const char *name)
{
    struct bcd_table *t = experiment_table(e, name);
    for (size_t i = 0; i < t->rows; i++)
        assert_within(column_of(t, BCD_ROLE_VALUE)[i], column_of(t, BCD_ROLE_THEORY)[i],
                      column_of(t, BCD_ROLE_STDERR)[i], 5, 1e-12);
    bcd_table_free(t);
}

/* Steps of the noise as long as the mean gap (.25), and many bonds of a cluster broken in one:
 * stationary all the same. The window counts bonds; gamma = 1: a fraction .50284 of the gaps. */
static void check_free_rods(double strength, double step)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 16, 'length': 20, 'diameter': 0.8, 'initial': "
                         "'equilibrium', 'interaction': {'type': 'sticky', 'strength': %g, "
                         "'range': 0}, 'time_step': %g, 'time': %g, 'realizations': 64, "
                         "'observables': {'contact_density': {'bins': 1, 'gap': 1e-9}, "
                         "'pair_distribution': {'bins': 25, 'last': 2.5}}}",
                         strength, step, 2000 * step),
        0);
    check_table(&e, "contact_density");
    check_table(&e, "pair_distribution");
    experiment_end(&e);
}

static void test_free_rods_at_any_step(void **state)
{
    (void)state;
    check_free_rods(1, 0.03);
    check_free_rods(0.1, 0.03);
    check_free_rods(10, 0.1);
}

/* From a start without bonds to the same equilibrium: .50284 of 16 gaps. */
static void test_bonds_form(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 16, 'length': 20, 'diameter': 0.8, 'interaction': {'type': "
                         "'sticky', 'strength': 1, 'range': 0}, 'time_step': 0.01, "
                         "'equilibration_time': 20, 'time': 10, 'realizations': 64, 'observables': "
                         "{'contact_density': {'bins': 1, 'gap': 1e-9}}}"),
        0);
    struct bcd_table *t = experiment_table(&e, "contact_density");
    const double per_gap = 1e-9 * 20 / 16;
    assert_within(column_of(t, BCD_ROLE_VALUE)[0] * per_gap, 0.50284,
                  column_of(t, BCD_ROLE_STDERR)[0] * per_gap, 5, 5e-6);
    bcd_table_free(t);
    experiment_end(&e);
}

/* Exact in a field: .28921 bonded, gamma = 1, U0 = 6. Measured at h = 1e-3: -.0029(8) of it, and
 * -.0060(9) in energy. */
static void test_field(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 16, 'length': 20, 'diameter': 0.8, 'initial': "
                         "'equilibrium', 'potential': {'type': 'cosine', 'amplitude': 6}, "
                         "'interaction': {'type': 'sticky', 'strength': 1, 'range': 0}, "
                         "'time_step': 1e-3, 'time': 10, 'realizations': 40, 'observables': "
                         "{'energy': {}, 'contact_density': {'bins': 1, 'gap': 1e-9}}}"),
        0);
    struct bcd_table *t = experiment_table(&e, "contact_density"),
                     *u = experiment_table(&e, "energy");
    const double per_gap = 1e-9 * 20 / 16;
    assert_within(column_of(t, BCD_ROLE_THEORY)[0] * per_gap, 0.28921, 0, 0, 5e-6);
    assert_within(column_of(t, BCD_ROLE_VALUE)[0] * per_gap, 0.28921,
                  column_of(t, BCD_ROLE_STDERR)[0] * per_gap, 5, 0.0045);
    assert_within(column_of(u, BCD_ROLE_VALUE)[0], column_of(u, BCD_ROLE_THEORY)[0],
                  column_of(u, BCD_ROLE_STDERR)[0], 5, 0.007);
    bcd_table_free(t), bcd_table_free(u);
    experiment_end(&e);
}

/* Two rods on a free ring: their gap is sticky reflected Brownian motion between two contacts. Its
 * relaxation is known in closed form. The step counts as a resistance of .5826 s between gap and
 * bond (two_sticky_rods.h), s^2 = 4 D h: the whole error, with no number fitted. */
static void test_relaxation_of_a_gap(void **state)
{
    (void)state;
    const double strength = 1, ell = 1, step = 0.005, resistance = 0.5826 * sqrt(4 * step);
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 2, 'length': 2, 'diameter': 0.5, 'initial': 'equilibrium', "
                         "'interaction': {'type': 'sticky', 'strength': %g, 'range': 0}, "
                         "'time_step': %g, 'time': 20, 'realizations': 500, 'observables': {'msd': "
                         "{'first': 0.05, 'last': 0.5, 'points': 4}}}",
                         strength, step),
        0);
    struct bcd_table *t = experiment_table(&e, "msd");
    assert_int_equal(t->rows, 4);
    for (size_t i = 0; i < t->rows; i++) {
        double lag = column_of(t, BCD_ROLE_X)[i];
        assert_within(column_of(t, BCD_ROLE_VALUE)[i],
                      two_sticky_rods_msd(strength, ell, lag, resistance),
                      column_of(t, BCD_ROLE_STDERR)[i], 5, 0);
    }
    /* The data tell the resistance from none: measured, 13 standard errors of 1000 realizations. */
    double without = two_sticky_rods_msd(strength, ell, column_of(t, BCD_ROLE_X)[0], 0);
    assert_true(without - column_of(t, BCD_ROLE_VALUE)[0] > 5 * column_of(t, BCD_ROLE_STDERR)[0]);
    bcd_table_free(t);
    experiment_end(&e);
}

/* gamma = 0: hard rods, whose steps without a field are exact as strang's are. */
static void test_without_stickiness(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 10, 'length': 10, 'diameter': 0.8, 'method': "
                         "'strang_bonds', 'interaction': {'type': 'sticky', 'strength': 0, 'range':"
                         " 0}, 'time_step': 0.5, 'time': 50, 'realizations': 1000, 'observables': "
                         "{'msd': {'first': 0.5, 'last': 8, 'points': 5}, 'pair_distribution': "
                         "{'bins': 20, 'last': 3}}}"),
        0);
    check_table(&e, "msd");
    check_table(&e, "pair_distribution");
    experiment_end(&e);
}

/* Clusters are bonds: as often as the contact density counts them; and results say what they are.
 */
static void test_clusters_and_remark(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 6, 'length': 9, 'diameter': 0.8, 'initial': 'equilibrium', "
                         "'interaction': {'type': 'sticky', 'strength': 1, 'range': 0}, "
                         "'time_step': 0.01, 'time': 5, 'realizations': 64, 'sample_every': 0.05, "
                         "'observables': {'cluster_sizes': {}, 'contact_density': {'bins': 1, "
                         "'gap': 1e-9}}}"),
        0);
    struct bcd_table *t = experiment_table(&e, "contact_density"),
                     *c = experiment_table(&e, "cluster_sizes");
    double mean_size = 0;
    for (size_t i = 0; i < c->rows; i++)
        mean_size += column_of(c, BCD_ROLE_X)[i] * column_of(c, BCD_ROLE_VALUE)[i];
    double bonded = column_of(t, BCD_ROLE_VALUE)[0] * 1e-9 * 9 / 6;
    double error = column_of(t, BCD_ROLE_STDERR)[0] * 1e-9 * 9 / 6;
    assert_within(1 - 1 / mean_size, bonded, error, 5, 1e-3);
    bool remarked = false;
    for (size_t i = 0; i < c->notes; i++)
        remarked |= strcmp(c->note[i].name, "experimental") == 0;
    assert_true(remarked);
    bcd_table_free(t), bcd_table_free(c);
    experiment_end(&e);
}

static void check_refused(const char *method, const char *rest)
{
    char job[400];
    snprintf(job, sizeof job,
             "{\"particles\": 4, \"length\": 5, \"diameter\": 0.5, \"time\": 1, \"method\": \"%s\","
             "\"observables\": {\"current\": {}}, %s}",
             method, rest);
    struct bcd_errors errors = {0};
    struct bcd_scene *scene = NULL;
    assert_int_equal(scene_json_parse(job, strlen(job), &scene, &errors), BCD_INVALID);
    assert_int_equal(errors.count, 1);
    assert_string_equal(errors.items[0].field, "/method");
}

static void test_who_can_run_bonds(void **state)
{
    (void)state;
    const char *contact = "\"interaction\": {\"type\": \"sticky\", \"strength\": 1, \"range\": 0}";
    check_refused("strang", contact);
    check_refused("elastic", contact);
    check_refused("bcd", contact);
    check_refused("strang_bonds", "\"interaction\": {\"type\": \"sticky\", \"strength\": 1, "
                                  "\"range\": 0.1}");
    check_refused("strang_bonds", "\"boundary\": \"walls\"");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_free_rods_at_any_step),
        cmocka_unit_test(test_bonds_form),
        cmocka_unit_test(test_field),
        cmocka_unit_test(test_relaxation_of_a_gap),
        cmocka_unit_test(test_without_stickiness),
        cmocka_unit_test(test_clusters_and_remark),
        cmocka_unit_test(test_who_can_run_bonds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
