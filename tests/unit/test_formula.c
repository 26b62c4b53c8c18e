/* SPDX-License-Identifier: GPL-3.0-or-later
 * Formulas: syntax and its complaints, values against the C library, derivatives against
 * differences, and texts that nobody meant as formulas. */
#include "kernels/formula.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct value {
    double f, d, dd;
};

static struct formula *made(const char *text)
{
    char complaint[160];
    struct formula *formula = formula_create(text, "x", complaint);
    if (!formula)
        fail_msg("%s: %s", text, complaint);
    return formula;
}

static struct value value_of(const char *text, double x)
{
    struct formula *formula = made(text);
    struct value v;
    formula_values(formula, &x, 1, &v.f, &v.d, &v.dd);
    formula_free(formula);
    return v;
}

static void assert_value(const char *text, double x, double expected, double relative)
{
    double f = value_of(text, x).f;
    if (f == expected || (isnan(f) && isnan(expected)))
        return;
    if (!(fabs(f - expected) <= relative * fabs(expected) + 1e-322)) /* of numbers below 1e-308 */
        fail_msg("%s at %.17g: %.17g, not %.17g", text, x, f, expected);
}

static void test_precedence(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        double value; /* at x = 2 */
    } cases[] = {
        {"1+2*3", 7},     {"(1+2)*3", 9},    {"2^3^2", 512},
        {"-x^2", -4},     {"(-x)^2", 4},     {"2^-1", 0.5},
        {"2^-x*4", 1},    {"8/4/2", 1},      {"8-4-2", 2},
        {"--x", 2},       {"-+-x", 2},       {"3--x", 5},
        {"2*-x", -4},     {"1 - 2 - x", -3}, {"x-1", 1},
        {"1-x", -1},      {"6/x", 3},        {"x/4", 0.5},
        {"min(x,1)", 1},  {"max(x , 1)", 2}, {"min(3,max(x,1))", 2},
        {"abs(-x)", 2},   {"2e1", 20},       {"2.5e-1", 0.25},
        {".5", 0.5},      {"5.", 5},         {"1E+2", 100},
        {"x^0", 1},       {"x^1", 2},        {"x^-2", 0.25},
        {"x^3", 8},       {"x^x^x", 16},     {"((((x))))", 2},
        {"sqrt(x+2)", 2}, {"-2^2", -4},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        assert_value(cases[i].text, 2, cases[i].value, 1e-15);
    assert_value("e", 0, M_E, 0);
    assert_value("pi", 0, M_PI, 0);
}

static void test_complaints_name_the_place(void **state)
{
    (void)state;
    static const struct {
        const char *text, *complaint;
    } cases[] = {
        {"", "character 1: the formula ends"},
        {"   ", "character 4: the formula ends"},
        {"foo", "character 1: unknown name \"foo\"; known are x"},
        {"2*foo(x)", "character 3: unknown name"},
        {"sin x", "character 1: sin needs its argument in brackets"},
        {"2x", "character 2: 'x' where + - * / ^ or a bracket should stand: products"},
        {"0x10", "character 2: 'x'"},
        {"2e", "character 2: 'e'"},
        {"x x", "character 3: 'x'"},
        {"1e999", "character 1: the number 1e999 is too large"},
        {"1+", "character 3: the formula ends"},
        {"*x", "character 1: '*'"},
        {"(x", "character 1: '(' without its ')'"},
        {"x)", "character 2: ')' without"},
        {"()", "character 2: ')' where"},
        {"sin()", "character 5: ')' where"},
        {"sin(x,x)", "character 1: sin takes one argument, not 2"},
        {"1+min(x)", "character 3: min takes two arguments, not 1"},
        {"min(x,x,x)", "character 1: min takes two arguments, not 3"},
        {"min(x,)", "character 7: ')' where"},
        {"x,x", "character 2: ',' outside"},
        {"(x,x)", "character 3: ',' outside"},
        {".", "character 1: a point"},
        {"1..2", "character 3: '.'"},
        {"x=1", "character 2: '='"},
        {"x;system(1)", "character 2: ';'"},
        {"x\n", "character 2: not a printable"},
        {"\xc3\xa4", "character 1: not a printable"},
        {"r", "character 1: unknown name \"r\""},
        {"y", "character 1: unknown name \"y\""},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char complaint[160] = "";
        struct formula *formula = formula_create(cases[i].text, "x", complaint);
        assert_null(formula);
        if (!strstr(complaint, cases[i].complaint))
            fail_msg("%s: \"%s\", not \"%s\"", cases[i].text, complaint, cases[i].complaint);
    }
    char complaint[160];
    struct formula *formula = formula_create("1/r", "r", complaint);
    assert_non_null(formula);
    formula_free(formula);
}

