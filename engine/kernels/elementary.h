/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * elementary.h - the elementary functions on the trajectory's path: branch-free, so that loops over
 * them are vectorised, and made of IEEE additions, multiplications, divisions and square roots
 * alone, so that every compiler, libm and x86-64 processor gives the same bits (needs
 * -ffp-contract=off). Polynomials: minimax in the squared argument, errors below 3e-19 and 5e-18
 * relative before rounding.
 */
#ifndef KERNELS_ELEMENTARY_H
#define KERNELS_ELEMENTARY_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* Nearest integer, ties to even; |x| < 2^51. Adding 1.5 * 2^52 rounds to whole numbers. */
static inline double round_whole(double x)
{
    const double magic = 6755399441055744.0;
    return (x + magic) - magic;
}

static inline double absolute(double x)
{
    return x < 0 ? -x : x;
}

static inline double from_bits(uint64_t bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static inline uint64_t to_bits(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* A whole number below 2^52, without a conversion: 2^52 + i is exact. */
static inline double number(int64_t i)
{
    return from_bits(0x4330000000000000u | (uint64_t)i) - 4503599627370496.0;
}

/* sin(2 pi v) for |v| <= 1/4. */
static inline double sin_quarter(double v)
{
    double z = v * v;
    double p = 0x1.9d1b88179ce9fp-4;
    p = p * z - 0x1.6f7977188bfe9p-1;
    p = p * z + 0x1.e8f35e9daaa94p+1;
    p = p * z - 0x1.e3074ddd1e8c9p+3;
    p = p * z + 0x1.50783485190efp+5;
    p = p * z - 0x1.32d2cce627543p+6;
    p = p * z + 0x1.466bc6775aa6ep+6;
    p = p * z - 0x1.4abbce625be52p+5;
    p = p * z + 0x1.921fb54442d18p+2;
    return p * v;
}

/* sin(2 pi u) and cos(2 pi u) for |u| <= 1/2. */
static inline double sin_half(double u)
{
    double a = fabs(u), back = 0.5 - a;
    double s = sin_quarter(a < back ? a : back);
    return from_bits(to_bits(s) ^ (to_bits(u) & 0x8000000000000000u));
}

static inline double cos_half(double u)
{
    return sin_quarter(0.25 - fabs(u));
}

/* sin(2 pi u) and cos(2 pi u) for |u| < 2^51: the argument counts turns. */
static inline double sin_turns(double u)
{
    return sin_half(u - round_whole(u));
}

static inline double cos_turns(double u)
{
    return cos_half(u - round_whole(u));
}

/* ln x for normal positive x: x = m 2^e with m in [sqrt 1/2, sqrt 2), ln m = 2 artanh(s). */
static inline double log_normal(double x)
{
    const uint64_t sqrt_half = 0x3fe6a09e667f3bcdu, one = 0x3ff0000000000000u;
    uint64_t shifted = to_bits(x) + (one - sqrt_half);
    /* The exponent as a double without an integer conversion: 2^52 + biased exponent. */
    double e = from_bits((shifted >> 52) | 0x4330000000000000u) - (4503599627370496.0 + 1023.0);
    double m = from_bits((shifted & 0x000fffffffffffffu) + sqrt_half);
    double s = (m - 1.0) / (m + 1.0);
    double z = s * s;
    double p = 0x1.2b5fb9f34d9dep-3;
    p = p * z + 0x1.39fdb9a93a519p-3;
    p = p * z + 0x1.7462ba254dcfbp-3;
    p = p * z + 0x1.c71c62d046370p-3;
    p = p * z + 0x1.2492492e03df2p-2;
    p = p * z + 0x1.9999999995224p-2;
    p = p * z + 0x1.5555555555558p-1;
    const double ln2_high = 0x1.62e42fefa3800p-1, ln2_low = 0x1.ef35793c76730p-45;
    return e * ln2_high + (2.0 * s + (s * z * p + e * ln2_low));
}

/* exp(x), |x| <= 700: 2^k times a minimax polynomial (relative error 4e-20) on |r| <= ln 2 / 2. */
static inline double exp_bounded(double x)
{
    const double ln2_high = 0x1.62e42fefa3800p-1, ln2_low = 0x1.ef35793c76730p-45;
    double k = round_whole(x * 1.4426950408889634);
    double r = (x - k * ln2_high) - k * ln2_low;
    double p = 0x1.1e505e389cb2cp-29;
    p = p * r + 0x1.af773c85ce13cp-26;
    p = p * r + 0x1.27e5aeb931e77p-22;
    p = p * r + 0x1.71dde82a22190p-19;
    p = p * r + 0x1.a01a013379fccp-16;
    p = p * r + 0x1.a01a01b7a5deep-13;
    p = p * r + 0x1.6c16c16c333cdp-10;
    p = p * r + 0x1.111111110dcadp-7;
    p = p * r + 0x1.55555555554ecp-5;
    p = p * r + 0x1.5555555555562p-3;
    p = p * r + 0.5;
    p = p * r + 1.0;
    p = p * r + 1.0;
    /* The sum's low bits are the whole number k + 1023, shifted into the exponent. */
    return p * from_bits(to_bits(k + (4503599627370496.0 + 1023.0)) << 52);
}

/* atan(x) for finite x: reduced to |t| <= tan(pi/8), minimax in t^2 (relative error 2e-16). */
static inline double arc_tangent(double x)
{
    const double eighth = 0.41421356237309503, three_eighths = 2.414213562373095;
    const double quarter_turn = 1.5707963267948966;
    double a = fabs(x);
    double up = a > three_eighths ? -1.0 : a > eighth ? a - 1.0 : a;
    double down = a > three_eighths ? a : a > eighth ? a + 1.0 : 1.0;
    double offset = a > three_eighths ? quarter_turn : a > eighth ? quarter_turn / 2 : 0.0;
    double t = up / down, z = t * t;
    double p = 0x1.75b2c6994ac59p-6;
    p = p * z - 0x1.6fa4d2b9767c1p-5;
    p = p * z + 0x1.d60a13a883f56p-5;
    p = p * z - 0x1.1060e74be9880p-4;
    p = p * z + 0x1.3b06d3c64cea8p-4;
    p = p * z - 0x1.745c839d2734ep-4;
    p = p * z + 0x1.c71c6df4e6969p-4;
    p = p * z - 0x1.2492491e20141p-3;
    p = p * z + 0x1.999999999126bp-3;
    p = p * z - 0x1.5555555555547p-2;
    double r = offset + (t + t * z * p);
    return x < 0 ? -r : r;
}

/* x^a for normal x > 0, as long as a ln x <= 700; 0 below exp(-700). */
static inline double power(double x, double a)
{
    double exponent = a * log_normal(x);
    return exponent < -700 ? 0 : exp_bounded(exponent);
}

/* ------------------------------------------- over the whole range of doubles
 * Accurate to a few units in the last place; NaN where a function has no value, infinite beyond
 * the largest double. */

static inline double exp_any(double x)
{
    double bounded = x > 1000 ? 1000 : x < -1000 ? -1000 : x;
    int direct = absolute(bounded) <= 700;
    double root = exp_bounded(direct ? bounded : bounded * 0.5);
    return direct ? root : root * root;
}

static inline double log_any(double x)
{
    int tiny = x < 0x1p-1022;
    double y = log_normal(tiny ? x * 0x1p54 : x) - (tiny ? 37.429947750237046 : 0.0);
    y = x == INFINITY ? INFINITY : x == 0 ? -INFINITY : y;
    return x >= 0 ? y : NAN;
}

/* e^x - 1 for |x| <= ln 2 / 2, as exp_bounded. */
static inline double exp_minus_one_small(double x)
{
    double p = 0x1.1e505e389cb2cp-29;
    p = p * x + 0x1.af773c85ce13cp-26;
    p = p * x + 0x1.27e5aeb931e77p-22;
    p = p * x + 0x1.71dde82a22190p-19;
    p = p * x + 0x1.a01a013379fccp-16;
    p = p * x + 0x1.a01a01b7a5deep-13;
    p = p * x + 0x1.6c16c16c333cdp-10;
    p = p * x + 0x1.111111110dcadp-7;
    p = p * x + 0x1.55555555554ecp-5;
    p = p * x + 0x1.5555555555562p-3;
    p = p * x + 0.5;
    return x + x * x * p;
}

/* x - m pi/2 for whole |m| <= 2^20, in three exact pieces and a rest; at most pi/2 for all m. */
static inline double less_quarter_turns(double x, double m)
{
    const double most = 1.5707963267948966;
    double r = (((x - m * 0x1.921fb544p+0) - m * 0x1.0b4611a6p-34) - m * 0x1.3198a2e0p-69) -
               m * 0x1.b839a252049c1p-104;
    return r > most ? most : r < -most ? -most : r;
}

/* 1 for even, -1 for odd whole numbers. */
static inline double sign_of_parity(double k)
{
    return 1 - 2 * absolute(k - 2 * round_whole(k * 0.5));
}

/* sin x, cos x of radians: |x| <= 10^6 to the last places, then with the absolute error |x| 2^-52
 * that x itself may have; NaN from 2^50 on. */
static inline double sin_any(double x)
{
    double k = round_whole(x * 0.3183098861837907);
    double r = less_quarter_turns(x, 2 * k);
    double s = sin_quarter(r * 0.15915494309189535) * sign_of_parity(k);
    return absolute(x) < 0x1p50 ? s : NAN;
}

static inline double cos_any(double x)
{
    double k = round_whole(x * 0.3183098861837907 - 0.5);
    double r = less_quarter_turns(x, 2 * k + 1);
    double s = -sin_quarter(r * 0.15915494309189535) * sign_of_parity(k);
    return absolute(x) < 0x1p50 ? s : NAN;
}

static inline double tan_any(double x)
{
    return sin_any(x) / cos_any(x);
}

static inline double arc_sine(double x)
{
    return arc_tangent(x / sqrt((1 - x) * (1 + x)));
}

static inline double arc_cosine(double x)
{
    return 2 * arc_tangent(sqrt((1 - x) / (1 + x)));
}

static inline double sinh_any(double x)
{
    double a = absolute(x), m = exp_minus_one_small(a < 0.34 ? a : 0);
    double half = exp_any(a * 0.5), e = half * half;
    double r = a < 0.34 ? 0.5 * (m + m / (m + 1)) : 0.5 * half * half - 0.5 / e;
    return x < 0 ? -r : r;
}

static inline double cosh_any(double x)
{
    double half = exp_any(absolute(x) * 0.5);
    return 0.5 * half * half + 0.5 / (half * half);
}

static inline double tanh_any(double x)
{
    double a = absolute(x), b = a < 30 ? 2 * a : 60, m = exp_minus_one_small(b < 0.34 ? b : 0);
    double e = exp_any(b), r = b < 0.34 ? m / (m + 2) : (e - 1) / (e + 1);
    r = x < 0 ? -r : r;
    return x == x ? r : NAN;
}

/* What rounding took from the product a b, exactly; |a|, |b| below 1e150. T. J. Dekker, Numer.
 * Math. 18, 224 (1971), doi 10.1007/BF01397083. */
static inline double product_rest(double a, double b, double product)
{
    const double splitter = 134217729.0; /* 2^27 + 1 */
    double a_high = a * splitter - (a * splitter - a), a_low = a - a_high;
    double b_high = b * splitter - (b * splitter - b), b_low = b - b_high;
    return ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
}

/* ln x for normal positive x as a sum of two: log_normal with the rests of its largest terms, to
 * about 2^-60. */
static inline double log_normal_pair(double x, double *rest)
{
    const uint64_t sqrt_half = 0x3fe6a09e667f3bcdu, one = 0x3ff0000000000000u;
    const double ln2_high = 0x1.62e42fefa3800p-1, ln2_low = 0x1.ef35793c76730p-45;
    uint64_t shifted = to_bits(x) + (one - sqrt_half);
    double e = from_bits((shifted >> 52) | 0x4330000000000000u) - (4503599627370496.0 + 1023.0);
    double m = from_bits((shifted & 0x000fffffffffffffu) + sqrt_half);
    double above = m + 1.0, above_rest = m - (above - 1.0);
    double s = (m - 1.0) / above, back = s * above;
    double s_rest = (((m - 1.0) - back) - product_rest(s, above, back) - s * above_rest) / above;
    double z = s * s;
    double p = 0x1.2b5fb9f34d9dep-3;
    p = p * z + 0x1.39fdb9a93a519p-3;
    p = p * z + 0x1.7462ba254dcfbp-3;
    p = p * z + 0x1.c71c62d046370p-3;
    p = p * z + 0x1.2492492e03df2p-2;
    p = p * z + 0x1.9999999995224p-2;
    p = p * z + 0x1.5555555555558p-1;
    /* |e ln 2| > |2 s| unless e is 0: then the sum is exact. */
    double whole = e * ln2_high, sum = whole + 2.0 * s;
    double small = (2.0 * s - (sum - whole)) + (s * z * p + (2.0 * s_rest + e * ln2_low));
    double high = sum + small;
    *rest = small - (high - sum);
    return high;
}

/* x^a for x >= 0: to 3 units in the last place while |a ln x| < 50, to 32 at the ends of the
 * numbers. NaN for x < 0. */
static inline double power_any(double x, double a)
{
    int normal = x >= 0x1p-1022 && x < INFINITY && absolute(a) < 1e150;
    double rest, high = log_normal_pair(normal ? x : 1, &rest);
    double y = a * (normal ? high : log_any(x));
    double y_rest = product_rest(normal ? a : 0, high, normal ? y : 0) + (normal ? a * rest : 0);
    double e = exp_any(y);
    double p = normal && absolute(y) < 800 ? e + e * y_rest : e;
    return a == 0 ? 1 : p;
}

#endif
