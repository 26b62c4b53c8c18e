/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * sticky - attraction of neighbours at contact, Baxter's sticky rods with a finite range:
 * doi 10.1103/PhysRevE.106.054606, Eqs. 31-32. The Boltzmann factor of a gap g < eps is
 *     exp(-V/kT) = 1 + gamma (p + 1) (eps - g)^p / eps^(p+1),
 * whose excess over 1 integrates to gamma; eps -> 0 is Baxter's contact. V scales with kT.
 * eps = 0 is that contact itself: no force, but bonds, for methods that know them.
 */
#include "part.h"
#include "kernels/attraction.h"

#include <math.h>

struct sticky_par {
    double strength, range, exponent;
    double diameter; /* of the rods, for energies */
    struct attraction attraction;
};

static const struct bcd_param sticky_params[] = {
    {.name = "strength",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .unit = "length",
     .min = 0,
     .max = 1e6,
     .doc = "gamma, stickiness",
     .offset = offsetof(struct sticky_par, strength)},
    {.name = "range",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .unit = "length",
     .min = 0,
     .max = 1e12,
     .doc = "eps, gap at which the attraction ends; 0 = contact alone, gamma delta(gap)",
     .offset = offsetof(struct sticky_par, range)},
    {.name = "exponent",
     .type = BCD_PARAM_NUMBER,
     .min = 1,
     .max = 100,
     .fallback = 3,
     .doc = "p, how steeply the attraction sets in; of no effect at contact alone",
     .offset = offsetof(struct sticky_par, exponent)},
    {0},
};

static void sticky_complete(struct bcd_group *group, const struct plan *plan,
                            struct bcd_errors *errors)
{
    (void)errors;
    struct sticky_par *p = group->values;
    p->diameter = plan->diameter;
    p->attraction = attraction_make(p->strength, p->range, p->exponent);
}

static bool sticky_absent(const void *par)
{
    return ((const struct sticky_par *)par)->strength == 0;
}

static bool sticky_contact(const void *par)
{
    return ((const struct sticky_par *)par)->range == 0;
}

static double sticky_range(const void *par)
{
    return ((const struct sticky_par *)par)->range;
}

/* out[i] += scale * F_i: neighbours closer than eps pull each other together. Each rod has the pull
 * of its left neighbour first; across the seam all others come first. */
static void sticky_add_force_within(const void *par, const struct ring *ring,
                                    const struct pair_stretch *within, double scale, double *out)
{
    const struct attraction attraction = ((const struct sticky_par *)par)->attraction;
    const double *y = ring->y, range = attraction.range;
    const int64_t first = within->first, end = within->end, last = ring->count - 1;
    const double pull = scale * ring->temperature;
    if (first > 0 && y[first] - y[first - 1] < range)
        out[first] -= pull * attraction_at(&attraction, y[first] - y[first - 1]);
    for (int64_t i = first; i < end - 1; i++) {
        double gap = y[i + 1] - y[i];
        if (gap < range) {
            double f = pull * attraction_at(&attraction, gap);
            out[i] += f;
            out[i + 1] -= f;
        }
    }
    if (end <= last && y[end] - y[end - 1] < range)
        out[end - 1] += pull * attraction_at(&attraction, y[end] - y[end - 1]);
    const double gap = y[0] + ring->free_length - y[last];
    if (ring->walls || !(gap < range) || (first > 0 && end <= last))
        return;
    const double f = pull * attraction_at(&attraction, gap);
    if (end > last)
        out[last] += f;
    if (first == 0)
        out[0] -= f;
}

static void sticky_add_force(const void *par, const struct ring *ring, double scale, double *out)
{
    const struct pair_stretch all = {0, ring->count};
    sticky_add_force_within(par, ring, &all, scale, out);
}

/* V = -kT ln(1 + gamma' u^p). */
static double sticky_energy(const void *par, double distance, double temperature)
{
    const struct sticky_par *p = par;
    double u = 1 - fmax(distance - p->diameter, 0) / p->range;
    if (u < 1e-300)
        return 0;
    double strength = p->strength * (p->exponent + 1) / p->range;
    return -temperature * log_normal(1 + strength * power(u, p->exponent));
}

/* max |dF/dg| / kT by a scan: the attraction has no closed extremum for general p. Infinite where
 * strength and range leave the numbers: no step is short enough then. */
static double sticky_stiffness(const void *par, const struct plan *plan)
{
    (void)plan;
    enum { POINTS = 4096 };
    const struct sticky_par *p = par;
    if (p->range == 0)
        return 0;
    double most = 0, before = attraction_at(&p->attraction, 0);
    for (int i = 1; i <= POINTS; i++) {
        double now = attraction_at(&p->attraction, p->range * i / POINTS);
        if (!isfinite(now - before))
            return INFINITY;
        double slope = fabs(now - before) * POINTS / p->range;
        most = slope > most ? slope : most;
        before = now;
    }
    return most;
}

static void sticky_theory(const void *par, struct theory_pair *pair)
{
    const struct sticky_par *p = par;
    *pair = (struct theory_pair){.kind = p->range > 0 ? THEORY_STICKY : THEORY_BAXTER,
                                 .strength = p->strength,
                                 .range = p->range,
                                 .exponent = p->exponent};
}

const struct pair_type pair_sticky = {
    .base = {.part = {.name = "sticky",
                      .doc = "attraction at contact, Baxter's sticky rods of finite range",
                      .params = sticky_params},
             .par_size = sizeof(struct sticky_par),
             .complete = sticky_complete},
    .absent = sticky_absent,
    .contact = sticky_contact,
    .range = sticky_range,
    .alone = true,
    .stiffness = sticky_stiffness,
    .theory = sticky_theory,
    .add_force = sticky_add_force,
    .add_force_within = sticky_add_force_within,
    .nearest = true,
    .energy = sticky_energy,
};
