/* SPDX-License-Identifier: GPL-3.0-or-later
 * A large ring that several hands work at (sharing.h) has the same bits as one that goes alone, for
 * every method, whoever does which part and when: by real threads of a crew (crew.h), and by one
 * that does the parts in an order of its own. */
#include "crew.h"
#include "run.h"
#include "scene.h"
#include "sharing.h"
#include "support/experiment.h"

#include <pthread.h>
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define COSINE "'potential': {'type': 'cosine', 'amplitude': 6}, "
#define PROFILE "'observables': {'density': {}}"

/* Steps in which rods meet, and rings can be cut all the same; but for the third scene, in which
 * noise carries rods past thousands of others, and methods that do not let noise alone. */
static const struct {
    const char *words;
    double room; /* length of the ring, per rod */
    double step;
} scenes[] = {
    {"'diameter': 0.5, " COSINE PROFILE, 2, 1e-3},
    {"'diameter': 0.99, " COSINE PROFILE, 1, 1e-4},
    {"'diameter': 0.99999, " COSINE PROFILE, 1, 1e-4},
    {"'diameter': 0.9, 'initial': 'lattice', " PROFILE, 1, 1e-4},
    {"'diameter': 0.5, 'boundary': 'walls', " COSINE PROFILE, 1, 1e-3},
    {"'diameter': 0.9, 'force': 2, 'potential': {'type': 'cosine', 'amplitude': 3, 'velocity': "
     "0.7}, " PROFILE,
     1, 1e-3},
    {"'diameter': 0.5, " COSINE
     "'interaction': {'type': 'sticky', 'strength': 0.2, 'range': 0.1}, " PROFILE,
     1, 1e-4},
    {"'diameter': 0.5, 'boundary': 'walls', 'interaction': {'type': 'sticky', 'strength': 0.2, "
     "'range': 0.1}, " PROFILE,
     1, 1e-4},
    {"'diameter': 0.5, " COSINE
     "'interaction': {'type': 'yukawa', 'strength': 1, 'screening': 2, 'cutoff': 2}, " PROFILE,
     1, 1e-4},
    {"'diameter': 0.95, " COSINE "'observables': {'contact_force': {}}", 1, 1e-4},
    {"'diameter': 0.8, 'potential': {'type': 'fourier', 'cosine': [2, 0.3], 'sine': [0, "
     "0.5]}, " PROFILE,
     1, 1e-4},
    {"'diameter': 0.7, 'potential': {'type': 'table', 'period': 0.5, 'values': [1, 0.2, -1, "
     "-0.1]}, " PROFILE,
     1, 1e-4},
    {"'diameter': 0.6, 'potential': {'type': 'expression', 'energy': "
     "'2*cos(2*pi*x)+exp(sin(4*pi*x))', 'period': 1}, " PROFILE,
     1, 1e-4},
    {"'diameter': 0.5, 'temperature': 0, " COSINE PROFILE, 1, 1e-4},
    {"'diameter': 0.5, 'interaction': {'type': 'sticky', 'strength': 0.2, 'range': 0}, " COSINE
         PROFILE,
     1, 1e-4},
};

enum { SHARING_METHODS = 4 }; /* all but these share no more than some of a step, or nothing */

/* Which of the scenes each runs. */
static const struct {
    const char *name;
    unsigned scenes;
    unsigned cut; /* and in which of these it cuts the ring to pool rods */
} methods[] = {
    {"bcd", 0x3fff, 0x3ffb},
    {"elastic", 0x1dff, 0},
    {"lm", 0x1ddf, 0},
    {"strang", 0x3dff, 0x3df7},
    {"strang_bonds", 0x4000, 0},
    {"strating", 0x1, 0},
    {"tao", 0x1, 0},
    {"metropolis", 0x1, 0},
    {"bcd_premerging", 0x1, 0},
};

/* --------------------------------------------------------------------- hands */

/* One thread, which does the parts in an order of its own. */
static int one_hand(void *context)
{
    (void)context;
    return 1;
}

static void share_out_of_order(void *context, bcd_part part, void *of, int64_t parts)
{
    int64_t *calls = context, from = (*calls)++;
    for (int64_t i = 0; i < parts; i++)
        part(of, from % 2 == 0 ? parts - 1 - i : (from + i) % parts);
}

/* `count` helpers that stay until told to go. */
struct helpers {
    struct crew *crew;
    struct crew_lead *lead;
    pthread_t thread[8];
    int count;
    atomic_bool over;
};

static bool is_over(void *context)
{
    return atomic_load(&((struct helpers *)context)->over);
}

static void *help(void *context)
{
    struct helpers *helpers = context;
    while (!is_over(helpers))
        if (!crew_help(helpers->crew, is_over, helpers))
            sched_yield();
    return NULL;
}

