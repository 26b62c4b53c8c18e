/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * report_work_precision.c - see report_work_precision.h. For each scene: exact references once; a
 * reference of the drift velocity; then for each method a ladder of time steps between half of the
 * one it would choose itself and half of the largest one that is not refused.
 *
 * Each entry has the same budget of processor time, turned into simulated time by a short run
 * before it. Realizations start from exact equilibrium, where one is quickly drawn or the run is
 * short, and are given some time to forget it.
 */
#include "report_work_precision.h"
#include "report_run.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { REALIZATIONS = 48, PROBE_STEPS = 1000, DOUBLINGS_MAX = 40, STEPS_MIN = 64 };
static const double ladder_least = 2, ladder_most = 4; /* ratio of neighbouring time steps */
static const double drift_share = 0.5, reference_share = 2; /* of an entry's budget */
static const double forget_time = 0.5, drift_forget_time = 5; /* in units of lambda^2 / D */
static const double drift_forget_least = 0.5; /* less, and a drift is still that of the start */
static const double slow_factor = 20; /* over budget by this: the probe was misled */

#define COSINE(u) "\"potential\":{\"type\":\"cosine\",\"amplitude\":" #u "}"
#define MEDIUM "\"particles\":16,\"length\":20,\"diameter\":0.8,"

/* f = 10 tilts wells of height 6. Under it rods leave wells of height 20 once in e^13 times: there
 * it is a force that nearly levels them (pi U0 = 63); a filled ring moves as a whole or not at all:
 * there it more than levels them (19). */
static const struct work_precision_scene scenes[WORK_PRECISION_SCENES] = {
    {"sparse", 16, "\"particles\":16,\"length\":32,\"diameter\":0.5," COSINE(6), 10, false, 1},
    {"medium", 16, MEDIUM COSINE(6), 10, false, 1},
    {"dense", 20, "\"particles\":20,\"length\":20,\"diameter\":0.95," COSINE(6), 30, true, 1},
    {"stiff", 16, MEDIUM COSINE(20), 60, false, 1},
    {"sticky", 16,
     MEDIUM COSINE(6) ",\"interaction\":{\"type\":\"sticky\",\"strength\":1,\"range\":0.05,"
                      "\"exponent\":3}",
     10, false, 3},
};

/* Exact profiles of the scene in work, on the measured bins. */
struct exact {
    double energy, contact;
    double density[WORK_PRECISION_BINS];
};

/* One run that is asked for. */
struct trial {
    const char *method;
    double time_step;   /* 0 = "auto" */
    int64_t steps;      /* of each realization */
    double equilibration;
    int realizations;
    int seed;   /* each entry has its own: errors of different entries are independent */
    bool drift; /* with the force, and the current alone; else the static averages */
    bool drawn; /* from exact equilibrium; else */
    bool lattice; /* from a lattice, or at random */
};

static bool measure_scene(struct work_precision *report, struct work_precision_result *result,
                          char *reason);
static bool measure_method(struct work_precision *report, struct work_precision_result *result,
                           const char *method, const struct exact *exact);

const struct work_precision_scene *work_precision_scene(size_t index)
{
    return index < WORK_PRECISION_SCENES ? &scenes[index] : NULL;
}

const char *work_precision_kind_name(enum work_precision_kind kind)
{
    static const char *const names[] = {"energy_error", "density_l1", "contact_error",
                                        "drift_error"};
    return names[kind];
}

static bool wanted(const char *only, const char *name)
{
    return !only || strcmp(only, name) == 0;
}

bool work_precision_known(struct work_precision_options *options)
{
    const char *scene = NULL, *method = NULL, *name;
    for (size_t i = 0; options->scene && i < WORK_PRECISION_SCENES; i++)
        if (strcmp(options->scene, scenes[i].name) == 0)
            scene = scenes[i].name;
    for (size_t i = 0; options->method && (name = report_run_method(i)) != NULL; i++)
        if (strcmp(options->method, name) == 0)
            method = name;
    bool known = (!options->scene || scene) && (!options->method || method);
    options->scene = known ? scene : options->scene;
    options->method = known ? method : options->method;
    return known;
}

