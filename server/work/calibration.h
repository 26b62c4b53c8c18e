/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * calibration.h - what the engine's nominal run times are on this machine: a factor per method,
 * from chunks that were run; of a method that never ran, from a short look at how fast the machine
 * is. Other work on the machine is part of it: what counts is the time that a chunk takes here.
 *
 * THREADS  Any thread may call anything but create, load and free.
 */
#ifndef CALIBRATION_H
#define CALIBRATION_H

#include "bcd.h"
#include "store.h"

struct calibration;

/* The method that a completed scene is run with. */
const char *calibration_method(const struct bcd_scene *scene);

/* NULL = no memory. Until something is known the factor is 1. */
struct calibration *calibration_create(void);
void calibration_free(struct calibration *calibration);

/* What was known before; looks at the machine (some ms) when that was nothing. */
enum store_status calibration_load(struct calibration *calibration, struct store *store);

/* Looks at the machine: the factor of what is not known otherwise. */
void calibration_probe(struct calibration *calibration);

/* Keeps what has changed since the last time. */
enum store_status calibration_save(struct calibration *calibration, struct store *store);

/* `seconds` of a core were used for what is nominally `nominal` seconds of this method. */
void calibration_note(struct calibration *calibration, const char *method, double nominal,
                      double seconds);

/* The same of exact theory: its row in the place of a method's. */
#define CALIBRATION_THEORY "theory"

/* What a job needs (bcd_scene_estimate) with its theory, core seconds as this machine takes them;
 * without a calibration (NULL) nominal ones. */
void calibration_estimate(struct calibration *calibration, const struct bcd_scene *scene,
                          struct bcd_estimate *estimate);

/* Makes a nominal one that of this machine. */
void calibration_apply(struct calibration *calibration, const struct bcd_scene *scene,
                       struct bcd_estimate *estimate);

/* Real over nominal time; *measured_seconds (may be NULL) = core seconds this is known from. */
double calibration_factor(struct calibration *calibration, const char *method,
                          double *measured_seconds);

#endif