static const struct bcd_hands *helpers_start(struct helpers *helpers, int count)
{
    *helpers = (struct helpers){.crew = crew_create(1), .count = count};
    assert_non_null(helpers->crew);
    helpers->lead = crew_lead(helpers->crew, "", 0);
    assert_non_null(helpers->lead);
    for (int i = 0; i < count; i++)
        assert_int_equal(pthread_create(&helpers->thread[i], NULL, help, helpers), 0);
    const struct bcd_hands *hands = crew_hands(helpers->lead);
    while (hands->count(hands->context) < count)
        sched_yield();
    return hands;
}

static void helpers_end(struct helpers *helpers)
{
    atomic_store(&helpers->over, true);
    for (int i = 0; i < helpers->count; i++)
        pthread_join(helpers->thread[i], NULL);
    assert_true(crew_helped_ns(helpers->lead) >= 0);
    crew_end(helpers->lead);
    crew_free(helpers->crew);
}

/* ----------------------------------------------------------------------- runs */

enum { RODS = 4 * SHARING_RODS + 100, STEPS = 12 };

static struct bcd_scene *job_of(size_t method, size_t scene)
{
    return experiment_scene(
        "{'particles': %d, 'length': %.17g, 'time_step': %g, 'time': %.17g, 'sample_every': %.17g, "
        "'stability': 'ignored', 'method': '%s', %s}",
        RODS, scenes[scene].room * RODS, scenes[scene].step, STEPS * scenes[scene].step,
        4 * scenes[scene].step, methods[method].name, scenes[scene].words);
}

/* Everything that is known of a run at its end: its rods, and its tally. */
struct end {
    char *bytes;
    size_t size;
};

static struct end finish(struct bcd_run *run, bool *cut)
{
    while (bcd_run_ticks_done(run) < bcd_run_ticks_total(run)) {
        assert_int_equal(bcd_run_advance(run, 5, NULL), BCD_OK);
        if (run_sim(run)->pieces->end > 0 && run_sim(run)->pieces->end < RODS)
            *cut = true;
    }
    struct end end = {.size = bcd_run_checkpoint_size(run)};
    end.bytes = malloc(end.size);
    assert_non_null(end.bytes);
    bcd_run_save(run, end.bytes);
    return end;
}

static void check(const struct bcd_scene *scene, const struct bcd_hands *hands,
                  const struct end *expected, bool *cut)
{
    struct bcd_run *run = NULL;
    assert_true(bcd_scene_takes_hands(scene));
    assert_int_equal(bcd_run_create(&run, scene, 0, NULL), BCD_OK);
    memset(run_sim(run)->pieces, 0, sizeof *run_sim(run)->pieces);
    bcd_run_lend_hands(run, hands);
    struct end end = finish(run, cut);
    assert_int_equal(end.size, expected->size);
    assert_memory_equal(end.bytes, expected->bytes, end.size);
    free(end.bytes);
    bcd_run_free(run);
}

static void for_all(void (*each)(size_t method, size_t scene))
{
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
        for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++)
            if (methods[m].scenes >> s & 1)
                each(m, s);
}

static struct end alone(const struct bcd_scene *scene)
{
    struct bcd_run *run = NULL;
    bool cut = false;
    assert_int_equal(bcd_run_create(&run, scene, 0, NULL), BCD_OK);
    memset(run_sim(run)->pieces, 0, sizeof *run_sim(run)->pieces);
    struct end end = finish(run, &cut);
    assert_false(cut);
    bcd_run_free(run);
    return end;
}

static void out_of_order(size_t method, size_t index)
{
    struct bcd_scene *scene = job_of(method, index);
    struct end expected = alone(scene);
    int64_t calls = 0;
    bool cut = false;
    const struct bcd_hands hands = {one_hand, share_out_of_order, &calls};
    check(scene, &hands, &expected, &cut);
    if (method < SHARING_METHODS) {
        assert_true(calls > 0);
        assert_int_equal(cut, methods[method].cut >> index & 1);
    }
    free(expected.bytes);
    bcd_scene_free(scene);
}

static void test_any_order(void **state)
{
    (void)state;
    for_all(out_of_order);
}

static void by_threads(size_t method, size_t index)
{
    static const int counts[] = {1, 2, 6};
    struct bcd_scene *scene = job_of(method, index);
    struct end expected = alone(scene);
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        struct helpers helpers;
        bool cut = false;
        check(scene, helpers_start(&helpers, counts[i]), &expected, &cut);
        helpers_end(&helpers);
    }
    free(expected.bytes);
    bcd_scene_free(scene);
}

static void test_threads(void **state)
{
    (void)state;
    for_all(by_threads);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_any_order),
        cmocka_unit_test(test_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
