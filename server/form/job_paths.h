/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * job_paths.h - every scalar that jobs can be found and sorted by, as dotted paths.
 */
#ifndef JOB_PATHS_H
#define JOB_PATHS_H

#include <stdbool.h>
#include <stddef.h>

enum { JOB_PATH_SIZE = 128 };
struct job_paths {
    size_t count, room;
    char (*path)[JOB_PATH_SIZE];
    bool failed; /* out of memory */
};

/* Parameters of the catalogue ("potential.amplitude"), "derived.NAME", "results.OBSERVABLE.NAME",
 * and what a record says of itself ("owner", "submitted_at"). Takes milliseconds. Jobs may have
 * more facts and results than these: warnings, comparisons with theory. */
void job_paths_init(struct job_paths *paths);
void job_paths_fini(struct job_paths *paths);

/* Whether a path is a parameter, or of the record: told at once. */
bool job_path_is_plain(const char *path);

#endif
