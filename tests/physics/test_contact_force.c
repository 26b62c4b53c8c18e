/* SPDX-License-Identifier: GPL-3.0-or-later
 * Contact forces: without noise they balance field and walls as a hand calculation has them; with
 * noise their mean is the pressure that neighbours exert on each other, at small steps. */
#include "support/experiment.h"
#include "scene_json.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static double note_of(const struct bcd_table *table, const char *name)
{
    for (size_t i = 0; i < table->notes; i++)
        if (strcmp(table->note[i].name, name) == 0)
            return table->note[i].number;
    fail_msg("no note %s", name);
    return NAN;
}

static void assert_number(double value, double expected)
{
    assert_within(value, expected, 0, 0, 1e-9 * (1 + fabs(expected)));
}

/* -------------------------------------------------------------- at rest */

/* Forces of a cluster at rest, all distinct ones with how many contacts bear each. */
struct rest {
    int kinds, pairs; /* pairs of neighbours, in contact or not */
    double force[8], count[8];
};

static void check_rest(const char *job, const struct rest *rest)
{
    static const char *const methods[] = {"bcd", "bcd_chronological", "bcd_premerging", "auto"};
    for (int m = 0; m < 4; m++) {
        struct experiment e = experiment_run(
            experiment_scene("{%s, 'method': '%s', 'temperature': 0, 'initial': 'lattice', 'time': "
                             "0.1, 'observables': {'contact_force': {'bins': 40, 'last': 20}}}",
                             job, methods[m]),
            0);
        struct bcd_table *t = experiment_table(&e, "contact_force");
        double sum = 0, contacts = 0, largest = 0, share[40] = {0};
        for (int k = 0; k < rest->kinds; k++) {
            sum += rest->force[k] * rest->count[k];
            contacts += rest->count[k];
            largest = fmax(largest, rest->force[k]);
            if (rest->force[k] < 20)
                share[(int)(rest->force[k] * 2)] += rest->count[k];
        }
        double within = 0;
        for (int i = 0; i < 40; i++) {
            assert_number(column_of(t, BCD_ROLE_X)[i], 0.25 + 0.5 * i);
            assert_number(column_of(t, BCD_ROLE_VALUE)[i], share[i] / contacts / 0.5);
            within += share[i] / contacts;
        }
        assert_number(note_of(t, "mean_force"), sum / rest->pairs);
        assert_number(note_of(t, "pushing_fraction"), contacts / rest->pairs);
        assert_number(note_of(t, "largest_force"), largest);
        assert_number(note_of(t, "beyond_last"), 1 - within);
        bcd_table_free(t);
        experiment_end(&e);
    }
}

/* Four rods at -.45, -.15, .15, .45 of the well at x = 0, two of them across the seam: outer
 * contacts bear the outer rods' force, the middle one that of the inner rods besides. */
static void test_cluster_in_a_well(void **state)
{
    (void)state;
    double most = M_PI * 6 / 4, outer = most * sin(2 * M_PI * 0.45 / 4),
           inner = most * sin(2 * M_PI * 0.15 / 4);
    const struct rest rest = {2, 4, {outer, outer + inner}, {2, 1}};
    check_rest("'particles': 4, 'length': 4, 'diameter': 0.3, 'potential': {'type': 'cosine', "
               "'amplitude': -6, 'wavelength': 4}, 'time_step': 1e-3, 'equilibration_time': 8",
               &rest);
    /* Forces do not depend on the step. */
    check_rest("'particles': 4, 'length': 4, 'diameter': 0.3, 'potential': {'type': 'cosine', "
               "'amplitude': -6, 'wavelength': 4}, 'time_step': 1e-2, 'equilibration_time': 8",
               &rest);
}

/* Rods driven to a wall lean on each other like bricks: 1 f, 2 f, 3 f and so on; the mobility does
 * not matter. Five times 4.1 is beyond the last bin. */
static void test_pile_at_a_wall(void **state)
{
    (void)state;
    struct rest rest = {5, 5, {0}, {1, 1, 1, 1, 1}};
    for (int k = 0; k < 5; k++)
        rest.force[k] = 4.1 * (k + 1);
    static const char *const drags[] = {"4.1", "-4.1"};
    for (int way = 0; way < 2; way++) {
        char job[200];
        snprintf(job, sizeof job,
                 "'particles': 6, 'length': 6.6, 'diameter': 1, 'boundary': 'walls', 'mobility': "
                 "0.25, 'force': %s, 'time_step': 1e-3, 'equilibration_time': 2",
                 drags[way]);
        check_rest(job, &rest);
    }
}

/* A train under drag is not pushed at all: no distribution to speak of. */
static void test_nothing_to_say(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 5, 'length': 10, 'diameter': 1, 'temperature': 0, 'force': "
                         "3, 'time': 0.1, 'time_step': 1e-2, 'observables': {'contact_force': "
                         "{}}}"),
        0);
    struct bcd_table *t = experiment_table(&e, "contact_force");
    assert_int_equal(t->rows, 50);
    assert_true(isnan(column_of(t, BCD_ROLE_VALUE)[0]));
    assert_true(note_of(t, "mean_force") == 0 && note_of(t, "pushing_fraction") == 0);
    bcd_table_free(t);
    experiment_end(&e);
}

