/* SPDX-License-Identifier: GPL-3.0-or-later
 * status.h - filling in errors (bcd.h). */
#ifndef STATUS_H
#define STATUS_H

#include "bcd.h"

/* Fills the optional error and returns its code, so that a failure is one statement. */
enum bcd_status error_set(struct bcd_error *error, enum bcd_status code, const char *field,
                          const char *format, ...) __attribute__((format(printf, 4, 5)));

/* A fault of ours, and no job's: the list then says BCD_NO_MEMORY as a whole. */
void errors_no_memory(struct bcd_errors *errors, const char *field);
/* What a list of faults comes to. */
enum bcd_status errors_status(const struct bcd_errors *errors);

#endif
