/* SPDX-License-Identifier: GPL-3.0-or-later
 * formula.c - from text to byte code: Dijkstra's shunting yard with a stack of pending operators,
 * no recursion. See formula.h; formula_values.c runs the code. */
#include "formula_code.h"

#include <assert.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COMPLAINT = 160, NAME_MAX_SHOWN = 24 };

/* An operator, function or bracket waiting for its operands. */
struct pending {
    int code; /* enum formula_code, or one of the two below */
    int precedence;
    size_t at;     /* where it stands in the text */
    int arguments; /* of a bracket: those that are complete; -1 = not a function's */
};
enum { PENDING_BRACKET = CODES, PENDING_MINUS };
enum { SUMS = 1, PRODUCTS, SIGNS, POWERS };

struct parser {
    const char *text, *variable;
    size_t at;
    char *complaint; /* [COMPLAINT]; "" = all well */
    bool operand_next;
    struct formula *formula;
    int operands;                  /* on the stack when the code so far has run */
    int starts[FORMULA_STACK_MAX]; /* where the code of each begins */
    int waiting;
    struct pending pending[FORMULA_LENGTH_MAX + 1];
};

static const struct {
    const char *name;
    enum formula_code code;
    int arguments;
} functions[] = {
    {"sin", CODE_SIN, 1},   {"cos", CODE_COS, 1},   {"tan", CODE_TAN, 1},   {"asin", CODE_ASIN, 1},
    {"acos", CODE_ACOS, 1}, {"atan", CODE_ATAN, 1}, {"sinh", CODE_SINH, 1}, {"cosh", CODE_COSH, 1},
    {"tanh", CODE_TANH, 1}, {"exp", CODE_EXP, 1},   {"log", CODE_LOG, 1},   {"sqrt", CODE_SQRT, 1},
    {"abs", CODE_ABS, 1},   {"min", CODE_MIN, 2},   {"max", CODE_MAX, 2},
};
enum { FUNCTIONS = sizeof functions / sizeof *functions };

static const char *function_name(int code)
{
    for (int i = 0; i < FUNCTIONS; i++)
        if ((int)functions[i].code == code)
            return functions[i].name;
    return "";
}

__attribute__((format(printf, 3, 4))) static void complain(struct parser *p, size_t at,
                                                           const char *format, ...)
{
    if (p->complaint[0])
        return; /* the first one counts */
    int used = snprintf(p->complaint, COMPLAINT, "character %zu: ", at + 1);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(p->complaint + used, COMPLAINT - (size_t)used, format, arguments);
    va_end(arguments);
}

static bool failed(const struct parser *p)
{
    return p->complaint[0] != 0;
}

/* ------------------------------------------------------------------- code */

static void append(struct parser *p, enum formula_code code, double operand)
{
    struct formula *f = p->formula;
    if (f->count == FORMULA_OPERATIONS_MAX) {
        complain(p, p->at, "the formula has more than %d operations", FORMULA_OPERATIONS_MAX);
        return;
    }
    f->steps[f->count++] = (struct formula_step){code, operand};
}

static void push(struct parser *p, enum formula_code code, double operand)
{
    if (p->operands == FORMULA_STACK_MAX) {
        complain(p, p->at, "more than %d operands wait for their operators: brackets too deep",
                 FORMULA_STACK_MAX);
        return;
    }
    p->starts[p->operands++] = p->formula->count;
    append(p, code, operand);
}

/* The code from step `from` on is replaced by the constant that it makes. */
static void fold_constants(struct parser *p, int from)
{
    struct formula part = {.count = p->formula->count - from};
    memcpy(part.steps, p->formula->steps + from, (size_t)part.count * sizeof *part.steps);
    double x = 0, value;
    formula_values(&part, &x, 1, &value, NULL, NULL);
    p->formula->count = from;
    append(p, CODE_CONSTANT, value);
}

/* Is the code of steps from .. end-1 one constant? */
static bool is_constant(const struct parser *p, int from, int end)
{
    return end - from == 1 && p->formula->steps[from].code == CODE_CONSTANT;
}

static void apply_to_one(struct parser *p, enum formula_code code, double operand)
{
    int from = p->starts[p->operands - 1];
    bool constant = is_constant(p, from, p->formula->count);
    append(p, code, operand);
    if (constant && !failed(p))
        fold_constants(p, from);
}

