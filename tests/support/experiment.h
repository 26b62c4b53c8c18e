/* SPDX-License-Identifier: GPL-3.0-or-later
 * experiment.h - a job in JSON run to its end in the test's own thread. Every function fails the
 * running test itself when something goes wrong, printing the job's faults. */
#ifndef EXPERIMENT_H
#define EXPERIMENT_H

#include "bcd.h"

struct experiment {
    struct bcd_scene *scene;
    struct bcd_tally *tally;
    struct bcd_theory *theory;
};

/* Parses (printf-style JSON, single quotes stand for double ones) and completes a scene. */
struct bcd_scene *experiment_scene(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Runs every chunk, in slices of `slice` ticks (0 = whole), and merges in order. */
struct experiment experiment_run(struct bcd_scene *scene, int64_t slice);
void experiment_end(struct experiment *experiment);

/* One observable's table; to be freed with bcd_table_free. */
struct bcd_table *experiment_table(const struct experiment *experiment, const char *observable);

/* A number of the completed scene's facts. */
double experiment_fact(const struct bcd_scene *scene, const char *name);

/* Values of a column. */
const double *column_of(const struct bcd_table *table, enum bcd_role role);

/* Fails unless |value - expected| <= sigmas * error + slack; prints all of it when it fails. */
void assert_within(double value, double expected, double error, double sigmas, double slack);

#endif
