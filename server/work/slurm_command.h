/* SPDX-License-Identifier: GPL-3.0-or-later
 * slurm_command.h - one of Slurm's programs, run with a time limit. No shell: it is started with
 * its arguments. */
#ifndef SLURM_COMMAND_H
#define SLURM_COMMAND_H

#include <stdatomic.h>
#include <stdint.h>

/* The answer may be as long as that, the rest is cut off. */
enum { SLURM_ANSWER_BYTES_MAX = 16 << 20 };

struct slurm_command {
    const char *const *arguments; /* the program first, NULL last */
    const char *in;               /* what it reads */
    int64_t most_ms;              /* then it is killed, and what it started */
    const atomic_bool *stopping;  /* or when this becomes true */
};

/* What it wrote to stdout (malloc'ed) if it ended with status 0 in time; else NULL, with the
 * status, or -1 - errno if it was not started, -1 if it was killed. Blocks. */
char *slurm_command_run(const struct slurm_command *command, int *status);

#endif
