/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * job_paths.h - every scalar that jobs can be found and sorted by, as dotted paths, and what its
 * values can be.
 */
#ifndef JOB_PATHS_H
#define JOB_PATHS_H

#include <stdbool.h>
#include <stddef.h>

/* What values can be, as a set. */
enum job_values {
    JOB_VALUES_NUMBER = 1,
    JOB_VALUES_MOMENT = 2, /* milliseconds since 1970, or ISO 8601 */
    JOB_VALUES_WORD = 4,   /* one of a few */
    JOB_VALUES_TEXT = 8,
    JOB_VALUES_OWNER = 16,
};

enum { JOB_PATH_SIZE = 128, JOB_WORDS_SIZE = 192 };
struct job_path {
    char name[JOB_PATH_SIZE];
    unsigned values;
    char words[JOB_WORDS_SIZE]; /* the few, with blanks between; "" = none */
};
struct job_paths {
    size_t count, room;
    struct job_path *path;
    bool failed; /* out of memory */
};

/* Parameters of the catalogue ("potential.amplitude"), "derived.NAME", "results.OBSERVABLE.NAME",
 * "outcome.NAME", and what a record says of itself ("owner", "submitted_at"); parts that share a
 * name have it several times. Takes milliseconds. Jobs may have more facts and results than these:
 * warnings, comparisons with theory. */
void job_paths_init(struct job_paths *paths);
void job_paths_fini(struct job_paths *paths);

/* What the values of a path can be, of all that have this name together; false = there is none. */
bool job_paths_find(const struct job_paths *paths, const char *name, struct job_path *found);

/* The same of all but "derived." and "results.", told at once. */
bool job_path_plain(const char *name, struct job_path *found);

#endif
