/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sweep_make.h - the jobs of a sweep, checked and made while those before them are being kept. If
 * one turns out to be none, nothing may be kept.
 *
 * THREADS  Large sweeps are made by two threads of their own, a bounded number of points ahead of
 *          the one that takes them; they end before sweep_make_free returns, and take no lock but
 *          those of this file and the calibration.
 */
#ifndef SWEEP_MAKE_H
#define SWEEP_MAKE_H

#include "queue.h"
#include "store_sweeps.h"
#include "sweep_json.h"

struct sweep_make;

/* Begins with the new points of a sweep, which is borrowed. Small sweeps are made when it returns,
 * of others the first points. Core seconds are those of this machine, as calibrated; a theory that
 * points share counts once, more or less. NULL = no memory. */
struct sweep_make *sweep_make_create(const struct sweep *sweep, struct queue *queue,
                                     const char *owner);
void sweep_make_free(struct sweep_make *make);

/* The points in order, to be taken once. It refuses (STORE_CONFLICT) when one cannot be made; its
 * hash is what makes a sweep the same: SHA-256 of owner, pointers and all jobs in order. */
const struct sweep_source *sweep_make_source(const struct sweep_make *make);

/* BCD_OK as long as nothing is wrong; else what sweep_faults tells of all points. */
enum bcd_status sweep_make_check(struct sweep_make *make, struct bcd_errors *errors);

#endif
