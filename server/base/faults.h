/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * faults.h - lists of faults (struct bcd_errors) in which one may be ours: a job is not to be
 * called wrong for want of memory.
 */
#ifndef FAULTS_H
#define FAULTS_H

#include "bcd.h"

/* There was no memory to read what stands there: a fault with that code. */
void faults_no_memory(struct bcd_errors *errors, const char *field);

/* What the list comes to: BCD_OK, BCD_INVALID, or BCD_NO_MEMORY if one of them is that. */
enum bcd_status faults_status(const struct bcd_errors *errors);

#endif
