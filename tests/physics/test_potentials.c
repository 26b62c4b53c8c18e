/* SPDX-License-Identifier: GPL-3.0-or-later
 * Potentials by Fourier terms, table and formula: against the cosine and each other, against their
 * own differences, against exact theory; and what of them is refused. */
#include "support/experiment.h"
#include "part.h"
#include "scene.h"
#include "scene_json.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define RING "{'particles': 3, 'length': 10, 'diameter': 0.5, 'time_step': 1e-7, 'time': 1e-5, "
#define WALLS                                                                                      \
    "{'particles': 3, 'length': 10, 'diameter': 0.5, 'boundary': 'walls', 'time_step': 1e-7, "     \
    "'time': 1e-5, "

static struct bcd_scene *ring_with(const char *potential)
{
    return experiment_scene(RING "'potential': %s, 'observables': {'energy': {}}}", potential);
}

static struct bcd_scene *walls_with(const char *potential)
{
    return experiment_scene(WALLS "'potential': %s, 'observables': {'energy': {}}}", potential);
}

static double force_at(const struct bcd_scene *scene, double x)
{
    double force = 0;
    struct rods one = {.y = &x, .count = 1};
    scene->plan.potential->add_force(scene->plan.potential_par, &one, 1, &force);
    return force;
}

static double energy_at(const struct bcd_scene *scene, double x)
{
    return plan_energy(&scene->plan, x);
}

static double curvature_of(const struct bcd_scene *scene)
{
    return scene->plan.potential->curvature_max(scene->plan.potential_par);
}

/* Same energies and forces over many periods; ends the scenes. */
static void assert_same_field(struct bcd_scene *a, struct bcd_scene *b, double slack)
{
    for (double x = -35; x < 65; x += 0.0337) {
        if (!(fabs(energy_at(a, x) - energy_at(b, x)) <= slack) ||
            !(fabs(force_at(a, x) - force_at(b, x)) <= slack))
            fail_msg("at %.17g: U %.17g %.17g, F %.17g %.17g", x, energy_at(a, x), energy_at(b, x),
                     force_at(a, x), force_at(b, x));
    }
    assert_within(curvature_of(a), curvature_of(b), 0, 0,
                  fmax(100 * slack, 1e-4) * curvature_of(b));
    bcd_scene_free(a), bcd_scene_free(b);
}

static void test_one_fourier_term_is_the_cosine(void **state)
{
    (void)state;
    assert_same_field(ring_with("{'type': 'fourier', 'cosine': [3]}"),
                      ring_with("{'type': 'cosine', 'amplitude': 6}"), 1e-12);
    assert_same_field(
        ring_with("{'type': 'fourier', 'wavelength': 2.5, 'cosine': [1.5], 'sine': [2]}"),
        ring_with("{'type': 'cosine', 'wavelength': 2.5, 'amplitude': 5, "
                  "'phase': -0.9272952180016122}"), /* atan2(2, 1.5) */
        1e-12);
    assert_same_field(ring_with("{'type': 'fourier', 'wavelength': 2, 'sine': [0, 1]}"),
                      ring_with("{'type': 'fourier', 'sine': [1]}"), 1e-11);
}

static void test_formula_of_a_cosine_is_the_cosine(void **state)
{
    (void)state;
    assert_same_field(ring_with("{'type': 'expression', 'energy': '3*cos(2*pi*x)', 'period': 1}"),
                      ring_with("{'type': 'cosine', 'amplitude': 6}"), 1e-13 * 6 * M_PI);
}

/* "[U(0), ..]" of a cosine */
static void cosine_values(char *text, size_t size, int count)
{
    size_t used = 0;
    for (int i = 0; i < count; i++)
        used += (size_t)snprintf(text + used, size - used, "%s%.14f", i ? ", " : "[",
                                 3 * cos(2 * M_PI * i / count));
    snprintf(text + used, size - used, "]");
}

