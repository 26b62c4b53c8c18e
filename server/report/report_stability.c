/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report_stability.h"
#include "report_run.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { REALIZATIONS = 16, CORE_SECONDS_MAX = 5, DENSITY_BINS = 20 };
static const double work_max = 1.6e6; /* rods times steps times realizations */
static const double overlap_max = 1e-9; /* of L: rounding of positions far from the origin */

#define COSINE(u) "\"potential\":{\"type\":\"cosine\",\"amplitude\":" #u "}"
#define SMALL "\"particles\":8,\"length\":10,\"diameter\":0.5,"
#define STICKY(gamma, range)                                                                       \
    ",\"interaction\":{\"type\":\"sticky\",\"strength\":" #gamma ",\"range\":" #range              \
    ",\"exponent\":3}"

/* The bound on an error of the energy is a tenth of its range, U0 (nothing melts within that:
 * melted, U0 = 100 gives -9 in place of -49.5): steps that melt are refused by all but metropolis,
 * which is exact in equilibrium with any. A drift off by more than half is no drift. */
static const struct stability_extreme extremes[] = {
    {.name = "U0 = 100", .members = SMALL COSINE(100), .bound = 10, .time = 1, .drawn = true},
    {.name = "U0 = 100, h = 2.5e-3",
     .members = SMALL COSINE(100) ",\"time_step\":2.5e-3",
     .bound = 10,
     .time = 1,
     .drawn = true},
    {.name = "U0 = 20", .members = SMALL COSINE(20), .bound = 2, .time = 10, .drawn = true},
    {.name = "sigma = 0.999, rho = 1",
     .members = "\"particles\":4,\"length\":4,\"diameter\":0.999," COSINE(6),
     .bound = 0.6,
     .time = 10,
     .drawn = true},
    {.name = "sigma > wavelength",
     .members = "\"particles\":8,\"length\":20,\"diameter\":1.4," COSINE(6),
     .bound = 0.6,
     .time = 10,
     .drawn = true},
    {.name = "ell = 0",
     .members = "\"particles\":10,\"length\":10,\"diameter\":1," COSINE(1),
     .bound = 0.1,
     .time = 10},
    {.name = "0 < ell < 1e-12 L",
     .members = "\"particles\":10,\"length\":10,\"diameter\":0.99999999999999," COSINE(1),
     .bound = 0.1,
     .time = 10},
    {.name = "ell < 0",
     .members = "\"particles\":10,\"length\":10,\"diameter\":1.01," COSINE(6),
     .judge = STABILITY_BY_REFUSAL,
     .time = 1},
    {.name = "L no multiple of the period",
     .members = "\"particles\":8,\"length\":10.5,\"diameter\":0.5," COSINE(6),
     .judge = STABILITY_BY_REFUSAL,
     .time = 1},
    {.name = "N = 1",
     .members = "\"particles\":1,\"length\":2,\"diameter\":0.5," COSINE(6),
     .bound = 0.6,
     .time = 100,
     .drawn = true},
    {.name = "N = 2",
     .members = "\"particles\":2,\"length\":2,\"diameter\":0.5," COSINE(6),
     .bound = 0.6,
     .time = 100,
     .drawn = true},
    {.name = "N = 10^6, 3 steps",
     .members = "\"particles\":1000000,\"length\":2000000,\"diameter\":0.5,"
                "\"time_step\":1e-5," COSINE(6),
     .bound = INFINITY,
     .time = 3e-5,
     .ticks_max = 3},
    {.name = "points: sigma = 0",
     .members = "\"particles\":8,\"length\":10,\"diameter\":0," COSINE(6),
     .bound = 0.6,
     .time = 10,
     .drawn = true},
    {.name = "long drag",
     .members = "\"particles\":8,\"length\":10,\"diameter\":0.5,\"force\":10",
     .judge = STABILITY_BY_VELOCITY,
     .expected = 10,
     .bound = 0.5,
     .time = 1e6},
    {.name = "force = 10^6",
     .members = SMALL COSINE(6) ",\"force\":1e6",
     .judge = STABILITY_BY_VELOCITY,
     .expected = 1e6,
     .bound = 0.5,
     .time = 1},
    {.name = "force = 10^6, h = 0.1",
     .members = SMALL COSINE(6) ",\"force\":1e6,\"time_step\":0.1",
     .judge = STABILITY_BY_REFUSAL,
     .time = 1},
    {.name = "kT = 0",
     .members = "\"particles\":3,\"length\":8,\"diameter\":0.2,\"temperature\":0,"
                "\"initial\":\"lattice\",\"potential\":"
                "{\"type\":\"cosine\",\"amplitude\":6,\"phase\":1}",
     .equilibration = 2,
     .expected = -3,
     .bound = 0.6,
     .time = 1},
    {.name = "kT = 1e-9",
     .members = "\"particles\":3,\"length\":8,\"diameter\":0.2,\"temperature\":1e-9,"
                "\"initial\":\"lattice\",\"potential\":"
                "{\"type\":\"cosine\",\"amplitude\":6,\"phase\":1}",
     .equilibration = 2,
     .expected = -3,
     .bound = 0.6,
     .time = 1},
    {.name = "time = 10^9 without a field",
     .members = "\"particles\":8,\"length\":10,\"diameter\":0.5",
     .judge = STABILITY_BY_DENSITY,
     .bound = 0.1,
     .time = 1e9},
    {.name = "time = 10^18",
     .members = SMALL COSINE(6) ",\"time\":1e18",
     .judge = STABILITY_BY_REFUSAL},
    {.name = "sticky: gamma = 10^6, range 10^-6",
     .members = SMALL COSINE(6) STICKY(1e6, 1e-6),
     .bound = 0.6,
     .time = 1},
    {.name = "sticky, h = 10^-3",
     .members = SMALL COSINE(6) STICKY(1, 0.05) ",\"time_step\":1e-3",
     .bound = 0.6,
     .time = 1,
     .drawn = true},
    {.name = "lambda = 0.01",
     .members = "\"particles\":8,\"length\":10,\"diameter\":0.5,\"potential\":"
                "{\"type\":\"cosine\",\"amplitude\":6,\"wavelength\":0.01}",
     .bound = 0.6,
     .time = 0.01,
     .least_time = 1e-4 / (4 * M_PI * M_PI),
     .drawn = true},
};

