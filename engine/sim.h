/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sim.h - the rods in motion: what methods advance and observables look at.
 *
 * Reduced coordinates y[i] = x[i] - i * diameter, unwrapped, on a ring of length ell = L - N sigma:
 * y[0] <= y[1] <= ... <= y[N-1] <= y[0] + ell. Contact is bitwise equality of neighbours.
 *
 * In small rings several realizations of one job go side by side, in lanes: what a vector register
 * and a processor's look ahead have no use for in one ring, the next one takes. Everything that has
 * a number for each rod has those of all lanes then, a lane arena_whole(N) behind the one before.
 * Each has its own noise and clock and the same bits as if it went alone.
 */
#ifndef SIM_H
#define SIM_H

#include "arena.h"
#include "bcd.h"
#include "plan.h"
#include "kernels/normals.h"

#include <string.h>

struct sim_clock {
    int64_t tick;  /* steps since the initial configuration */
    int64_t turns; /* y was moved back by turns * L to keep its digits; x = y + i sigma + turns L */
};

struct sim {
    const struct plan *plan; /* the scene's, or in a second pass that of twice its time step */
    int64_t lanes;           /* a power of two */
    double *y;               /* [lanes][arena_whole(N)], kept in checkpoints */
    const double *seen;      /* [N], what static observables look at: y, or a method's view */
    struct sim_clock *clock; /* [lanes], all at one tick; kept in checkpoints */
    const double *offset;    /* [lanes][arena_whole(N)], x - y; NULL with one lane */
    void *work;              /* the method's scratch */
    struct noise_key noise;
    struct bcd_watch *watch; /* over draws of equilibrium starts; may be NULL */
    const struct bcd_hands *hands; /* that help with a large ring; NULL = none */
    /* Of a large ring, scratch of sharing.h; NULL = it is none. */
    struct sharing_part *parts;
    struct isotonic_piece *pieces;
};
enum { LANES_MAX = 16 };

/* Streams of the counter-based generator. */
enum {
    STREAM_STEPS = 0,
    STREAM_INITIAL = 1,
    STREAM_VIEW = 2,
    STREAM_FIRST_KICK = 3, /* lm: the noise before the first step */
    STREAM_ACCEPT = 4,     /* metropolis: which moves are accepted */
    STREAM_REDRAW = 5,     /* tao: noise drawn anew after a contact */
    STREAM_BONDS = 6,      /* strang_bonds: which bonds break and form, how fast they part */
};

static inline double sim_time(const struct sim *sim)
{
    return (double)sim->clock->tick * sim->plan->time_step;
}

/* Ticks since the measurement began; negative during equilibration. */
static inline int64_t sim_measured(const struct sim *sim)
{
    return sim->clock->tick - sim->plan->equilibration_steps;
}

/* How many numbers there are for the rods of all lanes, the room behind each lane's included. */
static inline int64_t sim_rods(const struct sim *sim)
{
    return arena_whole(sim->plan->particles) * sim->lanes;
}

/* A number for each rod, and how to copy them. */
static inline double *sim_take_rods(const struct sim *sim, struct arena *arena)
{
    return arena_take(arena, (size_t)sim_rods(sim) * sizeof(double));
}

static inline void sim_copy_rods(const struct sim *sim, double *to, const double *from)
{
    memcpy(to, from, (size_t)sim_rods(sim) * sizeof *to);
}

/* One lane of several as a simulation of its own. */
static inline struct sim sim_lane(const struct sim *sim, int64_t lane)
{
    struct sim one = *sim;
    one.lanes = 1;
    one.offset = NULL;
    one.y += lane * arena_whole(sim->plan->particles);
    one.clock += lane;
    one.noise.realization += (uint32_t)lane;
    one.noise.lane = (uint8_t)lane;
    one.noise.all = false;
    return one;
}

/* One lane; more where sim_layout_lanes has made room. Methods are laid out afterwards. */
void sim_layout(struct sim *sim, const struct plan *plan, struct arena *kept);
void sim_layout_lanes(struct sim *sim, const struct plan *plan, int64_t lanes, struct arena *kept,
                      struct arena *scratch);

/* What the lanes are about: a realization and those after it. */
void sim_aim(struct sim *sim, int64_t realization);

/* Places the rods for a realization, in further lanes for those after it, and sets the clocks to 0.
 * Only an equilibrium draw can fail. */
enum bcd_status sim_begin(struct sim *sim, int64_t realization, struct bcd_error *error);

/* Moves all rods back by whole lengths L when they have drifted far: keeps the digits of y. Each
 * lane by itself. */
void sim_recentre(struct sim *sim);

#endif
