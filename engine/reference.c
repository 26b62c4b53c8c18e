/* SPDX-License-Identifier: GPL-3.0-or-later
 * reference.c - see reference.h and bcd.h: which exact theory a scene has, and how a measurement
 * compares with it. The mathematics is in theory/. */
#include "reference.h"
#include "equilibrium.h"
#include "status.h"
#include "table.h"
#include "theory/cost.h"
#include "watch.h"

#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---------------------------------------------------------------- solving */

typedef enum bcd_status theory_route(struct theory_result **, const struct theory_system *,
                                     const struct theory_wanted *, struct bcd_error *);

/* Of the seconds that a watch allows, this share may go into pair distributions. What is expected
 * to take so many times what is allowed is not begun. */
static const double pairs_share = 0.75, hopeless = 2;

static double allowance(bool pairs, double left)
{
    return pairs ? pairs_share * left : left;
}

static bool told_to_stop(const struct bcd_theory *theory)
{
    return theory->watch->end == BCD_WATCH_TOLD;
}

/* One attempt. What a limit of the watch cuts off is BCD_INVALID like any other theory that cannot
 * be had. `goes_on`: something else will be tried then. */
static enum bcd_status attempt(struct bcd_theory *theory, struct theory_result **result,
                               theory_route *route, const struct theory_system *system,
                               const struct theory_wanted *wanted, bool goes_on,
                               struct bcd_error *error)
{
    struct bcd_watch *watch = theory->watch;
    const double all = watch->seconds_max;
    const double left = allowance(goes_on, all - watch->seconds);
    double expected = route == theory_infinite ? theory_cost_infinite(system, wanted).seconds
                                               : theory_cost_canonical(system, wanted).seconds;
    if (all > 0 && expected > hopeless * left) {
        theory->cut_short = true;
        return error_set(error, BCD_INVALID, "",
                         "would take about %.2g core seconds, and may take %.2g", expected, left);
    }
    watch->seconds_max = all > 0 ? watch->seconds + left : 0;
    enum bcd_status status = route(result, system, wanted, error);
    watch->seconds_max = all;
    if (status != BCD_STOPPED || told_to_stop(theory))
        return status;
    if (watch->end == BCD_WATCH_SECONDS)
        error_set(error, BCD_STOPPED, "", "takes more than the %.2g core seconds that it may",
                  left);
    theory->cut_short = true;
    if (goes_on)
        watch->end = BCD_WATCH_GOES_ON;
    return BCD_INVALID;
}

static enum bcd_status solve(struct bcd_theory *theory, struct theory_result **result,
                             theory_route *route, const struct plan *plan,
                             const struct theory_wanted *wanted, char why_not[160])
{
    struct theory_system system = equilibrium_system(plan);
    struct bcd_error error = {0};
    bool pairs = wanted->pair_bins > 0;
    system.watch = theory->watch;
    enum bcd_status status = attempt(theory, result, route, &system, wanted, pairs, &error);
    if (status != BCD_OK)
        snprintf(why_not, 160, "%.159s", error.text);
    if (status == BCD_INVALID && pairs) { /* the rest may still be had */
        struct theory_wanted less = *wanted;
        less.pair_bins = 0;
        status = attempt(theory, result, route, &system, &less, false, NULL);
    }
    return status == BCD_INVALID ? BCD_OK : status;
}

static enum bcd_status solve_canonical(struct bcd_theory *theory, const struct plan *plan,
                                       const struct theory_wanted *wanted,
                                       const struct bcd_theory *known)
{
    if (!known)
        return solve(theory, &theory->canonical, theory_canonical, plan, wanted, theory->why_not);
    memcpy(theory->why_not, known->why_not, sizeof theory->why_not);
    theory->seconds += known->seconds;
    return known->canonical ? theory_result_copy(&theory->canonical, known->canonical) : BCD_OK;
}

static enum bcd_status solve_infinite(struct bcd_theory *theory, const struct plan *plan,
                                      const struct theory_wanted *wanted,
                                      const struct bcd_theory *known)
{
    if (!known || known->scope != BCD_THEORY_INFINITE)
        return solve(theory, &theory->infinite, theory_infinite, plan, wanted,
                     theory->why_not_infinite);
    memcpy(theory->why_not_infinite, known->why_not_infinite, sizeof theory->why_not_infinite);
    return known->infinite ? theory_result_copy(&theory->infinite, known->infinite) : BCD_OK;
}

