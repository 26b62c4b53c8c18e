/* SPDX-License-Identifier: GPL-3.0-or-later
 * central.c - see central.h. Nothing here calls libm's elementary functions: nearest distances and
 * stiffness decide about bits. */
#include "central.h"
#include "kernels/elementary.h"
#include "kernels/simd.h"

#include <math.h>

static const double rare = 15;        /* kT: an energy of weight 3e-7, NEAREST of central.h */
static const double thermal = 5;      /* kT: what steps must resolve */
static const double deepest = 500;    /* kT: attraction whose weight is still a number */
static const double energy_max = 1e9; /* of attraction, whatever the temperature */
static const double overlap = 1e150;
enum { BLOCK = 256, SCAN = 4096, ORDERS_MAX = 100000 };

/* The lowest energy that is accepted. */
static double bottom(const struct plan *plan)
{
    return -(plan->temperature > 0 ? fmin(deepest * plan->temperature, energy_max) : energy_max);
}

static double force_at(const struct central *c, const void *par, double r)
{
    double force;
    c->law->force(par, &r, 1, &force);
    return force;
}

static double energy_at(const struct central *c, const void *par, double r)
{
    return c->law->energy(par, r) - c->shift;
}

/* The i-th of SCAN steps from > 0 to `to`, in equal ratios. */
static double scan_at(double from, double to, int i)
{
    return i >= SCAN ? to : from * power(to / from, (double)i / SCAN);
}

/* ------------------------------------------------------------ nearest distance */

/* The force with which field and drag can press two rods together: that on all rods of a period
 * of the field, or on all rods that a drag piles up at a wall. */
static double squeeze(const struct plan *plan)
{
    double most = 0;
    for (int i = 0; plan->field && i < BLOCK; i++) {
        double x = plan->period * i / BLOCK, force = 0;
        struct rods one = {.y = &x, .count = 1};
        plan->potential->add_force(plan->potential_par, &one, 1, &force);
        most = fmax(most, fabs(force));
    }
    double rods = (double)plan->particles;
    double piled = plan->field ? ceil(rods * plan->period / plan->length) : 0;
    return most * piled + fabs(plan->force) * (plan->walls ? rods : piled);
}

/* How high repulsion must be for rods not to come closer. */
struct level {
    double energy, force;
};

/* NEAREST of central.h, or the low end: up to the mean distance or the cutoff. */
static double distance_of(const struct central *c, const struct plan *plan, struct level level,
                          double low)
{
    const void *par = c;
    double mean = plan->length / (double)plan->particles, from = fmin(mean, c->cutoff);
    if (!(from > low))
        return low;
    double usual = fmax(energy_at(c, par, from), 0);
    double pressure = mean < c->cutoff ? fmax(force_at(c, par, mean), 0) : 0;
    double distance = low;
    for (int i = 0; i < SCAN; i++) {
        double r = scan_at(low, from, i);
        double excess = energy_at(c, par, r) - usual - pressure * (from - r);
        bool never = plan->temperature > 0 ? excess >= level.energy : 2 * r <= from;
        /* An infinite energy has no force worth a look; NaN is never never. */
        if (!never || !(excess == INFINITY || force_at(c, par, r) > level.force))
            break;
        distance = r;
    }
    return distance;
}

/* --------------------------------------------------------------------- checks */

static bool check_cutoff(const struct bcd_group *group, const struct central *c,
                         const struct plan *plan, struct bcd_errors *errors)
{
    if (!(c->cutoff > plan->diameter)) {
        group_fault(group, c->law->cutoff, errors,
                    "must exceed the diameter %.12g, or no rods come within reach; it is %.12g",
                    plan->diameter, c->cutoff);
        return false;
    }
    if (!plan->walls && !(c->cutoff <= plan->length / 2)) {
        group_fault(group, c->law->cutoff, errors,
                    "must not exceed half of the ring, %.12g, or rods would act on each other "
                    "both ways round; it is %.12g",
                    plan->length / 2, c->cutoff);
        return false;
    }
    return true;
}

/* Points without a diameter: exp(-V/kT) must be integrable at r -> 0, for which r F >= -kT is
 * enough; without noise V must end somewhere. */
