/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "json_number.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static size_t point(char *text);
static size_t print_short(char *out, double v);
static size_t print_long(char *out, double v);
static size_t print_whole(char *out, bool negative, uint64_t whole, size_t places);

/* Between these, numbers are written without an exponent. */
static const double plain_min = 1e-4, plain_max = 1e9;
__extension__ typedef unsigned __int128 wide;

size_t json_number_print(char *out, double v)
{
    if (!isfinite(v))
        return (size_t)snprintf(out, JSON_NUMBER_SIZE, "null");
    if (v == 0)
        return (size_t)snprintf(out, JSON_NUMBER_SIZE, signbit(v) ? "-0.0" : "0");
    size_t length = print_short(out, v);
    length = length > 0 ? length : print_long(out, v);
    if (length > 0)
        return length;
    /* Any decimal of up to 15 digits survives the way through a normal double, and %g drops
     * trailing zeros: whoever needs fewer digits gets them at 15. Subnormals have fewer. */
    int digits = fabs(v) < DBL_MIN ? 1 : 15;
    for (; digits < 17; digits++) {
        snprintf(out, JSON_NUMBER_SIZE, "%.*g", digits, v);
        if (strtod(out, NULL) == v)
            return point(out);
    }
    snprintf(out, JSON_NUMBER_SIZE, "%.17g", v);
    return point(out);
}

/* Decimals of few digits, as most numbers of a job are, many times faster: v = m / 10^p with whole
 * m < 10^15 reads back as v, for both are exact and the quotient is rounded once; and decimals of
 * 15 digits survive the way through a double, so it is what %.15g says. 0: not one of them. */
static size_t print_short(char *out, double v)
{
    static const double power[] = {1,   10,  100,  1e3,  1e4,  1e5,  1e6,  1e7,
                                   1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
    enum { PLACES = sizeof(power) / sizeof(power[0]) };
    double size = fabs(v);
    size_t places = 0;
    if (size < plain_min || size >= plain_max)
        return 0;
    while (places < PLACES && size * power[places] < 1e15 &&
           rint(size * power[places]) / power[places] != size)
        places++;
    if (places == PLACES || size * power[places] >= 1e15)
        return 0;
    return print_whole(out, v < 0, (uint64_t)rint(size * power[places]), places);
}

/* The others without an exponent, many times faster than %g, in whole numbers and so exactly:
 * v = m 2^-shift, and v 10^places = product 2^-shift has 17 digits before the point. 15 of them
 * will do, or 16, if what is dropped is less than half the way to the next double. 0: not known,
 * where doubles are closer below than above. */
static size_t print_long(char *out, double v)
{
    int exponent;
    double size = fabs(v);
    uint64_t mantissa = (uint64_t)ldexp(frexp(size, &exponent), DBL_MANT_DIG);
    if (size < plain_min || size >= plain_max || mantissa == 1ULL << (DBL_MANT_DIG - 1))
        return 0;
    int shift = DBL_MANT_DIG - exponent;
    size_t places = 8;
    wide power = 100000000, least = (wide)10000000000000000 << shift;
    for (; mantissa * power < least; places++)
        power *= 10;
    wide product = mantissa * power;
    for (unsigned unit = 100;; unit /= 10, places++) {
        wide step = (wide)unit << shift, rest = product % step, whole = product / step;
        bool up = rest > step - rest || (rest == step - rest && whole % 2 == 1);
        wide off = up ? step - rest : rest;
        if (unit == 1 || 2 * off < power || (2 * off == power && mantissa % 2 == 0))
            return print_whole(out, v < 0, (uint64_t)whole + up, places - 2);
    }
}

/* whole / 10^places, of which trailing zeros are dropped. */
static size_t print_whole(char *out, bool negative, uint64_t whole, size_t places)
{
    enum { DIGITS_MAX = 24 };
    char digits[DIGITS_MAX];
    size_t first = DIGITS_MAX, length = 0;
    for (; places > 0 && whole % 10 == 0; places--)
        whole /= 10;
    for (size_t i = 0; whole > 0 || i <= places; i++) {
        if (i == places && places > 0)
            digits[--first] = '.';
        digits[--first] = (char)('0' + whole % 10);
        whole /= 10;
    }
    if (negative)
        out[length++] = '-';
    memcpy(out + length, digits + first, DIGITS_MAX - first);
    length += DIGITS_MAX - first;
    out[length] = '\0';
    return length;
}

/* Puts "." in place of whatever the locale writes between the digits. Returns the length. */
static size_t point(char *text)
{
    size_t digits = strspn(text, "+-0123456789");
    size_t rest = digits + strcspn(text + digits, "0123456789");
    if (text[digits] != '\0' && text[digits] != 'e') {
        text[digits] = '.';
        memmove(text + digits + 1, text + rest, strlen(text + rest) + 1);
    }
    return strlen(text);
}