static void test_table_of_a_cosine_is_nearly_the_cosine(void **state)
{
    (void)state;
    double slack = 3e-3; /* error of a spline's slope: 2 pi * 3 * (2 pi/n)^3 / 24 or so */
    for (int count = 64; count <= 128; count *= 2, slack /= 8) {
        char values[3000], potential[3200];
        cosine_values(values, sizeof values, count);
        snprintf(potential, sizeof potential, "{'type': 'table', 'period': 1, 'values': %s}",
                 values);
        assert_same_field(ring_with(potential), ring_with("{'type': 'cosine', 'amplitude': 6}"),
                          slack);
    }
}

static void test_many_fourier_terms(void **state)
{
    (void)state;
    enum { TERMS = 64 };
    double a[TERMS], b[TERMS], most = 0;
    char cosine[2000] = "", sine[2000] = "";
    for (int k = 0; k < TERMS; k++) {
        a[k] = cos(k * k + 1.0) / (k + 1), b[k] = sin(k * k * 3.0) / (k + 1);
        size_t c = strlen(cosine), s = strlen(sine);
        snprintf(cosine + c, sizeof cosine - c, "%s%.17g", k ? ", " : "", a[k]);
        snprintf(sine + s, sizeof sine - s, "%s%.17g", k ? ", " : "", b[k]);
    }
    struct bcd_scene *scene = experiment_scene(
        RING "'potential': {'type': 'fourier', 'cosine': [%s], 'sine': [%s]}, 'observables': "
             "{'energy': {}}}",
        cosine, sine);
    for (double x = 0; x < 1; x += 1.0 / 20021) {
        double u = 0, f = 0, curvature = 0;
        for (int k = 0; k < TERMS; k++) {
            double q = 2 * M_PI * (k + 1), c = cos(q * x), s = sin(q * x);
            u += a[k] * c + b[k] * s;
            f += q * (a[k] * s - b[k] * c);
            curvature -= q * q * (a[k] * c + b[k] * s);
        }
        most = fmax(most, fabs(curvature));
        assert_within(energy_at(scene, x), u, 0, 0, 1e-12);
        assert_within(force_at(scene, x), f, 0, 0, 1e-9);
    }
    assert_true(curvature_of(scene) >= most && curvature_of(scene) < 1.0002 * most);
    bcd_scene_free(scene);
}

/* F = -U', max|U''|, and many rods at once as one at a time. */
static void check_field(struct bcd_scene *scene, double low, double high)
{
    enum { POINTS = 4000, RODS = 200 };
    const double step = 1e-5, space = (high - low - 2 * step) / POINTS;
    double steepest = 0, curvature = curvature_of(scene), found = 0;
    for (int i = 0; i <= POINTS; i++) {
        double x = low + step + space * i, f = force_at(scene, x);
        double slope = (energy_at(scene, x + step) - energy_at(scene, x - step)) / (2 * step);
        assert_within(-slope, f, 0, 0, 1e-4 * (1 + fabs(f)));
        found = fmax(found, fabs(force_at(scene, x + step) - force_at(scene, x - step)) / 2 / step);
        steepest = fmax(steepest, fabs(f));
    }
    assert_true(steepest > 0 && found <= curvature * (1 + 1e-6) && found > 0.98 * curvature);
    double y[RODS], force[RODS], sum = 0;
    struct rods rods = {.y = y, .count = RODS, .diameter = (high - low) / RODS / 2};
    for (int i = 0; i < RODS; i++) {
        y[i] = low + (high - low) / RODS / 2 * i + 1e-3 * sin(i) * (high - low) / RODS;
        force[i] = 1;
    }
    const struct plan *plan = &scene->plan;
    plan->potential->add_force(plan->potential_par, &rods, 0.5, force);
    for (int i = 0; i < RODS; i++) {
        double x = y[i] + i * rods.diameter;
        assert_within(force[i], 1 + 0.5 * force_at(scene, x), 0, 0, 1e-9 * (1 + steepest));
        sum += energy_at(scene, x);
    }
    assert_within(plan->potential->energy_sum(plan->potential_par, &rods), sum, 0, 0,
                  1e-9 * (1 + fabs(sum)));
    bcd_scene_free(scene);
}

