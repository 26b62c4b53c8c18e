/* SPDX-License-Identifier: GPL-3.0-or-later
 * reference.c - see reference.h and bcd.h: which exact theory a scene has, and how a measurement
 * compares with it. The mathematics is in theory/. */
#include "reference.h"
#include "equilibrium.h"
#include "status.h"
#include "table.h"

#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---------------------------------------------------------------- solving */

typedef enum bcd_status theory_route(struct theory_result **, const struct theory_system *,
                                     const struct theory_wanted *, struct bcd_error *);

static enum bcd_status solve(struct theory_result **result, theory_route *route,
                             const struct plan *plan, const struct theory_wanted *wanted,
                             char why_not[160])
{
    struct theory_system system = equilibrium_system(plan);
    struct bcd_error error = {0};
    enum bcd_status status = route(result, &system, wanted, &error);
    if (status != BCD_OK)
        snprintf(why_not, 160, "%.159s", error.text);
    if (status == BCD_INVALID && wanted->pair_bins > 0) { /* the rest may still be had */
        struct theory_wanted less = *wanted;
        less.pair_bins = 0;
        status = route(result, &system, &less, NULL);
    }
    return status == BCD_NO_MEMORY ? status : BCD_OK;
}

enum bcd_status bcd_theory_create(struct bcd_theory **out, const struct bcd_scene *scene,
                                  enum bcd_theory_scope scope)
{
    struct bcd_theory *theory = calloc(1, sizeof *theory);
    if (!theory)
        return BCD_NO_MEMORY;
    struct theory_wanted wanted = {0};
    bool any = false;
    const struct scene_part *part;
    for (size_t i = 0; (part = scene_observable(scene, i)) != NULL; i++) {
        const struct observable_type *type = scene_observable_type(part);
        any = any || type->want;
        if (type->want)
            type->want(part->group.values, &scene->plan, &wanted);
    }
    const char *none = equilibrium_missing(&scene->plan);
    any = any || scope == BCD_THEORY_INFINITE;
    snprintf(theory->why_not, sizeof theory->why_not, "%s",
             none ? none : "the exact theory does not give it here");
    snprintf(theory->why_not_infinite, sizeof theory->why_not_infinite, "%s",
             none ? none : "was not asked for");
    enum bcd_status status = BCD_OK;
    if (!none && any) {
        status = solve(&theory->canonical, theory_canonical, &scene->plan, &wanted,
                       theory->why_not);
        if (!status && scope == BCD_THEORY_INFINITE)
            status = solve(&theory->infinite, theory_infinite, &scene->plan, &wanted,
                           theory->why_not_infinite);
    }
    if (status) {
        bcd_theory_free(theory);
        return status;
    }
    *out = theory;
    return BCD_OK;
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
    scene_observable_type(part)->exact(part->group.values, plan, exact);
    enum bcd_status status = BCD_OK;
    if (!exact->reference) {
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
                          .why_not = theory->why_not};
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
                                 .why_not = theory->why_not_infinite};
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
