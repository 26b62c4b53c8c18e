/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_bench.c - bcd bench: what a step costs, per rod and as a ratio to drawing its noise and
 * evaluating its force, for every method from 10 to 10^7 rods (cli_bench_step.h); what a second
 * worker gains (cli_bench_scaling.h), and a second thread at one large ring (cli_bench_hands.h);
 * what observables cost (cli_bench_observables.h), and reduced scenes against loops written by hand
 * (cli_bench_leave_out.h). See cli.h. */
#include "cli_bench_hands.h"
#include "cli_bench_leave_out.h"
#include "cli_bench_observables.h"
#include "cli_bench_scaling.h"
#include "cli_bench_step.h"
#include "cli.h"
#include "report_machine.h"
#include "report_run.h"
#include "text.h"

#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ------------------------------------------------------------------- steps */

static const int64_t sizes[] = {10, 100, 1000, 10000, 100000, 1000000, 10000000};

enum {
    SIZES = sizeof sizes / sizeof *sizes,
    LONG_SIZE = 100000, /* larger ones for the methods that `auto` may choose and bcd */
    LARGEST_SIZE = 10000000,
    SMALL_SIZE = 10, /* measured once more with realizations side by side */
    ABREAST = 16,
};

/* How far a method is measured: those meant for work up to the largest size, those of the papers as
 * far as they go, the others at every second size. */
static bool wanted(const char *method, size_t size)
{
    static const char *const working[] = {"bcd", "strang", "elastic", "lm"};
    static const char *const published[] = {"bcd_premerging", "bcd_chronological"};
    for (size_t i = 0; i < sizeof working / sizeof *working; i++)
        if (strcmp(method, working[i]) == 0)
            return true;
    for (size_t i = 0; i < sizeof published / sizeof *published; i++)
        if (strcmp(method, published[i]) == 0)
            return sizes[size] <= LONG_SIZE;
    return sizes[size] <= LONG_SIZE && size % 2 == 0;
}

static void add_separator(struct text *json)
{
    text_add(json, "%s\n", json->size && json->bytes[json->size - 1] == '[' ? "" : ",");
}

/* A number that may be unknown. */
static void add_number(struct text *json, const char *name, double value)
{
    if (isfinite(value))
        text_add(json, ",\"%s\":%.4g", name, value);
    else
        text_add(json, ",\"%s\":null", name);
}

/* One line of the table and one entry of the JSON. */
static void add_entry(struct text *json, const struct bench_case *which,
                      const struct bench_step *step)
{
    const struct bench_timing *timing = &step->timing;
    double ns = bench_step_ns(which, step, 1), n = (double)which->particles;
    bool tells = n >= 1e4; /* pages are too large for less */
    char size[32];
    if (which->realizations > 1)
        snprintf(size, sizeof size, "%lldx%lld", (long long)which->particles,
                 (long long)which->realizations);
    else
        snprintf(size, sizeof size, "%lld", (long long)which->particles);
    printf("%-8s %-18s %9s %9.2f %6.2f %8.2f %9.1f", which->scene, which->method, size, ns,
           timing->ns_stderr[1] / n, timing->ratio, step->bytes_per_rod);
    if (tells && isfinite(step->peak_bytes_per_rod))
        printf(" %9.1f\n", step->peak_bytes_per_rod);
    else
        printf(" %9s\n", "-");
    fflush(stdout);
    add_separator(json);
    text_add(json,
             "{\"scene\":\"%s\",\"method\":\"%s\",\"particles\":%lld,\"realizations\":%lld,"
             "\"threads\":1,\"warm_steps\":%lld",
             which->scene, which->method, (long long)which->particles,
             (long long)which->realizations, (long long)step->warm_steps);
    add_number(json, "ns_per_particle_step", ns);
    add_number(json, "ns_stderr", timing->ns_stderr[1] / n);
    add_number(json, "ratio_to_noise_and_force", timing->ratio);
    add_number(json, "ratio_stderr", timing->ratio_stderr);
    add_number(json, "noise_and_force_ns", timing->ns[0] / n);
    add_number(json, "bytes_per_particle", step->bytes_per_rod);
    add_number(json, "peak_bytes_per_particle", tells ? step->peak_bytes_per_rod : NAN);
    text_add(json, "}");
}