/* Methods times scenes that are asked for. */
static size_t count_work(const struct work_precision_options *options)
{
    size_t methods = 0, wanted_scenes = 0;
    const char *name;
    for (size_t i = 0; (name = report_run_method(i)) != NULL; i++)
        methods += wanted(options->method, name);
    for (size_t i = 0; i < WORK_PRECISION_SCENES; i++)
        wanted_scenes += wanted(options->scene, scenes[i].name);
    return methods * wanted_scenes;
}

bool work_precision_measure(struct work_precision *report,
                            const struct work_precision_options *options,
                            char reason[WORK_PRECISION_REASON])
{
    *report = (struct work_precision){.options = *options};
    report->share_step = 1 / fmax(1, (double)count_work(options));
    reason[0] = '\0';
    for (size_t i = 0; i < WORK_PRECISION_SCENES; i++) {
        if (!wanted(options->scene, scenes[i].name))
            continue;
        report->result[i].scene = &scenes[i];
        if (!measure_scene(report, &report->result[i], reason))
            return false;
    }
    return true;
}

/* -------------------------------------------------------------------- jobs */

/* Contacts are looked for in a gap of a hundredth; the automatic step would shrink to resolve it,
 * which is the user's concern and not the method's: those jobs ask for the density alone. */
static char *print_job(const struct work_precision_scene *scene, const struct trial *trial)
{
    struct text job = {0};
    text_add(&job, "{%s,\"method\":\"%s\",\"realizations\":%d,\"seed\":%d,\"initial\":\"%s\"",
             scene->members, trial->method, trial->realizations, trial->seed,
             trial->drawn     ? "equilibrium"
             : trial->lattice ? "lattice"
                              : "uniform");
    if (trial->time_step > 0) {
        report_add_member(&job, "time_step", trial->time_step);
        report_add_member(&job, "time", (double)trial->steps * trial->time_step);
        report_add_member(&job, "equilibration_time", trial->equilibration);
    } else {
        text_add(&job, ",\"time\":1000");
    }
    if (trial->drift) {
        report_add_member(&job, "force", scene->drift_force);
        text_add(&job, ",\"observables\":{\"current\":{}}}");
    } else if (trial->time_step > 0) {
        text_add(&job,
                 ",\"observables\":{\"density\":{\"bins\":%d},\"energy\":{},"
                 "\"contact_density\":{\"bins\":1,\"gap\":0.01}}}",
                 WORK_PRECISION_BINS);
    } else {
        text_add(&job, ",\"observables\":{\"density\":{\"bins\":%d}}}", WORK_PRECISION_BINS);
    }
    return text_take(&job);
}

static enum report_outcome run_trial(struct report_run *run,
                                     const struct work_precision_scene *scene,
                                     const struct trial *trial)
{
    char *job = print_job(scene, trial);
    enum report_outcome outcome = report_run_job(run, job);
    free(job);
    return outcome;
}

/* Is it accepted? Else why not. *step = the time step it would run with. */
static bool accepted(const struct work_precision_scene *scene, const struct trial *trial,
                     double *step, char *reason)
{
    static const atomic_int at_once = 1; /* completed, but not run */
    struct report_run run = {.stop = &at_once};
    bool good = run_trial(&run, scene, trial) == REPORT_STOPPED;
    bool coarse = good && report_run_fact(run.scene, "curvature_time_step") > 1;
    if (coarse)
        snprintf(reason, WORK_PRECISION_REASON, "steps past the potential's curvature");
    else if (good)
        *step = report_run_fact(run.scene, "time_step");
    else
        snprintf(reason, WORK_PRECISION_REASON, "%s%s%s", run.error.field,
                 run.error.field[0] ? ": " : "",
                 run.error.text[0] ? run.error.text : bcd_status_text(run.error.code));
    report_run_fini(&run);
    return good && !coarse;
}

/* Chooses the number of steps for a budget of one core's seconds after a short run, and then runs.
 * The results stay with `run`. */
