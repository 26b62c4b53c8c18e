/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_theory_watch.c - exact theory under a watch: ended when it is told so, within its limits,
 * with every byte given back; and what was expected of it against what it counted. */
#include "theory/cost.h"
#include "theory/sampler.h"
#include "watch.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

static double cosine_6(const void *ctx, double x)
{
    return *(const double *)ctx / 2 * cos(2 * M_PI * x);
}

struct scene {
    const char *name;
    int64_t rods;
    double length, diameter, amplitude;
    enum theory_pair_kind kind;
    double range;
    struct theory_wanted wanted;
    bool walls;
};

#define DENSITY .density_bins = 50
#define CONTACT .contact_bins = 20, .contact_gap = 1e-3
static const struct scene scenes[] = {
    {"sparse", 100, 200, .5, 6, THEORY_HARD, 0, {DENSITY}, false},
    {"shallow", 100, 200, .5, 2, THEORY_HARD, 0, {DENSITY}, false},
    {"deep", 30, 60, .5, 30, THEORY_HARD, 0, {DENSITY}, false},
    {"few", 10, 20, .5, 6, THEORY_HARD, 0, {DENSITY}, false},
    {"three", 3, 6, .5, 6, THEORY_HARD, 0, {DENSITY}, false},
    {"many", 10000, 20000, .5, 6, THEORY_HARD, 0, {DENSITY}, false},
    {"dense", 100, 100, .95, 6, THEORY_HARD, 0, {DENSITY}, false},
    {"contacts", 100, 200, .5, 6, THEORY_HARD, 0, {DENSITY, CONTACT}, false},
    {"free", 100, 200, .5, 0, THEORY_HARD, 0, {DENSITY, CONTACT}, false},
    {"pairs", 50, 100, .5, 6, THEORY_HARD, 0, {.pair_bins = 100, .pair_last = 4}, false},
    {"free pairs", 50, 100, .5, 0, THEORY_HARD, 0, {.pair_bins = 100, .pair_last = 4}, false},
    {"sticky", 20, 40, .5, 6, THEORY_STICKY, .1, {DENSITY, CONTACT}, false},
    {"bonds", 20, 40, .5, 6, THEORY_BAXTER, 0, {DENSITY}, false},
    {"walls", 20, 40, .5, 6, THEORY_HARD, 0, {DENSITY}, true},
    {"walls, contacts", 10, 20, .5, 6, THEORY_HARD, 0, {DENSITY, CONTACT}, true},
    {"walls, sticky", 5, 10, .5, 6, THEORY_STICKY, .1, {DENSITY, CONTACT}, true},
};
enum { SCENES = sizeof scenes / sizeof *scenes };

static struct theory_system system_of(const struct scene *scene, struct bcd_watch *watch)
{
    struct theory_system system = {.walls = scene->walls,
                                   .particles = scene->rods,
                                   .length = scene->length,
                                   .diameter = scene->diameter,
                                   .temperature = 1,
                                   .period = 1,
                                   .ctx = &scene->amplitude,
                                   .watch = watch,
                                   .pair = {scene->kind, 1, scene->range, 3, NULL, NULL, 0}};
    if (scene->amplitude > 0) {
        system.energy = cosine_6;
        system.curvature = 2 * M_PI * M_PI * scene->amplitude;
        if (scene->walls)
            system.period = 6 / sqrt(system.curvature);
    }
    return system;
}

/* What a question is about: how often it was asked, when to say yes. */
struct question {
    struct bcd_watch *watch;
    int asked, yes_at; /* 0 = never */
    double last, longest;
};

static bool should_stop(void *context)
{
    struct question *question = context;
    double waited = question->watch->seconds - question->last;
    question->longest = fmax(question->longest, waited);
    question->last = question->watch->seconds;
    return ++question->asked == question->yes_at;
}

