/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sharing.h - the work of one step of a large ring, cut into parts for several hands (bcd.h): rods
 * in stretches of SHARING_RODS, each of which some thread does from beginning to end. What a part
 * does to its rods is what the whole would do to them, bit for bit; resolvers, which look beyond a
 * stretch, are cut where that is so (kernels/isotonic.h) or joined afterwards
 * (kernels/ring_sort.h).
 *
 * Methods with proposals and resolvers of the usual kind share without knowing it: what is called
 * here is called by proposal.c and resolve.h. Methods of which every move depends on the one before
 * (metropolis, tao, strating, bonds, the published forms of bcd) share what they have of these, or
 * nothing. So do interactions of further neighbours (central.h), whose sums run along the whole
 * ring, and observables: sums over rods have one order.
 */
#ifndef SHARING_H
#define SHARING_H

#include "sim.h"
#include "kernels/isotonic.h"
#include "kernels/ring_sort_marked.h"

enum { SHARING_RODS = 4096, SHARING_PARTS_MIN = 4 };

/* What one part knows of its rods, and where to cut them. */
struct sharing_part {
    double low, high;              /* of all, */
    double high_before, low_after; /* and of those on either side of where the cut is looked for */
    double beyond;                 /* the lowest of the parts after it */
    struct isotonic_cut cut;       /* counts from the ring's first rod; 0 = none */
};

/* Rods first .. end-1; room: up to there, what stands past the last rod included (arena_whole). */
struct stretch {
    int64_t first, end, room;
};

static inline int64_t sharing_parts(int64_t n)
{
    return (n + SHARING_RODS - 1) / SHARING_RODS;
}

static inline bool sharing_pays(const struct plan *plan)
{
    return plan->free_length > 0 && sharing_parts(plan->particles) >= SHARING_PARTS_MIN;
}

/* Takes its memory, of a ring for which it pays. */
void sharing_layout(struct sim *sim, struct arena *scratch);

/* Is there anybody to share with right now? */
static inline bool sharing(const struct sim *sim)
{
    return sim->hands && sim->parts && sim->hands->count(sim->hands->context) > 0;
}

static inline struct stretch sharing_stretch(const struct sim *sim, int64_t part)
{
    const int64_t n = sim->plan->particles, first = part * SHARING_RODS, end = first + SHARING_RODS;
    return end < n ? (struct stretch){first, end, end} : (struct stretch){first, n, arena_whole(n)};
}

/* part(of, i) for each stretch of the ring. */
static inline void sharing_each(const struct sim *sim, bcd_part part, void *of)
{
    sim->hands->share(sim->hands->context, part, of, sharing_parts(sim->plan->particles));
}

/* What noise_add (noise.h) does, of the current tick; within: to the rods of a stretch. */
void sharing_add_noise(const struct sim *sim, const struct noise_key *key, double scale, double *z);
void sharing_add_noise_within(const struct sim *sim, const struct noise_key *key, double scale,
                              const struct stretch *rods, double *z);

/* The resolvers of resolve.h and of lm. */
void sharing_stick(const struct sim *sim, double *y, struct isotonic_block *blocks);
void sharing_reflect(const struct sim *sim, double *y, double *scratch);
void sharing_reflect_marked(const struct sim *sim, const struct marked_rods *rods);

#endif