static enum report_outcome run_for(struct report_run *run, const struct work_precision_scene *scene,
                                   struct trial *trial, double core_seconds)
{
    struct trial probe = *trial;
    struct report_run short_run = {.stop = run->stop};
    probe.steps = PROBE_STEPS;
    probe.realizations = 1;
    probe.drawn = false;
    probe.equilibration = 0;
    enum report_outcome outcome = run_trial(&short_run, scene, &probe);
    double step_ns = short_run.core_ns / PROBE_STEPS;
    if (outcome != REPORT_DONE)
        run->error = short_run.error;
    report_run_fini(&short_run);
    if (outcome != REPORT_DONE)
        return outcome;
    double steps = 1e9 * core_seconds / (fmax(step_ns, 1) * trial->realizations);
    steps = fmin(fmax(steps, STEPS_MIN), 1e12);
    double forget = trial->drift ? drift_forget_time : forget_time;
    double most = (trial->drift || scene->filled ? 0.3 : 0.1) * steps;
    double equilibration = floor(fmin(most, forget / trial->time_step));
    /* Draws of a filled ring take seconds to prepare. */
    trial->lattice = scene->filled && equilibration < most;
    trial->drawn = trial->drawn && !trial->lattice;
    trial->steps = (int64_t)(steps - equilibration);
    trial->equilibration = equilibration * trial->time_step;
    run->core_seconds_max = slow_factor * core_seconds + 1;
    return run_trial(run, scene, trial);
}

/* ---------------------------------------------------------- what comes out */

static double scalar(const struct bcd_table *table, enum bcd_role role)
{
    const struct bcd_column *column = table ? bcd_table_column(table, role) : NULL;
    return column && column->values && table->rows > 0 ? column->values[0] : NAN;
}

/* Bins are equally wide: sums stand for integrals. Error bars of bins add up as if they were
 * independent. The L1 of mere noise of standard deviation s is sqrt(2/pi) s a bin. */
static void judge_density(const struct bcd_table *table, const double *exact,
                          struct work_precision_entry *entry)
{
    struct work_precision_value *l1 = &entry->value[WORK_PRECISION_DENSITY];
    const struct bcd_column *value = table ? bcd_table_column(table, BCD_ROLE_VALUE) : NULL;
    const struct bcd_column *bar = table ? bcd_table_column(table, BCD_ROLE_STDERR) : NULL;
    double off = 0, all = 0, noise = 0, variance = 0;
    if (!value || !value->values || !bar || !bar->values || table->rows != WORK_PRECISION_BINS)
        return;
    for (size_t i = 0; i < table->rows; i++) {
        off += fabs(value->values[i] - exact[i]);
        all += exact[i];
        noise += sqrt(2 / M_PI) * bar->values[i];
        variance += bar->values[i] * bar->values[i];
    }
    *l1 = (struct work_precision_value){off / all, sqrt(variance) / all};
    entry->density_noise = noise / all;
}

static void judge_static(const struct report_run *run, const struct exact *exact,
                         struct work_precision_entry *entry)
{
    struct bcd_table *energy = report_run_table(run, NULL, "energy");
    struct bcd_table *density = report_run_table(run, NULL, "density");
    struct bcd_table *contact = report_run_table(run, NULL, "contact_density");
    entry->value[WORK_PRECISION_ENERGY] = (struct work_precision_value){
        scalar(energy, BCD_ROLE_VALUE) - exact->energy, scalar(energy, BCD_ROLE_STDERR)};
    entry->value[WORK_PRECISION_CONTACT] = (struct work_precision_value){
        scalar(contact, BCD_ROLE_VALUE) / exact->contact - 1,
        scalar(contact, BCD_ROLE_STDERR) / exact->contact};
    judge_density(density, exact->density, entry);
    bcd_table_free(energy);
    bcd_table_free(density);
    bcd_table_free(contact);
}

/* Velocity from the current J = rho <v>. */
static struct work_precision_value velocity(const struct report_run *run)
{
    struct bcd_table *table = report_run_table(run, NULL, "current");
    double density = report_run_fact(run->scene, "density");
    struct work_precision_value v = {scalar(table, BCD_ROLE_VALUE) / density,
                                     scalar(table, BCD_ROLE_STDERR) / density};
    bcd_table_free(table);
    return v;
}

static bool copy_theory(const struct bcd_theory *theory, const struct bcd_scene *scene,
                        const char *observable, double *values, size_t count)
{
    struct bcd_table *table = NULL;
    int index = report_run_observable(scene, observable);
    bool good = index >= 0 && bcd_theory_table(theory, scene, (size_t)index, &table) == BCD_OK;
    const struct bcd_column *exact = good ? bcd_table_column(table, BCD_ROLE_THEORY) : NULL;
    good = exact && exact->values && table->rows == count;
    if (good)
        memcpy(values, exact->values, count * sizeof *values);
    bcd_table_free(table);
    return good;
}

