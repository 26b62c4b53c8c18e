/* SPDX-License-Identifier: GPL-3.0-or-later
 * lm, strating, tao, metropolis: single steps against closed forms, equilibrium against exact
 * theory, errors in a field as measured, and that every step ends in a legal order. */
#include "part.h"
#include "support/experiment.h"
#include "scene_json.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

extern const struct method_type method_elastic, method_lm, method_metropolis, method_strating,
    method_tao;

/* ------------------------------------------------------------ single steps */

struct bare {
    struct plan plan;
    struct sim sim;
    struct arena kept, scratch;
};

/* Free rods with room for `ell` in all, moved by a method without a run around it. */
static struct bare *bare_create(const struct method_type *method, int64_t n, double ell,
                                bool walls, double step)
{
    struct bare *b = calloc(1, sizeof *b);
    b->plan = (struct plan){.particles = n, .length = ell + (double)n, .diameter = 1,
                            .free_length = ell, .walls = walls, .low = walls ? 0.5 : 0,
                            .mobility = 1, .temperature = 1, .diffusion = 1, .seed = 4,
                            .method = method, .time_step = step};
    for (int pass = 0; pass < 2; pass++) {
        b->kept.used = b->scratch.used = 0;
        sim_layout(&b->sim, &b->plan, &b->kept);
        method->layout(&b->sim, &b->kept, &b->scratch);
        if (pass == 1)
            break;
        b->kept.bytes = aligned_alloc(ARENA_ALIGNMENT, b->kept.used);
        b->scratch.bytes = aligned_alloc(ARENA_ALIGNMENT, b->scratch.used);
    }
    assert_int_equal(sim_begin(&b->sim, 0, NULL), BCD_OK);
    if (method->begin)
        method->begin(&b->sim);
    return b;
}

static void bare_free(struct bare *b)
{
    free(b->kept.bytes);
    free(b->scratch.bytes);
    free(b);
}

struct mean {
    double value, error;
};

enum { STEPS = 200000 };

/* Mean change of a gap d in one step of time t, the relative diffusion coefficient being 1: two
 * rods on a wide ring, or a rod and a wall. */
static struct mean mean_change(const struct method_type *method, double d, double t, bool wall)
{
    const double wide = 1000;
    struct bare *b = bare_create(method, wall ? 1 : 2, wide, wall, wall ? t : t / 2);
    double sum = 0, square = 0;
    for (int64_t tick = 0; tick < STEPS; tick++) {
        double *y = b->sim.y;
        b->sim.clock->tick = tick;
        y[0] = wall ? b->plan.low + d : 300;
        if (!wall)
            y[1] = y[0] + d;
        method->advance(&b->sim, 1);
        double change = (wall ? y[0] - b->plan.low : y[1] - y[0]) - d;
        sum += change;
        square += change * change;
    }
    bare_free(b);
    double mean = sum / STEPS;
    return (struct mean){mean, sqrt((square / STEPS - mean * mean) / STEPS)};
}

/* Reflected: 2 sqrt(t/pi) exp(-d^2/4t) - d erfc(d/(2 sqrt t)). Refused: sqrt(t/pi) exp(-d^2/4t). */
static double refused(double d, double t)
{
    return sqrt(t / M_PI) * exp(-d * d / (4 * t));
}

static double reflected(double d, double t)
{
    return 2 * refused(d, t) - d * erfc(d / (2 * sqrt(t)));
}

/* Free until straight paths meet, at t d/|x|; then |relative displacement| of the rest. */
static double redrawn(double d, double t)
{
    double sum = refused(d, t), dx = 1e-4 * sqrt(t);
    for (double x = d + dx / 2; x < d + 20 * sqrt(t); x += dx) {
        double weight = exp(-x * x / (4 * t)) / sqrt(4 * M_PI * t) * dx;
        sum += weight * (sqrt(4 * t * (1 - d / x) / M_PI) - d);
    }
    return sum;
}

