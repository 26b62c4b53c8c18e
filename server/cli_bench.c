/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_bench.c - bcd bench: what a step costs, per rod and as a ratio to drawing its noise and
 * evaluating its force, for every method; then reduced scenes against loops written by hand
 * (cli_bench_leave_out.h). See cli.h. */
#include "cli_bench_leave_out.h"
#include "bench_turns.h"
#include "cli.h"
#include "scene_json.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/utsname.h>
#include <unistd.h>

struct bench_scene {
    const char *name, *members; /* what makes the scene */
    int length_per_rod;
};

static const struct bench_scene scenes[] = {
    {"free", "\"time_step\":1e-4,\"diameter\":0.5", 2},
    {"sparse",
     "\"time_step\":1e-4,\"diameter\":0.5,\"potential\":{\"type\":\"cosine\",\"amplitude\":6}", 2},
    {"dense",
     "\"time_step\":1e-4,\"diameter\":0.99,\"potential\":{\"type\":\"cosine\",\"amplitude\":6}", 1},
    {"sticky",
     "\"time_step\":1e-5,\"diameter\":0.5,"
     "\"potential\":{\"type\":\"cosine\",\"amplitude\":6},\"interaction\":"
     "{\"type\":\"sticky\",\"strength\":1,\"range\":0.05,\"exponent\":3}",
     2},
};
static const int64_t sizes[] = {10, 1000, 100000};

enum { SIZES = sizeof sizes / sizeof *sizes };

static struct bcd_scene *make(const struct bench_scene *scene, const char *method, int64_t n)
{
    struct text job = {0};
    struct bcd_scene *made = NULL;
    struct bcd_errors errors = {0};
    text_add(&job,
             "{\"particles\":%lld,\"length\":%lld,%s,\"method\":\"%s\",\"time\":1e5,"
             "\"observables\":{\"current\":{}}}",
             (long long)n, (long long)n * scene->length_per_rod, scene->members, method);
    char *text = text_take(&job);
    if (text && scene_json_parse(text, strlen(text), &made, &errors) != BCD_OK)
        made = NULL;
    free(text);
    return made;
}

/* Noise and force alone. */
struct floor_work {
    double *y;
    int64_t n;
};

static bool advance_floor(void *context, int64_t ticks)
{
    struct floor_work *work = context;
    bcd_baseline_noise_and_force(work->y, work->n, ticks);
    return true;
}

static bool advance_run(void *context, int64_t ticks)
{
    return bcd_run_advance(context, ticks, NULL) == BCD_OK;
}

static enum bench_outcome measure(const struct bcd_scene *scene, int64_t n,
                                  struct bench_timing *timing)
{
    struct floor_work least = {calloc((size_t)n, sizeof(double)), n};
    struct bcd_run *run = NULL;
    enum bench_outcome outcome = BENCH_FAILED;
    if (least.y && bcd_run_create(&run, scene, 0, NULL) == BCD_OK)
        outcome = bench_turns((struct bench_work[]){{advance_floor, &least}, {advance_run, run}},
                              timing);
    bcd_run_free(run);
    free(least.y);
    return outcome;
}

static const char *method_name(size_t index)
{
    for (const struct bcd_param *row = bcd_job_params(); row->name; row++)
        if (strcmp(row->name, "method") == 0)
            return row->choice(index);
    return NULL;
}

static void add_separator(struct text *json)
{
    text_add(json, "%s\n", json->size && json->bytes[json->size - 1] == '[' ? "" : ",");
}

/* One line of the table and one entry of the JSON. */
static void add_entry(struct text *json, const struct bench_scene *bench, const char *method,
                      int64_t n, const struct bench_timing *timing)
{
    double ns = timing->ns[1] / (double)n;
    printf("%-8s %-18s %9lld %10.2f %10.2f\n", bench->name, method, (long long)n, ns,
           timing->ratio);
    add_separator(json);
    text_add(json,
             "{\"scene\":\"%s\",\"method\":\"%s\",\"particles\":%lld,\"realizations\":1,"
             "\"threads\":1,\"ns_per_particle_step\":%.4g,\"ratio_to_noise_and_force\":%.4g}",
             bench->name, method, (long long)n, ns, timing->ratio);
}

/* ns of a tick of the next size, as the last two sizes let expect. */
static double expected(const double *tick, size_t size)
{
    if (size < 2)
        return 0;
    double grown = (double)sizes[size - 1] / (double)sizes[size - 2];
    double power = log(tick[size - 1] / tick[size - 2]) / log(grown);
    return tick[size - 1] * pow((double)sizes[size] / (double)sizes[size - 1], power);
}

/* All sizes of one scene and method; a method that refuses the scene has none. false = failed. */
static bool add_sizes(struct text *json, const struct bench_scene *bench, const char *method)
{
    double tick[SIZES] = {0};
    enum bench_outcome outcome = BENCH_DONE;
    for (size_t i = 0; i < SIZES && outcome == BENCH_DONE; i++) {
        struct bench_timing timing = {.ns = {0, expected(tick, i)}};
        struct bcd_scene *scene = make(bench, method, sizes[i]);
        if (!scene)
            return true;
        outcome = timing.ns[1] > BENCH_TICK_NS_MAX ? BENCH_TOO_SLOW
                                                   : measure(scene, sizes[i], &timing);
        bcd_scene_free(scene);
        tick[i] = timing.ns[1];
        if (outcome == BENCH_DONE)
            add_entry(json, bench, method, sizes[i], &timing);
        else if (outcome == BENCH_TOO_SLOW)
            printf("%-8s %-18s %9lld  left out: a step takes about %.2g s\n", bench->name, method,
                   (long long)sizes[i], 1e-9 * tick[i]);
        fflush(stdout);
    }
    return outcome != BENCH_FAILED;
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

int cli_bench(const struct cli_command *self, int argc, char **argv)
{
    const char *path = argc == 3 && strcmp(argv[1], "--json") == 0 ? argv[2] : NULL;
    if (argc != 1 && !path)
        return cli_wrong(self, "only --json FILE is known");
    struct utsname machine;
    struct text json = {0};
    uname(&machine);
    text_add(&json, "{\"machine\":{\"architecture\":\"%s\",\"cores\":%ld},\"entries\":[",
             machine.machine, sysconf(_SC_NPROCESSORS_ONLN));
    printf("%-8s %-18s %9s %10s %10s\n", "scene", "method", "particles", "ns/rod", "ratio");
    bool good = true;
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++)
        for (size_t m = 1; method_name(m); m++)
            good = add_sizes(&json, &scenes[s], method_name(m)) && good;
    text_add(&json, "\n],\n\"leave_out\":[");
    good = leave_out_all(&json) && good;
    text_add(&json, "\n]}\n");
    char *text = text_take(&json);
    int status = !text ? CLI_FAILED : path ? write_file(path, text) : CLI_OK;
    free(text);
    return good ? status : CLI_FAILED;
}
