/* SPDX-License-Identifier: GPL-3.0-or-later
 * Realizations that go side by side (sim.h) have the same bits as if each went alone: positions,
 * views and contact forces of every method that knows lanes, and tallies of whole runs. */
#include "part.h"
#include "scene.h"
#include "step_error.h"
#include "support/experiment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* What runs give a method, without a run around it. */
struct bare {
    struct sim sim;
    struct arena kept, scratch;
};

static struct bare *bare_create(const struct plan *plan, int64_t lanes, int64_t realization)
{
    struct bare *b = calloc(1, sizeof *b);
    assert_non_null(b);
    for (int pass = 0; pass < 2; pass++) {
        b->kept.used = b->scratch.used = 0;
        sim_layout_lanes(&b->sim, plan, lanes, &b->kept, &b->scratch);
        plan->method->layout(&b->sim, &b->kept, &b->scratch);
        if (pass == 1)
            break;
        b->kept.bytes = aligned_alloc(ARENA_ALIGNMENT, b->kept.used);
        b->scratch.bytes = aligned_alloc(ARENA_ALIGNMENT, b->scratch.used + ARENA_ALIGNMENT);
        assert_non_null(b->kept.bytes);
        assert_non_null(b->scratch.bytes);
    }
    assert_int_equal(sim_begin(&b->sim, realization, NULL), BCD_OK);
    if (plan->method->begin)
        plan->method->begin(&b->sim);
    return b;
}

static void bare_free(struct bare *b)
{
    free(b->kept.bytes);
    free(b->scratch.bytes);
    free(b);
}

/* Everything that can be seen of a lane. */
static void check_lane(struct sim lane, struct sim *alone)
{
    const struct plan *plan = lane.plan;
    const size_t bytes = (size_t)plan->particles * sizeof(double);
    assert_memory_equal(lane.y, alone->y, bytes);
    if (step_error_views_used(plan))
        for (int view = 0; view < VIEWS; view++) {
            const double *seen = plan->method->view(&lane, (enum view)view);
            const double *expected = plan->method->view(alone, (enum view)view);
            assert_ptr_not_equal(seen, expected);
            assert_memory_equal(seen, expected, bytes);
        }
    if (!plan->asks_contact_forces)
        return;
    double *forces = malloc(2 * bytes);
    assert_non_null(forces);
    plan->method->contact_forces(&lane, forces);
    plan->method->contact_forces(alone, forces + plan->particles);
    assert_memory_equal(forces, forces + plan->particles, bytes);
    free(forces);
}

static void check_lanes(const struct bcd_scene *scene, int64_t lanes)
{
    static const int64_t slices[] = {1, 2, 40, 157};
    const int64_t first = 3;
    const struct plan *plan = &scene->plan;
    struct bare *together = bare_create(plan, lanes, first), *alone[LANES_MAX];
    for (int64_t lane = 0; lane < lanes; lane++)
        alone[lane] = bare_create(plan, 1, first + lane);
    for (size_t i = 0; i < sizeof slices / sizeof *slices; i++) {
        plan->method->advance(&together->sim, slices[i]);
        for (int64_t lane = 0; lane < lanes; lane++) {
            together->sim.clock[lane].tick = together->sim.clock->tick;
            plan->method->advance(&alone[lane]->sim, slices[i]);
            check_lane(sim_lane(&together->sim, lane), &alone[lane]->sim);
        }
    }
    for (int64_t lane = 0; lane < lanes; lane++)
        bare_free(alone[lane]);
    bare_free(together);
}

#define STATIC "'observables': {'density': {}}"

static const char *const scenes[] = {
    "'diameter': 0.5, 'potential': {'type': 'cosine', 'amplitude': 6}, " STATIC,
    "'diameter': 0.97, 'potential': {'type': 'cosine', 'amplitude': 3, 'phase': "
    "0.3}, " STATIC,
    "'diameter': 0.9, 'initial': 'lattice', " STATIC,
    "'diameter': 0.5, 'boundary': 'walls', 'potential': {'type': 'cosine', "
    "'amplitude': 4, 'wavelength': 0.9}, " STATIC,
    "'diameter': 0.9, 'force': 2, 'potential': {'type': 'cosine', 'amplitude': 3, "
    "'velocity': 0.7}, " STATIC,
    "'diameter': 0.5, 'potential': {'type': 'cosine', 'amplitude': 6}, "
    "'interaction': {'type': 'sticky', 'strength': 0.2, 'range': 0.1}, " STATIC,
    "'diameter': 0.95, 'potential': {'type': 'cosine', 'amplitude': 6}, "
    "'observables': {'contact_force': {}}",
};

/* Which of the scenes a method runs: bcd alone knows contact forces, lm no drag. */
static const struct {
    const char *name;
    unsigned scenes;
} methods[] = {{"bcd", 0x7f}, {"elastic", 0x3f}, {"strang", 0x3f}, {"lm", 0x2f}};

