/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd - Brownian cluster dynamics: an Euler step of all rods, projected back onto the rings in
 * order. The projection is one isotonic regression (kernels/isotonic.h) and equals fragmentation
 * and merging of clusters in doi 10.1103/PhysRevE.106.054606 and doi 10.1016/j.cpc.2024.109474.
 * Weak order 1/2 at contacts, 1 in smooth fields: rods behave as if shorter by 1.165 sqrt(D h).
 */
#include "part.h"
#include "noise.h"
#include "kernels/isotonic.h"

#include <math.h>
#include <string.h>

struct bcd_work {
    struct noise noise;
    double *z;
    struct isotonic_block *blocks;
};

static void bcd_layout(struct sim *sim, struct arena *scratch)
{
    struct bcd_work *work = arena_take(scratch, sizeof *work);
    size_t n = (size_t)sim->plan->particles;
    double *z = arena_take(scratch, n * sizeof *z);
    struct isotonic_block *blocks =
        arena_take(scratch, isotonic_blocks(sim->plan->particles) * sizeof *blocks);
    struct noise source;
    noise_layout(&source, sim->plan->particles, scratch);
    if (work)
        *work = (struct bcd_work){source, z, blocks};
    sim->work = work;
}

static void bcd_advance(struct sim *sim, int64_t ticks)
{
    const struct plan *plan = sim->plan;
    struct bcd_work *work = sim->work;
    int64_t n = plan->particles;
    const double drift = plan->mobility * plan->time_step;
    const bool forces = plan->field || plan->pair;
    const double noise = sqrt(2 * plan->diffusion * plan->time_step);
    for (int64_t t = 0; t < ticks; t++) {
        double *y = sim->y, *z = y;
        if (forces) { /* they need the old positions while the new ones are written */
            z = work->z;
            memcpy(z, y, (size_t)n * sizeof *z);
        }
        if (plan->field) {
            struct rods rods = {y, n, plan->diameter, sim_time(sim)};
            plan->potential->add_force(plan->potential_par, &rods, drift, z);
        }
        if (plan->pair) {
            struct ring ring = {y, n, plan->free_length, plan->temperature};
            plan->pair->add_force(plan->pair_par, &ring, drift, z);
        }
        if (plan->force != 0)
            for (int64_t i = 0; i < n; i++)
                z[i] += drift * plan->force;
        if (noise > 0)
            noise_add(&work->noise, &sim->noise, sim->clock->tick, noise, z);
        isotonic_ring(z, n, plan->free_length, work->blocks);
        if (z != y)
            memcpy(y, z, (size_t)n * sizeof *z);
        sim->clock->tick++;
    }
}

/* Tolerance: L1 error of the density. Measured errors: .018/k in the smooth part; at contacts the
 * effective shortening of rods against the mean gap, doi 10.1103/PhysRevE.106.054606 geometry. */
static double bcd_time_step(const struct plan *plan, const char **why)
{
    const double tolerance = 0.005, curvature_share = 0.018, gap_share = 0.25,
                 pair_share = 0.1;
    double step = INFINITY;
    *why = "nothing limits it";
    if (plan->field) {
        step = curvature_share /
               (plan->mobility * plan->potential->curvature_max(plan->potential_par));
        *why = "curvature of the potential";
    }
    if (plan->pair && plan->diffusion > 0) {
        double by_pair =
            pair_share / (2 * plan->diffusion * plan->pair->stiffness(plan->pair_par));
        if (by_pair < step) {
            step = by_pair;
            *why = "stiffness of the interaction";
        }
    }
    double gap = plan->free_length / (double)plan->particles;
    if (plan->particles > 1 && plan->diffusion > 0 && gap > 0) {
        double reach = tolerance * gap / gap_share;
        double by_gap = reach * reach / (4 * plan->diffusion);
        if (by_gap < step) {
            step = by_gap;
            *why = "mean gap between rods";
        }
    }
    return step;
}

const struct method_type method_bcd = {
    .part = {.name = "bcd", .doc = "Brownian cluster dynamics by isotonic regression"},
    .step_ns = 12,
    .bytes_per_rod = 28,
    .time_step = bcd_time_step,
    .layout = bcd_layout,
    .advance = bcd_advance,
};