static void test_forces_are_slopes(void **state)
{
    (void)state;
    check_field(ring_with("{'type': 'fourier', 'wavelength': 2.5, 'cosine': [0, 1, -0.3], 'sine': "
                          "[2]}"),
                -3, 7);
    check_field(ring_with("{'type': 'table', 'period': 5, 'values': [0, 3, 1, -2, 0.5, 4]}"), -6,
                9);
    check_field(ring_with("{'type': 'expression', 'energy': '16*x^2*(2-x)^2', 'period': 2}"), -2,
                4);
    check_field(ring_with("{'type': 'expression', 'energy': 'exp(sin(0.4*pi*x))/2 + "
                          "max(0, cos(0.4*pi*x))^3', 'period': 5}"),
                0, 10);
    check_field(walls_with("{'type': 'expression', 'energy': '1/x^3 + (x - 5)^2/4'}"), 0.25, 9.75);
    check_field(walls_with("{'type': 'fourier', 'wavelength': 3, 'sine': [2]}"), 0.25, 9.75);
}

/* Rounding is no jump, nor is a sum of large numbers. */
static void test_rounding_passes(void **state)
{
    (void)state;
    static const char *const formulas[] = {
        "sin(2*pi*x)^2 + cos(2*pi*x)^2", "1e5 + cos(20*pi*x)", "1e-300*cos(2*pi*x)",
        "cos(2*pi*x) + 1e7 - 1e7",       "cos(2*pi*x)^63",     "max(cos(2*pi*x), 0)^2"};
    for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++) {
        char potential[200];
        snprintf(potential, sizeof potential, "{'type': 'expression', 'energy': '%s', 'period': 1}",
                 formulas[i]);
        bcd_scene_free(ring_with(potential));
    }
}

/* Narrower than the first scan: the curvature is found all the same. */
static void test_sharp_bends_are_found(void **state)
{
    (void)state;
    struct bcd_scene *scene =
        walls_with("{'type': 'expression', 'energy': 'sqrt((x - 3.3333)^2 + 1e-8)', 'period': 0}");
    assert_within(curvature_of(scene), 1e4, 0, 0, 200);
    bcd_scene_free(scene);
    scene = walls_with("{'type': 'expression', 'energy': '0.01*tanh(1e4*(x - 7.77))'}");
    assert_within(curvature_of(scene), 0.01 * 1e8 * 0.7698003589, 0, 0, 2e4); /* 4/(3 sqrt 3) */
    bcd_scene_free(scene);
}

/* --------------------------------------------------------------- statistics */

/* The same noise, the same forces: the same rods. */
static double final_energy(const char *potential, const char *method)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 9, 'length': 12, 'diameter': 0.7, 'potential': %s, "
                         "'method': '%s', 'time_step': 1e-4, 'time': 0.05, 'sample_every': 0.05, "
                         "'observables': {'energy': {}}}",
                         potential, method),
        0);
    struct bcd_table *u = experiment_table(&e, "energy");
    double value = column_of(u, BCD_ROLE_VALUE)[0];
    bcd_table_free(u);
    experiment_end(&e);
    return value;
}

static void test_same_noise_same_run(void **state)
{
    (void)state;
    static const char *const methods[] = {"bcd", "elastic"};
    for (int i = 0; i < 2; i++) {
        double cosine = final_energy("{'type': 'cosine', 'amplitude': 6}", methods[i]);
        assert_within(final_energy("{'type': 'fourier', 'cosine': [3]}", methods[i]), cosine, 0, 0,
                      1e-11);
        assert_within(final_energy("{'type': 'expression', 'energy': '3*cos(2*pi*x)', 'period': "
                                   "1}",
                                   methods[i]),
                      cosine, 0, 0, 1e-11);
    }
}

/* Energy, density and the missing current against exact theory, the time step chosen by itself:
 * off by no more than the estimated error of the step and 5 standard errors. */
