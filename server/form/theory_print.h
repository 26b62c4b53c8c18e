/* SPDX-License-Identifier: GPL-3.0-or-later
 * theory_print.h - the exact references of a job as one JSON document: a table for each observable
 * asked for and "equilibrium", numbers about the whole. What `bcd theory` and POST /v1/theory
 * say. */
#ifndef THEORY_PRINT_H
#define THEORY_PRINT_H

#include "bcd.h"

/* malloc'ed; NULL = out of memory. Takes up to seconds. */
char *theory_print(const struct bcd_scene *scene);

#endif