static void test_one_step_from_a_gap(void **state)
{
    (void)state;
    static const double gaps[] = {0, 0.1, 0.5, 2};
    const double t = 0.3;
    for (size_t i = 0; i < sizeof gaps / sizeof *gaps; i++) {
        double d = gaps[i];
        struct mean elastic = mean_change(&method_elastic, d, t, false),
                    strating = mean_change(&method_strating, d, t, false),
                    tao = mean_change(&method_tao, d, t, false),
                    at_wall = mean_change(&method_strating, d, t, true),
                    metropolis = mean_change(&method_metropolis, d, t, true);
        assert_within(elastic.value, reflected(d, t), elastic.error, 5, 0);
        assert_true(strating.value == elastic.value);
        assert_within(at_wall.value, reflected(d, t), at_wall.error, 5, 0);
        assert_within(metropolis.value, refused(d, t), metropolis.error, 5, 0);
        assert_within(tao.value, redrawn(d, t), tao.error, 5, 0);
    }
    /* At contact, where all paths meet at once, nothing is lost; from a gap too much or little. */
    assert_true(fabs(redrawn(0, t) / reflected(0, t) - 1) < 1e-6);
    assert_true(fabs(redrawn(0.5, t) / reflected(0.5, t) - 1) > 0.05);
}

/* Ordered, finite, inside; whatever the room and the step. */
static void check_legal(const struct bare *b)
{
    const double *y = b->sim.y;
    const struct plan *plan = &b->plan;
    for (int64_t i = 0; i < plan->particles; i++)
        assert_true(isfinite(y[i]) && (i == 0 || y[i - 1] <= y[i]));
    assert_true(y[plan->particles - 1] <= y[0] + plan->free_length);
    assert_true(!plan->walls ||
                (y[0] >= plan->low && y[plan->particles - 1] <= plan->low + plan->free_length));
}

static void test_every_step_ends_in_order(void **state)
{
    (void)state;
    static const struct method_type *const methods[] = {&method_lm, &method_metropolis,
                                                        &method_strating, &method_tao};
    static const int64_t counts[] = {1, 2, 3, 40, 100000}; /* the last is worth but a few */
    static const double rooms[] = {0, 1e-3, 1, 1e3}, steps[] = {1e-8, 1e-2, 10};
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
        for (size_t c = 0; c < sizeof counts / sizeof *counts; c++)
            for (int i = 0; i < 24; i += counts[c] < 100 ? 1 : 7) {
                struct bare *b = bare_create(methods[m], counts[c], rooms[i / 3 % 4], i >= 12,
                                             steps[i % 3]);
                for (int tick = 0; tick < (counts[c] < 100 ? 30 : 1); tick++) {
                    methods[m]->advance(&b->sim, 1);
                    check_legal(b);
                }
                bare_free(b);
            }
}

/* ------------------------------------------------------------- equilibrium */

/* Every row of an observable within 5 standard errors of theory. */
static void check_rows(const struct experiment *e, const char *observable)
{
    struct bcd_table *t = experiment_table(e, observable);
    for (size_t i = 0; i < t->rows; i++)
        if (isfinite(column_of(t, BCD_ROLE_THEORY)[i]))
            assert_within(column_of(t, BCD_ROLE_VALUE)[i], column_of(t, BCD_ROLE_THEORY)[i],
                          column_of(t, BCD_ROLE_STDERR)[i], 5, 0);
    bcd_table_free(t);
}

/* Without a field the equilibrium of free rods is exact at any step, also of those that carry
 * noise from one step to the next. */
static void test_free_rods_at_any_step(void **state)
{
    (void)state;
    static const char *const methods[] = {"lm", "metropolis", "strating"};
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        struct experiment e = experiment_run(
            experiment_scene("{'particles': 10, 'length': 10, 'diameter': 0.8, 'method': '%s', "
                             "'time_step': 0.05, 'time': 50, 'realizations': 400, 'initial': "
                             "'lattice', 'equilibration_time': 5, 'observables': "
                             "{'pair_distribution': {'bins': 20, 'last': 3}}}",
                             methods[m]),
            0);
        check_rows(&e, "pair_distribution");
        experiment_end(&e);
    }
}