static void check_equilibrium(const char *potential)
{
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 8, 'length': 10, 'diameter': 0.8, 'potential': %s, "
                         "'method': 'strang', 'equilibration_time': 1, 'time': 20, 'realizations': "
                         "16, 'observables': {'energy': {}, 'density': {'bins': 8}, 'current': "
                         "{}}}",
                         potential),
        0);
    static const char *const names[] = {"energy", "density"};
    for (int i = 0; i < 2; i++) {
        struct bcd_table *t = experiment_table(&e, names[i]);
        for (size_t r = 0; r < t->rows; r++)
            assert_within(column_of(t, BCD_ROLE_VALUE)[r], column_of(t, BCD_ROLE_THEORY)[r],
                          column_of(t, BCD_ROLE_STDERR)[r], 5,
                          column_of(t, BCD_ROLE_TIME_STEP_ERROR)[r]);
        bcd_table_free(t);
    }
    struct bcd_table *j = experiment_table(&e, "current");
    assert_within(column_of(j, BCD_ROLE_VALUE)[0], 0, column_of(j, BCD_ROLE_STDERR)[0], 5, 0);
    bcd_table_free(j);
    experiment_end(&e);
}

static void test_equilibrium_in_a_ratchet(void **state)
{
    (void)state;
    check_equilibrium("{'type': 'fourier', 'sine': [2, 0.7]}");
}

static void test_equilibrium_in_formulas(void **state)
{
    (void)state;
    check_equilibrium("{'type': 'expression', 'energy': '2*exp(sin(2*pi*x) - 0.5*cos(4*pi*x))', "
                      "'period': 1}");
}

/* Between walls one rod in a narrow parabola has kT/2. */
static void test_equipartition_between_walls(void **state)
{
    (void)state;
    struct experiment e = experiment_run(
        experiment_scene("{'particles': 1, 'length': 2, 'diameter': 0.2, 'boundary': 'walls', "
                         "'potential': {'type': 'expression', 'energy': '60*(x-0.9)^2'}, 'method': "
                         "'strang', 'time_step': 5e-4, 'equilibration_time': 0.2, 'time': 20, "
                         "'realizations': 60, 'observables': {'energy': {}}}"),
        0);
    struct bcd_table *u = experiment_table(&e, "energy");
    assert_within(column_of(u, BCD_ROLE_VALUE)[0], 0.5, column_of(u, BCD_ROLE_STDERR)[0], 5,
                  column_of(u, BCD_ROLE_TIME_STEP_ERROR)[0]);
    assert_true(column_of(u, BCD_ROLE_STDERR)[0] < 0.01);
    bcd_table_free(u);
    experiment_end(&e);
}

/* Without noise rods end in a minimum, side by side. */
static double energy_at_rest(const char *setting)
{
    struct experiment e = experiment_run(
        experiment_scene("{%s, 'temperature': 0, 'method': 'strang', 'equilibration_time': 20, "
                         "'time': 0.1, 'observables': {'energy': {}}}",
                         setting),
        0);
    struct bcd_table *u = experiment_table(&e, "energy");
    double value = column_of(u, BCD_ROLE_VALUE)[0];
    bcd_table_free(u);
    experiment_end(&e);
    return value;
}

static void test_rods_come_to_rest_in_minima(void **state)
{
    (void)state;
    double minimum = INFINITY;
    for (double x = 0; x < 1; x += 1e-6)
        minimum = fmin(minimum, 2 * sin(2 * M_PI * x) + 0.2 * sin(4 * M_PI * x));
    assert_within(energy_at_rest("'particles': 1, 'length': 3, 'potential': {'type': 'fourier', "
                                 "'sine': [2, 0.2]}"),
                  minimum, 0, 0, 1e-9);
    assert_within(energy_at_rest("'particles': 1, 'length': 3, 'potential': {'type': 'expression', "
                                 "'energy': '2*sin(2*pi*x) + 0.2*sin(4*pi*x)', 'period': 1}"),
                  minimum, 0, 0, 1e-9);
    assert_within(energy_at_rest("'particles': 1, 'length': 8, 'potential': {'type': 'table', "
                                 "'period': 4, 'values': [1, 0, 1, 2]}"),
                  0, 0, 0, 1e-9);
    assert_within(energy_at_rest("'particles': 3, 'length': 6, 'diameter': 0.5, 'boundary': "
                                 "'walls', 'potential': {'type': 'expression', 'energy': "
                                 "'(x - 2)^2'}"),
                  0.5 / 3, 0, 0, 1e-9);
    /* A wall is in the way: centres no nearer than half a diameter. */
    assert_within(energy_at_rest("'particles': 1, 'length': 6, 'diameter': 0.5, 'boundary': "
                                 "'walls', 'potential': {'type': 'expression', 'energy': "
                                 "'(x + 1)^2'}"),
                  1.25 * 1.25, 0, 0, 1e-12);
}