/* Of one scene and method: ns of a tick and ratio to the floor at each size; 0 = not measured. */
struct sweep {
    double tick[SIZES], ratio[SIZES];
};

/* ns of a tick of the next size, if it grows as it did between the last two, or linearly. */
static double expected(const struct sweep *sweep, size_t size)
{
    size_t last = size;
    while (last > 0 && sweep->tick[last - 1] == 0)
        last--;
    size_t before = last > 0 ? last - 1 : 0;
    while (before > 0 && sweep->tick[before - 1] == 0)
        before--;
    if (last == 0)
        return 0;
    double power = before == 0 ? 1
                               : log(sweep->tick[last - 1] / sweep->tick[before - 1]) /
                                     log((double)sizes[last - 1] / (double)sizes[before - 1]);
    return sweep->tick[last - 1] * pow((double)sizes[size] / (double)sizes[last - 1], power);
}

/* Small rings go side by side where a job has several realizations: an entry more. */
static enum bench_outcome measure_abreast(struct text *json, const struct bench_case *alone)
{
    struct bench_case which = *alone;
    struct bench_step step;
    if (which.particles != SMALL_SIZE)
        return BENCH_DONE;
    which.realizations = ABREAST;
    enum bench_outcome outcome = bench_step_measure(&which, &bench_usual, &step);
    if (outcome == BENCH_DONE)
        add_entry(json, &which, &step);
    return outcome;
}

/* All sizes of one scene and method; a method that refuses the scene has none. */
static enum bench_outcome measure_sizes(struct text *json, const char *scene, const char *method,
                                        struct sweep *sweep)
{
    const struct bench_effort brief = {2e7, 3};
    enum bench_outcome outcome = BENCH_DONE;
    *sweep = (struct sweep){0};
    for (size_t i = 0; i < SIZES && outcome == BENCH_DONE; i++) {
        const struct bench_case which = {scene, method, sizes[i], 1};
        struct bench_step step = {.timing.ns[1] = expected(sweep, i)};
        if (!wanted(method, i))
            continue;
        if (step.timing.ns[1] > BENCH_TICK_NS_MAX)
            outcome = BENCH_TOO_SLOW;
        else
            outcome =
                bench_step_measure(&which, sizes[i] < LARGEST_SIZE ? &bench_usual : &brief, &step);
        if (outcome == BENCH_DONE) {
            sweep->tick[i] = step.timing.ns[1];
            sweep->ratio[i] = step.timing.ratio;
            add_entry(json, &which, &step);
            outcome = measure_abreast(json, &which);
        } else if (outcome == BENCH_TOO_SLOW) {
            printf("%-8s %-18s %9lld  left out: a step takes about %.2g s\n", scene, method,
                   (long long)sizes[i], 1e-9 * step.timing.ns[1]);
        }
    }
    return outcome;
}

/* The power of N with which a step's time grows, between 1000 rods and the most; NaN = unknown. */
static double growth(const struct sweep *sweep)
{
    size_t first = 0, last = SIZES - 1;
    while (sizes[first] < 1000)
        first++;
    while (last > first && sweep->tick[last] == 0)
        last--;
    if (last == first || sweep->tick[first] == 0)
        return NAN;
    return log(sweep->tick[last] / sweep->tick[first]) /
           log((double)sizes[last] / (double)sizes[first]);
}

static void add_growth(struct text *json, const char *scene, const char *method,
                       const struct sweep *sweep)
{
    if (!isfinite(growth(sweep)))
        return;
    add_separator(json);
    text_add(json, "{\"scene\":\"%s\",\"method\":\"%s\"", scene, method);
    add_number(json, "exponent", growth(sweep));
    text_add(json, "}");
    printf("%-8s %-18s a step's time grows as N^%.3f\n", scene, method, growth(sweep));
}

