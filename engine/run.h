/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * run.h - what run.c and team.c, both of which make realizations go side by side, know of each
 * other beyond bcd.h.
 */
#ifndef RUN_H
#define RUN_H

#include "sim.h"

/* How many of `count` realizations may go side by side: all that there is room for in the first
 * level cache, so far as there are so many; a power of two. */
int64_t run_lanes(const struct plan *plan, int64_t count);

/* The rods, borrowed. Whoever moves them keeps clock and the method's own memory in step. */
struct sim *run_sim(struct bcd_run *run);

/* What the method keeps in checkpoints. */
void *run_methods_own(const struct bcd_run *run, size_t *size);

/* Not finished, and not in a second pass. */
bool run_in_first_pass(const struct bcd_run *run);

/* The tick (of the realization) of whatever comes next. */
int64_t run_next_stop(const struct bcd_run *run);

/* Does what is due at that tick, once the run is there. */
enum bcd_status run_arrive(struct bcd_run *run, struct bcd_error *error);

#endif