static void judge(const struct report_run *run, const struct stability_extreme *extreme,
                  struct stability_result *result);
static bool disordered(const struct report_run *run);

const struct stability_extreme *stability_extreme(size_t index)
{
    return index < sizeof extremes / sizeof *extremes ? &extremes[index] : NULL;
}

const char *stability_verdict_name(enum stability_verdict verdict)
{
    static const char *const names[STABILITY_VERDICTS] = {
        "right",  "biased", "ran",         "refused",  "MELTED",
        "ACCEPTED", "NAN",  "OUT OF ORDER", "TOO LATE", "BROKEN"};
    return names[verdict];
}

bool stability_failed(enum stability_verdict verdict)
{
    return verdict > STABILITY_REFUSED;
}

bool stability_plan(const char *only, const char *method, size_t index,
                    struct stability_entry *entry)
{
    const struct stability_extreme *extreme;
    const char *name;
    for (size_t i = 0; (extreme = stability_extreme(i)) != NULL; i++) {
        if (only && !strstr(extreme->name, only))
            continue;
        for (size_t m = 1; (name = report_run_method(m)) != NULL; m++) {
            if ((method && strcmp(method, name) != 0) || index-- > 0)
                continue;
            *entry = (struct stability_entry){.extreme = extreme, .method = name};
            return true;
        }
    }
    return false;
}

