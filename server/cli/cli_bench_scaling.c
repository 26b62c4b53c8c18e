/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli_bench_scaling.h"
#include "cli.h"
#include "cli_bench_step.h"
#include "cli_simulate.h"
#include "scene_json.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { RODS = 1000, REALIZATIONS = 64, TURNS = 3 };

static struct bcd_scene *make(void)
{
    const struct bench_case which = {"sparse", "bcd", RODS, 1};
    char *members = bench_scene_members(&which);
    struct text job = {0};
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    text_add(&job,
             "%s,\"time\":0.4,\"realizations\":%d,\"observables\":{\"density\":{\"bins\":50}}}",
             members ? members : "", REALIZATIONS);
    char *text = text_take(&job);
    if (members && text && scene_json_parse(text, strlen(text), &scene, &errors) != BCD_OK)
        scene = NULL;
    free(members);
    free(text);
    return scene;
}

static double seconds_of(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Seconds that all cores together were busy since the machine started; NaN = unknown. */
static double busy_seconds(void)
{
    double user = NAN, nice, system, idle, wait, irq = 0, soft = 0, steal = 0;
    FILE *file = fopen("/proc/stat", "r");
    if (file && fscanf(file, "cpu %lf %lf %lf %lf %lf %lf %lf %lf", &user, &nice, &system, &idle,
                       &wait, &irq, &soft, &steal) == 8)
        user = (user + nice + system + irq + soft + steal) / (double)sysconf(_SC_CLK_TCK);
    if (file)
        fclose(file);
    return user;
}

/* The job once: wall clock, processor time and what others used. */
struct turn {
    double seconds, core_seconds, others;
};

static bool simulate(const struct bcd_scene *scene, int64_t workers, double *core_seconds)
{
    struct cli_simulation simulation = {.scene = scene, .workers = workers, .quiet = true};
    bool good = cli_simulate(&simulation) == CLI_OK;
    bcd_tally_free(simulation.tally);
    *core_seconds = simulation.core_seconds;
    return good;
}

/* Two processes that know nothing of each other, the whole job on one worker in each. */
static bool simulate_apart(const struct bcd_scene *scene)
{
    pid_t children[2] = {-1, -1};
    bool good = true;
    fflush(NULL); /* or they would print it once more */
    for (int i = 0; i < 2; i++) {
        double core_seconds;
        children[i] = fork();
        if (children[i] == 0)
            _exit(simulate(scene, 1, &core_seconds) ? 0 : 1);
    }
    for (int i = 0; i < 2; i++) {
        int status = 1;
        good = children[i] > 0 && waitpid(children[i], &status, 0) == children[i] && status == 0 &&
               good;
    }
    return good;
}

/* Of this process and its children that have ended. */
static double own_seconds(void)
{
    struct rusage children = {0};
    getrusage(RUSAGE_CHILDREN, &children);
    return seconds_of(CLOCK_PROCESS_CPUTIME_ID) +
           (double)(children.ru_utime.tv_sec + children.ru_stime.tv_sec) +
           1e-6 * (double)(children.ru_utime.tv_usec + children.ru_stime.tv_usec);
}

static bool take_turn(const struct bcd_scene *scene, enum bench_way way, struct turn *turn)
{
    double wall = seconds_of(CLOCK_MONOTONIC), own = own_seconds(), busy = busy_seconds();
    bool good = way == BENCH_APART ? simulate_apart(scene)
                                   : simulate(scene, way == BENCH_ONE ? 1 : 2, &turn->core_seconds);
    own = own_seconds() - own;
    turn->seconds = seconds_of(CLOCK_MONOTONIC) - wall;
    if (way == BENCH_APART)
        turn->core_seconds = own;
    busy = busy_seconds() - busy - own;
    turn->others = busy < 0 ? 0 : busy / turn->seconds;
    return good;
}

enum bench_outcome bench_scaling_measure(struct bench_scaling *result)
{
    struct bcd_scene *scene = make();
    double seconds[BENCH_WAYS][TURNS], core[BENCH_WAYS][TURNS], gain[TURNS], machine[TURNS],
        share[TURNS];
    double others = 0; /* the most of all turns */
    bool good = scene != NULL;
    *result = (struct bench_scaling){.particles = RODS, .realizations = REALIZATIONS};
    result->chunks = scene ? bcd_scene_chunks(scene) : 0;
    for (int i = 0; good && i < TURNS; i++) {
        for (int way = 0; good && way < BENCH_WAYS; way++) {
            struct turn turn = {0};
            good = take_turn(scene, (enum bench_way)way, &turn);
            seconds[way][i] = turn.seconds;
            core[way][i] = turn.core_seconds;
            others = turn.others > others || isnan(turn.others) ? turn.others : others;
        }
        gain[i] = seconds[BENCH_ONE][i] / seconds[BENCH_TWO][i];
        machine[i] = 2 * seconds[BENCH_ONE][i] / seconds[BENCH_APART][i];
        share[i] = gain[i] / machine[i];
    }
    bcd_scene_free(scene);
    if (!good)
        return BENCH_FAILED;
    for (int way = 0; way < BENCH_WAYS; way++) {
        result->seconds[way] = bench_median(seconds[way], TURNS);
        result->core_seconds[way] = bench_median(core[way], TURNS);
    }
    result->others = others;
    result->speedup = bench_median(gain, TURNS);
    result->machine = bench_median(machine, TURNS);
    result->share = bench_median(share, TURNS);
    result->possible = 2 * result->core_seconds[BENCH_ONE] / result->core_seconds[BENCH_TWO];
    return BENCH_DONE;
}