/* With a constant on either side an operation of two may be one of one: x - 2 = x + (-2). */
static bool take_constant(struct parser *p, enum formula_code code, int left, int right)
{
    static const struct {
        bool on_the_right, on_the_left, negative;
        enum formula_code code;
    } with[CODES] = {[CODE_ADD] = {true, true, false, CODE_SHIFT},
                     [CODE_SUBTRACT] = {true, false, true, CODE_SHIFT},
                     [CODE_MULTIPLY] = {true, true, false, CODE_SCALE},
                     [CODE_POWER] = {true, false, false, CODE_RAISE}};
    struct formula *f = p->formula;
    int at = -1;
    if (with[code].on_the_right && is_constant(p, right, f->count))
        at = right;
    else if (with[code].on_the_left && is_constant(p, left, right))
        at = left;
    if (at < 0)
        return false;
    double operand = f->steps[at].operand;
    f->count--;
    memmove(f->steps + at, f->steps + at + 1, (size_t)(f->count - at) * sizeof *f->steps);
    append(p, with[code].code, with[code].negative ? -operand : operand);
    return true;
}

static void apply_to_two(struct parser *p, enum formula_code code)
{
    int right = p->starts[p->operands - 1], left = p->starts[p->operands - 2];
    p->operands--;
    bool both = is_constant(p, left, right) && is_constant(p, right, p->formula->count);
    if (!both && take_constant(p, code, left, right))
        return;
    append(p, code, 0);
    if (both && !failed(p))
        fold_constants(p, left);
}

/* --------------------------------------------------------- pending operators */

static void hold(struct parser *p, struct pending what)
{
    assert(p->waiting <= FORMULA_LENGTH_MAX); /* each takes a character of the text */
    p->pending[p->waiting++] = what;
}

static void apply(struct parser *p, const struct pending *what)
{
    if (what->code == PENDING_MINUS)
        apply_to_one(p, CODE_SCALE, -1);
    else if (what->code >= CODE_ADD)
        apply_to_two(p, (enum formula_code)what->code);
    else
        apply_to_one(p, (enum formula_code)what->code, 0);
}

/* Applies what binds at least as tightly as `precedence`, back to the last open bracket. */
static void apply_pending(struct parser *p, int precedence)
{
    while (p->waiting > 0 && !failed(p)) {
        const struct pending *last = &p->pending[p->waiting - 1];
        if (last->code == PENDING_BRACKET || last->precedence < precedence)
            return;
        p->waiting--;
        apply(p, last);
    }
}

/* ------------------------------------------------------------------- tokens */

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

static size_t digits_from(const char *text, size_t at)
{
    while (is_digit(text[at]))
        at++;
    return at;
}

/* End of the number that begins at `at`: digits, a point, digits, an exponent. */
static size_t number_end(const char *text, size_t at)
{
    size_t end = digits_from(text, at);
    if (text[end] == '.')
        end = digits_from(text, end + 1);
    if (text[end] == 'e' || text[end] == 'E') {
        size_t sign = text[end + 1] == '+' || text[end + 1] == '-';
        if (is_digit(text[end + 1 + sign]))
            end = digits_from(text, end + 1 + sign);
    }
    return end;
}

static void read_number(struct parser *p)
{
    char number[FORMULA_LENGTH_MAX + 1];
    size_t end = number_end(p->text, p->at), length = end - p->at;
    memcpy(number, p->text + p->at, length);
    number[length] = 0;
    double value = strtod(number, NULL);
    if (length == 1 && number[0] == '.')
        complain(p, p->at, "a point without digits");
    else if (!isfinite(value))
        complain(p, p->at, "the number %.*s is too large", NAME_MAX_SHOWN, number);
    push(p, CODE_CONSTANT, value);
    p->at = end;
    p->operand_next = false;
}

static void read_function(struct parser *p, int index, size_t end)
{
    while (p->text[end] == ' ')
        end++;
    if (p->text[end] != '(') {
        complain(p, p->at, "%s needs its argument in brackets", functions[index].name);
        return;
    }
    hold(p, (struct pending){(int)functions[index].code, POWERS + 1, p->at, 0});
    hold(p, (struct pending){PENDING_BRACKET, 0, end, 0});
    p->at = end + 1;
}

static void read_name(struct parser *p)
{
    size_t end = p->at;
    while (is_letter(p->text[end]) || is_digit(p->text[end]))
        end++;
    const char *name = p->text + p->at;
    size_t length = end - p->at;
    for (int i = 0; i < FUNCTIONS; i++) {
        if (strlen(functions[i].name) == length && memcmp(name, functions[i].name, length) == 0) {
            read_function(p, i, end);
            return;
        }
    }
    if (strlen(p->variable) == length && memcmp(name, p->variable, length) == 0)
        push(p, CODE_VARIABLE, 0);
    else if (length == 2 && memcmp(name, "pi", 2) == 0)
        push(p, CODE_CONSTANT, 3.141592653589793);
    else if (length == 1 && *name == 'e')
        push(p, CODE_CONSTANT, 2.718281828459045);
    else
        complain(p, p->at,
                 "unknown name \"%.*s\"; known are %s pi e sin cos tan asin acos atan sinh cosh "
                 "tanh exp log sqrt abs min max",
                 (int)(length < NAME_MAX_SHOWN ? length : NAME_MAX_SHOWN), name, p->variable);
    p->at = end;
    p->operand_next = false;
}