bool stability_measure(struct stability *report, const struct stability_options *options)
{
    struct stability_entry entry;
    report->count = report->failed = report->planned = 0;
    while (report->planned < STABILITY_ENTRIES_MAX &&
           stability_plan(options->only, NULL, report->planned, &entry))
        report->planned++;
    while (report->count < report->planned) {
        stability_plan(options->only, NULL, report->count, &entry);
        entry.result = stability_try(entry.extreme, entry.method, options->stop);
        if (options->stop && atomic_load(options->stop))
            return false;
        report->failed += stability_failed(entry.result.verdict);
        report->entry[report->count++] = entry;
        if (options->found)
            options->found(options->context, report);
    }
    return true;
}

/* -------------------------------------------------------------------- jobs */

/* What is asked of the extreme besides its own members. */
struct demand {
    const char *method;
    double time_step; /* 0 = the members' or the method's own */
    double time, equilibration;
    bool drawn, path; /* from equilibrium; with the rods' last positions, to see their order */
};
static void doubt(const struct demand *demand, const struct stability_extreme *extreme,
                  struct stability_result *result);

static char *print_job(const struct stability_extreme *extreme, const struct demand *demand)
{
    struct text job = {0};
    text_add(&job, "{%s,\"method\":\"%s\",\"realizations\":%d", extreme->members, demand->method,
             extreme->ticks_max > 0 ? 2 : REALIZATIONS);
    if (demand->drawn)
        text_add(&job, ",\"initial\":\"equilibrium\"");
    if (demand->time_step > 0)
        report_add_member(&job, "time_step", demand->time_step);
    if (demand->time > 0)
        report_add_member(&job, "time", demand->time);
    if (demand->equilibration > 0)
        report_add_member(&job, "equilibration_time", demand->equilibration);
    if (extreme->judge == STABILITY_BY_VELOCITY)
        text_add(&job, ",\"observables\":{\"current\":{}");
    else if (extreme->judge == STABILITY_BY_DENSITY)
        text_add(&job, ",\"observables\":{\"density\":{\"bins\":%d}", DENSITY_BINS);
    else
        text_add(&job, ",\"observables\":{\"energy\":{}");
    if (demand->path) {
        text_add(&job, ",\"trajectory\":{\"every\":");
        text_add_number(&job, demand->time);
        text_add(&job, "}");
    }
    text_add(&job, "}}");
    return text_take(&job);
}

static enum report_outcome run_demand(struct report_run *run,
                                      const struct stability_extreme *extreme,
                                      const struct demand *demand)
{
    char *job = print_job(extreme, demand);
    enum report_outcome outcome = report_run_job(run, job);
    free(job);
    return outcome;
}

/* The method's own step, and no more of them than are quick. REFUSED keeps its words in `run`. */
static bool plan_time(struct report_run *run, const struct stability_extreme *extreme,
                      struct demand *demand)
{
    static const atomic_int at_once = 1; /* completed, but not run */
    struct report_run probe = {.stop = &at_once};
    demand->time = extreme->time;
    demand->equilibration = extreme->equilibration;
    bool good = run_demand(&probe, extreme, demand) == REPORT_STOPPED;
    if (good) {
        double step = report_run_fact(probe.scene, "time_step");
        double rods = report_run_fact(probe.scene, "density") *
                      bcd_group_number(bcd_scene_job_view(probe.scene),
                                       bcd_group_find(bcd_scene_job_view(probe.scene), "length"));
        double most = extreme->ticks_max > 0 ? (double)extreme->ticks_max
                                             : fmax(work_max / (rods * REALIZATIONS), 1);
        double steps = fmin(report_run_fact(probe.scene, "steps"), floor(most));
        if (!strstr(extreme->members, "\"time_step\""))
            demand->time_step = step;
        demand->time = steps * step;
        demand->equilibration = fmin(extreme->equilibration, floor(most) * step);
    } else {
        run->error = probe.error;
    }
    report_run_fini(&probe);
    return good;
}

static void put_words(struct stability_result *result, const struct bcd_error *error)
{
    snprintf(result->words, sizeof result->words, "%.64s%s%.220s", error->field,
             error->field[0] ? ": " : "",
             error->text[0] ? error->text : bcd_status_text(error->code));
}

