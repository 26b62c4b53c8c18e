/* SPDX-License-Identifier: GPL-3.0-or-later
 * random_ring.c - see random_ring.h. */
#include "random_ring.h"

#include <math.h>
#include <stdbool.h>

static const double two_pi = 6.283185307179586;

static uint64_t next_word(struct dice *dice)
{
    uint64_t z = dice->state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

double dice_uniform(struct dice *dice)
{
    return (double)(next_word(dice) >> 11) * 0x1p-53;
}

double dice_normal(struct dice *dice)
{
    double radius = sqrt(-2.0 * log(1.0 - dice_uniform(dice)));
    return radius * cos(two_pi * dice_uniform(dice));
}

/* y[i] first holds how far rod i is round the ring, in open gaps, then its position. */
static void place_rods(double *y, const struct ring_recipe *recipe, struct dice *dice)
{
    double round = 0;
    y[0] = 0;
    for (int i = 1; i < recipe->n; i++) {
        if (dice_uniform(dice) >= recipe->closed)
            round += 1e-3 + dice_uniform(dice);
        y[i] = round;
    }
    bool seam_open = dice_uniform(dice) >= recipe->closed;
    double whole = round + (seam_open ? 1e-3 + dice_uniform(dice) : 0);
    double origin = recipe->origin * (1 + 0.1 * dice_uniform(dice));
    for (int i = 0; i < recipe->n; i++) {
        /* In contact across the seam: exactly there, whatever the rounding. */
        bool at_seam = !seam_open && round > 0 && y[i] == round;
        double way = whole > 0 ? recipe->ell * (y[i] / whole) : 0;
        y[i] = origin + (at_seam ? recipe->ell : way);
    }
}

static double displace(const struct ring_recipe *recipe, int i, int kicked, struct dice *dice)
{
    switch (recipe->kind) {
    case DISPLACE_TIES:
        return floor(5 * dice_uniform(dice)) - 2;
    case DISPLACE_FLOW:
        return sin(two_pi * i / recipe->n);
    case DISPLACE_KICK:
        return i == kicked ? (kicked % 2 ? 1 : -1) : 0;
    default:
        return dice_normal(dice);
    }
}

void random_ring(double *y, double *displacement, const struct ring_recipe *recipe,
                 struct dice *dice)
{
    place_rods(y, recipe, dice);
    int kicked = (int)(recipe->n * dice_uniform(dice));
    for (int i = 0; i < recipe->n; i++)
        displacement[i] = recipe->amplitude * displace(recipe, i, kicked, dice);
}
