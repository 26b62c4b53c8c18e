/* SPDX-License-Identifier: GPL-3.0-or-later
 * tools.c - memory, errors, Gauss-Legendre rules, complex matrices (tools.h). */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tools.h"

enum bcd_status theory_fail(struct bcd_error *error, enum bcd_status code, const char *format, ...)
{
    if (!error) {
        return code;
    }
    va_list args;
    va_start(args, format);
    memset(error, 0, sizeof *error);
    error->code = code;
    vsnprintf(error->text, sizeof error->text, format, args);
    va_end(args);
    return code;
}

struct scratch_block {
    struct scratch_block *next;
    size_t bytes;
    max_align_t data[];
};

void *scratch_bytes(struct scratch *scratch, size_t bytes)
{
    enum { LIMIT = 1 << 30 }; /* no computation here needs a gigabyte in one block */
    struct scratch_block *block = NULL;
    if (watch_take(scratch->watch, (double)bytes) && bytes <= LIMIT) {
        block = calloc(1, sizeof *block + bytes + 1);
    }
    if (!block) {
        watch_take(scratch->watch, -(double)bytes);
        scratch->failed = true;
        return NULL;
    }
    block->bytes = bytes;
    block->next = scratch->blocks;
    scratch->blocks = block;
    return block->data;
}

double *scratch_doubles(struct scratch *scratch, size_t count)
{
    return scratch_bytes(scratch, count * sizeof(double));
}

double complex *scratch_complex(struct scratch *scratch, size_t count)
{
    return scratch_bytes(scratch, count * sizeof(double complex));
}

void scratch_free(struct scratch *scratch)
{
    struct scratch_block *block = scratch->blocks;
    while (block) {
        struct scratch_block *next = block->next;
        watch_take(scratch->watch, -(double)block->bytes);
        free(block);
        block = next;
    }
    scratch->blocks = NULL;
}

/* Newton's method on the Legendre polynomial, from Tricomi's approximation of its roots. */
void gauss_legendre(size_t count, double *node, double *weight)
{
    double n = (double)count;
    for (size_t i = 0; i < count; i++) {
        double x = -cos(PI * ((double)i + .75) / (n + .5)), slope = 1;
        for (int turn = 0; turn < 20; turn++) {
            double p = 1, before = 0;
            for (size_t k = 1; k <= count; k++) {
                double next = ((2. * (double)k - 1) * x * p - ((double)k - 1) * before) / (double)k;
                before = p;
                p = next;
            }
            slope = n * (x * p - before) / (x * x - 1);
            double step = p / slope;
            x -= step;
            if (fabs(step) < 1e-16) {
                break;
            }
        }
        node[i] = x;
        weight[i] = 2 / ((1 - x * x) * slope * slope);
    }
}

void matrix_init(struct matrix *matrix, struct scratch *scratch, size_t n)
{
    matrix->n = n;
    matrix->re = scratch_doubles(scratch, n * n);
    matrix->im = scratch_doubles(scratch, n * n);
}

/* Row i of the product is a combination of the rows of b: unit stride throughout. Two rows of b at
 * a time halve the traffic of the row that is written. */
static void add_two_rows(size_t n, double *restrict const out[2], const double a[4],
                         const double *const b[4])
{
    double *restrict re = out[0], *restrict im = out[1];
    const double *restrict u = b[0], *restrict v = b[1], *restrict s = b[2], *restrict t = b[3];
    double x = a[0], y = a[1], z = a[2], w = a[3];
    for (size_t j = 0; j < n; j++) {
        re[j] += (x * u[j] - y * v[j]) + (z * s[j] - w * t[j]);
        im[j] += (x * v[j] + y * u[j]) + (z * t[j] + w * s[j]);
    }
}

void matrix_multiply(struct matrix *out, const struct matrix *a, const struct matrix *b)
{
    size_t n = a->n;
    memset(out->re, 0, n * n * sizeof(double));
    memset(out->im, 0, n * n * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        double *restrict const row[2] = {out->re + i * n, out->im + i * n};
        for (size_t k = 0; k < n; k += 2) {
            /* n may be odd: the last row then goes twice, once with factor 0. */
            size_t next = k + 1 < n ? k + 1 : k;
            double use = k + 1 < n ? 1 : 0;
            const double factor[4] = {a->re[i * n + k], a->im[i * n + k], use * a->re[i * n + next],
                                      use * a->im[i * n + next]};
            const double *const rows[4] = {b->re + k * n, b->im + k * n, b->re + next * n,
                                           b->im + next * n};
            add_two_rows(n, row, factor, rows);
        }
    }
}

double matrix_norm(const struct matrix *matrix)
{
    size_t n = matrix->n;
    double norm = 0;
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (size_t j = 0; j < n; j++) {
            sum += fabs(matrix->re[i * n + j]) + fabs(matrix->im[i * n + j]);
        }
        norm = sum > norm ? sum : norm;
    }
    return norm;
}