struct stability_result stability_try(const struct stability_extreme *extreme, const char *method,
                                      const atomic_int *stop)
{
    struct stability_result result = {.verdict = STABILITY_REFUSED, .off = NAN, .stderror = NAN,
                                      .time_step_error = NAN, .time_step = NAN, .time = NAN};
    struct report_run run = {.stop = stop, .core_seconds_max = CORE_SECONDS_MAX};
    struct demand demand = {.method = method};
    enum report_outcome outcome = REPORT_REFUSED;
    if (plan_time(&run, extreme, &demand)) {
        demand.drawn = extreme->drawn;
        demand.path = true;
        outcome = run_demand(&run, extreme, &demand);
        /* Some methods are for averages alone. */
        if (outcome == REPORT_REFUSED && strcmp(run.error.field, "/method") == 0) {
            report_run_fini(&run);
            demand.path = false;
            outcome = run_demand(&run, extreme, &demand);
        }
    }
    result.core_seconds = run.core_ns * 1e-9;
    if (outcome == REPORT_DONE) {
        result.time_step = report_run_fact(run.scene, "time_step");
        result.time = demand.time;
        judge(&run, extreme, &result);
        doubt(&demand, extreme, &result);
        if (!stability_failed(result.verdict) && demand.path && disordered(&run))
            result.verdict = STABILITY_DISORDER;
    } else {
        put_words(&result, &run.error);
        bool budget = run.error.code == BCD_OK; /* or an error of the engine */
        if (outcome == REPORT_FAILED)
            result.verdict = !budget                                  ? STABILITY_BROKEN
                             : run.core_ns > 2e9 * CORE_SECONDS_MAX ? STABILITY_LATE
                                                                      : STABILITY_RAN;
    }
    report_run_fini(&run);
    return result;
}

/* ----------------------------------------------------------------- verdicts */

static double at(const struct bcd_table *table, enum bcd_role role, size_t row)
{
    const struct bcd_column *column = bcd_table_column(table, role);
    return column && column->values && row < table->rows ? column->values[row] : NAN;
}

/* Chance explains 3 standard errors, and rounding. What the engine's own estimate of the time-step
 * error explains is biased all the same. */
static void grade(struct stability_result *result, double bound)
{
    double off = fabs(result->off);
    double chance = 3 * (isfinite(result->stderror) ? result->stderror : 0) + 1e-6;
    if (off > fmax(chance, bound)) {
        result->verdict = STABILITY_MELTED;
    } else if (chance > bound) {
        result->verdict = STABILITY_RAN;
        snprintf(result->words, sizeof result->words, "tells nothing: error bars beyond %g", bound);
    } else if (off <= chance) {
        result->verdict = STABILITY_RIGHT;
    } else {
        result->verdict = STABILITY_BIASED;
        if (isfinite(result->time_step_error))
            snprintf(result->words, sizeof result->words, "its own estimate of that: %.1e",
                     result->time_step_error);
    }
}

/* Too short a run tells little: one from equilibrium is right by its start, another wrong by it. */
static void doubt(const struct demand *demand, const struct stability_extreme *extreme,
                  struct stability_result *result)
{
    double least = extreme->least_time > 0 ? extreme->least_time : 1 / (4 * M_PI * M_PI);
    bool hasty = demand->equilibration < 0.99 * extreme->equilibration;
    bool early = hasty || (demand->time < least && !extreme->drawn);
    if (extreme->judge == STABILITY_BY_VELOCITY || result->verdict > STABILITY_MELTED ||
        (demand->time >= least && !hasty) || (result->verdict == STABILITY_MELTED && !early))
        return;
    result->verdict = STABILITY_RAN;
    snprintf(result->words, sizeof result->words, "tells nothing: %s %.1e is too short",
             hasty ? "equilibration of" : "a time of",
             hasty ? demand->equilibration : demand->time);
}

