/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cluster_sizes - fraction of clusters that consist of 1, 2, 3, ... rods. Neighbours belong
 * together when their gap is at most `gap`; the default 0 asks for exact contact, as the method
 * keeps it. With noise exact contacts are partly an effect of the time step (they fade as sqrt h):
 * a small positive `gap` gives a measure that converges. A wall belongs to no cluster.
 */
#include "part.h"
#include "counts.h"
#include "table.h"

#include <math.h>

struct cluster_par {
    double gap;
    int64_t largest;
};

static const struct bcd_param cluster_params[] = {
    {.name = "gap",
     .type = BCD_PARAM_NUMBER,
     .unit = "length",
     .min = 0,
     .max = 1e12,
     .doc = "largest gap within a cluster; 0 = exact contact",
     .offset = offsetof(struct cluster_par, gap)},
    {.name = "largest",
     .type = BCD_PARAM_INTEGER,
     .min = 1,
     .max = 100000,
     .fallback = 1000,
     .doc = "the last size listed; larger clusters count as this one",
     .offset = offsetof(struct cluster_par, largest)},
    {0},
};

static size_t cluster_count(const void *par, const struct plan *plan)
{
    const struct cluster_par *p = par;
    return (size_t)(plan->particles < p->largest ? plan->particles : p->largest);
}

static size_t cluster_memory(const void *par, const struct plan *plan)
{
    return counts_memory(cluster_count(par, plan));
}

static double cluster_sample_ns(const void *par, const struct plan *plan)
{
    (void)par, (void)plan;
    return 2.5;
}

static void count_cluster(struct observer *o, int64_t size)
{
    struct counts *counts = o->memory;
    int64_t largest = (int64_t)o->count;
    counts->bin[(size < largest ? size : largest) - 1]++;
    counts->samples++;
}

/* Clusters are the stretches between open gaps; the one across the seam starts after the last. */
static void cluster_sample(struct observer *o, const struct sim *sim)
{
    const double *y = sim->seen;
    const double gap = ((const struct cluster_par *)o->par)->gap;
    int64_t n = o->plan->particles, size = 1, head = 0;
    for (int64_t i = 0; i + 1 < n; i++) {
        if (y[i + 1] - y[i] <= gap) {
            size++;
            continue;
        }
        if (head == 0)
            head = size; /* may continue across the seam: counted last */
        else
            count_cluster(o, size);
        size = 1;
    }
    bool seam_closed = !o->plan->walls && (y[0] + o->plan->free_length) - y[n - 1] <= gap;
    if (head == 0) { /* no open gap but perhaps the seam: one cluster of all rods */
        count_cluster(o, size);
    } else if (seam_closed) {
        count_cluster(o, head + size);
    } else {
        count_cluster(o, head);
        count_cluster(o, size);
    }
}

static void cluster_end_block(struct observer *o, const struct sim *sim, double *values)
{
    (void)sim;
    counts_end_block(o, 1, values);
}

static enum bcd_status cluster_describe(const void *par, const struct plan *plan,
                                        const struct moments *moments, struct bcd_table *table)
{
    size_t rows = moments ? cluster_count(par, plan) : 0;
    while (rows > 1 && !(moments->mean[rows - 1] > 0))
        rows--; /* sizes that never occurred */
    table_describe(table, "cluster_sizes", rows);
    table_axes(table, "cluster size (rods)", "fraction of clusters");
    table->log_y = true;
    double *size = table_add(table, "size", BCD_ROLE_X);
    if (!size)
        return BCD_NO_MEMORY;
    for (size_t i = 0; i < rows; i++)
        size[i] = (double)(i + 1);
    return BCD_OK;
}

static enum bcd_status cluster_extend(const void *par, const struct plan *plan,
                                      struct bcd_table *table)
{
    const struct cluster_par *p = par;
    table_note_number(table, "gap", p->gap);
    if (plan->particles > p->largest)
        table_note_number(table, "largest", (double)p->largest);
    return BCD_OK;
}

const struct observable_type observable_cluster_sizes = {
    .base = {.part = {.name = "cluster_sizes",
                      .doc = "fraction of clusters by number of rods",
                      .params = cluster_params},
             .par_size = sizeof(struct cluster_par)},
    .sample_ns = cluster_sample_ns,
    .value = "fraction",
    .at_contact = true,
    .one_view = true, /* a drift ends in exact contacts: the other view says nothing */
    .count = cluster_count,
    .memory = cluster_memory,
    .begin = counts_begin,
    .sample = cluster_sample,
    .end_block = cluster_end_block,
    .describe = cluster_describe,
    .extend = cluster_extend,
};