static bool check_collapse(const struct bcd_group *group, const struct central *c, double low,
                           const struct plan *plan, struct bcd_errors *errors)
{
    double energy = energy_at(c, group->values, low);
    if (plan->diameter > 0 || energy == INFINITY)
        return true;
    double pull = -low * force_at(c, group->values, low);
    if (pull <= fmax(plan->temperature, 1e-3 * fabs(energy)))
        return true;
    group_fault(group, c->law->strength, errors,
                "attracts without bounds at r -> 0: needs a diameter above 0");
    return false;
}

/* All energies and forces between the nearest distance and the cutoff are numbers. */
static bool check_values(const struct bcd_group *group, struct central *c,
                         const struct plan *plan, struct bcd_errors *errors)
{
    c->flat = true;
    for (int i = 0; i <= SCAN; i++) {
        double r = scan_at(c->nearest, c->cutoff, i);
        double energy = energy_at(c, group->values, r), force = force_at(c, group->values, r);
        if (!isfinite(energy) || !isfinite(force)) {
            group_fault(group, c->law->strength, errors,
                        "gives no finite energy and force at r = %.6g", r);
            return false;
        }
        if (energy < bottom(plan)) {
            group_fault(group, c->law->strength, errors,
                        "attracts with an energy of %.4g at r = %.6g, which must not exceed %.6g "
                        "(%g kT): rods would never part",
                        -energy, r, -bottom(plan), deepest);
            return false;
        }
        c->flat = c->flat && force == 0;
    }
    return true;
}

bool central_complete(struct bcd_group *group, const struct central_law *law, double cutoff,
                      const struct plan *plan, struct bcd_errors *errors)
{
    void *par = group->values;
    struct central *c = par;
    *c = (struct central){.law = law, .cutoff = cutoff, .diameter = plan->diameter};
    if (!check_cutoff(group, c, plan, errors))
        return false;
    c->shift = law->energy(par, cutoff);
    if (!isfinite(c->shift)) {
        group_fault(group, law->strength, errors, "has no finite energy at the cutoff %.6g",
                    cutoff);
        return false;
    }
    double scale = fmin(cutoff, plan->length / (double)plan->particles);
    double low = fmax(plan->diameter, 1e-9 * scale);
    if (!check_collapse(group, c, low, plan, errors))
        return false;
    double press = squeeze(plan), kT = plan->temperature;
    c->nearest = distance_of(c, plan, (struct level){rare * kT, 2 * press}, low);
    c->stiff = distance_of(c, plan, (struct level){thermal * kT, press}, c->nearest);
    if (!check_values(group, c, plan, errors))
        return false;
    c->nearest_energy = energy_at(c, par, c->nearest);
    c->nearest_force = force_at(c, par, c->nearest);
    return true;
}

/* ---------------------------------------------------------------------- slots */

bool central_absent(const void *par)
{
    return ((const struct central *)par)->flat;
}

double central_range(const void *par)
{
    const struct central *c = par;
    return c->cutoff - c->diameter;
}

double central_energy(const void *par, double distance, double temperature)
{
    (void)temperature;
    const struct central *c = par;
    if (distance >= c->cutoff)
        return 0;
    if (distance < c->nearest)
        return c->nearest_energy + c->nearest_force * (c->nearest - distance);
    double energy = energy_at(c, par, distance);
    return isfinite(energy) ? energy : overlap; /* a pole that the scan of checks did not meet */
}

static double energy_for_theory(const void *par, double distance)
{
    return central_energy(par, distance, 0);
}

void central_theory(const void *par, struct theory_pair *pair)
{
    const struct central *c = par;
    *pair = (struct theory_pair){
        .kind = THEORY_ENERGY, .energy = energy_for_theory, .ctx = par, .cutoff = c->cutoff};
}

/* Of further neighbours: rods at half the mean distance. */
static double stiffness_of_further(const struct central *c, const struct plan *plan)
{
    double apart = fmax(c->stiff, plan->length / (2 * (double)plan->particles)), sum = 0;
    for (int64_t k = 2; k < ORDERS_MAX && (double)k * apart < c->cutoff; k++) {
        double below = (double)k * apart, above = fmin(below * (1 + 1e-4), c->cutoff);
        sum += fabs(force_at(c, c, above) - force_at(c, c, below)) / (above - below);
    }
    return sum;
}