static void judge_scalar(const struct bcd_table *table, const struct stability_extreme *extreme,
                         double scale, struct stability_result *result)
{
    double value = at(table, BCD_ROLE_VALUE, 0) / scale;
    double exact = extreme->expected != 0 ? extreme->expected : at(table, BCD_ROLE_THEORY, 0);
    double unit = extreme->judge == STABILITY_BY_VELOCITY ? fabs(exact) : 1;
    result->stderror = at(table, BCD_ROLE_STDERR, 0) / scale / unit;
    result->time_step_error = fabs(at(table, BCD_ROLE_TIME_STEP_ERROR, 0) / scale / unit);
    if (!isfinite(value)) {
        result->verdict = STABILITY_NAN;
        return;
    }
    result->verdict = STABILITY_RAN;
    if (!isfinite(exact) || !isfinite(extreme->bound)) {
        snprintf(result->words, sizeof result->words, "there is no exact value");
        return;
    }
    result->off = (value - exact) / unit;
    grade(result, extreme->bound);
}

static void judge_density(const struct bcd_table *table, const struct stability_extreme *extreme,
                          struct stability_result *result)
{
    double off = 0, all = 0, noise = 0;
    for (size_t i = 0; i < table->rows; i++) {
        double exact = at(table, BCD_ROLE_THEORY, i);
        off += fabs(at(table, BCD_ROLE_VALUE, i) - exact);
        noise += at(table, BCD_ROLE_STDERR, i);
        all += exact;
    }
    result->off = off / all;
    result->stderror = noise / all;
    result->verdict = STABILITY_NAN;
    if (isfinite(off))
        grade(result, extreme->bound);
}

static void judge(const struct report_run *run, const struct stability_extreme *extreme,
                  struct stability_result *result)
{
    static const char *const names[] = {
        [STABILITY_BY_ENERGY] = "energy",
        [STABILITY_BY_DENSITY] = "density",
        [STABILITY_BY_VELOCITY] = "current",
        [STABILITY_BY_REFUSAL] = "energy",
    };
    struct bcd_theory *theory = NULL;
    if (extreme->judge != STABILITY_BY_VELOCITY && isfinite(extreme->bound))
        bcd_theory_create(&theory, run->scene, BCD_THEORY_RING, NULL, NULL);
    struct bcd_table *table = report_run_table(run, theory, names[extreme->judge]);
    result->verdict = STABILITY_BROKEN;
    if (table && extreme->judge == STABILITY_BY_DENSITY)
        judge_density(table, extreme, result);
    else if (table)
        judge_scalar(table, extreme,
                     extreme->judge == STABILITY_BY_VELOCITY
                         ? report_run_fact(run->scene, "density")
                         : 1,
                     result);
    if (extreme->judge == STABILITY_BY_REFUSAL)
        result->verdict = STABILITY_ACCEPTED;
    bcd_table_free(table);
    bcd_theory_free(theory);
}

/* Last positions of the first realization: each rod a diameter or more beyond the one before. The
 * table holds rod after rod, times rising. */
static bool disordered(const struct report_run *run)
{
    struct bcd_table *table = report_run_table(run, NULL, "trajectory");
    const struct bcd_group *job = bcd_scene_job_view(run->scene);
    double diameter = bcd_group_number(job, bcd_group_find(job, "diameter"));
    double length = bcd_group_number(job, bcd_group_find(job, "length"));
    double before = NAN, first = NAN;
    bool wrong = !table;
    for (size_t i = 0; table && i < table->rows; i++) {
        bool last = i + 1 == table->rows ||
                    at(table, BCD_ROLE_X, i + 1) <= at(table, BCD_ROLE_X, i);
        double x = at(table, BCD_ROLE_VALUE, i);
        if (!last)
            continue;
        double reach = overlap_max * fmax(length, fabs(x));
        wrong = wrong || !isfinite(x) || x < before + diameter - reach ||
                x > first + length + reach;
        first = isnan(first) ? x : first;
        before = x;
    }
    bcd_table_free(table);
    return wrong;
}
