/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_report_msd.h - Fig. 7 of the 2024 paper (doi 10.1016/j.cpc.2024.109474): mean squared
 * displacements of sticky rods in a cosine potential, all stickinesses of one diameter in one
 * panel, and what is said of them: the plateau within a well, the law t^(1/2), the order of the
 * curves.
 */
#ifndef CLI_REPORT_MSD_H
#define CLI_REPORT_MSD_H

#include "bcd.h"
#include "cli_report_scenes.h"

struct msd_curve {
    const struct report_scene *scene;
    const struct bcd_table *table;
};

/* The picture of curves that stand diameter by diameter, stickiness rising; malloc'ed, NULL =
 * out of memory. */
char *msd_figure_print(const struct msd_curve *curves, size_t count, const char *title,
                       const char *subtitle);

/* The verdicts in words, a line for each curve and one for each pair of curves at an early and a
 * late lag; malloc'ed, NULL = out of memory. */
char *msd_verdict_print(const struct msd_curve *curves, size_t count);

#endif