/* ------------------------------------------------------------ in equilibrium */

struct answer {
    double mean, error, pushing;
};

static struct answer measure(const char *scene, const char *method, double step, double time)
{
    struct experiment e = experiment_run(
        experiment_scene("{%s, 'initial': 'equilibrium', 'method': '%s', 'time_step': %.17g, "
                         "'time': %.17g, 'sample_every': %.17g, 'realizations': 32, "
                         "'time_step_error': 'skipped', 'observables': {'contact_force': {}}}",
                         scene, method, step, time, 10 * step),
        0);
    struct bcd_table *t = experiment_table(&e, "contact_force");
    double sum = 0, width = 2 * column_of(t, BCD_ROLE_X)[0];
    for (size_t i = 0; i < t->rows; i++)
        sum += column_of(t, BCD_ROLE_VALUE)[i] * width;
    assert_within(sum, 1 - note_of(t, "beyond_last"), 0, 0, 1e-9);
    struct answer a = {note_of(t, "mean_force"), note_of(t, "mean_force_stderr"),
                       note_of(t, "pushing_fraction")};
    bcd_table_free(t);
    experiment_end(&e);
    return a;
}

/* Errors fall as sqrt(h): twice the value at h / 4 less that at h is free of them. `slack`, a
 * share, is left for errors of order h. */
static void check_limit(const struct answer *coarse, const struct answer *fine, double exact,
                        double slack)
{
    double value = 2 * fine->mean - coarse->mean,
           error = sqrt(4 * fine->error * fine->error + coarse->error * coarse->error);
    printf("# mean %.4f(%.4f), %.4f(%.4f) at h / 4: %.4f(%.4f), exact %.4f\n", coarse->mean,
           coarse->error, fine->mean, fine->error, value, error, exact);
    assert_within(value, exact, error, 5, slack * exact);
    assert_true(error < 0.03 * exact);
    /* Fewer neighbours push at shorter steps, the harder: forces go as h^(-1/2). */
    double harder = fine->mean / fine->pushing * coarse->pushing / coarse->mean;
    printf("# a push is %.3f times as strong at h / 4\n", harder);
    assert_within(harder, 2, 0, 0, 0.1);
}

/* kT (N - 1) / ell: gaps of a free ring have the density (N - 1) / ell (1 - g / ell)^(N - 2). Rods
 * that seem shorter have ell + N 1.165 sqrt(D h) in its place. */
static void test_pressure_of_free_rods(void **state)
{
    (void)state;
    const char *scene = "'particles': 8, 'length': 10, 'diameter': 0.75, 'temperature': 0.5, "
                        "'mobility': 2";
    struct answer coarse = measure(scene, "auto", 1e-3, 40),
                  fine = measure(scene, "bcd", 2.5e-4, 40);
    assert_within(coarse.mean, 3.5 / (4 + 8 * 1.165 * sqrt(1e-3)), coarse.error, 5, 0);
    assert_within(fine.mean, 3.5 / (4 + 8 * 1.165 * sqrt(2.5e-4)), fine.error, 5, 0);
    check_limit(&coarse, &fine, 3.5 / 4, 0.01);
    struct answer same = measure(scene, "bcd_premerging", 1e-3, 40);
    assert_within(same.mean, coarse.mean, 0, 0, 1e-9);
    same = measure(scene, "bcd_chronological", 1e-3, 40);
    assert_within(same.mean, coarse.mean, 0, 0, 1e-9);
    assert_true(same.pushing == coarse.pushing);
}

/* In a field kT times the density of gap 0: the contact density over the density, exact. */
static double exact_pressure(const char *scene)
{
    struct experiment e = experiment_run(
        experiment_scene(
            "{%s, 'method': 'bcd', 'initial': 'lattice', 'time_step': 1e-4, 'time': "
            "1e-4, 'time_step_error': 'skipped', 'observables': {'density': {'bins': "
            "1}, 'contact_density': {'bins': 1, 'gap': 1e-7}}, 'stability': 'ignored'}",
            scene),
        0);
    struct bcd_table *d = experiment_table(&e, "density"),
                     *c = experiment_table(&e, "contact_density");
    double pressure = column_of(c, BCD_ROLE_THEORY)[0] / column_of(d, BCD_ROLE_THEORY)[0];
    bcd_table_free(d), bcd_table_free(c);
    experiment_end(&e);
    return pressure;
}

static void test_pressure_in_a_field(void **state)
{
    (void)state;
    const char *scene = "'particles': 6, 'length': 6, 'diameter': 0.7, 'potential': {'type': "
                        "'cosine', 'amplitude': 3}";
    struct answer coarse = measure(scene, "bcd", 4e-4, 40), fine = measure(scene, "bcd", 1e-4, 40);
    check_limit(&coarse, &fine, exact_pressure(scene), 0.02);
}