/* ----------------------------------------------------------------- refusals */

static void assert_refused(const char *job, const char *field, const char *text)
{
    char json[3000];
    snprintf(json, sizeof json, "%s", job);
    for (char *c = json; *c; c++)
        *c = *c == '\'' ? '"' : *c;
    struct bcd_errors errors = {0};
    struct bcd_scene *scene = NULL;
    assert_int_equal(scene_json_parse(json, strlen(json), &scene, &errors), BCD_INVALID);
    bcd_scene_free(scene);
    assert_true(errors.count > 0);
    if (strcmp(errors.items[0].field, field) != 0 || !strstr(errors.items[0].text, text))
        fail_msg("%s: %s %s", job, errors.items[0].field, errors.items[0].text);
}

#define ENERGY(text) "{'type': 'expression', 'energy': '" text "', 'period': 1}"

static void test_refusals(void **state)
{
    (void)state;
    static const struct {
        const char *potential, *field, *text;
    } cases[] = {
        {"{'type': 'fourier'}", "/potential/cosine", "is required, or \"sine\""},
        {"{'type': 'fourier', 'cosine': []}", "/potential/cosine", "is required, or \"sine\""},
        {"{'type': 'fourier', 'cosine': 3}", "/potential/cosine", "must be a list"},
        {"{'type': 'fourier', 'sine': ['a']}", "/potential/sine/0", "must be a number"},
        {"{'type': 'fourier', 'sine': [1, 1e7]}", "/potential/sine/1", "at most 1000000"},
        {"{'type': 'fourier', 'sine': [1], 'wavelength': 0}", "/potential/wavelength", "above 0"},
        {"{'type': 'fourier', 'sine': [1], 'wavelength': 3}", "/length", "whole number of periods"},
        {"{'type': 'table', 'period': 1}", "/potential/values", "is required"},
        {"{'type': 'table', 'values': [1, 2, 3, 4]}", "/potential/period", "is required"},
        {"{'type': 'table', 'period': -1, 'values': [1, 2, 3, 4]}", "/potential/period", "above 0"},
        {"{'type': 'table', 'period': 1, 'values': [1, 2, 3]}", "/potential/values", "4 to 4096"},
        {"{'type': 'table', 'period': 1, 'values': [1, 2, null, 3]}", "/potential/values/2",
         "must be a number"},
        {"{'type': 'table', 'period': 1, 'values': [1, 2, -1e300, 3]}", "/potential/values/2",
         "at least -1000000"},
        {"{'type': 'expression', 'period': 1}", "/potential/energy", "is required"},
        {ENERGY(""), "/potential/energy", "1 to 1000 characters"},
        {ENERGY("3*cos(2*pi*y)"), "/potential/energy", "character 12: unknown name \"y\""},
        {ENERGY("1e999"), "/potential/energy", "character 1: the number 1e999 is too large"},
        {"{'type': 'expression', 'energy': 5, 'period': 1}", "/potential/energy", "a text"},
        {"{'type': 'expression', 'energy': 'x', 'period': -1}", "/potential/period", "at least 0"},
        {"{'type': 'expression', 'energy': 'x*(1-x)'}", "/potential", "has no period"},
        {ENERGY("x"), "/potential/period", "U(0) = 0, U(1) = 1"},
        {ENERGY("x*(1-x)"), "/potential/period", "U'(0) = 1, U'(1) = -1"},
        {ENERGY("log(x)"), "/potential/energy", "at x = 0 energy, slope and curvature are -inf"},
        {ENERGY("1/(x-0.5)"), "/potential/energy", "at x = 0.5"},
        {ENERGY("1/(x-0.3)^2"), "/potential/energy", "jump at x = 0.3"},
        {ENERGY("sqrt(x-2)"), "/potential/energy", "must be finite"},
        {ENERGY("abs(x-1/3)"), "/potential/energy", "jump at x = 0.333333333"},
        {ENERGY("(x-0.7)/sqrt((x-0.7)^2)"), "/potential/energy", "jump at x = 0.7"},
        {ENERGY("cos(2*pi*x) + 1e-3*abs(x-0.5)/(x-0.5)"), "/potential/energy", "x = 0.5"},
        {ENERGY("exp(1000*x)"), "/potential/energy", "must be finite"},
        {ENERGY("1e200*cos(2*pi*x)"), "/time_step", ""},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char job[1000];
        snprintf(job, sizeof job, RING "'potential': %s, 'observables': {'energy': {}}}",
                 cases[i].potential);
        assert_refused(job, cases[i].field, cases[i].text);
    }
}