/* How many times faster bcd is than its published forms, by the ratios to the same floor. */
static void add_published(struct text *json, const char *scene, const char *method,
                          const struct sweep sweeps[2])
{
    for (size_t i = 0; i < SIZES; i++) {
        if (sweeps[0].ratio[i] == 0 || sweeps[1].ratio[i] == 0)
            continue;
        double times = sweeps[1].ratio[i] / sweeps[0].ratio[i];
        printf("%-8s %-18s %9lld %9.2f times the cost of bcd\n", scene, method, (long long)sizes[i],
               times);
        add_separator(json);
        text_add(json, "{\"scene\":\"%s\",\"method\":\"%s\",\"particles\":%lld", scene, method,
                 (long long)sizes[i]);
        add_number(json, "ratio_to_bcd", times);
        text_add(json, "}");
    }
}

/* The sections of the JSON. */
struct sections {
    struct text entries, growth, published;
};

static bool measure_scene(struct sections *sections, const char *scene)
{
    bool good = true;
    struct sweep sweeps[2] = {0}; /* bcd, and the method at hand */
    printf("%-8s %-18s %9s %9s %6s %8s %9s %9s\n", "scene", "method", "particles", "ns/rod", "+-",
           "ratio", "bytes/rod", "peak");
    for (size_t m = 1; report_run_method(m); m++) {
        const char *method = report_run_method(m);
        good = measure_sizes(&sections->entries, scene, method, &sweeps[1]) != BENCH_FAILED && good;
        add_growth(&sections->growth, scene, method, &sweeps[1]);
        if (strcmp(method, "bcd") == 0)
            sweeps[0] = sweeps[1];
        else if (strncmp(method, "bcd_", 4) == 0)
            add_published(&sections->published, scene, method, sweeps);
    }
    return good;
}

/* --------------------------------------------------------------- two workers */

static bool measure_scaling(struct text *json)
{
    struct bench_scaling s;
    if (bench_scaling_measure(&s) != BENCH_DONE)
        return false;
    printf("\ntwo workers, %lld chunks of bcd, sparse, %lld rods: %.3f s and %.3f s, %.2f times as "
           "fast\n(the machine gives two processes that share nothing %.2f, of which this is %.3f; "
           "%.2f if no\nworker ever waited; others kept %.2f cores busy meanwhile)\n",
           (long long)s.chunks, (long long)s.particles, s.seconds[BENCH_ONE], s.seconds[BENCH_TWO],
           s.speedup, s.machine, s.share, s.possible, s.others);
    add_separator(json);
    text_add(json,
             "{\"scene\":\"sparse\",\"method\":\"bcd\",\"particles\":%lld,"
             "\"realizations\":%lld,\"chunks\":%lld,\"threads\":2",
             (long long)s.particles, (long long)s.realizations, (long long)s.chunks);
    add_number(json, "seconds_one_worker", s.seconds[BENCH_ONE]);
    add_number(json, "seconds_two_workers", s.seconds[BENCH_TWO]);
    add_number(json, "seconds_two_processes", s.seconds[BENCH_APART]);
    add_number(json, "core_seconds_one_worker", s.core_seconds[BENCH_ONE]);
    add_number(json, "core_seconds_two_workers", s.core_seconds[BENCH_TWO]);
    add_number(json, "core_seconds_two_processes", s.core_seconds[BENCH_APART]);
    add_number(json, "speedup", s.speedup);
    add_number(json, "speedup_of_two_processes", s.machine);
    add_number(json, "share_of_two_processes", s.share);
    add_number(json, "speedup_without_waiting", s.possible);
    add_number(json, "cores_used_by_others", s.others);
    text_add(json, "}");
    return true;
}

/* ---------------------------------------------------- one ring, two threads */