static void repeat(char *text, const char *part, size_t times)
{
    for (size_t i = 0; i < times; i++)
        memcpy(text + i * strlen(part), part, strlen(part));
    text[times * strlen(part)] = 0;
}

static void assert_refused(const char *text, const char *expected)
{
    char complaint[160] = "";
    assert_null(formula_create(text, "x", complaint));
    if (!strstr(complaint, expected))
        fail_msg("\"%s\", not \"%s\"", complaint, expected);
}

static void test_limits(void **state)
{
    (void)state;
    char text[2100];
    repeat(text, "(", 499); /* brackets alone hold nothing on the stack */
    strcat(text, "x");
    memset(text + 500, ')', 499);
    text[999] = 0;
    assert_value(text, 7, 7, 0);
    repeat(text, "x", 1001);
    assert_refused(text, "character 1001: a formula has at most 1000");
    repeat(text, "(", 1000);
    assert_refused(text, "character 1001: the formula ends");
    repeat(text, "-", 999);
    strcat(text, "x");
    assert_refused(text, "more than 256 operations");
    repeat(text, "x+(", 31);
    strcat(text, "x");
    memset(text + strlen(text), 0, 1);
    size_t length = strlen(text);
    memset(text + length, ')', 31);
    text[length + 31] = 0;
    assert_value(text, 1, 32, 0);
    repeat(text, "x+(", 32);
    strcat(text, "x");
    assert_refused(text, "more than 32 operands");
    repeat(text, "x^", 300);
    strcat(text, "x");
    assert_refused(text, "more than 32 operands");
    repeat(text, "x*", 200);
    strcat(text, "x");
    assert_refused(text, "more than 256 operations");
    repeat(text, "2+", 499); /* constants are added up while reading */
    strcat(text, "x");
    assert_value(text, 2, 1000, 0);
}

typedef double libm_function(double x);

static void check_function(const char *name, libm_function *libm, const double range[2],
                           double ulps)
{
    char text[40];
    snprintf(text, sizeof text, "%s(x)", name);
    struct formula *formula = made(text);
    enum { POINTS = 20001 };
    static double x[POINTS], f[POINTS];
    for (int i = 0; i < POINTS; i++)
        x[i] = range[0] + (range[1] - range[0]) * i / (POINTS - 1);
    formula_values(formula, x, POINTS, f, NULL, NULL);
    for (int i = 0; i < POINTS; i++) {
        double exact = libm(x[i]), unit = fmax(fabs(exact) * 0x1p-52, 0x1p-1074);
        if (f[i] != exact && !(fabs(f[i] - exact) <= ulps * unit))
            fail_msg("%s(%.17g): %.17g, not %.17g: %g ulp", name, x[i], f[i], exact,
                     (f[i] - exact) / unit);
    }
    formula_free(formula);
}

