/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fuzz.h"

#include "kernels/formula.h"

#include <string.h>

enum { POINTS = 37 };

/* The same bits, one point at a time or many, with derivatives or without. */
static void check_values(const struct formula *formula)
{
    double x[POINTS], values[3][POINTS], one[3], alone[POINTS];
    for (int i = 0; i < POINTS; i++)
        x[i] = i % 4 == 3 ? (i - 18) * 1e7 : (i - 18) * 0.25;
    formula_values(formula, x, POINTS, values[0], values[1], values[2]);
    formula_values(formula, x, POINTS, alone, NULL, NULL);
    FUZZ_CHECK(memcmp(alone, values[0], sizeof(alone)) == 0);
    for (int i = 0; i < POINTS; i++) {
        formula_values(formula, &x[i], 1, &one[0], &one[1], &one[2]);
        for (int k = 0; k < 3; k++)
            FUZZ_CHECK(memcmp(&one[k], &values[k][i], sizeof(double)) == 0);
    }
}

void fuzz_formula(const uint8_t *data, size_t size)
{
    char complaint[160] = "", *text = fuzz_text(data, size);
    struct formula *formula = formula_create(text, "x", complaint);
    if (formula)
        check_values(formula);
    else
        FUZZ_CHECK(complaint[0] && memchr(complaint, '\0', sizeof(complaint)));
    formula_free(formula);
    free(text);
}