/* max |dF/dr| by a scan: no closed extremum for general laws. From the distance on where repulsion
 * is 5 kT: rods come closer, but so seldom (weight .007) and so shortly that steps need not follow
 * them. What throws them out again is bounded, a few of these distances at the longest step. In an
 * attraction nothing is left out. Measured for two points, V = 1.5 exp(-r/2)/r, strang: at
 * 2 D h max|F'|/kT = .3 g(r) is off by less than .0006, at .84 by less than .003 of its 1.13.
 * Further neighbours add theirs: a chain relaxes at the rate of all its springs. */
double central_stiffness(const void *par, const struct plan *plan)
{
    const struct central *c = par;
    double most = 0, r = c->stiff, force = force_at(c, par, r);
    for (int i = 1; i <= SCAN; i++) {
        double next = scan_at(c->stiff, c->cutoff, i), there = force_at(c, par, next);
        if (next > r)
            most = fmax(most, fabs(there - force) / (next - r));
        r = next, force = there;
    }
    return most + stiffness_of_further(c, plan);
}

/* ----------------------------------------------------------------- the shared loop */

/* Pairs of one order k within one block: rods left[j] and right[j], j < count, at a distance of
 * right[j] - left[j] + offset. */
struct stretch {
    const double *left, *right;
    int64_t count;
    double offset;
};

/* r[j]: distances within [nearest, cutoff]; share[j]: scale, or 0 for pairs beyond the cutoff.
 * Returns how many are closer. */
KERNEL_CLONES
static int64_t measure(const struct central *c, const struct stretch *s, double scale, double *r,
                       double *share)
{
    const double *left = s->left, *right = s->right;
    const double nearest = c->nearest, cutoff = c->cutoff, offset = s->offset;
    int64_t near = 0;
    for (int64_t j = 0; j < s->count; j++) {
        double d = (right[j] - left[j]) + offset;
        near += d < cutoff ? 1 : 0;
        share[j] = d < cutoff ? scale : 0;
        double above = d > nearest ? d : nearest;
        r[j] = above < cutoff ? above : cutoff;
    }
    return near;
}

KERNEL_CLONES
static void add(double *out, const double *force, int64_t count)
{
    for (int64_t j = 0; j < count; j++)
        out[j] += force[j];
}

KERNEL_CLONES
static void subtract(double *out, const double *force, int64_t count)
{
    for (int64_t j = 0; j < count; j++)
        out[j] -= force[j];
}

KERNEL_CLONES
static void multiply(double *force, const double *share, int64_t count)
{
    for (int64_t j = 0; j < count; j++)
        force[j] *= share[j];
}

struct block {
    double r[BLOCK], share[BLOCK], force[BLOCK];
};

/* Pairs (i, i + k) of the rods i = from .. to-1, those that reach across the seam last. Returns how
 * many are within the cutoff. */
static int64_t add_block(const struct central *c, const struct ring *ring, const int64_t order[3],
                         double scale, double *out)
{
    const int64_t k = order[0], from = order[1], to = order[2], n = ring->count;
    const double *y = ring->y, offset = (double)k * ring->diameter;
    struct block b;
    int64_t seam = to < n - k ? to : from > n - k ? from : n - k;
    struct stretch inner = {y + from, y + from + k, seam - from, offset};
    struct stretch across = {y + seam, y + seam + k - n, to - seam, offset + ring->free_length};
    int64_t near = measure(c, &inner, scale, b.r, b.share);
    if (to > seam)
        near += measure(c, &across, scale, b.r + (seam - from), b.share + (seam - from));
    if (near == 0)
        return 0;
    c->law->force(c, b.r, to - from, b.force);
    multiply(b.force, b.share, to - from);
    subtract(out + from, b.force, to - from);
    if (seam > from)
        add(out + from + k, b.force, seam - from);
    if (to > seam)
        add(out + seam + k - n, b.force + (seam - from), to - seam);
    return near;
}

/* Neighbours of order k + 1 are further apart than those of order k: the first order out of reach
 * is the last. On a ring a pair is met from both sides, once at most closer than L/2 >= cutoff. */
void central_add_force(const void *par, const struct ring *ring, double scale, double *out)
{
    const struct central *c = par;
    int64_t near = 1;
    for (int64_t k = 1; near > 0 && k < ring->count; k++) {
        int64_t lefts = ring->walls ? ring->count - k : ring->count;
        near = 0;
        for (int64_t from = 0; from < lefts; from += BLOCK) {
            int64_t to = from + BLOCK < lefts ? from + BLOCK : lefts;
            near += add_block(c, ring, (const int64_t[3]){k, from, to}, scale, out);
        }
    }
}