/* A place where an operand begins. */
static void read_operand(struct parser *p)
{
    char c = p->text[p->at];
    if (is_digit(c) || c == '.') {
        read_number(p);
    } else if (is_letter(c)) {
        read_name(p);
    } else if (c == '(') {
        hold(p, (struct pending){PENDING_BRACKET, 0, p->at, -1});
        p->at++;
    } else if (c == '-') {
        hold(p, (struct pending){PENDING_MINUS, SIGNS, p->at, 0});
        p->at++;
    } else if (c == '+') {
        p->at++;
    } else if (c == 0) {
        complain(p, p->at, "the formula ends where a number, a name or a bracket should follow");
    } else if (c >= ' ' && c <= '~') {
        complain(p, p->at, "'%c' where a number, a name or a bracket should stand", c);
    } else {
        complain(p, p->at, "not a printable character");
    }
}

static void close_bracket(struct parser *p)
{
    apply_pending(p, 0);
    if (failed(p))
        return;
    if (p->waiting == 0) {
        complain(p, p->at, "')' without its '('");
        return;
    }
    struct pending bracket = p->pending[--p->waiting];
    if (bracket.arguments >= 0) {
        struct pending function = p->pending[--p->waiting];
        int wanted = function.code >= CODE_ADD ? 2 : 1;
        if (bracket.arguments + 1 != wanted)
            complain(p, function.at, "%s takes %s, not %d", function_name(function.code),
                     wanted == 1 ? "one argument" : "two arguments", bracket.arguments + 1);
        else
            apply(p, &function);
    }
    p->at++;
}

static void next_argument(struct parser *p)
{
    apply_pending(p, 0);
    if (failed(p))
        return;
    if (p->waiting == 0 || p->pending[p->waiting - 1].arguments < 0) {
        complain(p, p->at, "',' outside a function's brackets");
        return;
    }
    p->pending[p->waiting - 1].arguments++;
    p->at++;
    p->operand_next = true;
}

/* A place where an operand has just ended. */
static void read_operator(struct parser *p)
{
    static const struct {
        char sign;
        enum formula_code code;
        int precedence;
    } operators[] = {{'+', CODE_ADD, SUMS},
                     {'-', CODE_SUBTRACT, SUMS},
                     {'*', CODE_MULTIPLY, PRODUCTS},
                     {'/', CODE_DIVIDE, PRODUCTS},
                     {'^', CODE_POWER, POWERS}};
    char c = p->text[p->at];
    if (c == ')') {
        close_bracket(p);
        return;
    }
    if (c == ',') {
        next_argument(p);
        return;
    }
    for (size_t i = 0; i < sizeof operators / sizeof *operators; i++) {
        if (operators[i].sign != c)
            continue;
        /* Equals are applied from the left, but for powers: 2^3^2 = 2^9. */
        int precedence = operators[i].precedence;
        apply_pending(p, precedence == POWERS ? POWERS + 1 : precedence);
        hold(p, (struct pending){(int)operators[i].code, precedence, p->at, 0});
        p->at++;
        p->operand_next = true;
        return;
    }
    if (c >= ' ' && c <= '~')
        complain(p, p->at, "'%c' where + - * / ^ or a bracket should stand%s", c,
                 is_letter(c) || is_digit(c) || c == '(' ? ": products need their *" : "");
    else
        complain(p, p->at, "not a printable character");
}

static void parse(struct parser *p)
{
    p->operand_next = true;
    while (!failed(p)) {
        while (p->text[p->at] == ' ')
            p->at++;
        if (p->operand_next)
            read_operand(p);
        else if (p->text[p->at])
            read_operator(p);
        else
            break;
    }
    apply_pending(p, 0);
    if (p->waiting > 0)
        complain(p, p->pending[p->waiting - 1].at, "'(' without its ')'");
}

struct formula *formula_create(const char *text, const char *variable, char complaint[160])
{
    complaint[0] = 0;
    if (strnlen(text, FORMULA_LENGTH_MAX + 1) > FORMULA_LENGTH_MAX) {
        snprintf(complaint, COMPLAINT, "character %d: a formula has at most %d characters",
                 FORMULA_LENGTH_MAX + 1, FORMULA_LENGTH_MAX);
        return NULL;
    }
    struct parser *parser = calloc(1, sizeof *parser);
    struct formula *formula = calloc(1, sizeof *formula);
    if (parser && formula) {
        *parser = (struct parser){
            .text = text, .variable = variable, .complaint = complaint, .formula = formula};
        parse(parser);
    }
    bool sound = parser && formula && !complaint[0];
    free(parser);
    if (sound)
        return formula;
    free(formula);
    return NULL;
}

void formula_free(struct formula *formula)
{
    free(formula);
}
