/* SPDX-License-Identifier: GPL-3.0-or-later
 * slurm_file.h - what the operator says about pilots; see slurm.h. */
#ifndef SLURM_FILE_H
#define SLURM_FILE_H

#include <stdbool.h>
#include <stddef.h>

enum { SLURM_TEXT_SIZE = 256, SLURM_PILOTS_MAX = 10000 };

struct slurm_file {
    long pilots, poll_s, idle_s; /* at most at a time; between two looks; idle pilots end */
    long timeout_s;              /* of each command */
    char command[SLURM_TEXT_SIZE], url[SLURM_TEXT_SIZE], token_file[SLURM_TEXT_SIZE];
    char bin[SLURM_TEXT_SIZE]; /* where sbatch and the others are; "" = in PATH */
    char name[SLURM_TEXT_SIZE], account[SLURM_TEXT_SIZE], partition[SLURM_TEXT_SIZE];
    char qos[SLURM_TEXT_SIZE], constraint[SLURM_TEXT_SIZE], time[SLURM_TEXT_SIZE];
    char memory[SLURM_TEXT_SIZE], modules[SLURM_TEXT_SIZE]; /* modules: with blanks between */
};

/* False with words in reason (file, line, what is wrong). Values hold no character that means
 * something to a shell. */
bool slurm_file_read(const char *path, struct slurm_file *file, char *reason, size_t size);

/* Whether a value has only such characters, and room. */
bool slurm_file_harmless(const char *value);

#endif
