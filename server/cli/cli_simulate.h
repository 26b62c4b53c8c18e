/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_simulate.h - a scene run to its end on threads of this process, with a progress bar, for the
 * subcommands that simulate. The tally is that of the service, bit for bit, whatever the number of
 * workers.
 */
#ifndef CLI_SIMULATE_H
#define CLI_SIMULATE_H

#include "bcd.h"

struct cli_simulation {
    const struct bcd_scene *scene;
    int64_t workers;   /* threads, 1 or more */
    bool quiet;        /* no progress bar; there is none either unless stderr is a terminal */
    const char *label; /* goes before the bar; NULL = nothing */
    /* Results. */
    struct bcd_tally *tally;    /* the caller's; NULL unless all went well */
    struct bcd_verdict verdict; /* about it: why there are no more realizations */
    double core_seconds;        /* processor time of all threads together */
};

/* Runs all chunks, or as many as the job's target takes. CLI_OK; otherwise words on stderr and
 * CLI_FAILED, or CLI_SIGNAL + the number of the signal (Ctrl-C) that ended it. */
int cli_simulate(struct cli_simulation *simulation);

/* Cores that this process may use. */
int64_t cli_cores(void);

#endif