static bool measure_hands(struct text *json)
{
    static const char *const which[][2] = {
        {"sparse", "bcd"}, {"dense", "bcd"}, {"sparse", "strang"}, {"dense", "strang"}};
    static const int64_t rods[] = {20000, 100000, 1000000};
    bool good = true;
    printf("\none large ring by one thread and by two, in turns (wall clock)\n%-8s %-18s %9s %9s "
           "%9s %9s\n",
           "scene", "method", "particles", "ns/rod", "by two", "speedup");
    for (size_t i = 0; i < sizeof which / sizeof *which; i++)
        for (size_t r = 0; r < sizeof rods / sizeof *rods; r++) {
            const struct bench_case one = {which[i][0], which[i][1], rods[r], 1};
            struct bench_hands hands = {0};
            good = bench_hands_measure(&one, &hands) == BENCH_DONE && good;
            printf("%-8s %-18s %9lld %9.2f %9.2f %9.2f\n", one.scene, one.method,
                   (long long)one.particles, hands.ns[0], hands.ns[1], hands.speedup);
            fflush(stdout);
            add_separator(json);
            text_add(json, "{\"scene\":\"%s\",\"method\":\"%s\",\"particles\":%lld", one.scene,
                     one.method, (long long)one.particles);
            add_number(json, "ns_one_thread", hands.ns[0]);
            add_number(json, "ns_two_threads", hands.ns[1]);
            add_number(json, "speedup", hands.speedup);
            text_add(json, "}");
        }
    return good;
}

/* -------------------------------------------------------------- observables */

static bool measure_observables(struct text *json)
{
    static const int64_t rods[] = {16, 1000};
    static const char *const methods[] = {"strang", "bcd"};
    bool good = true;
    printf("\nsparse, one observable at its default sampling\n%-8s %-18s %9s %9s %9s\n", "method",
           "observable", "particles", "ns/rod", "cost");
    for (size_t m = 0; m < 2; m++)
        for (size_t r = 0; r < 2; r++)
            for (size_t o = 0; bench_observable_name(o); o++) {
                struct bench_timing t = {0};
                enum bench_outcome outcome = bench_observable_measure(o, methods[m], rods[r], &t);
                good = good && outcome == BENCH_DONE;
                printf("%-8s %-18s %9lld %9.2f %7.1f %%\n", methods[m], bench_observable_name(o),
                       (long long)rods[r], t.ns[1] / (double)rods[r], 100 * (t.ratio - 1));
                fflush(stdout);
                add_separator(json);
                text_add(json, "{\"method\":\"%s\",\"observable\":\"%s\",\"particles\":%lld",
                         methods[m], bench_observable_name(o), (long long)rods[r]);
                add_number(json, "share_of_stepping", t.ratio - 1);
                add_number(json, "share_stderr", t.ratio_stderr);
                text_add(json, "}");
            }
    return good;
}

/* --------------------------------------------------------------- leave out */

static void add_leave_out(struct text *json, const struct leave_out *one)
{
    const double n = (double)one->particles;
    printf("%-8s %-8s %9lld %10.2f %10.2f %8.3f %9.1f %9.1f\n", one->scene, one->method,
           (long long)one->particles, one->timing.ns[1] / n, one->timing.ns[0] / n,
           one->timing.ratio, one->bytes[1], one->bytes[0]);
    fflush(stdout);
    add_separator(json);
    text_add(json,
             "{\"scene\":\"%s\",\"method\":\"%s\",\"particles\":%lld,"
             "\"ns_per_particle_step\":%.4g,\"hand_written_ns_per_particle_step\":%.4g,"
             "\"ratio_to_hand_written\":%.4g,\"bytes_per_particle\":%.4g,"
             "\"hand_written_bytes_per_particle\":%.4g}",
             one->scene, one->method, (long long)one->particles, one->timing.ns[1] / n,
             one->timing.ns[0] / n, one->timing.ratio, one->bytes[1], one->bytes[0]);
}

