/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_estimate_long.c - how long jobs take against what is said before: on this machine, of many
 * scenes and methods. */
#include "calibration.h"
#include "scene_json.h"
#include "support/experiment.h"

#include <glob.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

enum { CASES_MAX = 128 };
#define PATIENCE 0.25 /* core seconds of one case; what is left is extrapolated */

struct result {
    char name[80], method[24];
    double nominal, seconds;
};

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Core seconds of the whole job, from its first chunk or a part of it. */
static double measure(const struct bcd_scene *scene)
{
    struct bcd_run *run = NULL;
    struct bcd_error error;
    double started = now_s(), used = 0;
    int64_t slice = 1, done = 0;
    assert_int_equal(bcd_run_create(&run, scene, 0, &error), BCD_OK);
    int64_t total = bcd_run_ticks_total(run);
    while (done < total && used < PATIENCE) {
        assert_int_equal(bcd_run_advance(run, slice, &error), BCD_OK);
        done = bcd_run_ticks_done(run);
        used = now_s() - started;
        slice = used < 0.02 ? 2 * slice : slice;
    }
    bcd_run_free(run);
    return used * (double)total / (double)done * (double)bcd_scene_chunks(scene);
}

static void add(struct result *results, size_t *count, const char *name, const char *text)
{
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    struct bcd_estimate estimate;
    struct result *result = &results[*count];
    if (scene_json_parse(text, strlen(text), &scene, &errors) != BCD_OK) {
        print_message("# %s: %s %s\n", name, errors.items[0].field, errors.items[0].text);
        return; /* this method cannot do it */
    }
    bcd_scene_estimate(scene, &estimate);
    snprintf(result->name, sizeof(result->name), "%s", name);
    snprintf(result->method, sizeof(result->method), "%s", calibration_method(scene));
    result->nominal = estimate.core_seconds;
    result->seconds = measure(scene);
    ++*count;
    bcd_scene_free(scene);
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The median of max(r, 1/r), and the share of cases above 2. */
static double off_by(const double *factor, const struct result *results, size_t count,
                     double *above)
{
    double off[CASES_MAX], median;
    *above = 0;
    for (size_t i = 0; i < count; i++) {
        double ratio = results[i].seconds / (results[i].nominal * factor[i]);
        off[i] = ratio > 1 ? ratio : 1 / ratio;
        *above += off[i] > 2 ? 1.0 / (double)count : 0;
    }
    qsort(off, count, sizeof(off[0]), compare);
    median = off[count / 2];
    return median;
}

#define SPARSE "\"length\":200,\"diameter\":0.5,\"potential\":{\"type\":\"cosine\",\"amplitude\":6}"
#define STEP "\"time_step\":0.0005,\"time\":500"

/* Forces and observables that cost more than usual, by the method that is usual for them. */
static void add_forces(struct result *results, size_t *count)
{
#define RODS "\"particles\":100,\"length\":200,\"diameter\":0.5," STEP
#define ENERGY ",\"observables\":{\"energy\":{}}"
    static const struct {
        const char *name, *rest;
    } scenes[] = {
        {"formula", RODS ENERGY ",\"potential\":{\"type\":\"expression\",\"period\":1,"
                                "\"energy\":\"3*cos(2*pi*x)\"}"},
        {"formula, long",
         RODS ENERGY ",\"potential\":{\"type\":\"expression\",\"period\":1,\"energy\":"
                     "\"3*cos(2*pi*x)+exp(sin(2*pi*x))+tanh(cos(4*pi*x))+log(2+sin(2*pi*x))"
                     "+sqrt(2+cos(2*pi*x))+atan(sin(2*pi*x))+cosh(sin(2*pi*x))\"}"},
        {"formula, few", "\"particles\":5,\"length\":10,\"diameter\":0.5," STEP ENERGY
                         ",\"potential\":{\"type\":\"expression\",\"period\":1,"
                         "\"energy\":\"3*cos(2*pi*x)+exp(sin(2*pi*x))\"}"},
        {"fourier", RODS ENERGY ",\"potential\":{\"type\":\"fourier\",\"cosine\":[3,1,0.5,0.2,0.1],"
                                "\"sine\":[1,0.5,0.3]}"},
        {"table", RODS ENERGY ",\"potential\":{\"type\":\"table\",\"period\":1,"
                              "\"values\":[0,1,2,3,3,2,1,0]}"},
        {"yukawa", RODS ENERGY ",\"interaction\":{\"type\":\"yukawa\",\"strength\":1,"
                               "\"screening\":2,\"cutoff\":1.5}"},
        {"yukawa, far", RODS ENERGY ",\"interaction\":{\"type\":\"yukawa\",\"strength\":1,"
                                    "\"screening\":0.2,\"cutoff\":20}"},
        {"power", RODS ENERGY ",\"interaction\":{\"type\":\"power\",\"strength\":1,"
                              "\"exponent\":3,\"cutoff\":2.5}"},
        {"pair formula", RODS ENERGY ",\"interaction\":{\"type\":\"expression\","
                                     "\"energy\":\"2*exp(-r)/r\",\"cutoff\":2.5}"},
        {"pair table", RODS ENERGY ",\"interaction\":{\"type\":\"table\",\"first\":0.5,"
                                   "\"last\":2,\"values\":[3,2,1,0.5,0.2,0]}"},
        {"sticky", RODS ENERGY ",\"interaction\":{\"type\":\"sticky\",\"strength\":1,"
                               "\"range\":0.2,\"exponent\":3}"},
        {"contact force", RODS ",\"observables\":{\"contact_force\":{},\"pair_distribution\":"
                               "{\"bins\":100,\"last\":5}}"},
        {"pairs", RODS ",\"observables\":{\"pair_distribution\":{\"bins\":100,\"last\":5}}"},
        {"lags, few", "\"particles\":4,\"length\":8,\"diameter\":0.5," STEP
                      ",\"observables\":{\"msd\":{\"first\":0.001,\"last\":100,"
                      "\"points\":400}}"},
        {"lags, one", "\"particles\":1,\"length\":8,\"diameter\":0.5," STEP
                      ",\"observables\":{\"msd\":{\"first\":0.001,\"last\":100,"
                      "\"points\":200}}"},
        {"walls", RODS ENERGY ",\"boundary\":\"walls\",\"potential\":{\"type\":\"cosine\","
                              "\"amplitude\":6}"},
        {"equilibrium", "\"particles\":2000,\"length\":4000,\"diameter\":0.5,\"time_step\":0.0005,"
                        "\"time\":0.5,\"initial\":\"equilibrium\"" ENERGY},
        {"trajectory", RODS ",\"observables\":{\"trajectory\":{\"every\":10,\"rods\":10}}"},
        {"far lags", "\"particles\":1000,\"length\":1000,\"time_step\":50000,\"time\":1e9,"
                     "\"observables\":{\"msd\":{\"first\":50000,\"last\":1e8,\"points\":9}}"},
        {"clusters", RODS ",\"observables\":{\"cluster_sizes\":{}}"},
    };
    char text[2048], name[80];
    for (size_t i = 0; i < sizeof(scenes) / sizeof(scenes[0]); i++) {
        snprintf(text, sizeof(text), "{%s,\"realizations\":2,\"stability\":\"ignored\"}",
                 scenes[i].rest);
        snprintf(name, sizeof(name), "%s", scenes[i].name);
        add(results, count, name, text);
    }
#undef RODS
#undef ENERGY
}

static size_t run_all(struct result *results)
{
    static const char *const methods[] = {"auto",    "bcd",      "bcd_chronological",
                                          "elastic", "strang",   "bcd_premerging",
                                          "lm",      "strating", "tao"};
    static const struct {
        const char *name, *rest;
    } scenes[] = {
        {"plain", "\"particles\":100," SPARSE "," STEP ",\"observables\":{\"energy\":{}}"},
        {"few", "\"particles\":4,\"length\":8,\"diameter\":0.5," STEP
                ",\"observables\":{\"density\":{\"bins\":50}}"},
        {"many", "\"particles\":10000,\"length\":20000,\"diameter\":0.5," STEP
                 ",\"observables\":{\"energy\":{}}"},
        {"msd", "\"particles\":100," SPARSE "," STEP
                ",\"observables\":{\"msd\":{\"first\":0.01,\"last\":50,\"points\":60}}"},
        {"lags", "\"particles\":100," SPARSE "," STEP
                 ",\"observables\":{\"msd\":{\"first\":0.005,\"last\":100,\"points\":400}}"},
        {"all", "\"particles\":100," SPARSE "," STEP
                ",\"observables\":{\"msd\":{\"first\":0.01,\"last\":10,\"points\":30},"
                "\"density\":{\"bins\":100},\"contact_density\":{\"bins\":20},\"energy\":{},"
                "\"current\":{},\"cluster_sizes\":{}}"},
        {"dense", "\"particles\":100,\"length\":110," STEP
                  ",\"diameter\":0.99,\"observables\":{\"energy\":{},\"density\":{\"bins\":50}}"},
    };
    size_t count = 0;
    char text[2048], name[80];
    add_forces(results, &count);
    for (size_t s = 0; s < sizeof(scenes) / sizeof(scenes[0]); s++) {
        for (size_t m = 0; m < sizeof(methods) / sizeof(methods[0]); m++) {
            snprintf(text, sizeof(text),
                     "{%s,\"realizations\":2,\"stability\":\"ignored\",\"method\":\"%s\"}",
                     scenes[s].rest, methods[m]);
            snprintf(name, sizeof(name), "%s %s", scenes[s].name, methods[m]);
            add(results, &count, name, text);
        }
    }
    glob_t files;
    assert_int_equal(glob("tests/scenes/*.json", 0, NULL, &files), 0);
    for (size_t i = 0; i < files.gl_pathc && count < CASES_MAX; i++) {
        static char job[65536];
        FILE *file = fopen(files.gl_pathv[i], "r");
        assert_non_null(file);
        job[fread(job, 1, sizeof(job) - 1, file)] = '\0';
        fclose(file);
        add(results, &count, files.gl_pathv[i] + strlen("tests/scenes/"), job);
    }
    globfree(&files);
    return count;
}

static void estimates_are_right_within_two(void **state)
{
    (void)state;
    static struct result results[CASES_MAX];
    double factor[CASES_MAX], above;
    size_t count = run_all(results);
    struct calibration *fresh = calibration_create(), *learned = calibration_create();
    assert_true(count > 50 && fresh && learned);
    calibration_probe(fresh);
    for (size_t i = 0; i < count; i++) {
        factor[i] = calibration_factor(fresh, results[i].method, NULL);
        print_message("# %-40s %-18s nominal %9.4g s real %9.4g s ratio %.2f\n", results[i].name,
                      results[i].method, results[i].nominal, results[i].seconds,
                      results[i].seconds / results[i].nominal / factor[i]);
        calibration_note(learned, results[i].method, results[i].nominal * PATIENCE,
                         results[i].seconds * PATIENCE);
    }
    double first = off_by(factor, results, count, &above);
    print_message("# at first off by %.2f, above two %.0f %%\n", first, 100 * above);
    for (size_t i = 0; i < count; i++)
        factor[i] = calibration_factor(learned, results[i].method, NULL);
    double later = off_by(factor, results, count, &above);
    print_message("# after these, off by %.2f, above two %.0f %%\n", later, 100 * above);
    calibration_free(fresh);
    calibration_free(learned);
    assert_true(first < 2);
    assert_true(later < 1.5 && above < 0.25);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(estimates_are_right_within_two)};
    return cmocka_run_group_tests_name("estimate", tests, NULL, NULL);
}