static int rising(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Deterministic: what is counted does not depend on the machine. */
static void costs_are_known_before(void **state)
{
    (void)state;
    double off[SCENES];
    for (int i = 0; i < SCENES; i++) {
        struct bcd_watch watch = {0};
        struct theory_system system = system_of(&scenes[i], &watch);
        struct theory_result *result = NULL;
        struct theory_cost cost = theory_cost_canonical(&system, &scenes[i].wanted);
        assert_int_equal(theory_canonical(&result, &system, &scenes[i].wanted, NULL), BCD_OK);
        theory_result_free(result);
        double ratio = watch.seconds / cost.seconds;
        print_message("# %-16s counted %.3g s, expected %.3g s; %.3g MB, expected %.3g\n",
                      scenes[i].name, watch.seconds, cost.seconds, watch.bytes_most / 1e6,
                      cost.bytes / 1e6);
        assert_true(ratio > .25 && ratio < 4);
        assert_true(watch.bytes_most < 4 * cost.bytes + 1e6);
        assert_true(watch.bytes == 0);
        off[i] = fmax(ratio, 1 / ratio);
    }
    qsort(off, SCENES, sizeof *off, rising);
    assert_true(off[SCENES / 2] < 1.5 && off[SCENES * 3 / 4] < 2.2);
}

/* Wherever it is told to stop, it stops, leaves nothing and says so. */
static void it_stops_when_told(void **state)
{
    (void)state;
    for (int i = 0; i < SCENES; i++) {
        struct bcd_watch watch = {.should_stop = should_stop};
        struct question all = {.watch = &watch};
        struct theory_system system = system_of(&scenes[i], &watch);
        struct theory_result *result = NULL;
        watch.context = &all;
        assert_int_equal(theory_canonical(&result, &system, &scenes[i].wanted, NULL), BCD_OK);
        theory_result_free(result);
        assert_true(all.longest < .1); /* that long somebody waits at most */
        for (int at = 1; at <= all.asked; at += 1 + all.asked / 2) {
            struct question question = {.watch = &watch, .yes_at = at};
            struct bcd_error error = {0};
            watch = (struct bcd_watch){.should_stop = should_stop, .context = &question};
            result = NULL;
            assert_int_equal(theory_canonical(&result, &system, &scenes[i].wanted, &error),
                             BCD_STOPPED);
            assert_null(result);
            assert_int_equal(error.code, BCD_STOPPED);
            assert_string_equal(error.text, "was told to stop");
            assert_int_equal(question.asked, at);
            assert_true(watch.seconds - question.last < .1);
            assert_true(watch.bytes == 0);
        }
    }
}

/* Nor does what is refused at the first look cost anything. */
static void refused_systems_cost_nothing(void **state)
{
    (void)state;
    struct theory_system system = system_of(&scenes[0], NULL);
    system.pair.kind = THEORY_ENERGY;
    system.pair.cutoff = 20; /* beyond nearest neighbours */
    assert_true(theory_cost_canonical(&system, &scenes[0].wanted).seconds == 0);
    assert_true(theory_cost_infinite(&system, &scenes[0].wanted).seconds == 0);
    system = system_of(&scenes[0], NULL);
    system.temperature = 0;
    assert_true(theory_cost_canonical(&system, &scenes[0].wanted).seconds == 0);
    assert_true(theory_cost_sampler(&system).seconds == 0);
}

static void results_do_not_depend_on_being_watched(void **state)
{
    (void)state;
    const struct scene *scene = &scenes[7];
    struct bcd_watch watch = {.seconds_max = 100, .bytes_max = 1e9};
    struct theory_system system = system_of(scene, &watch);
    struct theory_result *a = NULL, *b = NULL, *copy = NULL;
    assert_int_equal(theory_canonical(&a, &system, &scene->wanted, NULL), BCD_OK);
    system.watch = NULL;
    assert_int_equal(theory_canonical(&b, &system, &scene->wanted, NULL), BCD_OK);
    assert_int_equal(theory_result_copy(&copy, a), BCD_OK);
    assert_memory_equal(a->density, b->density, 50 * sizeof(double));
    assert_memory_equal(a->contact_window, b->contact_window, 20 * sizeof(double));
    assert_memory_equal(copy->density, a->density, (50 + 20 + 20) * sizeof(double));
    assert_true(copy->energy == a->energy && copy->error == a->error && copy->points == a->points);
    theory_result_free(a);
    theory_result_free(b);
    theory_result_free(copy);
}

static void limits_cut_it_short(void **state)
{
    (void)state;
    for (int i = 0; i < SCENES; i++) {
        struct bcd_watch seconds = {.seconds_max = 1e-4}, bytes = {.bytes_max = 1000};
        struct theory_system system = system_of(&scenes[i], &seconds);
        struct theory_result *result = NULL;
        struct bcd_error error = {0};
        assert_int_equal(theory_canonical(&result, &system, &scenes[i].wanted, &error),
                         BCD_STOPPED);
        assert_string_equal(error.text, "would take more than 0.0001 core seconds");
        assert_int_equal(seconds.end, BCD_WATCH_SECONDS);
        system.watch = &bytes;
        assert_int_equal(theory_canonical(&result, &system, &scenes[i].wanted, &error),
                         BCD_STOPPED);
        assert_string_equal(error.text, "would take more than 1000 bytes of memory");
        assert_true(bytes.bytes == 0);
        assert_null(result);
    }
}

static double half(void *ctx)
{
    double *x = ctx;
    *x = fmod(*x * 1.9 + .37, 1);
    return .001 + .998 * *x;
}

/* Rods so dense that rings do not close: seconds of trials, then the recursion. */
static void samplers_and_draws_stop_too(void **state)
{
    (void)state;
    for (int i = 0; i < SCENES; i++) {
        if (scenes[i].rods > 1000)
            continue;
        struct bcd_watch watch = {.should_stop = should_stop};
        struct question question = {.watch = &watch, .yes_at = 1}, draw = {.yes_at = 1};
        struct theory_system system = system_of(&scenes[i], &watch);
        struct theory_sampler *sampler = NULL;
        struct bcd_error error = {0};
        watch.context = &question;
        if (theory_sampler_create(&sampler, &system, &error) == BCD_OK) {
            assert_int_equal(question.asked, 0); /* it took less than the first question */
            theory_sampler_free(sampler);
        } else {
            assert_int_equal(error.code, BCD_STOPPED);
            assert_true(question.asked == 1 && watch.seconds < .1 && watch.bytes == 0);
        }
        watch = (struct bcd_watch){0};
        double ctx = .5, y[1000];
        struct bcd_watch other = {.should_stop = should_stop, .context = &draw};
        struct theory_uniforms uniforms = {.next = half, .ctx = &ctx, .watch = &other};
        draw.watch = &other;
        assert_int_equal(theory_sampler_create(&sampler, &system, &error), BCD_OK);
        watch.seconds = watch.bytes = 0;
        enum bcd_status status = theory_sampler_draw(sampler, y, &uniforms, &error);
        assert_true(status == (other.end ? BCD_STOPPED : BCD_OK));
        assert_true(other.seconds < .1 && other.bytes == 0);
        assert_true(watch.seconds == 0 && watch.bytes == 0); /* forgotten */
        theory_sampler_free(sampler);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(costs_are_known_before),
        cmocka_unit_test(refused_systems_cost_nothing),
        cmocka_unit_test(it_stops_when_told),
        cmocka_unit_test(results_do_not_depend_on_being_watched),
        cmocka_unit_test(limits_cut_it_short),
        cmocka_unit_test(samplers_and_draws_stop_too),
    };
    return cmocka_run_group_tests_name("theory under a watch", tests, NULL, NULL);
}
