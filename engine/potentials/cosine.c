/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cosine - U(x, t) = (U0 / 2) cos(2 pi (x - v t) / lambda + phase): a standing (v = 0) or
 * travelling wave with barriers of height U0.
 */
#include "part.h"
#include "kernels/elementary.h"
#include "kernels/wave.h"

#include <math.h>

struct cosine_par {
    double amplitude, wavelength, phase, velocity;
    struct wave still; /* at time 0, for ever when it stands */
    double steepest;   /* U0/2 k */
};

static const struct bcd_param cosine_params[] = {
    {.name = "amplitude",
     .type = BCD_PARAM_NUMBER,
     .required = true,
     .unit = "energy",
     .min = -1e6,
     .max = 1e6,
     .doc = "U0, height of the barriers",
     .offset = offsetof(struct cosine_par, amplitude)},
    {.name = "wavelength",
     .type = BCD_PARAM_NUMBER,
     .above_min = true,
     .unit = "length",
     .min = 0,
     .max = 1e12,
     .fallback = 1,
     .doc = "lambda, period of the potential",
     .offset = offsetof(struct cosine_par, wavelength)},
    {.name = "phase",
     .type = BCD_PARAM_NUMBER,
     .unit = "radian",
     .min = -1e6,
     .max = 1e6,
     .doc = "phase at x = 0",
     .offset = offsetof(struct cosine_par, phase)},
    {.name = "velocity",
     .type = BCD_PARAM_NUMBER,
     .unit = "length/time",
     .min = -1e9,
     .max = 1e9,
     .doc = "v, velocity of the travelling wave",
     .offset = offsetof(struct cosine_par, velocity)},
    {0},
};

static double wave_number(const struct cosine_par *par)
{
    return 2 * M_PI / par->wavelength;
}

static double cosine_period(const void *par)
{
    return ((const struct cosine_par *)par)->wavelength;
}

static bool cosine_flat(const void *par)
{
    return ((const struct cosine_par *)par)->amplitude == 0;
}

static double cosine_curvature_max(const void *par)
{
    const struct cosine_par *p = par;
    return fabs(p->amplitude) / 2 * wave_number(p) * wave_number(p);
}

static bool cosine_steady(const void *par)
{
    const struct cosine_par *p = par;
    return p->velocity == 0 || p->amplitude == 0;
}

static double cosine_velocity(const void *par)
{
    return ((const struct cosine_par *)par)->velocity;
}

static struct wave wave_at(const struct cosine_par *par, double time)
{
    double turns = par->phase / (2 * M_PI) - par->velocity * time / par->wavelength;
    return (struct wave){1 / par->wavelength, turns - floor(turns)};
}

static void cosine_complete(struct bcd_group *group, const struct plan *plan,
                            struct bcd_errors *errors)
{
    (void)plan;
    (void)errors;
    struct cosine_par *p = group->values;
    p->still = wave_at(p, 0);
    p->steepest = p->amplitude / 2 * wave_number(p);
}

static void cosine_add_force(const void *par, const struct rods *rods, double scale, double *out)
{
    const struct cosine_par *p = par;
    const struct wave wave = p->velocity == 0 ? p->still : wave_at(p, rods->time);
    const struct wave_places at = {rods->y, rods->offset, rods->count};
    const struct wave_line line = {rods->y, rods->count, rods->first, rods->diameter};
    if (rods->offset)
        wave_add_sine_at(out, &at, &wave, scale * p->steepest);
    else
        wave_add_sine(out, &line, &wave, scale * p->steepest);
}

/* E = exp(k t), k = mu (U0/2) (2 pi/lambda)^2; beyond e^500 every rod has long arrived. */
static double cosine_flow_growth(const void *par, double mobility, double duration)
{
    const struct cosine_par *p = par;
    double rate = mobility * p->amplitude / 2 * wave_number(p) * wave_number(p);
    return exp_bounded(fmax(-500, fmin(500, rate * duration)));
}

static void cosine_flow(const void *par, const struct rods *rods, double growth, double *y)
{
    const struct cosine_par *p = par;
    const struct wave wave = p->velocity == 0 ? p->still : wave_at(p, rods->time);
    const struct wave_places at = {rods->y, rods->offset, rods->count};
    const struct wave_line line = {rods->y, rods->count, rods->first, rods->diameter};
    if (rods->offset)
        wave_flow_at(y, &at, &wave, growth);
    else
        wave_flow(y, &line, &wave, growth);
}

static double cosine_energy_sum(const void *par, const struct rods *rods)
{
    const struct cosine_par *p = par;
    struct wave wave = wave_at(p, rods->time);
    return p->amplitude / 2 * wave_sum_cosine(rods->y, rods->count, rods->diameter, &wave);
}

static void cosine_energies(const void *par, const double *x, int n, double *energy)
{
    const struct cosine_par *p = par;
    struct wave wave = wave_at(p, 0);
    wave_cosine(energy, x, n, &wave);
    for (int i = 0; i < n; i++)
        energy[i] = p->amplitude / 2 * energy[i];
}

const struct potential_type potential_cosine = {
    .base = {.part = {.name = "cosine",
                      .doc = "U(x) = U0/2 cos(2 pi (x - v t)/lambda + phase)",
                      .params = cosine_params},
             .par_size = sizeof(struct cosine_par),
             .complete = cosine_complete},
    .period = cosine_period,
    .flat = cosine_flat,
    .curvature_max = cosine_curvature_max,
    .flow = cosine_flow,
    .flow_growth = cosine_flow_growth,
    .add_force = cosine_add_force,
    .energy_sum = cosine_energy_sum,
    .energies = cosine_energies,
    .steady = cosine_steady,
    .velocity = cosine_velocity,
};
