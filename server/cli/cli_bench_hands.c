/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli_bench_hands.h"
#include "bcd.h"
#include "crew.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <time.h>

enum { TURNS = 11 };
static const double turn_rod_steps = 1.2e7; /* about a tenth of a second */

static double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

struct helper {
    struct crew *crew;
    atomic_bool over;
};

static bool is_over(void *context)
{
    return atomic_load(&((struct helper *)context)->over);
}

static void *help(void *context)
{
    struct helper *helper = context;
    while (!is_over(helper))
        if (!crew_help(helper->crew, is_over, helper))
            sched_yield();
    return NULL;
}

static bool take_turns(struct bcd_run *run, const struct bcd_hands *hands, double particles,
                       struct bench_hands *result)
{
    double ns[2][TURNS], gain[TURNS];
    const int64_t ticks = (int64_t)(turn_rod_steps / particles) + 2;
    bool good = bench_advance_run(run, 2 * ticks); /* warm */
    for (int i = 0; good && i < TURNS; i++) {
        for (int k = 0; good && k < 2; k++) {
            bcd_run_lend_hands(run, k ? hands : NULL);
            good = bench_advance_run(run, 1); /* to where its memory is now at home */
            double before = seconds_now();
            good = good && bench_advance_run(run, ticks);
            ns[k][i] = 1e9 * (seconds_now() - before) / (double)ticks / particles;
        }
        gain[i] = ns[0][i] / ns[1][i];
    }
    for (int k = 0; good && k < 2; k++)
        result->ns[k] = bench_median(ns[k], TURNS);
    result->speedup = good ? bench_median(gain, TURNS) : 0;
    return good;
}

enum bench_outcome bench_hands_measure(const struct bench_case *which, struct bench_hands *result)
{
    struct bcd_scene *scene = bench_step_scene(which);
    struct helper helper = {.crew = crew_create(1)};
    struct crew_lead *lead = crew_lead(helper.crew, "", 0);
    struct bcd_run *run = NULL;
    pthread_t thread;
    bool good = scene && lead && bcd_run_create(&run, scene, 0, NULL) == BCD_OK &&
                pthread_create(&thread, NULL, help, &helper) == 0;
    if (good) {
        while (crew_helpers(helper.crew) == 0)
            sched_yield();
        good = take_turns(run, crew_hands(lead), (double)which->particles, result);
        atomic_store(&helper.over, true);
        pthread_join(thread, NULL);
    }
    crew_end(lead);
    crew_free(helper.crew);
    bcd_run_free(run);
    bcd_scene_free(scene);
    return good ? BENCH_DONE : BENCH_FAILED;
}
