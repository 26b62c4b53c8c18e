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

/* One job on so many workers: wall clock, processor time and what others used. */
struct turn {
    double seconds, core_seconds, others;
};

static bool take_turn(const struct bcd_scene *scene, int64_t workers, struct turn *turn)
{
    struct cli_simulation simulation = {.scene = scene, .workers = workers, .quiet = true};
    double wall = seconds_of(CLOCK_MONOTONIC), own = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
    double busy = busy_seconds();
    if (cli_simulate(&simulation) != CLI_OK)
        return false;
    own = seconds_of(CLOCK_PROCESS_CPUTIME_ID) - own;
    turn->seconds = seconds_of(CLOCK_MONOTONIC) - wall;
    turn->core_seconds = simulation.core_seconds;
    busy = busy_seconds() - busy - own;
    turn->others = busy < 0 ? 0 : busy / turn->seconds;
    bcd_tally_free(simulation.tally);
    return true;
}

enum bench_outcome bench_scaling_measure(struct bench_scaling *result)
{
    struct bcd_scene *scene = make();
    double seconds[2][TURNS], core[2][TURNS], gain[TURNS];
    double others = 0; /* the most of all turns */
    bool good = scene != NULL;
    *result = (struct bench_scaling){.particles = RODS, .realizations = REALIZATIONS};
    result->chunks = scene ? bcd_scene_chunks(scene) : 0;
    for (int i = 0; good && i < TURNS; i++) {
        for (int k = 0; good && k < 2; k++) {
            struct turn turn = {0};
            good = take_turn(scene, k + 1, &turn);
            seconds[k][i] = turn.seconds;
            core[k][i] = turn.core_seconds;
            others = turn.others > others || isnan(turn.others) ? turn.others : others;
        }
        gain[i] = seconds[0][i] / seconds[1][i];
    }
    bcd_scene_free(scene);
    if (!good)
        return BENCH_FAILED;
    for (int k = 0; k < 2; k++) {
        result->seconds[k] = bench_median(seconds[k], TURNS);
        result->core_seconds[k] = bench_median(core[k], TURNS);
    }
    result->others = others;
    result->speedup = bench_median(gain, TURNS);
    result->possible = 2 * result->core_seconds[0] / result->core_seconds[1];
    return BENCH_DONE;
}
