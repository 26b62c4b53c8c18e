/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * formula.h - energies given as text, "3*cos(2*pi*x) + 0.1*x^2": parsed once into byte code, which
 * knows its own derivatives exactly. Bounded in size, depth and stack; it can reach nothing but its
 * one variable.
 *
 * SYNTAX  numbers, the variable, pi, e, + - * / ^ (right-associative, above unary minus), brackets,
 *         sin cos tan asin acos atan sinh cosh tanh exp log sqrt abs min max (two arguments).
 *         A negative base needs a constant whole exponent. Spaces are free between them.
 * BITS    elementary functions of kernels/elementary.h: the same on every machine.
 *
 * Not taken: libmatheval (unmaintained, libm's bits, a stack without bounds) and muparser (C++,
 * libm's bits, no exact derivatives).
 */
#ifndef KERNELS_FORMULA_H
#define KERNELS_FORMULA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { FORMULA_LENGTH_MAX = 1000, FORMULA_OPERATIONS_MAX = 256, FORMULA_STACK_MAX = 32 };

struct formula; /* opaque; one malloc'ed block without pointers into itself */

/* Parses; on failure NULL, with a complaint that names the place: "character 7: unknown name
 * \"foo\"; known are ...", or "" = no memory. variable: "x" or "r". */
struct formula *formula_create(const char *text, const char *variable, char complaint[160]);
void formula_free(struct formula *formula);

/* values[i], and if not NULL first and second derivatives, at x[i], i = 0 .. count-1, vectorised
 * over blocks of points. Where the formula has no value they are NaN or infinite. */
void formula_values(const struct formula *formula, const double *x, size_t count, double *values,
                    double *first, double *second);

/* What that takes, roughly, in ns for each of so many points at once. */
double formula_ns(const struct formula *formula, double points);

#endif
