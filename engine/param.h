/* SPDX-License-Identifier: GPL-3.0-or-later
 * param.h - parameter groups beyond what bcd.h shows: making them and filling in defaults. */
#ifndef PARAM_H
#define PARAM_H

#include "bcd.h"

/* Sets every row to its fallback (required ones stay as they are until given). */
void group_init(struct bcd_group *group, const struct bcd_param *rows, void *values,
                const char *pointer, const char *type);

/* Frees the values and the lists and texts in them. */
void group_free(struct bcd_group *group);

/* Of two groups: is every value the same, bit for bit, and what is hashed of them. Values that no
 * row describes do not count. */
bool group_equal(const struct bcd_group *a, const struct bcd_group *b);
uint64_t group_hash(const struct bcd_group *group);

/* A fault for each required row that was not given. */
void group_check_required(const struct bcd_group *group, struct bcd_errors *errors);

/* A fault about one row of the group: the field is the group's pointer and the row's name. */
void group_fault(const struct bcd_group *group, const char *row, struct bcd_errors *errors,
                 const char *format, ...) __attribute__((format(printf, 4, 5)));
/* There was no memory for its value. */
void group_no_memory(const struct bcd_group *group, const char *row, struct bcd_errors *errors);

#endif
