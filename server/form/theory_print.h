/* SPDX-License-Identifier: GPL-3.0-or-later
 * theory_print.h - the exact references of a job as one JSON document: a table for each observable
 * asked for and "equilibrium", numbers about the whole. What `bcd theory` and POST /v1/theory
 * say. */
#ifndef THEORY_PRINT_H
#define THEORY_PRINT_H

#include "bcd.h"

/* *text is malloc'ed. theory: of scope BCD_THEORY_INFINITE; closed forms take up to seconds.
 * BCD_NO_MEMORY, or BCD_STOPPED by the theory's watch. */
enum bcd_status theory_print(const struct bcd_theory *theory, const struct bcd_scene *scene,
                             char **text);

#endif
