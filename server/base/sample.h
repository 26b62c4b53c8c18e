/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sample.h - a job that asks for every observable of the catalogue, never run: what its facts and
 * tables are called is known before there is any job.
 */
#ifndef SAMPLE_H
#define SAMPLE_H

#include "bcd.h"

struct sample {
    struct bcd_scene *scene;
    struct bcd_tally *tally;
};

/* Small; takes milliseconds. False = out of memory, or an observable that cannot be had (a
 * mistake of ours). */
bool sample_init(struct sample *sample);
void sample_fini(struct sample *sample);

/* The empty table of the index-th observable of the catalogue; NULL past the last, or out of
 * memory. Ended by bcd_table_free. */
struct bcd_table *sample_table(const struct sample *sample, size_t index);

#endif