/* Formulas a few characters off: taken or refused at the right place, in bounded time. */
static void test_mutated_formulas(void **state)
{
    (void)state;
    static const char good[] = "3*cos(2*pi*x)^2-exp(sin(4*pi*x))/(1.5+cos(6*pi*x))";
    uint64_t seed = 7;
    size_t taken = 0, refused = 0;
    for (int i = 0; i < 400; i++) {
        char formula[sizeof good], job[1000];
        memcpy(formula, good, sizeof good);
        for (int k = 0; k <= i % 2; k++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            formula[(seed >> 40) % (sizeof good - 1)] = good[(seed >> 20) % (sizeof good - 1)];
        }
        snprintf(job, sizeof job,
                 RING "'potential': {'type': 'expression', 'energy': '%s', 'period': 1}, "
                      "'observables': {'energy': {}}}",
                 formula);
        for (char *c = job; *c; c++)
            *c = *c == '\'' ? '"' : *c;
        struct bcd_errors errors = {0};
        struct bcd_scene *scene = NULL;
        if (scene_json_parse(job, strlen(job), &scene, &errors) == BCD_OK) {
            double x = 0.4, u = energy_at(scene, x), f = force_at(scene, x);
            assert_true(isfinite(u) && isfinite(f));
            taken++;
        } else {
            assert_true(strncmp(errors.items[0].field, "/potential", 10) == 0 ||
                        strcmp(errors.items[0].field, "/time_step") == 0);
            refused++;
        }
        bcd_scene_free(scene);
    }
    assert_true(taken > 20 && refused > 100);
}

static void test_flat_potentials_exert_no_force(void **state)
{
    (void)state;
    static const char *const flat[] = {
        "{'type': 'fourier', 'cosine': [0, 0], 'sine': [0]}",
        "{'type': 'table', 'period': 1, 'values': [2.5, 2.5, 2.5, 2.5, 2.5]}",
        "{'type': 'expression', 'energy': '5', 'period': 1}",
        "{'type': 'expression', 'energy': 'x - x', 'period': 1}",
    };
    for (size_t i = 0; i < sizeof flat / sizeof *flat; i++) {
        struct bcd_scene *scene = ring_with(flat[i]);
        assert_false(scene->plan.field);
        assert_non_null(scene->plan.potential);
        bcd_scene_free(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_fourier_term_is_the_cosine),
        cmocka_unit_test(test_formula_of_a_cosine_is_the_cosine),
        cmocka_unit_test(test_table_of_a_cosine_is_nearly_the_cosine),
        cmocka_unit_test(test_many_fourier_terms),
        cmocka_unit_test(test_forces_are_slopes),
        cmocka_unit_test(test_rounding_passes),
        cmocka_unit_test(test_sharp_bends_are_found),
        cmocka_unit_test(test_same_noise_same_run),
        cmocka_unit_test(test_equilibrium_in_a_ratchet),
        cmocka_unit_test(test_equilibrium_in_formulas),
        cmocka_unit_test(test_equipartition_between_walls),
        cmocka_unit_test(test_rods_come_to_rest_in_minima),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_mutated_formulas),
        cmocka_unit_test(test_flat_potentials_exert_no_force),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
