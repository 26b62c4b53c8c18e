/* SPDX-License-Identifier: GPL-3.0-or-later
 * coverage.c - see coverage.h. */
#include "coverage.h"
#include "scene_json.h"
#include "support/experiment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { CORE_SECONDS_MAX = 20 };

/* The scene with a step given as text; NULL = refused. */
static struct bcd_scene *make(const struct coverage_scene *scene, const char *method,
                              const char *step, int realizations)
{
    char job[1500];
    int length = snprintf(job, sizeof job,
                          "{%s, 'method': '%s', 'time_step': %s, 'time': %.17g, "
                          "'realizations': %d}",
                          scene->members, method, step, scene->time, realizations);
    assert_in_range(length, 1, sizeof job - 1);
    for (char *c = job; *c; c++)
        *c = *c == '\'' ? '"' : *c;
    struct bcd_scene *made = NULL;
    struct bcd_errors errors = {0};
    if (scene_json_parse(job, strlen(job), &made, &errors) == BCD_OK)
        return made;
    static const char *const may_refuse[] = {"/method", "/time_step", "/observables/msd/first"};
    bool may = false;
    for (size_t i = 0; i < sizeof may_refuse / sizeof *may_refuse; i++)
        may = may || strcmp(errors.items[0].field, may_refuse[i]) == 0;
    if (!may)
        fail_msg("%s: %s: %s", scene->name, errors.items[0].field, errors.items[0].text);
    return NULL;
}

static void add_table(struct coverage *c, const struct bcd_table *t, const char *what)
{
    const double *value = column_of(t, BCD_ROLE_VALUE), *error = column_of(t, BCD_ROLE_STDERR);
    const struct bcd_column *exact = bcd_table_column(t, BCD_ROLE_THEORY),
                            *step = bcd_table_column(t, BCD_ROLE_TIME_STEP_ERROR);
    assert_non_null(step);
    if (!exact || !exact->values || !step->values)
        return;
    size_t values = 0, covered = 0;
    double worst = 0;
    for (size_t i = 0; i < t->rows; i++) {
        if (!isfinite(exact->values[i]) || !isfinite(step->values[i]) || !(error[i] > 0) ||
            step->values[i] == 0 || /* exact in law, which other tests see to */
            error[i] > 0.25 * fabs(exact->values[i])) /* too few counts for a law of errors */
            continue;
        double off = fabs(value[i] - exact->values[i]);
        bool in = off <= step->values[i] + 2 * error[i], resolved = off > 3 * error[i];
        values++, covered += in;
        c->resolved += resolved, c->caught += resolved && in;
        worst = fmax(worst, (off - step->values[i]) / error[i]);
    }
    c->values += values, c->covered += covered;
    printf("# %s %s: %zu of %zu, worst %.1f standard errors beyond\n", what, t->name, covered,
           values, worst);
}

void coverage_add(struct coverage *coverage, const struct coverage_scene *scene, const char *method,
                  double factor, int realizations)
{
    struct bcd_scene *made = make(scene, method, "\"auto\"", realizations);
    if (!made)
        return;
    char step[40], what[120];
    double h = factor * experiment_fact(made, "time_step");
    bcd_scene_free(made);
    snprintf(step, sizeof step, "%.17g", scene->time / ceil(scene->time / h));
    snprintf(what, sizeof what, "%s, %s, %g steps of %s", scene->name, method, factor, step);
    made = make(scene, method, step, realizations);
    if (!made)
        return;
    struct bcd_estimate estimate;
    bcd_scene_estimate(made, &estimate);
    if (estimate.core_seconds > CORE_SECONDS_MAX) {
        printf("# %s: left out, takes %.0f s\n", what, estimate.core_seconds);
        bcd_scene_free(made);
        return;
    }
    struct experiment e = experiment_run(made, 0);
    for (size_t i = 0; bcd_scene_part(e.scene, BCD_SLOT_OBSERVABLE, i); i++) {
        struct bcd_table *t = experiment_table(
            &e, bcd_scene_part(e.scene, BCD_SLOT_OBSERVABLE, i)->type);
        add_table(coverage, t, what);
        bcd_table_free(t);
    }
    experiment_end(&e);
}
