/* SPDX-License-Identifier: GPL-3.0-or-later
 * formula_values.c - runs the byte code of formula_code.h over blocks of points. Derivatives by
 * forward mode: every step turns (f, f', f'') of its operands into its own; A. Griewank and
 * A. Walther, Evaluating Derivatives (2008), chapter 3. */
#include "elementary.h"
#include "formula_code.h"
#include "simd.h"

#include <math.h>
#include <stddef.h>

enum { BLOCK = 64, LANES = 8 };

/* One place of the stack: f, f', f'' at every point of the block. */
struct slot {
    double f[BLOCK], d[BLOCK], dd[BLOCK];
};

/* Takes top (and top[1], if it takes two), leaves top; n points. */
typedef void step_function(struct slot *top, double operand, int n);

static void push_constant(struct slot *top, double operand, int n)
{
    for (int j = 0; j < n; j++) {
        top->f[j] = operand;
        top->d[j] = top->dd[j] = 0;
    }
}

KERNEL_CLONES
static void step_scale(struct slot *top, double operand, int n)
{
    for (int j = 0; j < n; j++) {
        top->f[j] *= operand;
        top->d[j] *= operand;
        top->dd[j] *= operand;
    }
}

KERNEL_CLONES
static void step_shift(struct slot *top, double operand, int n)
{
    for (int j = 0; j < n; j++)
        top->f[j] += operand;
}

/* Of a function g of one argument: g(f), g'(f), g''(f). */
struct outer {
    double g, d, dd;
};

static inline void chain(struct slot *top, int j, struct outer g)
{
    double d = top->d[j], dd = top->dd[j];
    top->f[j] = g.g;
    top->d[j] = g.d * d;
    top->dd[j] = g.dd * (d * d) + g.d * dd;
}

