/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_report_force.h - Fig. 5 of the 2022 paper (doi 10.1103/PhysRevE.106.054606): the attraction
 * of sticky rods (its Eq. 32) against the gap for several exponents p, and its largest value
 * against p, for gamma .1, 1 and 10 at eps = .05. Computed from the engine's own force, not
 * simulated.
 *
 * UNITS  wavelength and kT are 1.
 */
#ifndef CLI_REPORT_FORCE_H
#define CLI_REPORT_FORCE_H

#include "bcd.h"

#define FORCE_NAME "2022-fig5"
enum { FORCE_GAMMAS = 3, FORCE_EXPONENTS = 5 };

struct force_figure {
    struct bcd_table *force;   /* gap and attraction, series of p within series of gamma */
    struct bcd_table *largest; /* p and the largest attraction, series of gamma */
    double gamma[FORCE_GAMMAS], best[FORCE_GAMMAS]; /* the exponent of the least largest force */
    double least[FORCE_GAMMAS];                     /* and that force */
};

/* false = out of memory, or the engine refuses such rods (with words on stderr). */
bool force_figure_init(struct force_figure *figure);
void force_figure_fini(struct force_figure *figure);

/* The picture; malloc'ed, NULL = out of memory. */
char *force_figure_print(const struct force_figure *figure);

#endif
