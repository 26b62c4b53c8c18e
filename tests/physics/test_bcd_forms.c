/* SPDX-License-Identifier: GPL-3.0-or-later
 * The three forms of the BCD step as methods, with the engine's noise and forces: step by step from
 * the same state they end in the same one but for rounding, and exert the same contact forces; so
 * do long runs of their own, for the step brings no two rings further apart than their forces do.
 */
#include "support/experiment.h"
#include "kernels/clusters.h"
#include "part.h"
#include "scene.h"
#include "scene_json.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

extern const struct method_type method_bcd, method_bcd_chronological, method_bcd_premerging;

enum { FORMS = 3 };
static const struct method_type *const forms[FORMS] = {&method_bcd, &method_bcd_chronological,
                                                       &method_bcd_premerging};

/* One scene, run by all three. */
struct race {
    struct bcd_scene *scene;
    const struct plan *plan;
    struct lane lane;
    struct sim sim[FORMS];
    void *kept[FORMS], *scratch[FORMS];
    double *force[FORMS];
    int64_t contacts; /* closed ones seen: to be sure that there were some */
};

static void race_begin(struct race *race, const char *parts, int64_t realization)
{
    race->scene = experiment_scene("{%s, 'initial': 'uniform', 'method': 'bcd', 'time': 1, "
                                   "'observables': {'contact_force': {}}}",
                                   parts);
    race->plan = &race->scene->plan;
    race->lane = (struct lane){race->plan->particles, race->plan->free_length, race->plan->walls,
                               race->plan->low};
    for (int f = 0; f < FORMS; f++) {
        struct sim *sim = &race->sim[f];
        struct arena kept = {0}, scratch = {0};
        sim_layout(sim, race->plan, &kept);
        forms[f]->layout(sim, &kept, &scratch);
        race->kept[f] = kept.bytes = aligned_alloc(ARENA_ALIGNMENT, kept.used);
        race->scratch[f] = scratch.bytes = aligned_alloc(ARENA_ALIGNMENT, scratch.used);
        assert_non_null(race->kept[f]);
        assert_non_null(race->scratch[f]);
        kept.used = scratch.used = 0;
        sim_layout(sim, race->plan, &kept);
        forms[f]->layout(sim, &kept, &scratch);
        assert_int_equal(sim_begin(sim, realization, NULL), BCD_OK);
        race->force[f] = calloc((size_t)race->plan->particles, sizeof(double));
        assert_non_null(race->force[f]);
    }
}

static void race_end(struct race *race)
{
    for (int f = 0; f < FORMS; f++) {
        free(race->kept[f]);
        free(race->scratch[f]);
        free(race->force[f]);
    }
    bcd_scene_free(race->scene);
}

/* The largest number there is: what rounding is measured by. */
static double scale_of(const struct race *race)
{
    const double *y = race->sim[0].y;
    int64_t n = race->plan->particles;
    return fmax(fmax(fabs(y[0]), fabs(y[n - 1])), fmax(1, race->plan->length));
}

static void check_legal(const struct race *race, int form)
{
    const struct lane *lane = &race->lane;
    const double *y = race->sim[form].y;
    for (int64_t i = 0; i + 1 < lane->n; i++)
        assert_true(y[i] <= y[i + 1]);
    double low = lane->walls ? lane->low : y[0];
    assert_true(y[0] >= low && (y[lane->n - 1] <= low + lane->ell || lane->n == 1));
}

/* Largest distance of rods from those of the first form. */
static double apart(const struct race *race, int form)
{
    double off = 0;
    for (int64_t i = 0; i < race->plan->particles; i++)
        off = fmax(off, fabs(race->sim[form].y[i] - race->sim[0].y[i]));
    return off;
}