/* What the observables ask of it; false = none does. */
static bool wanted_of(const struct bcd_scene *scene, struct theory_wanted *wanted)
{
    bool any = false;
    const struct scene_part *part;
    *wanted = (struct theory_wanted){0};
    for (size_t i = 0; (part = scene_observable(scene, i)) != NULL; i++) {
        const struct observable_type *type = scene_observable_type(part);
        any = any || type->want;
        if (type->want)
            type->want(part->group.values, &scene->plan, wanted);
    }
    return any;
}

enum bcd_status bcd_theory_create(struct bcd_theory **out, const struct bcd_scene *scene,
                                  enum bcd_theory_scope scope, struct bcd_watch *watch,
                                  const struct bcd_theory *known)
{
    struct bcd_theory *theory = calloc(1, sizeof *theory);
    if (!theory)
        return BCD_NO_MEMORY;
    struct theory_wanted wanted;
    const char *none = equilibrium_missing(&scene->plan);
    bool any = wanted_of(scene, &wanted) || scope == BCD_THEORY_INFINITE;
    theory->scope = scope;
    theory->watch = watch ? watch : &theory->own;
    snprintf(theory->why_not, sizeof theory->why_not, "%s",
             none ? none : "the exact theory does not give it here");
    snprintf(theory->why_not_infinite, sizeof theory->why_not_infinite, "%s",
             none ? none : "was not asked for");
    const double before = theory->watch->seconds;
    enum bcd_status status = BCD_OK;
    if (!none && any) {
        status = solve_canonical(theory, &scene->plan, &wanted, known);
        if (!status && scope == BCD_THEORY_INFINITE)
            status = solve_infinite(theory, &scene->plan, &wanted, known);
    }
    theory->seconds += theory->watch->seconds - before;
    if (status) {
        bcd_theory_free(theory);
        return status;
    }
    *out = theory;
    return BCD_OK;
}

/* Adds what an attempt is expected to take; returns the seconds that are left. */
static double add_expected(struct bcd_theory_cost *sum, const struct theory_cost *cost, bool pairs,
                           double left)
{
    double allowed = allowance(pairs, left);
    double seconds = cost->seconds > hopeless * allowed ? 0 : fmin(cost->seconds, allowed);
    sum->seconds += seconds;
    sum->bytes = seconds > 0 ? fmax(sum->bytes, cost->bytes) : sum->bytes;
    return left - seconds;
}

typedef struct theory_cost cost_of(const struct theory_system *, const struct theory_wanted *);

static double add_route(struct bcd_theory_cost *sum, cost_of *cost_of_it,
                        const struct theory_system *system, const struct theory_wanted *wanted,
                        double left)
{
    struct theory_wanted less = *wanted;
    struct theory_cost cost = cost_of_it(system, wanted);
    bool pairs = wanted->pair_bins > 0;
    if (pairs) {
        double before = left;
        left = add_expected(sum, &cost, true, left);
        if (before - left == cost.seconds && cost.seconds > 0)
            return left; /* it succeeds */
        less.pair_bins = 0;
        cost = cost_of_it(system, &less);
    }
    return add_expected(sum, &cost, false, left);
}

void bcd_theory_estimate(const struct bcd_scene *scene, enum bcd_theory_scope scope,
                         double seconds_max, struct bcd_theory_cost *cost)
{
    struct theory_wanted wanted;
    double left = seconds_max > 0 ? seconds_max : INFINITY, forms_ns = 0;
    const struct scene_part *part;
    bool any = wanted_of(scene, &wanted) || scope == BCD_THEORY_INFINITE;
    *cost = (struct bcd_theory_cost){0};
    if (any && !equilibrium_missing(&scene->plan)) {
        struct theory_system system = equilibrium_system(&scene->plan);
        left = add_route(cost, theory_cost_canonical, &system, &wanted, left);
        if (scope == BCD_THEORY_INFINITE)
            left = add_route(cost, theory_cost_infinite, &system, &wanted, left);
    }
    for (size_t i = 0; (part = scene_observable(scene, i)) != NULL; i++) {
        const struct observable_type *type = scene_observable_type(part);
        forms_ns += type->exact_ns ? type->exact_ns(part->group.values, &scene->plan) : 0;
    }
    cost->seconds += fmin(1e-9 * forms_ns, left);
}

