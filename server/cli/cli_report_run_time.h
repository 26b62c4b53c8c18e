/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_report_run_time.h - after Fig. 6 of the 2024 paper (doi 10.1016/j.cpc.2024.109474): the run
 * time of a step against the number of rods, of the published forms of Brownian cluster dynamics,
 * O(N^2) as of 2022 (bcd_chronological) and O(N) as of 2024 (bcd_premerging), with bcd and strang
 * beside, for sparse and dense rods (cli_bench_step.h).
 *
 * UNITS  microseconds of one core of this machine per time step of all rods.
 */
#ifndef CLI_REPORT_RUN_TIME_H
#define CLI_REPORT_RUN_TIME_H

#include "bcd.h"

#define RUN_TIME_NAME "2024-fig6"
enum { RUN_TIME_SCENES = 2, RUN_TIME_METHODS = 4, RUN_TIME_SIZES = 9 };

struct run_time_figure {
    /* Rods and run time; sizes within methods within scenes. NaN = too slow to be measured. */
    struct bcd_table *table;
    double ratio_to_floor[RUN_TIME_SCENES][RUN_TIME_METHODS][RUN_TIME_SIZES];
};

/* Measures, about a minute, and prints a line per method. false = failed. */
bool run_time_figure_init(struct run_time_figure *figure);
void run_time_figure_fini(struct run_time_figure *figure);

/* The picture, and all its numbers as CSV; malloc'ed, NULL = out of memory. */
char *run_time_figure_print(const struct run_time_figure *figure);
char *run_time_figure_csv(const struct run_time_figure *figure);

#endif