static bool leave_out_all(struct text *json)
{
    static const int64_t rods[] = {100, 1000, 10000};
    unsigned features;
    bool good = true;
    printf("\nwhole runs against loops written by hand for the scene\n"
           "%-8s %-8s %9s %10s %10s %8s %9s %9s\n",
           "scene", "method", "particles", "ns/rod", "by hand", "ratio", "bytes/rod", "by hand");
    for (size_t s = 0; bcd_baseline_name(s, &features); s++)
        for (int strang = 0; strang < 2; strang++)
            for (size_t i = 0; i < sizeof rods / sizeof *rods; i++) {
                struct leave_out one;
                enum bench_outcome outcome = leave_out_measure(s, strang == 1, rods[i], &one);
                if (outcome == BENCH_DONE)
                    add_leave_out(json, &one);
                good = good && outcome != BENCH_FAILED;
            }
    return good;
}

static int write_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    bool written = file && fputs(text, file) >= 0;
    written = file && fclose(file) == 0 && written;
    if (!written)
        fprintf(stderr, "bcd bench: %s cannot be written\n", path);
    return written ? CLI_OK : CLI_FAILED;
}

/* Everything that is timed by processor time stays on the core it is on. */
static void pin(cpu_set_t *before)
{
    cpu_set_t one;
    int core = sched_getcpu();
    CPU_ZERO(before);
    CPU_ZERO(&one);
    CPU_SET(core < 0 ? 0 : core, &one);
    if (sched_getaffinity(0, sizeof *before, before) == 0)
        sched_setaffinity(0, sizeof one, &one);
}

static void add_section(struct text *json, const char *name, struct text *section)
{
    char *items = text_take(section);
    text_add(json, ",\n\"%s\":%s\n]", name, items ? items : "[");
    json->failed = json->failed || !items;
    free(items);
}

static int bench(const struct cli_line *line)
{
    const char *path = cli_value(line, "json");
    struct sections steps = {0};
    struct text scaling = {0}, hands = {0}, observables = {0}, leave_out = {0}, json = {0};
    struct text *const sections[] = {&steps.entries, &steps.growth, &steps.published,
                                     &scaling,       &hands,        &observables,
                                     &leave_out};
    static const char *const names[] = {"entries", "growth",      "published", "scaling",
                                        "hands",   "observables", "leave_out"};
    cpu_set_t all;
    bool good = true;
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++)
        text_add(sections[i], "[");
    pin(&all);
    for (size_t s = 0; bench_scene_name(s); s++)
        good = measure_scene(&steps, bench_scene_name(s)) && good;
    good = measure_observables(&observables) && good;
    good = leave_out_all(&leave_out) && good;
    sched_setaffinity(0, sizeof all, &all);
    good = measure_scaling(&scaling) && good;
    good = measure_hands(&hands) && good;
    char *machine = report_machine_json();
    text_add(&json, "{\"machine\":%s", machine ? machine : "{}");
    free(machine);
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++)
        add_section(&json, names[i], sections[i]);
    text_add(&json, "}\n");
    char *text = text_take(&json);
    int status = !text ? CLI_FAILED : path ? write_file(path, text) : CLI_OK;
    free(text);
    return good ? status : CLI_FAILED;
}

static const struct cli_option options[] = {
    {.name = "json", .value = "FILE", .doc = "writes the numbers there too"},
    {0},
};

const struct cli_command cli_bench_command = {
    .name = "bench",
    .operands = "",
    .doc = "measures what a step costs, per method and scene",
    .text = "Nanoseconds of one core per rod and step, and the ratio to drawing the noise and\n"
            "evaluating the force alone, measured in turns with it; 10 to 10^7 rods, medians with\n"
            "standard errors, bytes per rod. Then what a second worker gains, with many rings and\n"
            "with one, and what observables cost. On a shared machine trust the ratio. About four\n"
            "minutes.",
    .options = options,
    .function = bench,
};