/* One rod in a box, then five, at steps that reach across it: flat, only if lm's noise turns with
 * the path at a wall. */
static void test_free_rods_between_walls(void **state)
{
    (void)state;
    static const char *const methods[] = {"lm", "metropolis", "strating"};
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
        for (int n = 1; n <= 5; n += 4) {
            struct experiment e = experiment_run(
                experiment_scene("{'particles': %d, 'length': 3, 'diameter': 0.3, 'boundary': "
                                 "'walls', 'method': '%s', 'time_step': 0.1, 'time': 100, "
                                 "'sample_every': 0.1, 'realizations': 100, 'observables': "
                                 "{'density': {'bins': 15}}}",
                                 n, methods[m]),
                0);
            struct bcd_table *t = experiment_table(&e, "density");
            /* One rod's centre is anywhere in [.15, 2.85]; bins are .2 wide. */
            for (size_t i = 1; i + 1 < t->rows && n == 1; i++)
                assert_within(column_of(t, BCD_ROLE_VALUE)[i], 1 / 2.7,
                              column_of(t, BCD_ROLE_STDERR)[i], 5, 0);
            /* More are alike from both ends. */
            for (size_t i = 0; i < t->rows / 2; i++)
                assert_within(column_of(t, BCD_ROLE_VALUE)[i],
                              column_of(t, BCD_ROLE_VALUE)[t->rows - 1 - i],
                              2 * column_of(t, BCD_ROLE_STDERR)[i], 5, 0);
            bcd_table_free(t);
            experiment_end(&e);
        }
}

struct answer {
    double off, error, l1; /* energy minus exact, its standard error, L1 error of the density */
};

/* N = 16, L = 20, sigma = .8, U0 = 6. */
static struct answer in_a_field(const char *method, double step)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 16, 'length': 20, 'diameter': 0.8, 'initial': "
                         "'equilibrium', 'potential': {'type': 'cosine', 'amplitude': 6}, "
                         "'method': '%s', 'time_step': %.17g, 'time': 60, 'realizations': 16, "
                         "'observables': {'energy': {}, 'density': {'bins': 50}}}",
                         method, step),
        0);
    struct bcd_table *t = experiment_table(&e, "energy"), *d = experiment_table(&e, "density");
    struct answer a = {column_of(t, BCD_ROLE_VALUE)[0] - column_of(t, BCD_ROLE_THEORY)[0],
                       column_of(t, BCD_ROLE_STDERR)[0], 0};
    for (size_t i = 0; i < d->rows; i++)
        a.l1 += fabs(column_of(d, BCD_ROLE_VALUE)[i] - column_of(d, BCD_ROLE_THEORY)[i]) /
                (double)d->rows;
    bcd_table_free(t), bcd_table_free(d);
    experiment_end(&e);
    return a;
}

/* Energy and L1 at h = 2.5e-3 measured with other programs: lm +.0023/.0026, elastic +.0649/.0638;
 * at 1e-3 lm -.0011/.0012, elastic +.0285. tao: +.0627(4) and +.0236(10), own longer runs. */
static void test_errors_in_a_field(void **state)
{
    (void)state;
    struct answer lm = in_a_field("lm", 2.5e-3), fine = in_a_field("lm", 1e-3),
                  strating = in_a_field("strating", 2.5e-3),
                  strating_fine = in_a_field("strating", 1e-3), tao = in_a_field("tao", 2.5e-3),
                  tao_fine = in_a_field("tao", 1e-3);
    assert_within(lm.off, 0.0023, lm.error, 5, 0.0005);
    assert_within(fine.off, 0, fine.error, 5, 0.0011);
    assert_true(lm.l1 < 0.005 && fine.l1 < 0.004);
    assert_within(strating.off, 0.0649, strating.error, 5, 0.003);
    assert_within(strating_fine.off, 0.0285, strating_fine.error, 5, 0.001);
    assert_within(tao.off, 0.0627, tao.error, 5, 0.0004);
    assert_within(tao_fine.off, 0.0236, tao_fine.error, 5, 0.001);
}