bool bcd_theory_cut_short(const struct bcd_theory *theory)
{
    return theory->cut_short;
}

size_t bcd_theory_bytes(const struct bcd_theory *theory)
{
    return sizeof *theory + theory_result_bytes(theory->canonical) +
           theory_result_bytes(theory->infinite);
}

double bcd_theory_seconds(const struct bcd_theory *theory)
{
    return theory->seconds;
}

void bcd_theory_free(struct bcd_theory *theory)
{
    if (!theory)
        return;
    theory_result_free(theory->canonical);
    theory_result_free(theory->infinite);
    free(theory);
}

/* ----------------------------------------------------------------- columns */

/* Adds one column of exact values under a name; absent with a reason where there are none. */
static enum bcd_status add_exact(struct bcd_table *table, const char *name,
                                 const struct scene_part *part, const struct plan *plan,
                                 struct exact *exact)
{
    exact->rows = table->rows;
    exact->values = calloc(table->rows + 1, sizeof *exact->values);
    if (!exact->values)
        return BCD_NO_MEMORY;
    const double before = exact->watch->seconds;
    scene_observable_type(part)->exact(part->group.values, plan, exact);
    enum bcd_status status = BCD_OK;
    struct bcd_error late = {0};
    /* Who spends nothing has it from the equilibrium, or it is simple: that is whole. */
    if (watch_ended(exact->watch) && exact->watch->seconds > before && exact->reference) {
        watch_stopped(exact->watch, &late);
        exact->reference = NULL;
        exact->reason = late.text;
    }
    if (exact->watch->end == BCD_WATCH_TOLD) {
        status = BCD_STOPPED;
    } else if (!exact->reference) {
        table_add_absent(table, name, BCD_ROLE_THEORY, exact->reason);
    } else {
        double *values = table_add(table, name, BCD_ROLE_THEORY);
        status = values ? BCD_OK : BCD_NO_MEMORY;
        for (size_t i = 0; values && i < table->rows; i++)
            values[i] = exact->values[i];
    }
    free(exact->values);
    return status;
}

enum bcd_status reference_add(struct bcd_table *table, const struct bcd_theory *theory,
                              const struct bcd_scene *scene, size_t index)
{
    const struct scene_part *part = scene_observable(scene, index);
    if (!scene_observable_type(part)->exact)
        return BCD_OK;
    if (!theory) {
        table_add_absent(table, "theory", BCD_ROLE_THEORY, "was not asked for");
        return BCD_OK;
    }
    struct exact exact = {.equilibrium = theory->canonical,
                          .equilibrium_kind = "canonical",
                          .why_not = theory->why_not,
                          .watch = theory->watch};
    enum bcd_status status = add_exact(table, "theory", part, &scene->plan, &exact);
    if (!status && exact.reference)
        table_note_text(table, "reference", exact.reference);
    return status;
}

enum bcd_status bcd_theory_table(const struct bcd_theory *theory, const struct bcd_scene *scene,
                                 size_t index, struct bcd_table **out)
{
    const struct scene_part *part = scene_observable(scene, index);
    if (!part)
        return BCD_INVALID;
    const struct observable_type *type = scene_observable_type(part);
    struct bcd_table *table = calloc(1, sizeof *table);
    if (!table)
        return BCD_NO_MEMORY;
    enum bcd_status status = type->describe(part->group.values, &scene->plan, NULL, table);
    if (!status && !type->exact)
        table_add_absent(table, "theory", BCD_ROLE_THEORY, "no exact theory is known");
    if (!status && type->exact)
        status = reference_add(table, theory, scene, index);
    if (!status && type->want) {
        struct exact infinite = {.equilibrium = theory->infinite,
                                 .equilibrium_kind = "infinite",
                                 .why_not = theory->why_not_infinite,
                                 .watch = theory->watch};
        status = add_exact(table, "infinite", part, &scene->plan, &infinite);
    }
    if (status) {
        bcd_table_free(table);
        return status;
    }
    *out = table;
    return BCD_OK;
}