static bool find_exact(const struct work_precision_scene *row, struct exact *exact)
{
    static const atomic_int at_once = 1;
    struct trial trial = {.method = "auto", .time_step = 1e-6, .steps = 1000, .realizations = 1};
    struct report_run run = {.stop = &at_once};
    struct bcd_theory *theory = NULL;
    bool good = run_trial(&run, row, &trial) == REPORT_STOPPED &&
                bcd_theory_create(&theory, run.scene, BCD_THEORY_RING, NULL, NULL) == BCD_OK &&
                copy_theory(theory, run.scene, "energy", &exact->energy, 1) &&
                copy_theory(theory, run.scene, "contact_density", &exact->contact, 1) &&
                copy_theory(theory, run.scene, "density", exact->density, WORK_PRECISION_BINS);
    bcd_theory_free(theory);
    report_run_fini(&run);
    return good;
}

/* --------------------------------------------------------------- one scene */

static bool stopped(const struct work_precision *report)
{
    return report->options.stop && atomic_load(report->options.stop);
}

/* Core seconds of one entry. */
static double budget(const struct work_precision *report,
                     const struct work_precision_result *result)
{
    return report->options.core_seconds * result->scene->share;
}

/* There is no exact drift velocity of more than one rod: strang with a quarter of its own step. */
static bool measure_reference(const struct work_precision *report,
                              struct work_precision_result *result)
{
    struct trial trial = {.method = "strang", .realizations = REALIZATIONS, .drift = true};
    struct report_run run = {.stop = report->options.stop};
    double step = NAN;
    result->reference.velocity = result->reference.stderror = NAN;
    if (!accepted(result->scene, &trial, &step, result->reference.reason))
        return true;
    trial.time_step = result->reference.time_step = step / 4;
    enum report_outcome outcome =
        run_for(&run, result->scene, &trial, reference_share * budget(report, result));
    if (outcome == REPORT_DONE) {
        struct work_precision_value v = velocity(&run);
        result->reference.velocity = v.error;
        result->reference.stderror = v.stderror;
    } else {
        snprintf(result->reference.reason, WORK_PRECISION_REASON, "%s", run.error.text);
    }
    report_run_fini(&run);
    return outcome != REPORT_STOPPED;
}

static bool measure_scene(struct work_precision *report, struct work_precision_result *result,
                          char *reason)
{
    struct exact exact;
    const char *method;
    if (!find_exact(result->scene, &exact)) {
        snprintf(reason, WORK_PRECISION_REASON, "no exact reference for the scene \"%s\"",
                 result->scene->name);
        return false;
    }
    result->energy = exact.energy;
    result->contact = exact.contact;
    if (!measure_reference(report, result))
        return false;
    for (size_t i = 0; (method = report_run_method(i)) != NULL; i++) {
        if (!wanted(report->options.method, method))
            continue;
        if (!measure_method(report, result, method, &exact))
            return false;
        report->share += report->share_step;
        if (report->options.progress)
            report->options.progress(report->options.context, fmin(report->share, 1));
    }
    return true;
}

/* -------------------------------------------------------------- one method */

/* Time steps from coarse to fine; their number. "auto" is run with its own step alone. */
static int make_ladder(const struct work_precision *report,
                       const struct work_precision_result *result, const char *method,
                       double *ladder, char *reason)
{
    struct trial trial = {.method = method, .realizations = 1};
    char ignored[WORK_PRECISION_REASON];
    double own, step, largest;
    if (!accepted(result->scene, &trial, &own, reason))
        return 0;
    ladder[0] = own;
    if (strcmp(method, "auto") == 0)
        return 1;
    largest = own;
    trial.steps = PROBE_STEPS;
    for (int i = 0; i < DOUBLINGS_MAX; i++) {
        trial.time_step = 2 * largest;
        if (!accepted(result->scene, &trial, &step, ignored))
            break;
        largest = trial.time_step;
    }
    int count = report->options.levels;
    double top = fmax(own, largest / 2), bottom = own / 2;
    double ratio = pow(top / bottom, 1.0 / (count - 1));
    ratio = fmin(fmax(ratio, ladder_least), ladder_most);
    for (int i = 0; i < count; i++)
        ladder[i] = top / pow(ratio, i);
    return count;
}

