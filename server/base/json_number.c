/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "json_number.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static size_t point(char *text);

size_t json_number_print(char *out, double v)
{
    if (!isfinite(v))
        return (size_t)snprintf(out, JSON_NUMBER_SIZE, "null");
    if (v == 0)
        return (size_t)snprintf(out, JSON_NUMBER_SIZE, signbit(v) ? "-0.0" : "0");
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
