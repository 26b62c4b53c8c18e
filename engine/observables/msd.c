/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * msd - mean squared displacement of tagged rods, <(x(t + lag) - x(t))^2>, unwrapped, at lags
 * spread evenly in the logarithm, averaged over all rods and many time origins t.
 *
 * Lag k has its origins at multiples of stride[k], a power of two from a quarter to an eighth of
 * the lag (short lags: the shortest stride): denser ones are so correlated that they add nothing.
 * Origins of one stride share a ring of
 * stored configurations, so memory grows with the logarithm of the longest lag, not with the run.
 *
 * Where a method has a middle of the drift, rods are looked at there: after a noise they are
 * further from where the potential holds them, and displacements too large.
 *
 * A second pass with twice the time step (plan.h) has the even lags alone; long ones are made even.
 *
 * A single realization is cut into blocks for its error bar. A lag's samples are gathered over as
 * many blocks as make at least four lags; where that leaves one sample there is no error bar.
 */
#include "part.h"
#include "step_error.h"
#include "table.h"
#include "kernels/elementary.h"
#include "kernels/sums.h"
#include "theory/closed_forms.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { POINTS_MAX = 500, STRIDES_MAX = 56, STRIDE_SHORT = 64, ORIGINS = 256 };

struct msd_par {
    double first, last;
    int64_t points;
};

static const struct bcd_param msd_params[] = {
    {.name = "first",
     .type = BCD_PARAM_AUTO,
     .above_min = true,
     .unit = "time",
     .min = 0,
     .max = 1e18,
     .fallback = NAN,
     .doc = "shortest lag; auto = the time step",
     .offset = offsetof(struct msd_par, first)},
    {.name = "last",
     .type = BCD_PARAM_AUTO,
     .above_min = true,
     .unit = "time",
     .min = 0,
     .max = 1e18,
     .fallback = NAN,
     .doc = "longest lag; auto = a tenth of the measured time, at least first",
     .offset = offsetof(struct msd_par, last)},
    {.name = "points",
     .type = BCD_PARAM_INTEGER,
     .min = 1,
     .max = POINTS_MAX,
     .fallback = 40,
     .doc = "lags from first to last, evenly spaced in the logarithm",
     .offset = offsetof(struct msd_par, points)},
    {0},
};

/* The lags in ticks, rising (0: no whole number of ticks), with the stride of their origins and the
 * blocks that one sample gathers; configurations kept per stride. A pure function of parameters
 * and plan; what is past count and strides is not set. */
struct msd_lags {
    int64_t count, strides;
    int64_t lag[POINTS_MAX], gather[POINTS_MAX];
    int level[POINTS_MAX];                           /* index of the stride */
    int64_t stride[STRIDES_MAX], slots[STRIDES_MAX]; /* slots: configurations in the ring */
    int64_t first_slot[STRIDES_MAX], total_slots;
};

/* Kept in checkpoints: the lags, the next tick of each with an origin one lag ago, sums of the
 * samples in progress, then per slot {turns, y[N]}. */
struct msd_memory {
    struct msd_lags lags;
    int64_t due[POINTS_MAX];
    double sum[POINTS_MAX];
    int64_t origins[POINTS_MAX];
    int64_t block;
    double frames[];
};

static size_t frame_doubles(const struct plan *plan)
{
    return (size_t)plan->particles + 1;
}

/* ------------------------------------------------------------------- lags */

static int64_t ticks_of(double time, const struct plan *plan)
{
    double ticks = fmin(rint(time / plan->time_step), (double)plan->steps);
    return ticks < 1 ? 1 : (int64_t)ticks;
}

static void spread_lags(const struct msd_par *par, const struct plan *plan, struct msd_lags *lags)
{
    int64_t first = isnan(par->first) ? 1 : ticks_of(par->first, plan);
    int64_t last = isnan(par->last) ? (plan->steps + 9) / 10 : ticks_of(par->last, plan);
    last = first < last ? last : first;
    double ratio = (double)last / (double)first;
    lags->count = 0;
    for (int64_t k = 0; k < par->points; k++) {
        double share = par->points > 1 ? (double)k / (double)(par->points - 1) : 0;
        int64_t lag = (int64_t)rint((double)first * power(ratio, share));
        lag = k + 1 == par->points && par->points > 1 ? last : lag;
        lag -= plan->paired > 0 && lag > 100 ? lag % 2 : 0;
        if (lags->count == 0 || lag > lags->lag[lags->count - 1])
            lags->lag[lags->count++] = lag;
    }
}

