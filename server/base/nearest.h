/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * nearest.h - the names that would have been right, for a fault: all of them, and the one that was
 * probably meant.
 */
#ifndef NEAREST_H
#define NEAREST_H

#include <stddef.h>

struct nearest {
    const char *name; /* like enough to be meant, or NULL; borrowed */
    size_t edits;
    char list[200]; /* "a, b, c", cut where it gets too long */
    size_t used;
};

/* A name that would have been right, instead of the given one (may be NULL). Starts from {0}. */
void nearest_know(struct nearest *nearest, const char *name, const char *given);

#endif
