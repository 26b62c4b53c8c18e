/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_bench.c - bcd bench: what a step costs, per rod and as a ratio to drawing its noise and
 * evaluating its force; see cli.h. Baseline and run are timed in turns, medians are shown: the
 * ratio holds on a machine whose speed drifts, a time in ns does not. */
#include "cli.h"
#include "scene_json.h"
#include "text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/utsname.h>
#include <time.h>
#include <unistd.h>

enum { TURNS = 7 };
static const double turn_rod_steps = 4e6; /* about 50 ms a turn */

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

static double now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values)
{
    qsort(values, TURNS, sizeof *values, by_value);
    return values[TURNS / 2];
}

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
        fprintf(stderr, "bcd bench: %s, %s: %s\n", scene->name, method,
                errors.count ? errors.items[0].text : "out of memory");
    free(text);
    return made;
}

struct timing {
    double ns, ratio; /* per rod and step; over noise and force alone */
};

static bool measure(const struct bcd_scene *scene, int64_t n, struct timing *timing)
{
    double step[TURNS], ratio[TURNS], *y = calloc((size_t)n, sizeof *y);
    int64_t ticks = (int64_t)(turn_rod_steps / (double)n);
    struct bcd_run *run = NULL;
    bool good = y && bcd_run_create(&run, scene, 0, NULL) == BCD_OK &&
                bcd_run_advance(run, ticks, NULL) == BCD_OK; /* warm */
    for (int i = 0; good && i < TURNS; i++) {
        double start = now_ns();
        bcd_baseline_noise_and_force(y, n, ticks);
        double middle = now_ns();
        good = bcd_run_advance(run, ticks, NULL) == BCD_OK;
        step[i] = (now_ns() - middle) / ((double)ticks * (double)n);
        ratio[i] = step[i] * (double)ticks * (double)n / (middle - start);
    }
    if (good)
        *timing = (struct timing){median(step), median(ratio)};
    bcd_run_free(run);
    free(y);
    return good;
}

static const char *method_name(size_t index)
{
    for (const struct bcd_param *row = bcd_job_params(); row->name; row++)
        if (strcmp(row->name, "method") == 0)
            return row->choice(index);
    return NULL;
}

/* One line of the table and one entry of the JSON. */
static bool add_entry(struct text *json, const struct bench_scene *bench, const char *method,
                      int64_t n)
{
    struct timing timing;
    struct bcd_scene *scene = make(bench, method, n);
    bool good = scene && measure(scene, n, &timing);
    bcd_scene_free(scene);
    if (!good)
        return false;
    printf("%-8s %-10s %9lld %10.2f %10.2f\n", bench->name, method, (long long)n, timing.ns,
           timing.ratio);
    fflush(stdout);
    text_add(json,
             "%s\n{\"scene\":\"%s\",\"method\":\"%s\",\"particles\":%lld,\"realizations\":1,"
             "\"threads\":1,\"ns_per_particle_step\":%.4g,\"ratio_to_noise_and_force\":%.4g}",
             json->size && json->bytes[json->size - 1] == '[' ? "" : ",", bench->name, method,
             (long long)n, timing.ns, timing.ratio);
    return true;
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
    printf("%-8s %-10s %9s %10s %10s\n", "scene", "method", "particles", "ns/rod", "ratio");
    bool good = true;
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++)
        for (size_t m = 1; method_name(m); m++)
            for (size_t n = 0; n < sizeof sizes / sizeof *sizes; n++)
                good = add_entry(&json, &scenes[s], method_name(m), sizes[n]) && good;
    text_add(&json, "\n]}\n");
    char *text = text_take(&json);
    int status = !text ? CLI_FAILED : path ? write_file(path, text) : CLI_OK;
    free(text);
    return good ? status : CLI_FAILED;
}
