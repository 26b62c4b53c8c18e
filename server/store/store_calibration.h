/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_calibration.h - how much longer than nominal runs take on this machine. See store.h for
 * threads, errors and memory.
 */
#ifndef STORE_CALIBRATION_H
#define STORE_CALIBRATION_H

#include "store.h"

enum { CALIBRATION_NAME_SIZE = 32 };

struct calibration_row {
    char method[CALIBRATION_NAME_SIZE]; /* "" = the machine as such */
    double factor;                      /* real over nominal time, > 0 */
    double seconds;                     /* core seconds it was measured on */
};

/* At most `room` rows; *count tells how many there are. */
enum store_status store_calibration_load(struct store *store, struct calibration_row *rows,
                                         size_t room, size_t *count);
enum store_status store_calibration_save(struct store *store, const struct calibration_row *rows,
                                         size_t count);

#endif