static void test_functions_against_the_c_library(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        libm_function *libm;
        double from, to;
    } cases[] = {
        {"sin", sin, -7, 7},         {"sin", sin, -1e-3, 1e-3},     {"sin", sin, 9e5, 1e6},
        {"cos", cos, -7, 7},         {"cos", cos, 1.57, 1.571},     {"cos", cos, -1e6, -9e5},
        {"tan", tan, -7, 7},         {"tan", tan, -1e-9, 1e-9},     {"asin", asin, -1, 1},
        {"asin", asin, -1e-4, 1e-4}, {"acos", acos, -1, 1},         {"acos", acos, 0.9999, 1},
        {"atan", atan, -40, 40},     {"atan", atan, -1e300, 1e300}, {"sinh", sinh, -3, 3},
        {"sinh", sinh, -700, 700},   {"sinh", sinh, -1e-5, 1e-5},   {"cosh", cosh, -3, 3},
        {"cosh", cosh, -709, 709},   {"tanh", tanh, -3, 3},         {"tanh", tanh, -1e-5, 1e-5},
        {"tanh", tanh, -1000, 1000}, {"exp", exp, -3, 3},           {"exp", exp, -708, 710},
        {"exp", exp, -1e4, 1e4},     {"log", log, 1e-3, 3},         {"log", log, 0.999, 1.001},
        {"log", log, 1, 1e300},      {"log", log, 1e-320, 1e-310},  {"sqrt", sqrt, 0, 1e3},
        {"abs", fabs, -1, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        check_function(cases[i].name, cases[i].libm, (double[]){cases[i].from, cases[i].to}, 6);
}

static void test_special_values(void **state)
{
    (void)state;
    static const double at[] = {0,         -0.0, 1,    -1,     2,      -2,      1e300,
                                -1e300,    NAN,  0.5,  1e-310, 5e-324, 1e16,    INFINITY,
                                -INFINITY, 710,  -746, 1e5,    0x1p52, -0x1p60, 709.9};
    static const struct {
        const char *text;
        libm_function *libm;
        double most; /* of |x| that are checked */
    } cases[] = {
        {"asin(x)", asin, INFINITY}, {"acos(x)", acos, INFINITY}, {"atan(x)", atan, INFINITY},
        {"exp(x)", exp, INFINITY},   {"log(x)", log, INFINITY},   {"sqrt(x)", sqrt, INFINITY},
        {"tanh(x)", tanh, INFINITY}, {"sinh(x)", sinh, INFINITY}, {"cosh(x)", cosh, INFINITY},
        {"sin(x)", sin, 1e6},        {"cos(x)", cos, 1e6}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++)
        for (size_t i = 0; i < sizeof at / sizeof *at; i++)
            if (!(fabs(at[i]) > cases[c].most))
                assert_value(cases[c].text, at[i], cases[c].libm(at[i]), 2e-15);
    for (size_t i = 0; i < sizeof at / sizeof *at; i++)
        assert_true(fabs(value_of("sin(x)", at[i]).f) <= 1 || isnan(value_of("sin(x)", at[i]).f));
    assert_true(isnan(value_of("sin(x)", 1e300).f) && isnan(value_of("cos(x)", INFINITY).f));
    assert_true(isnan(value_of("x^0.5", -1).f) && isnan(value_of("min(x,1)", NAN).f));
    assert_true(isnan(value_of("max(1,x)", NAN).f) && isinf(value_of("1/x", 0).f));
}

/* Powers: base, exponent as a constant, and as something that is worked out. */
static void test_powers(void **state)
{
    (void)state;
    static const double exponents[] = {2,  3,   5,   12,  31,    64,  65,   100, -1, -2,
                                       -7, -70, 0.5, 1.5, -0.25, 3.7, 20.3, 0,   1};
    for (size_t i = 0; i < sizeof exponents / sizeof *exponents; i++) {
        double a = exponents[i];
        char constant[60], general[60];
        /* By multiplication each factor may add half a place. */
        double multiplied = a == rint(a) && fabs(a) <= 64 ? fabs(a) / 2 : 0;
        snprintf(constant, sizeof constant, "x^(%.17g)", a);
        snprintf(general, sizeof general, "x^(%.17g+0*x)", a);
        for (double x = 1e-3; x < 1e3; x *= 1.37) {
            double exact = pow(x, a), slack = 2e-16 * (4 + fabs(a * log(x)) / 64 + multiplied);
            assert_value(constant, x, exact, slack);
            assert_value(general, x, exact, slack);
            if (a == rint(a))
                assert_value(constant, -x, pow(-x, a), slack);
            else
                assert_true(isnan(value_of(constant, -x).f));
        }
        assert_value(constant, 0, pow(0, a), 0);
        assert_value(general, 0, pow(0, a), 0);
    }
    assert_value("2^x", 0.5, M_SQRT2, 1e-15);
}

/* Central differences with Richardson's extrapolation. */
static double difference(const struct formula *formula, double x, int derivative)
{
    double estimate[2];
    for (int k = 0; k < 2; k++) {
        double step = ldexp(1, -9 - k), at[2] = {x - step, x + step}, f[2], d[2];
        formula_values(formula, at, 2, f, d, NULL);
        estimate[k] = derivative == 1 ? (f[1] - f[0]) / (2 * step) : (d[1] - d[0]) / (2 * step);
    }
    return (4 * estimate[1] - estimate[0]) / 3;
}

static void test_derivatives(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "3*cos(2*pi*x)+0.1*x^2",
        "sin(x)",
        "cos(3*x)",
        "tan(x/2)",
        "asin(x/4)",
        "acos(x/4)",
        "atan(2*x)",
        "sinh(x)",
        "cosh(x)",
        "tanh(x)",
        "exp(-x*x)",
        "log(x)",
        "sqrt(x)",
        "abs(x-3)",
        "x^x",
        "x^2.5",
        "x^-3",
        "2^x",
        "x^(sin(x)+2)",
        "1/(1+x^2)",
        "(x^3-x)/(x+2)",
        "min(x^2,3)",
        "max(x^2,1/x^3)",
        "exp(sin(x)*cos(x))/x",
        "x^64/1e12",
        "x^70/1e12",
        "-x",
        "5",
        "x-(x-x)*3",
        "log(exp(x)+1)",
        "(-x)^3",
        "x*sin(x)*cos(x)*exp(x)",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct formula *formula = made(texts[i]);
        for (double x = 0.3; x < 1.5; x += 0.171) {
            struct value v;
            formula_values(formula, &x, 1, &v.f, &v.d, &v.dd);
            double d = difference(formula, x, 1), dd = difference(formula, x, 2);
            double slack = 2e-6 * (1 + fabs(v.f) + fabs(v.d) + fabs(v.dd));
            if (!(fabs(v.d - d) < slack) || !(fabs(v.dd - dd) < slack))
                fail_msg("%s at %g: %.12g %.12g, not %.12g %.12g", texts[i], x, v.d, v.dd, d, dd);
        }
        formula_free(formula);
    }
    struct value v = value_of("3*cos(2*pi*x)", 0.1);
    assert_true(fabs(v.d + 6 * M_PI * sin(0.2 * M_PI)) < 2e-14);
    assert_true(fabs(v.dd + 12 * M_PI * M_PI * cos(0.2 * M_PI)) < 1e-13);
}

