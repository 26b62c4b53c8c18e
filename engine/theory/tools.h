/* SPDX-License-Identifier: GPL-3.0-or-later
 * tools.h - what the theory's files share: memory, errors, quadrature, grids, square matrices. */
#ifndef THEORY_TOOLS_H
#define THEORY_TOOLS_H

#include <complex.h>
#include <stdbool.h>

#include "../watch.h"
#include "theory.h"

#define PI 3.14159265358979323846

/* Fills the optional error and returns its code. */
enum bcd_status theory_fail(struct bcd_error *error, enum bcd_status code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Memory of one computation: blocks that are freed together. After a failed request `failed` stays
 * set, so that a group of requests is checked once. Blocks are zeroed. */
struct scratch_block;
struct scratch {
    struct scratch_block *blocks;
    bool failed;
    struct bcd_watch *watch; /* told of every block; may be NULL */
};
double *scratch_doubles(struct scratch *scratch, size_t count);
double complex *scratch_complex(struct scratch *scratch, size_t count);
void *scratch_bytes(struct scratch *scratch, size_t bytes);
void scratch_free(struct scratch *scratch);

/* Gauss-Legendre rule on [-1, 1]; nodes ascending. */
void gauss_legendre(size_t count, double *node, double *weight);

enum { BUMP_RULE = 16 };

/* A system that has been checked, with the potential folded onto one period. */
struct model {
    struct theory_system system;
    struct theory_wanted wanted;
    double period;      /* internal period: that of U, or a convenient fraction of L without U */
    double bin_period;  /* stretch that is divided into bins */
    double lowest;      /* smallest U found: weights are relative to it */
    double free_length; /* ell = L - N sigma > 0 */
    double mean_gap;    /* ell / N */
    double density;     /* N / L */
    double reach;       /* f(g) = 1 from here on */
    double bond;        /* weight of the delta function at g = 0 */
    bool any_pressure;  /* the transfer operator is wanted near the mean gap, not exactly at it */
    double node[BUMP_RULE], weight[BUMP_RULE]; /* Gauss-Legendre, for the bump */
};
enum bcd_status model_init(struct model *model, const struct theory_system *system,
                           const struct theory_wanted *wanted, struct bcd_error *error);
/* The same between walls: period = system.period or L, bin_period = L; model_init refuses walls. */
enum bcd_status model_init_walls(struct model *model, const struct theory_system *system,
                                 const struct theory_wanted *wanted, struct bcd_error *error);
/* Whether they refuse the system for what it is, no energy looked at. */
bool model_refuses(const struct theory_system *system);
/* Nominal ns of one Boltzmann factor. */
double model_weight_ns(const struct model *model);
/* Counts ns; false: whatever is being computed is to end, with any values: its caller's caller,
 * refine or another that answers, makes BCD_STOPPED of it. */
static inline bool model_spend(const struct model *model, double ns)
{
    return watch_spend(model->system.watch, ns);
}
double model_energy(const struct model *model, double x);
/* exp(-(U - lowest)/kT), with a force U - f x in U's place. */
double model_weight(const struct model *model, double x);
double model_bump(const struct model *model, double gap); /* f(g) - 1 without delta function */

/* A measure on gaps g >= 0: uniform on [from, to], a delta function at 0, and points. */
struct measure {
    double from, to; /* to = INFINITY: the whole line; from == to: no uniform part */
    double delta;
    size_t count, capacity;
    double *gap, *weight; /* [count] */
};
/* f(g) dg on [from, to), to be integrated against waves up to the given wave number. The memory is
 * the scratch's. from = 0 includes the delta function. */
enum bcd_status measure_init(struct measure *measure, const struct model *model,
                             struct scratch *scratch, const double range[2], double wave_number);
/* Quadrature of the bump f - 1 over [from, to]; the points are appended. */
void measure_add_bump(struct measure *measure, const struct model *model, const double range[2],
                      double wave_number);
size_t measure_capacity(const struct model *model, const double range[2], double wave_number);

/* n (odd) equidistant points of one period and their Fourier modes k = -half .. half. */
struct grid {
    size_t n, half;
    double period;
    double *x, *weight, *energy; /* [n] */
    double complex *root;        /* [n] exp(2 pi i j / n) */
    struct bcd_watch *watch;     /* the model's; may be NULL */
};
void grid_init(struct grid *grid, const struct model *model, struct scratch *scratch, size_t n);
/* Fourier coefficients c_k, k = 0 .. half, of a real function: f = sum_k c_k exp(i kappa_k x). */
void grid_analyse(const struct grid *grid, const double *values, double complex *coefficient);
/* Mean of the function over each of `bins` equal bins of [0, length). */
void grid_bins(const struct grid *grid, const double complex *coefficient, double length,
               double *mean, size_t bins);

/* Fourier multiplier of  psi -> int measure(dg) e^{-s g} psi(x + sigma + g)  for modes -half..half;
 * with moment = 1 the measure is multiplied by g. */
struct kernel_args {
    const struct grid *grid;
    const struct measure *measure;
    double diameter;
    double complex s;
    int moment;
};
void kernel_modes(const struct kernel_args *args, double complex *mode);
/* First column g_d of the circulant matrix of these modes: matrix_ij = g_{(i-j) mod n}. */
void kernel_column(const struct grid *grid, const double complex *mode, double complex *column);

/* Complex square matrices, real and imaginary parts apart. */
struct matrix {
    size_t n;
    double *re, *im; /* [n][n] */
};
void matrix_init(struct matrix *matrix, struct scratch *scratch, size_t n);
void matrix_multiply(struct matrix *out, const struct matrix *a, const struct matrix *b);
double matrix_norm(const struct matrix *matrix); /* largest sum of |re| + |im| over a row */

/* Results. */
enum bcd_status result_create(struct theory_result **result, const struct theory_wanted *wanted);
double result_distance(const struct theory_result *a, const struct theory_result *b,
                       const struct model *model);

/* Computes on finer and finer grids until two in a row agree, or the watch ends it. compute returns
 * BCD_INVALID when its grid is too coarse, BCD_INTERNAL when finer ones would be of no use, both
 * with a text for the caller. */
struct refinement {
    enum bcd_status (*compute)(struct theory_result **result, const struct model *model,
                               size_t level, struct bcd_error *error);
    size_t levels;
    const char *what;
};
enum bcd_status refine(struct theory_result **result, const struct model *model,
                       const struct theory_wanted *wanted, const struct refinement *how,
                       struct bcd_error *error);

#endif