static int64_t stride_of(int64_t lag, int64_t shortest)
{
    int64_t stride = shortest;
    while (stride * 8 <= lag)
        stride *= 2;
    return stride;
}

/* Of one lag's origin, per rod: its squared displacement (about 1 ns), and the look that it needs,
 * which goes half a drift ahead where a method has views. */
static double look_ns(const struct plan *plan)
{
    const double rods = (double)plan->particles, halfway = 0.6 * plan->method->view_ns + 50 / rods;
    return 1 + 120 / rods + (step_error_views_used(plan) ? halfway : 0);
}

/* The shortest stride for which looking costs about a sixth of a step: origins of all lags per step
 * times the cost of one. Runs of few steps get their origins all the same. */
static int64_t shortest_stride(const struct msd_lags *lags, const struct plan *plan)
{
    const double allowed = 0.17 * (plan->method->step_ns + 60 / (double)plan->particles);
    const double look = look_ns(plan);
    int64_t stride = 1;
    while (stride < STRIDE_SHORT || stride * ORIGINS <= plan_block_end(plan, 0)) {
        double per_step = 0;
        for (int64_t k = 0; k < lags->count; k++)
            per_step += look / (double)stride_of(lags->lag[k], stride);
        if (per_step <= allowed)
            break;
        stride *= 2;
    }
    return stride;
}

static void find_lags(const struct msd_par *par, const struct plan *plan, struct msd_lags *lags)
{
    lags->strides = lags->total_slots = 0;
    spread_lags(par, plan->fine, lags);
    int64_t ticks = plan_ticks_per_step(plan), block = plan_block_end(plan->fine, 0);
    for (int64_t k = 0; k < lags->count; k++) {
        int64_t lag = lags->lag[k];
        lags->gather[k] = 1;
        while (lags->gather[k] < plan->fine->blocks && lags->gather[k] * block < 4 * lag)
            lags->gather[k] *= 2; /* blocks are a power of two */
        lags->lag[k] = lag % ticks == 0 ? lag / ticks : 0;
    }
    int64_t shortest = shortest_stride(lags, plan);
    for (int64_t k = 0; k < lags->count; k++) {
        int64_t lag = lags->lag[k], stride = stride_of(lag, shortest);
        if (lag == 0 && lags->strides > 0) /* the longest one: its neighbour's will do */
            stride = lags->stride[lags->strides - 1];
        if (lags->strides == 0 || lags->stride[lags->strides - 1] != stride) {
            assert(lags->strides < STRIDES_MAX);
            lags->slots[lags->strides] = 0;
            lags->stride[lags->strides++] = stride;
        }
        lags->level[k] = (int)(lags->strides - 1);
        int64_t *slots = &lags->slots[lags->strides - 1];
        *slots = lag / stride + 1 > *slots ? lag / stride + 1 : *slots;
    }
    for (int64_t l = 0; l < lags->strides; l++) {
        lags->first_slot[l] = lags->total_slots;
        lags->total_slots += lags->slots[l];
    }
}

/* ------------------------------------------------------------- in motion */

static void msd_check(const struct bcd_group *group, const struct plan *plan,
                      struct bcd_errors *errors)
{
    const struct msd_par *par = group->values;
    double h = plan->time_step, time = (double)plan->steps * h;
    if (par->first < h * (1 - 1e-9))
        group_fault(group, "first", errors, "must not be below the time step %.12g", h);
    if (par->first > time * (1 + 1e-9))
        group_fault(group, "first", errors, "must not exceed the measured time %.12g", time);
    if (par->last > time * (1 + 1e-9))
        group_fault(group, "last", errors, "must not exceed the measured time %.12g", time);
    if (par->first > par->last)
        group_fault(group, "last", errors, "must not be below first = %.12g", par->first);
}

/* Two steps within the shortest lag at least. */
static double msd_time_step_max(const void *par, const struct plan *plan)
{
    (void)plan;
    double first = ((const struct msd_par *)par)->first;
    return isnan(first) ? INFINITY : first / 2;
}

/* Lags that are reached only, and the origins kept for them. */
static double msd_step_ns(const void *par, const struct plan *plan)
{
    struct msd_lags lags;
    double cost = 0;
    find_lags(par, plan, &lags);
    for (int64_t k = 0; k < lags.count; k++)
        cost += look_ns(plan) / (double)lags.stride[lags.level[k]] *
                (1 - (double)lags.lag[k] / (double)plan->steps);
    for (int64_t l = 0; l < lags.strides; l++)
        cost += 0.5 / (double)lags.stride[l];
    return cost;
}