/* Forces of the next step, and that asking for them leaves the run as it is. */
static void check_forces(struct race *race, int form)
{
    const struct plan *plan = race->plan;
    size_t rods = (size_t)plan->particles * sizeof(double);
    double *before = malloc(rods);
    assert_non_null(before);
    memcpy(before, race->sim[form].y, rods);
    forms[form]->contact_forces(&race->sim[form], race->force[form]);
    assert_memory_equal(before, race->sim[form].y, rods);
    free(before);
    double slack = 64 * DBL_EPSILON * scale_of(race) * sqrt((double)plan->particles) /
                   (plan->mobility * plan->time_step);
    for (int64_t i = 0; i < plan->particles; i++)
        assert_within(race->force[form][i], race->force[0][i], 0, 0, slack);
}

static int64_t contacts(const struct race *race)
{
    int64_t count = 0;
    for (int64_t i = 0; i < race->lane.n; i++)
        count += lane_contact(&race->lane, race->sim[0].y, i);
    return count;
}

/* Steps of all forms, each begun where the first one stands. */
static double run_in_step(struct race *race, int64_t steps)
{
    size_t rods = (size_t)race->plan->particles * sizeof(double);
    double worst = 0;
    for (int64_t t = 0; t < steps; t++) {
        for (int f = 0; f < FORMS; f++) {
            if (t % 16 == 0)
                check_forces(race, f);
            forms[f]->advance(&race->sim[f], 1);
            check_legal(race, f);
        }
        race->contacts += contacts(race);
        double scale = scale_of(race);
        for (int f = 1; f < FORMS; f++) {
            worst = fmax(worst, apart(race, f) / (DBL_EPSILON * scale));
            assert_true(race->sim[f].clock->tick == race->sim[0].clock->tick);
            memcpy(race->sim[f].y, race->sim[0].y, rods);
        }
    }
    return worst;
}

static const char *const scenes[] = {
    "'particles': 1, 'length': 3, 'diameter': 0.5, 'time_step': 1e-2",
    "'particles': 1, 'length': 3, 'diameter': 3, 'time_step': 1e-2",
    "'particles': 2, 'length': 2, 'diameter': 0.9, 'time_step': 1e-3",
    "'particles': 2, 'length': 2, 'diameter': 1, 'force': 7, 'time_step': 1e-3",
    "'particles': 13, 'length': 20, 'diameter': 0.8, 'time_step': 1e-2",
    "'particles': 40, 'length': 40, 'diameter': 0.99, 'time_step': 1e-2",
    "'particles': 40, 'length': 40, 'diameter': 1, 'time_step': 1e-2",
    "'particles': 40, 'length': 40, 'diameter': 0.9999999999, 'time_step': 1e-3",
    "'particles': 30, 'length': 40, 'diameter': 0.8, 'time_step': 1e-3, 'force': 10, 'potential': "
    "{'type': 'cosine', 'amplitude': 6}",
    "'particles': 45, 'length': 40, 'diameter': 0.8, 'time_step': 1e-3, 'force': 15, 'potential': "
    "{'type': 'cosine', 'amplitude': 6}, 'temperature': 0",
    "'particles': 8, 'length': 8, 'diameter': 0.3, 'time_step': 1e-3, 'potential': {'type': "
    "'cosine', 'amplitude': 6, 'wavelength': 8}, 'temperature': 0",
    "'particles': 20, 'length': 25, 'diameter': 0.8, 'time_step': 1e-5, 'potential': {'type': "
    "'cosine', 'amplitude': 6}, 'interaction': {'type': 'sticky', 'strength': 1, 'range': 0.1}",
    "'particles': 20, 'length': 25, 'diameter': 0.8, 'time_step': 1e-3, 'boundary': 'walls', "
    "'force': -5, 'potential': {'type': 'cosine', 'amplitude': 6}",
    "'particles': 5, 'length': 5, 'diameter': 0.99, 'time_step': 1e-2, 'boundary': 'walls'",
    "'particles': 5, 'length': 5, 'diameter': 1, 'time_step': 1e-2, 'boundary': 'walls'",
    "'particles': 9, 'length': 10, 'diameter': 1, 'time_step': 1e-3, 'boundary': 'walls', "
    "'temperature': 0, 'force': 2",
    "'particles': 3000, 'length': 3000, 'diameter': 0.9, 'time_step': 1e-2, 'potential': {'type': "
    "'cosine', 'amplitude': 1}",
};
enum { SCENES = sizeof scenes / sizeof *scenes };

