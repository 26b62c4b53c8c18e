/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * formula_code.h - what the parser (formula.c) writes and the evaluator (formula_values.c) runs:
 * byte code of a stack machine whose slots hold value, first and second derivative.
 */
#ifndef KERNELS_FORMULA_CODE_H
#define KERNELS_FORMULA_CODE_H

#include "formula.h"

enum formula_code {
    CODE_CONSTANT, /* pushes the operand */
    CODE_VARIABLE, /* pushes the variable */
    /* Take the top of the stack and, where they need one, the operand. */
    CODE_SCALE, /* f * operand */
    CODE_SHIFT, /* f + operand */
    CODE_RAISE, /* f ^ operand */
    CODE_SIN,
    CODE_COS,
    CODE_TAN,
    CODE_ASIN,
    CODE_ACOS,
    CODE_ATAN,
    CODE_SINH,
    CODE_COSH,
    CODE_TANH,
    CODE_EXP,
    CODE_LOG,
    CODE_SQRT,
    CODE_ABS,
    /* Take two. */
    CODE_ADD,
    CODE_SUBTRACT,
    CODE_MULTIPLY,
    CODE_DIVIDE,
    CODE_POWER,
    CODE_MIN,
    CODE_MAX,
    CODES
};

struct formula_step {
    enum formula_code code;
    double operand;
};

struct formula {
    int count;
    struct formula_step steps[FORMULA_OPERATIONS_MAX];
};

#endif