static size_t msd_count(const void *par, const struct plan *plan)
{
    struct msd_lags lags;
    spread_lags(par, plan->fine, &lags);
    return (size_t)lags.count;
}

static size_t msd_memory(const void *par, const struct plan *plan)
{
    struct msd_lags lags;
    find_lags(par, plan, &lags);
    return sizeof(struct msd_memory) +
           (size_t)lags.total_slots * frame_doubles(plan) * sizeof(double);
}

static double *frame_at(const struct observer *o, int64_t level, int64_t origin)
{
    struct msd_memory *memory = o->memory;
    const struct msd_lags *lags = &memory->lags;
    int64_t slot = lags->first_slot[level] + origin / lags->stride[level] % lags->slots[level];
    return memory->frames + (size_t)slot * frame_doubles(o->plan);
}

static void keep_origins(struct observer *o, const struct sim *sim, int64_t tick)
{
    const struct msd_lags *lags = &((struct msd_memory *)o->memory)->lags;
    for (int64_t l = 0; l < lags->strides; l++) {
        if (tick & (lags->stride[l] - 1))
            break; /* they rise */
        double *frame = frame_at(o, l, tick);
        frame[0] = (double)sim->clock->turns;
        memcpy(frame + 1, sim->seen, (size_t)o->plan->particles * sizeof *frame);
    }
}

static void msd_begin(struct observer *o, const struct sim *sim)
{
    struct msd_memory *memory = o->memory;
    memset(memory, 0, sizeof *memory);
    struct msd_lags *lags = &memory->lags;
    find_lags(o->par, o->plan, lags);
    for (int64_t k = 0; k < lags->count; k++) /* from the origin at tick 0 */
        memory->due[k] = lags->lag[k] > 0 ? lags->lag[k] : INT64_MAX;
    keep_origins(o, sim, 0);
}

static int64_t msd_next(const struct observer *o, int64_t after)
{
    const struct msd_memory *memory = o->memory;
    const struct msd_lags *lags = &memory->lags;
    int64_t next = (after | (lags->stride[0] - 1)) + 1; /* the next origin */
    for (int64_t k = 0; k < lags->count; k++)
        next = memory->due[k] < next ? memory->due[k] : next;
    return next;
}

static void msd_sample(struct observer *o, const struct sim *sim)
{
    struct msd_memory *memory = o->memory;
    const struct msd_lags *lags = &memory->lags;
    const struct plan *plan = o->plan;
    int64_t tick = sim_measured(sim);
    for (int64_t k = 0; k < lags->count; k++) {
        if (memory->due[k] != tick)
            continue;
        memory->due[k] += lags->stride[lags->level[k]];
        const double *frame = frame_at(o, lags->level[k], tick - lags->lag[k]);
        double turned = ((double)sim->clock->turns - frame[0]) * plan->length;
        memory->sum[k] += sum_squared_displacement(sim->seen, frame + 1, plan->particles, turned);
        memory->origins[k]++;
    }
    keep_origins(o, sim, tick);
}

static void msd_end_block(struct observer *o, const struct sim *sim, double *values)
{
    (void)sim;
    struct msd_memory *memory = o->memory;
    memory->block++;
    for (size_t k = 0; k < o->count; k++) {
        values[k] = NAN;
        if (memory->block % memory->lags.gather[k] != 0 || memory->origins[k] == 0 ||
            memory->lags.lag[k] == 0)
            continue;
        values[k] = memory->sum[k] / ((double)memory->origins[k] * (double)o->plan->particles);
        memory->sum[k] = 0;
        memory->origins[k] = 0;
    }
}

/* ----------------------------------------------------------------- result */

static enum bcd_status msd_describe(const void *par, const struct plan *plan,
                                    const struct moments *moments, struct bcd_table *table)
{
    (void)moments;
    struct msd_lags lags;
    find_lags(par, plan, &lags);
    table_describe(table, "msd", (size_t)lags.count);
    table_axes(table, "lag time t", "MSD \xe2\x9f\xa8[x(t) - x(0)]\xc2\xb2\xe2\x9f\xa9");
    table->log_x = table->log_y = true;
    double *lag = table_add(table, "lag", BCD_ROLE_X);
    if (!lag)
        return BCD_NO_MEMORY;
    for (int64_t k = 0; k < lags.count; k++)
        lag[k] = (double)lags.lag[k] * plan->time_step;
    return BCD_OK;
}