static void test_each_lane_alone(void **state)
{
    (void)state;
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
        for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++)
            for (int n = 3; n <= 10 && methods[m].scenes >> s & 1; n++) {
                struct bcd_scene *scene = experiment_scene(
                    "{'particles': %d, 'length': %d, 'time_step': %s, 'time': 1, 'realizations': "
                    "20, 'method': '%s', %s}",
                    n, s == 1 ? n : n + 1, s == 5 ? "1e-5" : "1e-3", methods[m].name, scenes[s]);
                assert_true(scene->plan.method->lanes);
                for (int64_t lanes = 2; lanes <= LANES_MAX; lanes *= 2)
                    check_lanes(scene, lanes);
                bcd_scene_free(scene);
            }
}

/* A run's tally as bytes, to be freed. */
static void *finish(struct bcd_run *run, int64_t slice)
{
    while (bcd_run_ticks_done(run) < bcd_run_ticks_total(run))
        assert_int_equal(bcd_run_advance(run, slice, NULL), BCD_OK);
    const struct bcd_tally *tally = bcd_run_tally(run);
    void *bytes = malloc(bcd_tally_size(tally));
    assert_non_null(bytes);
    bcd_tally_save(tally, bytes);
    return bytes;
}

static struct bcd_scene *job_of(const char *method, int n, int realizations)
{
    return experiment_scene("{'particles': %d, 'length': %d, 'diameter': 0.8, 'potential': "
                            "{'type': 'cosine', 'amplitude': 5}, 'time_step': 1e-3, "
                            "'equilibration_time': 0.011, 'time': 0.12, 'realizations': %d, "
                            "'method': '%s', 'observables': {'density': {'bins': 9}, 'energy': {}, "
                            "'cluster_sizes': {}%s}}",
                            n, n + 1, realizations, method,
                            strcmp(method, "lm") == 0
                                ? ""
                                : ", 'msd': {'points': 7}, 'current': {}, 'trajectory': {'every': "
                                  "0.01}");
}

/* The job's realizations one at a time, each added to what the ones before it measured: from the
 * third on nothing goes beside. Pairs for the time-step error are among them. */
static void *one_by_one(const char *method, int n, int realizations)
{
    void *bytes = NULL;
    for (int k = 2; k <= realizations; k++) {
        struct bcd_scene *scene = job_of(method, n, k);
        struct bcd_tally *before = NULL;
        struct bcd_run *run = NULL;
        assert_int_equal(bcd_run_create(&run, scene, 0, NULL), BCD_OK);
        assert_int_equal(bcd_tally_create(&before, scene), BCD_OK);
        if (bytes) {
            assert_int_equal(bcd_tally_restore(before, bytes, bcd_tally_size(before), NULL),
                             BCD_OK);
            assert_int_equal(bcd_run_continue(run, before, NULL), BCD_OK);
        }
        free(bytes);
        bytes = finish(run, 1000000);
        bcd_tally_free(before);
        bcd_run_free(run);
        bcd_scene_free(scene);
    }
    return bytes;
}

static void test_runs(void **state)
{
    (void)state;
    static const int rods[] = {1, 4, 10, 29, 64};
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
        for (size_t i = 0; i < sizeof rods / sizeof *rods; i++) {
            const int realizations = 23; /* 16 + 4 + 2 + 1 where there are 16 lanes */
            void *expected = one_by_one(methods[m].name, rods[i], realizations);
            for (int64_t slice = 1; slice < 1000000; slice = 30 * slice + 7) {
                struct bcd_scene *scene = job_of(methods[m].name, rods[i], realizations);
                struct bcd_run *run = NULL;
                assert_int_equal(bcd_scene_chunks(scene), 1);
                assert_int_equal(bcd_run_create(&run, scene, 0, NULL), BCD_OK);
                void *bytes = finish(run, slice);
                assert_memory_equal(bytes, expected, bcd_tally_size(bcd_run_tally(run)));
                free(bytes);
                bcd_run_free(run);
                bcd_scene_free(scene);
            }
            free(expected);
        }
}

/* A slice ends where it should, or before all lanes are one step further; large rings keep to the
 * tick. */
static void test_slices(void **state)
{
    (void)state;
    static const int rods[] = {10, 200};
    static const int64_t more[] = {7, 0};
    for (int i = 0; i < 2; i++) {
        struct bcd_scene *scene = job_of("bcd", rods[i], 23);
        struct bcd_run *run = NULL;
        assert_int_equal(bcd_run_create(&run, scene, 0, NULL), BCD_OK);
        for (int slice = 1; slice < 60; slice++) {
            int64_t done = bcd_run_ticks_done(run);
            assert_int_equal(bcd_run_advance(run, slice, NULL), BCD_OK);
            assert_in_range(bcd_run_ticks_done(run), done + slice, done + slice + more[i]);
        }
        bcd_run_free(run);
        bcd_scene_free(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_lane_alone),
        cmocka_unit_test(test_runs),
        cmocka_unit_test(test_slices),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
