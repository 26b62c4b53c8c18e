/* SPDX-License-Identifier: GPL-3.0-or-later
 * counts.h - the memory of observables that count into bins: what density, contact_density,
 * pair_distribution and cluster_sizes have in common. */
#ifndef COUNTS_H
#define COUNTS_H

#include "part.h"

#include <math.h>
#include <string.h>

/* The block in progress. */
struct counts {
    int64_t samples; /* what the counts are divided by */
    int64_t bin[];   /* [observer->count] */
};

static inline size_t counts_memory(size_t bins)
{
    return sizeof(struct counts) + bins * sizeof(int64_t);
}

/* observable_type.begin */
static inline void counts_begin(struct observer *o, const struct sim *sim)
{
    (void)sim;
    memset(o->memory, 0, counts_memory(o->count));
}

/* values[i] = unit * bin[i] / samples, NaN without samples; the next block begins. */
static inline void counts_end_block(struct observer *o, double unit, double *values)
{
    const struct counts *counts = o->memory;
    for (size_t i = 0; i < o->count; i++)
        values[i] = counts->samples
                        ? (double)counts->bin[i] * (unit / (double)counts->samples)
                        : NAN;
    counts_begin(o, NULL);
}

#endif