static void test_step_by_step(void **state)
{
    (void)state;
    for (int s = 0; s < SCENES; s++) {
        struct race race = {0};
        race_begin(&race, scenes[s], 3);
        int64_t steps = race.plan->particles > 100 ? 60 : 3000;
        double worst = run_in_step(&race, steps);
        printf("# scene %d: %.1f ulp at worst, %d contacts in all\n", s, worst, (int)race.contacts);
        assert_true(worst <= 32);
        assert_int_equal(race.contacts > steps / 10, race.plan->particles > 1);
        race_end(&race);
    }
}

/* Left to themselves: distances grow no faster than the force tears rods apart, (1 + h k)^steps. */
static void test_long_runs(void **state)
{
    (void)state;
    static const int among[] = {4, 5, 8, 9, 12};
    for (size_t k = 0; k < sizeof among / sizeof *among; k++) {
        struct race race = {0};
        race_begin(&race, scenes[among[k]], 0);
        for (int f = 0; f < FORMS; f++)
            forms[f]->advance(&race.sim[f], 20000);
        double scale = scale_of(&race), off = fmax(apart(&race, 1), apart(&race, 2));
        printf("# scene %d: %.3g apart after 20000 steps\n", among[k], off);
        assert_true(off < 1e-9 * scale);
        race_end(&race);
    }
}

/* Whole jobs: the same tables to twelve digits. */
static void test_jobs_agree(void **state)
{
    (void)state;
    double mean[FORMS];
    for (int f = 0; f < FORMS; f++) {
        struct experiment e = experiment_run(
            experiment_scene("{'particles': 16, 'length': 20, 'diameter': 0.8, 'force': 4, "
                             "'potential': {'type': 'cosine', 'amplitude': 6}, 'method': '%s', "
                             "'time_step': 1e-3, 'time': 5, 'realizations': 3, 'observables': "
                             "{'current': {}}}",
                             forms[f]->part.name),
            0);
        struct bcd_table *t = experiment_table(&e, "current");
        mean[f] = column_of(t, BCD_ROLE_VALUE)[0];
        bcd_table_free(t);
        experiment_end(&e);
        assert_within(mean[f], mean[0], 0, 0, 1e-12);
    }
    assert_true(mean[0] != 0);
}

/* The event by event form ends at 10^5 rods, and does not begin with more. */
static void test_many_rods(void **state)
{
    (void)state;
    const char *job = "{\"particles\": %d, \"length\": 200000, \"diameter\": 1, \"time_step\": "
                      "1e-2, \"time\": 0.03, \"method\": \"bcd_chronological\", "
                      "\"observables\": {\"current\": {}}}";
    for (int more = 0; more < 2; more++) {
        char text[300];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
        snprintf(text, sizeof text, job, 100000 + more);
#pragma GCC diagnostic pop
        struct bcd_errors errors = {0};
        struct bcd_scene *scene = NULL;
        enum bcd_status status = scene_json_parse(text, strlen(text), &scene, &errors);
        assert_int_equal(status, more ? BCD_INVALID : BCD_OK);
        if (more) {
            assert_string_equal(errors.items[0].field, "/method");
            continue;
        }
        struct experiment e = experiment_run(scene, 0);
        experiment_end(&e);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_step_by_step),
        cmocka_unit_test(test_long_runs),
        cmocka_unit_test(test_jobs_agree),
        cmocka_unit_test(test_many_rods),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