/* step_NAME applies the function outer_NAME to all points. */
#define STEP_OF_ONE(name)                                                                          \
    KERNEL_CLONES                                                                                  \
    static void step_##name(struct slot *top, double operand, int n)                               \
    {                                                                                              \
        (void)operand;                                                                             \
        for (int j = 0; j < n; j++)                                                                \
            chain(top, j, outer_##name(top->f[j]));                                                \
    }

static inline struct outer outer_sin(double f)
{
    double s = sin_any(f), c = cos_any(f);
    return (struct outer){s, c, -s};
}

static inline struct outer outer_cos(double f)
{
    double s = sin_any(f), c = cos_any(f);
    return (struct outer){c, -s, -c};
}

static inline struct outer outer_tan(double f)
{
    double t = tan_any(f), d = 1 + t * t;
    return (struct outer){t, d, 2 * t * d};
}

static inline struct outer outer_asin(double f)
{
    double q = 1 / ((1 - f) * (1 + f)), d = sqrt(q);
    return (struct outer){arc_sine(f), d, f * q * d};
}

static inline struct outer outer_acos(double f)
{
    double q = 1 / ((1 - f) * (1 + f)), d = sqrt(q);
    return (struct outer){arc_cosine(f), -d, -(f * q * d)};
}

static inline struct outer outer_atan(double f)
{
    double d = 1 / (1 + f * f);
    return (struct outer){arc_tangent(f), d, -2 * (f * d) * d};
}

static inline struct outer outer_sinh(double f)
{
    double s = sinh_any(f), c = cosh_any(f);
    return (struct outer){s, c, s};
}

static inline struct outer outer_cosh(double f)
{
    double s = sinh_any(f), c = cosh_any(f);
    return (struct outer){c, s, c};
}

static inline struct outer outer_tanh(double f)
{
    double t = tanh_any(f), c = cosh_any(f), d = 1 / (c * c);
    return (struct outer){t, d, -2 * t * d};
}

static inline struct outer outer_exp(double f)
{
    double e = exp_any(f);
    return (struct outer){e, e, e};
}

static inline struct outer outer_log(double f)
{
    double d = f >= 0 ? 1 / f : NAN;
    return (struct outer){log_any(f), d, -d * d};
}

static inline struct outer outer_sqrt(double f)
{
    double r = sqrt(f), d = 0.5 / r;
    return (struct outer){r, d, -0.5 * d / f};
}

static inline struct outer outer_abs(double f)
{
    double sign = f > 0 ? 1 : f < 0 ? -1 : f;
    return (struct outer){absolute(f), sign, 0};
}

STEP_OF_ONE(sin)
STEP_OF_ONE(cos)
STEP_OF_ONE(tan)
STEP_OF_ONE(asin)
STEP_OF_ONE(acos)
STEP_OF_ONE(atan)
STEP_OF_ONE(sinh)
STEP_OF_ONE(cosh)
STEP_OF_ONE(tanh)
STEP_OF_ONE(exp)
STEP_OF_ONE(log)
STEP_OF_ONE(sqrt)
STEP_OF_ONE(abs)
#undef STEP_OF_ONE

/* Whole exponents up to 64 by multiplication; further ones by exponential and logarithm. */
static const double whole_max = 64;

/* out = x^k by squaring. */
KERNEL_CLONES
static void power_whole(const double *x, unsigned k, double *out, int n)
{
    double square[BLOCK];
    for (int j = 0; j < n; j++) {
        square[j] = x[j];
        out[j] = 1;
    }
    for (; k; k >>= 1) {
        if (k & 1)
            for (int j = 0; j < n; j++)
                out[j] *= square[j];
        for (int j = 0; j < n; j++)
            square[j] *= square[j];
    }
}

KERNEL_CLONES
static void raise_whole(struct slot *top, double a, int n)
{
    double low[BLOCK]; /* x^(a-2), or x^-a for a negative one */
    power_whole(top->f, (unsigned)(a >= 2 ? a - 2 : -a), low, n);
    for (int j = 0; j < n; j++) {
        double x = top->f[j], p, d, dd;
        if (a >= 2) {
            dd = low[j];
            d = dd * x;
            p = d * x;
        } else {
            p = 1 / low[j];
            d = p / x;
            dd = d / x;
        }
        chain(top, j, (struct outer){p, a * d, a * (a - 1) * dd});
    }
}

/* x^a; negative x take whole exponents only. */
static inline double power_signed(double x, double a)
{
    double sign = x < 0 && a == round_whole(a) ? sign_of_parity(a) : 1;
    return sign * power_any(sign == 1 && a != round_whole(a) ? x : absolute(x), a);
}

KERNEL_CLONES
static void raise_far(struct slot *top, double a, int n)
{
    for (int j = 0; j < n; j++) {
        double x = top->f[j];
        chain(top, j,
              (struct outer){power_signed(x, a), a * power_signed(x, a - 1),
                             a * (a - 1) * power_signed(x, a - 2)});
    }
}

static void step_raise(struct slot *top, double a, int n)
{
    if (a == 0)
        push_constant(top, 1, n);
    else if (a == 1)
        return;
    else if (a == round_whole(a) && absolute(a) <= whole_max)
        raise_whole(top, a, n);
    else
        raise_far(top, a, n);
}

KERNEL_CLONES
static void step_add(struct slot *top, double operand, int n)
{
    (void)operand;
    for (int j = 0; j < n; j++) {
        top->f[j] += top[1].f[j];
        top->d[j] += top[1].d[j];
        top->dd[j] += top[1].dd[j];
    }
}

KERNEL_CLONES
static void step_subtract(struct slot *top, double operand, int n)
{
    (void)operand;
    for (int j = 0; j < n; j++) {
        top->f[j] -= top[1].f[j];
        top->d[j] -= top[1].d[j];
        top->dd[j] -= top[1].dd[j];
    }
}

KERNEL_CLONES
static void step_multiply(struct slot *top, double operand, int n)
{
    (void)operand;
    for (int j = 0; j < n; j++) {
        double a = top->f[j], da = top->d[j], b = top[1].f[j], db = top[1].d[j];
        top->f[j] = a * b;
        top->d[j] = da * b + a * db;
        top->dd[j] = (top->dd[j] * b + a * top[1].dd[j]) + 2 * (da * db);
    }
}

/* q = a / b:  q' = (a' - q b') / b,  q'' = (a'' - 2 q' b' - q b'') / b. */
KERNEL_CLONES
static void step_divide(struct slot *top, double operand, int n)
{
    (void)operand;
    for (int j = 0; j < n; j++) {
        double b = top[1].f[j], db = top[1].d[j], q = top->f[j] / b;
        double dq = (top->d[j] - q * db) / b;
        top->f[j] = q;
        top->d[j] = dq;
        top->dd[j] = ((top->dd[j] - 2 * (dq * db)) - q * top[1].dd[j]) / b;
    }
}

/* a^b = exp(w), w = b ln a, for a > 0; where a is 0 only the value is known. */
KERNEL_CLONES
static void step_power(struct slot *top, double operand, int n)
{
    (void)operand;
    for (int j = 0; j < n; j++) {
        double a = top->f[j], b = top[1].f[j], db = top[1].d[j];
        double p = power_any(a, b), log = log_any(a), ra = top->d[j] / a;
        double dw = db * log + b * ra;
        double ddw = (top[1].dd[j] * log + 2 * (db * ra)) + b * (top->dd[j] / a - ra * ra);
        top->f[j] = p;
        top->d[j] = p * dw;
        top->dd[j] = p * (dw * dw + ddw);
    }
}

static inline void choose(struct slot *top, int j, int second)
{
    top->f[j] = second ? top[1].f[j] : top->f[j];
    top->d[j] = second ? top[1].d[j] : top->d[j];
    top->dd[j] = second ? top[1].dd[j] : top->dd[j];
}

static void step_min(struct slot *top, double operand, int n)
{
    (void)operand;
    for (int j = 0; j < n; j++) /* the second if it is less, or not a number */
        choose(top, j, top[1].f[j] < top->f[j] || isnan(top[1].f[j]));
}

static void step_max(struct slot *top, double operand, int n)
{
    (void)operand;
    for (int j = 0; j < n; j++)
        choose(top, j, top[1].f[j] > top->f[j] || isnan(top[1].f[j]));
}

static step_function *function_of(enum formula_code code)
{
    static step_function *const functions[CODES] = {
        [CODE_CONSTANT] = push_constant, [CODE_SCALE] = step_scale,
        [CODE_SHIFT] = step_shift,       [CODE_RAISE] = step_raise,
        [CODE_SIN] = step_sin,           [CODE_COS] = step_cos,
        [CODE_TAN] = step_tan,           [CODE_ASIN] = step_asin,
        [CODE_ACOS] = step_acos,         [CODE_ATAN] = step_atan,
        [CODE_SINH] = step_sinh,         [CODE_COSH] = step_cosh,
        [CODE_TANH] = step_tanh,         [CODE_EXP] = step_exp,
        [CODE_LOG] = step_log,           [CODE_SQRT] = step_sqrt,
        [CODE_ABS] = step_abs,           [CODE_ADD] = step_add,
        [CODE_SUBTRACT] = step_subtract, [CODE_MULTIPLY] = step_multiply,
        [CODE_DIVIDE] = step_divide,     [CODE_POWER] = step_power,
        [CODE_MIN] = step_min,           [CODE_MAX] = step_max,
    };
    return functions[code];
}

static void push_variable(struct slot *top, const double *x, int count, int n)
{
    for (int j = 0; j < n; j++) {
        top->f[j] = x[j < count ? j : count - 1]; /* whole registers: the last point repeats */
        top->d[j] = 1;
        top->dd[j] = 0;
    }
}

/* The result stands in stack[0]. */
static void run_block(const struct formula *formula, const double *x, int count, struct slot *stack)
{
    int n = (count + LANES - 1) / LANES * LANES, depth = 0;
    for (int i = 0; i < formula->count; i++) {
        const struct formula_step *step = &formula->steps[i];
        depth += step->code <= CODE_VARIABLE ? 1 : step->code >= CODE_ADD ? -1 : 0;
        if (step->code == CODE_VARIABLE)
            push_variable(&stack[depth - 1], x, count, n);
        else
            function_of(step->code)(&stack[depth - 1], step->operand, n);
    }
}

void formula_values(const struct formula *formula, const double *x, size_t count, double *values,
                    double *first, double *second)
{
    struct slot stack[FORMULA_STACK_MAX];
    for (size_t start = 0; start < count; start += BLOCK) {
        int n = count - start < BLOCK ? (int)(count - start) : BLOCK;
        run_block(formula, x + start, n, stack);
        for (int j = 0; j < n; j++) {
            values[start + (size_t)j] = stack->f[j];
            if (first)
                first[start + (size_t)j] = stack->d[j];
            if (second)
                second[start + (size_t)j] = stack->dd[j];
        }
    }
}

double formula_ns(const struct formula *formula, double points)
{
    const double call = 30, function = 12, operation = 1.5;
    double each = 0;
    for (int i = 0; i < formula->count; i++) {
        enum formula_code code = formula->steps[i].code;
        bool elementary = (code >= CODE_SIN && code <= CODE_SQRT) || code == CODE_POWER;
        each += elementary ? function : operation;
    }
    return each + call * formula->count / points;
}