/* Blocks and their rests give the same bits as single points. */
static void test_blocks(void **state)
{
    (void)state;
    enum { POINTS = 200 };
    struct formula *formula = made("x^2.5*sin(x)/(1+exp(-x)) + min(x, 2)");
    double x[POINTS], f[POINTS], d[POINTS], dd[POINTS];
    for (int i = 0; i < POINTS; i++)
        x[i] = 0.01 + 0.03 * i;
    for (size_t count = 0; count <= POINTS; count += 1 + count / 5) {
        formula_values(formula, x, count, f, d, dd);
        for (size_t i = 0; i < count; i++) {
            struct value v;
            formula_values(formula, x + i, 1, &v.f, &v.d, &v.dd);
            assert_true(v.f == f[i] && v.d == d[i] && v.dd == dd[i]);
        }
    }
    formula_free(formula);
}

/* --------------------------------------------------------------- nonsense */

static uint64_t next_random(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return *seed >> 33;
}

static size_t random_tokens(char *text, uint64_t *seed)
{
    static const char *const tokens[] = {
        "x", "x",     "(",    ")",    "(",    ")",    "+",      "-",   "*",  "/",    "^",
        ",", "sin(",  "min(", "max(", "log(", "exp(", "1",      "2.5", "e",  "pi",   "1e308",
        " ", "sqrt(", "abs(", "0",    "tan(", "foo",  "1e-320", "-",   "^-", "acos("};
    size_t used = 0, parts = next_random(seed) % (next_random(seed) % 2 ? 120 : 8);
    for (size_t i = 0; i < parts; i++) {
        const char *token = tokens[next_random(seed) % (sizeof tokens / sizeof *tokens)];
        memcpy(text + used, token, strlen(token));
        used += strlen(token);
    }
    return used;
}

static size_t random_text(char *text, uint64_t *seed)
{
    static const char good[] = "3*cos(2*pi*x)+0.1*x^2-min(x,1)/(1+exp(-x))";
    size_t kind = next_random(seed) % 3, used = 0;
    if (kind == 0) {
        used = random_tokens(text, seed);
    } else if (kind == 1) {
        memcpy(text, good, sizeof good);
        used = sizeof good - 1;
        for (int i = 0; i < (int)(1 + next_random(seed) % 3); i++)
            text[next_random(seed) % used] = good[next_random(seed) % used];
    } else {
        used = next_random(seed) % 40;
        for (size_t i = 0; i < used; i++)
            text[i] = (char)(1 + next_random(seed) % 255);
    }
    text[used] = 0;
    return used;
}

static void test_nonsense_never_crashes(void **state)
{
    (void)state;
    uint64_t seed = 2024;
    size_t parsed = 0, refused = 0;
    static const double x[] = {0, 1, -1, 0.5, 1e300, -INFINITY, NAN, 3};
    for (int i = 0; i < 100000; i++) {
        char text[1000], complaint[160];
        double f[8], d[8], dd[8];
        random_text(text, &seed);
        struct formula *formula = formula_create(text, "x", complaint);
        if (formula) {
            formula_values(formula, x, 8, f, d, dd);
            parsed++;
        } else {
            assert_true(strncmp(complaint, "character ", 10) == 0);
            assert_true(strlen(complaint) < 160);
            refused++;
        }
        formula_free(formula);
    }
    assert_true(parsed > 1000 && refused > 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_precedence),
        cmocka_unit_test(test_complaints_name_the_place),
        cmocka_unit_test(test_limits),
        cmocka_unit_test(test_functions_against_the_c_library),
        cmocka_unit_test(test_special_values),
        cmocka_unit_test(test_powers),
        cmocka_unit_test(test_derivatives),
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_nonsense_never_crashes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
