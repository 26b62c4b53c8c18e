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
    "'diameter': 0.8, 'potential': {'type': 'fourier', 'cosine': [2, 0.3], 'sine': [0, "
    "0.5]}, " STATIC,
    "'diameter': 0.7, 'potential': {'type': 'table', 'period': 0.5, 'values': [1, 0.2, -1, "
    "-0.1]}, " STATIC,
    "'diameter': 0.6, 'potential': {'type': 'expression', 'energy': '2*cos(2*pi*x)+exp(sin(4*pi*"
    "x))', 'period': 1}, " STATIC,
    "'diameter': 0.6, 'boundary': 'walls', 'potential': {'type': 'expression', 'energy': "
    "'(x-2)^2/2'}, " STATIC,
};

/* Which of the scenes a method runs: bcd alone knows contact forces, lm no drag. */
static const struct {
    const char *name;
    unsigned scenes;
} methods[] = {{"bcd", 0x7ff}, {"elastic", 0x7bf}, {"strang", 0x7bf}, {"lm", 0x7af}};

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

/* ---------------------------------------------------------------------- teams */

static const struct {
    int rods;
    int64_t count;
} teams[] = {{1, 16}, {4, 2}, {10, 8}, {29, 4}, {64, 2}};

/* A job whose realizations are a chunk each, as if they were long. */
static struct bcd_scene *job_of_chunks(const char *method, int n, int64_t count)
{
    struct bcd_scene *scene = job_of(method, n, (int)count);
    scene->plan.per_chunk = 1;
    scene->plan.chunks = count;
    return scene;
}

static struct bcd_team *team_create(const struct bcd_scene *scene, int64_t count)
{
    struct bcd_team *team = NULL;
    const struct bcd_team_wanted wanted = {.scene = scene, .count = count};
    assert_true(bcd_scene_team(scene) >= count);
    assert_int_equal(bcd_team_create(&team, &wanted, NULL), BCD_OK);
    assert_int_equal(bcd_team_count(team), count);
    return team;
}

static void team_advance(struct bcd_team *team, int64_t ticks, int64_t slice)
{
    int64_t done = bcd_team_ticks_done(team), total = bcd_team_ticks_total(team);
    int64_t end = ticks < total - done ? done + ticks : total;
    while (done < end) {
        int64_t go = slice < end - done ? slice : end - done;
        assert_int_equal(bcd_team_advance(team, go, NULL), BCD_OK);
        int64_t now = bcd_team_ticks_done(team);
        assert_in_range(now, done + go, done + go + bcd_team_count(team) - 1);
        done = now;
    }
}

/* All runs of the team have ended as each does alone. */
static void check_tallies(const struct bcd_team *team, const struct bcd_scene *scene)
{
    for (int64_t i = 0; i < bcd_team_count(team); i++) {
        struct bcd_run *alone = NULL;
        assert_int_equal(bcd_run_create(&alone, scene, i, NULL), BCD_OK);
        void *expected = finish(alone, 1000000);
        const struct bcd_tally *tally = bcd_run_tally(bcd_team_run(team, i));
        void *bytes = malloc(bcd_tally_size(tally));
        assert_non_null(bytes);
        bcd_tally_save(tally, bytes);
        assert_memory_equal(bytes, expected, bcd_tally_size(tally));
        free(bytes);
        free(expected);
        bcd_run_free(alone);
    }
}

static void test_teams(void **state)
{
    (void)state;
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
        for (size_t t = 0; t < sizeof teams / sizeof *teams; t++)
            for (int64_t slice = 1; slice < 1000000; slice = 30 * slice + 7) {
                struct bcd_scene *scene =
                    job_of_chunks(methods[m].name, teams[t].rods, teams[t].count);
                struct bcd_team *team = team_create(scene, teams[t].count);
                team_advance(team, INT64_MAX / 2, slice);
                check_tallies(team, scene);
                bcd_team_free(team);
                bcd_scene_free(scene);
            }
}

/* Copies the run `index` of a team as a checkpoint. */
static void restore(struct bcd_run *to, const struct bcd_run *from)
{
    size_t size = bcd_run_checkpoint_size(from);
    void *bytes = malloc(size);
    assert_non_null(bytes);
    bcd_run_save(from, bytes);
    assert_int_equal(bcd_run_restore(to, bytes, size, NULL), BCD_OK);
    free(bytes);
}

/* Checkpoints of a team at any time, first pass or second, go on in another one and alone; and in
 * one that has lost some of them. */
static void test_team_checkpoints(void **state)
{
    (void)state;
    static const int64_t at[] = {9, 70, 131, 140}; /* of 131 + 65 ticks of each */
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
        for (size_t t = 0; t < sizeof teams / sizeof *teams; t++)
            for (size_t a = 0; a < sizeof at / sizeof *at; a++) {
                const int64_t count = teams[t].count;
                struct bcd_scene *scene = job_of_chunks(methods[m].name, teams[t].rods, count);
                struct bcd_team *before = team_create(scene, count),
                                *after = team_create(scene, count);
                struct bcd_run *alone = NULL;
                assert_int_equal(bcd_run_create(&alone, scene, 1, NULL), BCD_OK);
                team_advance(before, at[a] * count, 17);
                restore(alone, bcd_team_run(before, 1));
                for (int64_t i = 0; i < count; i++)
                    if (i % 3 != 2)
                        restore(bcd_team_run(after, i), bcd_team_run(before, i));
                team_advance(before, 5, 1); /* goes its own way */
                team_advance(after, INT64_MAX / 2, 23);
                check_tallies(after, scene);
                void *bytes = finish(alone, 1000000);
                void *last = finish(bcd_team_run(after, 1), 1);
                assert_memory_equal(bytes, last, bcd_tally_size(bcd_run_tally(alone)));
                free(bytes);
                free(last);
                bcd_run_free(alone);
                bcd_team_free(before);
                bcd_team_free(after);
                bcd_scene_free(scene);
            }
}

/* Who goes together: realizations of small rings that have chunks of their own. */
static void test_team_sizes(void **state)
{
    (void)state;
    static const struct {
        const char *rings;
        int64_t realizations;
        double time;
        int64_t expected;
    } cases[] = {
        {"'particles': 10, 'length': 20", 40, 500, 8},
        {"'particles': 8, 'length': 20", 40, 500, 16},
        {"'particles': 10, 'length': 20", 7, 500, 4},
        {"'particles': 100, 'length': 200", 40, 500, 1},
        {"'particles': 10, 'length': 20", 1, 500, 1},
        {"'particles': 10, 'length': 20", 40, 1, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct bcd_scene *scene =
            experiment_scene("{%s, 'diameter': 0.5, 'time_step': 1e-3, 'time': %g, "
                             "'realizations': %d, 'method': 'bcd', 'observables': {'energy': {}}, "
                             "'potential': {'type': 'cosine', 'amplitude': 6}}",
                             cases[i].rings, cases[i].time, (int)cases[i].realizations);
        assert_int_equal(bcd_scene_team(scene), cases[i].expected);
        bcd_scene_free(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_lane_alone),
        cmocka_unit_test(test_runs),
        cmocka_unit_test(test_slices),
        cmocka_unit_test(test_teams),
        cmocka_unit_test(test_team_checkpoints),
        cmocka_unit_test(test_team_sizes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
