/* SPDX-License-Identifier: GPL-3.0-or-later
 * reference.h - exact values beside measured ones: struct bcd_theory from the inside. */
#ifndef REFERENCE_H
#define REFERENCE_H

#include "scene.h"

struct bcd_theory {
    struct theory_result *canonical, *infinite; /* NULL = there is none */
    char why_not[160], why_not_infinite[160];
    enum bcd_theory_scope scope;
    struct bcd_watch *watch; /* the caller's, or own */
    struct bcd_watch own;
    bool cut_short;
    double seconds;
};

/* Adds the column "theory" for the index-th observable: exact values, or why there are none, with
 * the note "reference". theory may be NULL: nobody asked for it. */
enum bcd_status reference_add(struct bcd_table *table, const struct bcd_theory *theory,
                              const struct bcd_scene *scene, size_t index);

/* Adds the column "z", (value - theory) / stderr, made normal from Student's t with samples[i] - 1
 * degrees of freedom, and the notes chi_square, degrees_of_freedom and p_value over all rows that
 * have one. Needs the columns value, stderr and theory; adds nothing where one is absent. */
enum bcd_status reference_compare(struct bcd_table *table, const double *samples);

#endif