/* Moves as wide as the wells and wider than the gaps: exact all the same. */
static void test_metropolis_is_exact_at_long_steps(void **state)
{
    (void)state;
    static const char *const scenes[] = {
        "{'particles': 16, 'length': 20, 'diameter': 0.8, 'initial': 'equilibrium', 'potential': "
        "{'type': 'cosine', 'amplitude': 6}, 'method': 'metropolis', 'time_step': 8e-3, 'time': "
        "40, 'sample_every': 8e-3, 'realizations': 24, "
        "'observables': {'energy': {}, 'density': {'bins': 25}, "
        "'contact_density': {'bins': 5, 'gap': 0.05}, 'pair_distribution': {'bins': 10}}}",
        "{'particles': 8, 'length': 10, 'diameter': 0.8, 'initial': 'equilibrium', 'potential': "
        "{'type': 'cosine', 'amplitude': 3}, 'interaction': {'type': 'sticky', 'strength': 0.3, "
        "'range': 0.1}, 'method': 'metropolis', 'time_step': 1e-3, 'time': 15, "
        "'realizations': 60, 'observables': {'energy': {}, 'density': {'bins': 25}, "
        "'contact_density': {'bins': 5, 'gap': 0.02}}}",
    };
    for (size_t s = 0; s < 2; s++) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
#pragma GCC diagnostic ignored "-Wformat-security"
        struct experiment e = experiment_run(experiment_scene(scenes[s]), 0);
#pragma GCC diagnostic pop
        check_rows(&e, "energy");
        check_rows(&e, "density");
        check_rows(&e, "contact_density");
        experiment_end(&e);
    }
}

/* ------------------------------------------------------------------ refusals */

static void check_refused(const char *method, const char *rest, const char *word)
{
    char job[600];
    snprintf(job, sizeof job, "{'length': 8, 'time': 1, 'method': '%s', %s}", method, rest);
    for (char *c = job; *c; c++)
        *c = *c == '\'' ? '"' : *c;
    struct bcd_errors errors = {0};
    struct bcd_scene *scene = NULL;
    assert_int_equal(scene_json_parse(job, strlen(job), &scene, &errors), BCD_INVALID);
    assert_int_equal(errors.count, 1);
    assert_string_equal(errors.items[0].field, "/method");
    assert_non_null(strstr(errors.items[0].text, word));
}

static void test_refusals(void **state)
{
    (void)state;
    const char *statics = "'observables': {'density': {}}";
    char rest[300];
    check_refused("lm", "'particles': 2, 'observables': {'msd': {}}", "how rods move");
    check_refused("lm", "'particles': 2, 'observables': {'current': {}}", "how rods move");
    snprintf(rest, sizeof rest, "'particles': 2, 'force': 1e-9, %s", statics);
    check_refused("lm", rest, "drag force");
    snprintf(rest, sizeof rest, "'particles': 2, 'potential': {'type': 'cosine', 'amplitude': 1, "
                                "'velocity': 1}, %s", statics);
    check_refused("lm", rest, "moves");
    static const char *const methods[] = {"lm", "strating", "tao", "metropolis"};
    snprintf(rest, sizeof rest, "'particles': 2, 'temperature': 0, %s", statics);
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++)
        check_refused(methods[i], rest, i == 3 ? "kT" : "without noise");
    snprintf(rest, sizeof rest, "'particles': 8, 'diameter': 1, %s", statics);
    check_refused("metropolis", rest, "closed packing");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_step_from_a_gap),
        cmocka_unit_test(test_every_step_ends_in_order),
        cmocka_unit_test(test_free_rods_at_any_step),
        cmocka_unit_test(test_free_rods_between_walls),
        cmocka_unit_test(test_errors_in_a_field),
        cmocka_unit_test(test_metropolis_is_exact_at_long_steps),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