/* Pairs of (rod, origin) that every lag was averaged over. */
static enum bcd_status msd_extend(const void *par, const struct plan *plan, struct bcd_table *table)
{
    struct msd_lags lags;
    find_lags(par, plan, &lags);
    double *samples = table_add(table, "samples", BCD_ROLE_OTHER);
    if (!samples)
        return BCD_NO_MEMORY;
    for (int64_t k = 0; k < lags.count; k++) {
        int64_t origins = (plan->steps - lags.lag[k]) / lags.stride[lags.level[k]] + 1;
        samples[k] = (double)origins * (double)plan->particles * (double)plan->realizations;
    }
    return BCD_OK;
}

/* MSD of one rod in a potential after long times: 2 D_eff t (Lifson, Jackson). */
static void one_rod_asymptote(const struct plan *plan, const struct msd_lags *lags,
                              struct exact *exact)
{
    struct one_rod rod = {.energy = plan_energy,
                          .ctx = plan,
                          .period = plan->period,
                          .kT = plan->temperature,
                          .D = plan->diffusion,
                          .energy_ns = plan_energy_ns(plan),
                          .watch = exact->watch};
    double diffusion;
    if (lifson_jackson(&diffusion, &rod, NULL))
        return;
    for (size_t k = 0; k < exact->rows; k++) {
        double msd = 2 * diffusion * (double)lags->lag[k] * plan->time_step;
        exact->values[k] = msd > plan->period * plan->period ? msd : NAN; /* else not long */
    }
    exact->reference = "asymptote";
}

/* Between walls one free rod is known. */
static void exact_between_walls(const struct plan *plan, const struct msd_lags *lags,
                                struct exact *exact)
{
    exact->reason = "no closed form between walls but for one free rod";
    if (plan->particles > 1 || plan->field || plan->force != 0)
        return;
    for (size_t k = 0; k < exact->rows; k++)
        exact->values[k] = msd_between_walls(plan->free_length, plan->diffusion,
                                             (double)lags->lag[k] * plan->time_step);
    exact->reference = "canonical";
}

/* Without potential and interaction: the exact single file on the ring, plus what a drag adds. */
static void msd_exact(const void *par, const struct plan *plan, struct exact *exact)
{
    struct msd_lags lags;
    find_lags(par, plan, &lags);
    if (plan->walls) {
        exact_between_walls(plan, &lags, exact);
        return;
    }
    exact->reason = "no closed form for rods in a potential or with an interaction";
    if (plan->pair || (plan->field && plan->particles > 1))
        return;
    if (plan->field && plan_field_steady(plan) && plan->force == 0 && plan->temperature > 0)
        one_rod_asymptote(plan, &lags, exact);
    if (plan->field)
        return;
    const struct single_file ring = {
        plan->particles, plan->length, plan->diameter, plan->diffusion, exact->watch};
    for (size_t k = 0; k < exact->rows; k++) {
        double t = (double)lags.lag[k] * plan->time_step;
        double drift = plan->mobility * plan->force * t;
        double spread = plan->free_length > 0 && plan->particles > 1 && plan->diffusion > 0
                            ? single_file_msd_watched(&ring, t)
                            : 2 * plan->diffusion * t / (double)plan->particles;
        exact->values[k] = spread + drift * drift;
    }
    exact->reference = "canonical";
}

static double msd_exact_ns(const void *par, const struct plan *plan)
{
    struct msd_lags lags;
    double ns = 0;
    if (plan->walls || plan->pair || plan->field || plan->particles < 2 || plan->free_length <= 0)
        return 0;
    const struct single_file ring = {
        plan->particles, plan->length, plan->diameter, plan->diffusion, NULL};
    spread_lags(par, plan->fine, &lags);
    for (int64_t k = 0; k < lags.count; k++)
        ns += single_file_msd_ns(&ring, (double)lags.lag[k] * plan->time_step);
    return ns;
}

const struct observable_type observable_msd = {
    .base = {.part = {.name = "msd",
                      .doc = "mean squared displacement of tagged rods",
                      .params = msd_params},
             .par_size = sizeof(struct msd_par)},
    .check = msd_check,
    .time_step_max = msd_time_step_max,
    .value = "msd",
    .dynamic = true,
    .mid_drift = true,
    .count = msd_count,
    .step_ns = msd_step_ns,
    .memory = msd_memory,
    .begin = msd_begin,
    .next = msd_next,
    .sample = msd_sample,
    .end_block = msd_end_block,
    .describe = msd_describe,
    .extend = msd_extend,
    .exact = msd_exact,
    .exact_ns = msd_exact_ns,
};