/* -------------------------------------------------------------------- rules */

/* Only methods that know contact forces can be asked for them. */
static void test_other_methods_are_refused(void **state)
{
    (void)state;
    const char *job = "{\"particles\": 2, \"length\": 4, \"time\": 1, \"method\": \"%s\", "
                      "\"observables\": {\"contact_force\": {\"bins\": %d}}}";
    static const struct {
        const char *method, *field;
        int bins;
    } jobs[] = {{"strang", "/method", 50},
                {"elastic", "/method", 50},
                {"bcd", "/observables/contact_force/bins", 0},
                {"bcd", "/observables/contact_force/bins", 100001},
                {"auto", NULL, 50},
                {"bcd_premerging", NULL, 50}};
    for (size_t i = 0; i < sizeof jobs / sizeof *jobs; i++) {
        char text[300];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
        snprintf(text, sizeof text, job, jobs[i].method, jobs[i].bins);
#pragma GCC diagnostic pop
        struct bcd_errors errors = {0};
        struct bcd_scene *scene = NULL;
        enum bcd_status status = scene_json_parse(text, strlen(text), &scene, &errors);
        assert_int_equal(status == BCD_OK, jobs[i].field == NULL);
        if (jobs[i].field)
            assert_string_equal(errors.items[0].field, jobs[i].field);
        bcd_scene_free(scene);
    }
}

/* A run that is asked for its forces goes the same way as one that is not, in slices of any size.
 */
static void test_looking_does_not_disturb(void **state)
{
    (void)state;
    const char *job = "{'particles': 9, 'length': 12, 'diameter': 0.9, %s'method': 'bcd', "
                      "'time_step': 1e-3, 'time': 3, 'observables': {'current': {}%s}}";
    static const char *const fields[] = {"", "'potential': {'type': 'cosine', 'amplitude': 5}, "};
    for (int k = 0; k < 2; k++) {
        double current[2];
        for (int asked = 0; asked < 2; asked++) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
            struct experiment e = experiment_run(
                experiment_scene(job, fields[k], asked ? ", 'contact_force': {}" : ""),
                asked ? 7 : 0);
#pragma GCC diagnostic pop
            struct bcd_table *t = experiment_table(&e, "current");
            current[asked] = column_of(t, BCD_ROLE_VALUE)[0];
            bcd_table_free(t);
            experiment_end(&e);
        }
        assert_true(current[0] == current[1] && current[0] != 0);
    }
}

/* A run stopped in the middle of a block and taken up by another one ends in the same bytes. */
static void test_checkpoint_keeps_the_block(void **state)
{
    (void)state;
    struct bcd_scene *scene = experiment_scene(
        "{'particles': 9, 'length': 12, 'diameter': 0.9, 'method': 'bcd', 'time_step': 1e-3, "
        "'time': 1, 'observables': {'contact_force': {'bins': 7}}}");
    struct bcd_run *whole = NULL, *first = NULL, *second = NULL;
    assert_int_equal(bcd_run_create(&whole, scene, 0, NULL), BCD_OK);
    assert_int_equal(bcd_run_create(&first, scene, 0, NULL), BCD_OK);
    assert_int_equal(bcd_run_create(&second, scene, 0, NULL), BCD_OK);
    int64_t total = bcd_run_ticks_total(whole);
    size_t size = bcd_run_checkpoint_size(first);
    unsigned char *checkpoint = malloc(size);
    assert_non_null(checkpoint);
    assert_int_equal(bcd_run_advance(whole, total, NULL), BCD_OK);
    assert_int_equal(bcd_run_advance(first, total / 3, NULL), BCD_OK);
    bcd_run_save(first, checkpoint);
    assert_int_equal(bcd_run_restore(second, checkpoint, size, NULL), BCD_OK);
    assert_int_equal(bcd_run_advance(second, total, NULL), BCD_OK);

    size_t bytes = bcd_tally_size(bcd_run_tally(whole));
    unsigned char *a = malloc(bytes), *b = malloc(bytes);
    bcd_tally_save(bcd_run_tally(whole), a);
    bcd_tally_save(bcd_run_tally(second), b);
    assert_memory_equal(a, b, bytes);
    free(a), free(b), free(checkpoint);
    bcd_run_free(whole), bcd_run_free(first), bcd_run_free(second);
    bcd_scene_free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cluster_in_a_well),
        cmocka_unit_test(test_pile_at_a_wall),
        cmocka_unit_test(test_nothing_to_say),
        cmocka_unit_test(test_pressure_of_free_rods),
        cmocka_unit_test(test_pressure_in_a_field),
        cmocka_unit_test(test_other_methods_are_refused),
        cmocka_unit_test(test_looking_does_not_disturb),
        cmocka_unit_test(test_checkpoint_keeps_the_block),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