/* While the newest entry is being measured. */
static int entry_seed(const struct work_precision_result *result)
{
    return (int)result->entry_count;
}

static bool measure_drift(const struct work_precision *report,
                          const struct work_precision_result *result,
                          struct work_precision_entry *entry)
{
    struct trial trial = {.method = entry->method, .time_step = entry->time_step,
                          .realizations = REALIZATIONS, .drift = true,
                          .seed = entry_seed(result)};
    struct report_run run = {.stop = report->options.stop};
    double reference = result->reference.velocity;
    if (result->reference.reason[0]) {
        snprintf(entry->drift_reason, WORK_PRECISION_REASON, "no reference: %.360s",
                 result->reference.reason);
        return true;
    }
    enum report_outcome outcome =
        run_for(&run, result->scene, &trial, drift_share * budget(report, result));
    if (outcome == REPORT_DONE && trial.equilibration < drift_forget_least) {
        snprintf(entry->drift_reason, WORK_PRECISION_REASON,
                 "the budget does not last to forget the start");
    } else if (outcome == REPORT_DONE) {
        struct work_precision_value v = velocity(&run);
        entry->value[WORK_PRECISION_DRIFT] = (struct work_precision_value){
            v.error / reference - 1,
            hypot(v.stderror, result->reference.stderror * v.error / reference) /
                fabs(reference)};
        entry->drift_time = (double)trial.steps * trial.time_step * trial.realizations;
    } else {
        snprintf(entry->drift_reason, WORK_PRECISION_REASON, "%s", run.error.text);
    }
    report_run_fini(&run);
    return outcome != REPORT_STOPPED;
}

static void keep_job(struct work_precision_result *result, const struct trial *trial)
{
    char *job = result->job[0] ? NULL : print_job(result->scene, trial);
    if (job)
        snprintf(result->job, sizeof result->job, "%s", job);
    free(job);
}

/* One time step of one method; false = stopped. A run that fails keeps its NaNs. */
static bool measure_entry(const struct work_precision *report,
                          struct work_precision_result *result, const struct exact *exact,
                          struct work_precision_entry *entry)
{
    struct trial trial = {.method = entry->method, .time_step = entry->time_step,
                          .realizations = REALIZATIONS, .drawn = true,
                          .seed = entry_seed(result)};
    struct report_run run = {.stop = report->options.stop};
    enum report_outcome outcome = run_for(&run, result->scene, &trial, budget(report, result));
    entry->cost = NAN;
    entry->density_noise = NAN;
    for (int k = 0; k < WORK_PRECISION_KINDS; k++)
        entry->value[k] = (struct work_precision_value){NAN, NAN};
    if (outcome == REPORT_DONE) {
        double time = (double)trial.steps * trial.time_step;
        entry->time = time * trial.realizations;
        entry->cost = run.core_ns / ((time + trial.equilibration) * trial.realizations *
                                     result->scene->particles);
        judge_static(&run, exact, entry);
        keep_job(result, &trial);
    } else {
        snprintf(entry->reason, WORK_PRECISION_REASON, "%s", run.error.text);
    }
    report_run_fini(&run);
    return outcome != REPORT_STOPPED && !stopped(report) && measure_drift(report, result, entry);
}

static bool measure_method(struct work_precision *report, struct work_precision_result *result,
                           const char *name, const struct exact *exact)
{
    double ladder[WORK_PRECISION_LEVELS_MAX];
    if (result->method_count == WORK_PRECISION_METHODS_MAX)
        return true;
    struct work_precision_method *method = &result->method[result->method_count++];
    *method = (struct work_precision_method){.name = name, .first = result->entry_count};
    int count = make_ladder(report, result, name, ladder, method->refused);
    if (stopped(report))
        return false;
    for (int i = 0; i < count; i++) {
        struct work_precision_entry *entry = &result->entry[result->entry_count++];
        *entry = (struct work_precision_entry){.method = name, .time_step = ladder[i]};
        method->count++;
        if (!measure_entry(report, result, exact, entry))
            return false;
    }
    work_precision_fit(method, &result->entry[method->first]);
    return true;
}
