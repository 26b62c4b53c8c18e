/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * contact_force - forces with which neighbours in contact push each other: doi
 * 10.1103/PhysRevE.106.054606, Eq. 8. Their distribution over the pairs that push, as a probability
 * density over 0 .. last; the notes give the share of pushes beyond that (the density integrates to
 * 1 less that share), the mean force over all pairs of neighbours, whether they push or not, with
 * its standard error, the share of neighbours that push, and the largest push (mean over the
 * samples: realizations or blocks).
 *
 * With noise the force of a single step is what holds back displacements of sqrt(2 D h): its
 * distribution widens as h^(-1/2), and the share of neighbours that push falls as h^(1/2). The mean
 * over all pairs converges. In equilibrium it is kT times the probability density of gap 0, the
 * pressure of the walls that neighbours are to each other, but for what the method does to
 * contacts: rods that seem shorter by 1.165 sqrt(D h) push less.
 */
#include "part.h"
#include "table.h"

#include <math.h>
#include <string.h>

struct force_par {
    int64_t bins;
    double last;
};

/* The values of a sample: the bins, then these. */
enum { MEAN, PUSHING, LARGEST, BEYOND, EXTRAS };

/* The block in progress; the bins' counts and room for the forces of all rods follow it. */
struct force_memory {
    int64_t samples, pushes, beyond;
    double sum, largest;
    int64_t bin[];
};

static const struct bcd_param force_params[] = {
    {.name = "bins",
     .type = BCD_PARAM_INTEGER,
     .min = 1,
     .max = 100000,
     .fallback = 50,
     .doc = "bins over [0, last]",
     .offset = offsetof(struct force_par, bins)},
    {.name = "last",
     .type = BCD_PARAM_AUTO,
     .above_min = true,
     .unit = "force",
     .min = 0,
     .max = 1e30,
     .fallback = NAN,
     .doc = "largest force; auto = four times what the noise of a step exerts, and twice what "
            "potential and drag do",
     .offset = offsetof(struct force_par, last)},
    {0},
};

/* Of the scene's own time step, also where a second pass takes longer ones. */
static double force_last(const void *par, const struct plan *plan)
{
    double last = ((const struct force_par *)par)->last;
    if (!isnan(last))
        return last;
    double reach = sqrt(2 * plan->diffusion * plan->fine->time_step);
    double usual = 4 * reach / (plan->mobility * plan->fine->time_step) + 2 * fabs(plan->force);
    if (plan->field) { /* a cosine's force is at most curvature * wavelength / (2 pi) */
        double period = fmin(plan->potential->period(plan->potential_par), plan->length);
        usual += plan->potential->curvature_max(plan->potential_par) * period / 3.14159265358979;
    }
    return usual > 0 && isfinite(usual) ? usual : 1;
}

static size_t force_bins(const void *par)
{
    return (size_t)((const struct force_par *)par)->bins;
}

static size_t force_count(const void *par, const struct plan *plan)
{
    (void)plan;
    return force_bins(par) + EXTRAS;
}

static size_t force_memory(const void *par, const struct plan *plan)
{
    return sizeof(struct force_memory) + force_bins(par) * sizeof(int64_t) +
           (size_t)plan->particles * sizeof(double);
}

/* A look is a step taken on copies. */
static double force_sample_ns(const void *par, const struct plan *plan)
{
    (void)par;
    return plan->method->step_ns + 6;
}

static void force_begin(struct observer *o, const struct sim *sim)
{
    (void)sim;
    memset(o->memory, 0, force_memory(o->par, o->plan));
}

static int64_t pairs_of(const struct plan *plan)
{
    return plan->particles - (plan->walls || plan->particles == 1);
}

static void force_sample(struct observer *o, const struct sim *sim)
{
    const struct plan *plan = o->plan;
    struct force_memory *memory = o->memory;
    const int64_t bins = (int64_t)force_bins(o->par);
    const double per_force = (double)bins / force_last(o->par, plan);
    double *force = (double *)(memory->bin + bins);
    struct sim now = *sim; /* methods look ahead with memory of their own and leave the run alone */
    plan->method->contact_forces(&now, force);
    for (int64_t i = 0; i < plan->particles; i++) {
        if (!(force[i] > 0))
            continue;
        double at = force[i] * per_force;
        memory->pushes++;
        memory->sum += force[i];
        memory->largest = fmax(memory->largest, force[i]);
        if (at < (double)bins)
            memory->bin[(int64_t)at]++;
        else
            memory->beyond++;
    }
    memory->samples++;
}

static void force_end_block(struct observer *o, const struct sim *sim, double *values)
{
    const struct force_memory *memory = o->memory;
    const size_t bins = force_bins(o->par);
    const double width = force_last(o->par, o->plan) / (double)bins;
    const double pushes = (double)memory->pushes; /* 0: NaN, nothing to say */
    const double looks = (double)memory->samples * (double)pairs_of(o->plan);
    for (size_t i = 0; i < bins; i++)
        values[i] = pushes > 0 ? (double)memory->bin[i] / (pushes * width) : NAN;
    values[bins + MEAN] = looks > 0 ? memory->sum / looks : NAN;
    values[bins + PUSHING] = looks > 0 ? pushes / looks : NAN;
    values[bins + LARGEST] = looks > 0 ? memory->largest : NAN;
    values[bins + BEYOND] = pushes > 0 ? (double)memory->beyond / pushes : NAN;
    force_begin(o, sim);
}

static void note_extras(const struct moments *moments, size_t bins, struct bcd_table *table)
{
    static const char *const names[] = {[MEAN] = "mean_force",
                                        [PUSHING] = "pushing_fraction",
                                        [LARGEST] = "largest_force",
                                        [BEYOND] = "beyond_last"};
    for (size_t k = 0; k < EXTRAS; k++) {
        double samples = moments->samples[bins + k];
        table_note_number(table, names[k], samples > 0 ? moments->mean[bins + k] : NAN);
        if (k == MEAN)
            table_note_number(
                table, "mean_force_stderr",
                samples > 1 ? sqrt(moments->square[bins + k] / (samples * (samples - 1))) : NAN);
    }
}

static enum bcd_status force_describe(const void *par, const struct plan *plan,
                                      const struct moments *moments, struct bcd_table *table)
{
    size_t bins = force_bins(par);
    table_describe(table, "contact_force", bins);
    table_axes(table, "contact force", "probability density");
    table->log_y = true;
    if (moments)
        note_extras(moments, bins, table);
    return table_add_centres(table, "force", force_last(par, plan));
}

const struct observable_type observable_contact_force = {
    .base = {.part = {.name = "contact_force",
                      .doc = "forces with which neighbours in contact push each other",
                      .params = force_params},
             .par_size = sizeof(struct force_par)},
    .sample_ns = force_sample_ns,
    .value = "probability_density",
    .dynamic = true,
    .contact_forces = true,
    .no_time_step_error =
        "forces within one step have no limit with noise: they grow as time_step^(-1/2) "
        "and fewer neighbours push; their mean converges",
    .count = force_count,
    .memory = force_memory,
    .begin = force_begin,
    .sample = force_sample,
    .end_block = force_end_block,
    .describe = force_describe,
};