static enum bcd_status add_number(struct bcd_table *table, const char *name, double value,
                                  const char *why_not)
{
    if (isnan(value)) {
        table_add_absent(table, name, BCD_ROLE_OTHER, why_not);
        return BCD_OK;
    }
    double *at = table_add(table, name, BCD_ROLE_OTHER);
    if (!at)
        return BCD_NO_MEMORY;
    *at = value;
    return BCD_OK;
}

enum bcd_status bcd_theory_summary(const struct bcd_theory *theory, struct bcd_table **out)
{
    const struct theory_result *ring = theory->canonical, *infinite = theory->infinite;
    struct bcd_table *table = calloc(1, sizeof *table);
    if (!table)
        return BCD_NO_MEMORY;
    table_describe(table, "equilibrium", 1);
    table->scalar = true;
    const struct {
        const char *name;
        double value;
        const char *why_not;
    } rows[] = {
        {"energy", ring ? ring->energy : NAN, theory->why_not},
        {"energy_infinite", infinite ? infinite->energy : NAN, theory->why_not_infinite},
        {"pressure_infinite", infinite ? infinite->pressure : NAN, theory->why_not_infinite},
        {"bonded_fraction", ring ? ring->bonded_fraction : NAN,
         ring ? "rods do not bond" : theory->why_not},
        {"relative_error", ring ? ring->error : NAN, theory->why_not},
    };
    enum bcd_status status = BCD_OK;
    for (size_t i = 0; !status && i < sizeof rows / sizeof *rows; i++)
        status = add_number(table, rows[i].name, rows[i].value, rows[i].why_not);
    if (status) {
        bcd_table_free(table);
        return status;
    }
    *out = table;
    return BCD_OK;
}

/* -------------------------------------------------------------- comparison */

/* The normal deviate that is as unlikely as t of Student's distribution. */
static double normal_of_t(double t, double freedom)
{
    double tail = gsl_cdf_tdist_Q(fabs(t), freedom);
    double z = tail > 1e-300 ? gsl_cdf_ugaussian_Qinv(tail) : 37;
    return t < 0 ? -z : z;
}

/* An asymptote is not what a measurement should meet. */
static bool comparable(const struct bcd_table *table)
{
    for (size_t i = 0; i < table->notes; i++)
        if (strcmp(table->note[i].name, "reference") == 0)
            return strcmp(table->note[i].text, "asymptote") != 0;
    return false;
}

enum bcd_status reference_compare(struct bcd_table *table, const double *samples)
{
    if (!comparable(table))
        return BCD_OK;
    const struct bcd_column *value = bcd_table_column(table, BCD_ROLE_VALUE),
                            *error = bcd_table_column(table, BCD_ROLE_STDERR),
                            *theory = bcd_table_column(table, BCD_ROLE_THEORY);
    if (!value || !error || !theory || !value->values || !error->values || !theory->values)
        return BCD_OK;
    const double *v = value->values, *e = error->values, *exact = theory->values;
    double *z = table_add(table, "z", BCD_ROLE_OTHER);
    if (!z)
        return BCD_NO_MEMORY;
    double sum = 0, freedom = 0;
    for (size_t i = 0; i < table->rows; i++) {
        z[i] = NAN;
        if (!(e[i] > 0) || !isfinite(exact[i]) || samples[i] < 2)
            continue;
        z[i] = normal_of_t((v[i] - exact[i]) / e[i], samples[i] - 1);
        sum += z[i] * z[i];
        freedom += 1;
    }
    if (freedom == 0)
        return BCD_OK;
    table_note_number(table, "chi_square", sum);
    table_note_number(table, "degrees_of_freedom", freedom);
    table_note_number(table, "p_value", gsl_cdf_chisq_Q(sum, freedom));
    if (table->rows > 1) /* rods that share a well raise or lower whole stretches of a profile */
        table_note_text(table, "p_value_assumes", "independent rows");
    return BCD_OK;
}
