/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_scalar.c - see store_scalar.h. */
#include "store_scalar.h"

#include "text.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct scalar scalar_integer(int64_t value)
{
    return (struct scalar){.type = SCALAR_INTEGER, .integer = value};
}

struct scalar scalar_real(double value)
{
    return (struct scalar){.type = isfinite(value) ? SCALAR_REAL : SCALAR_NONE, .real = value};
}

struct scalar scalar_text(const char *text, size_t length)
{
    return (struct scalar){.type = SCALAR_TEXT, .length = (uint32_t)length, .text = text};
}

/* ------------------------------------------------------------------ order */

static int rank(const struct scalar *value)
{
    return value->type == SCALAR_NONE ? 2 : value->type == SCALAR_TEXT;
}

static int compare_numbers(const struct scalar *a, const struct scalar *b)
{
    if (a->type == b->type && a->type == SCALAR_INTEGER)
        return (a->integer > b->integer) - (a->integer < b->integer);
    if (a->type == b->type)
        return (a->real > b->real) - (a->real < b->real);
    /* 64 bits of mantissa: both kinds are exact. */
    long double x = a->type == SCALAR_INTEGER ? (long double)a->integer : (long double)a->real;
    long double y = b->type == SCALAR_INTEGER ? (long double)b->integer : (long double)b->real;
    return (x > y) - (x < y);
}

static int compare_texts(const struct scalar *a, const struct scalar *b)
{
    int order = memcmp(a->text, b->text, a->length < b->length ? a->length : b->length);

    return order ? order : (a->length > b->length) - (a->length < b->length);
}

int scalar_compare(const struct scalar *a, const struct scalar *b, bool descending)
{
    int left = rank(a), right = rank(b), order;

    if (left == 2 || right == 2)
        return left - right;
    if (left != right)
        order = left - right;
    else
        order = left == 1 ? compare_texts(a, b) : compare_numbers(a, b);
    return descending ? -order : order;
}

/* ---------------------------------------------------------------- reading */

static struct scalar parse_number(const char *text, size_t length, char **end)
{
    bool whole = true;

    for (size_t i = 0; i < length && whole; i++)
        whole = (text[i] >= '0' && text[i] <= '9') || text[i] == '-' || text[i] == '+';
    if (whole) {
        long long integer;

        errno = 0;
        integer = strtoll(text, end, 10);
        if (errno == 0)
            return scalar_integer(integer);
    }
    return scalar_real(strtod(text, end));
}

struct scalar scalar_parse(const char *text)
{
    size_t length = strlen(text);
    struct scalar number;
    char *end;

    if (length > 0 && strspn(text, "0123456789+-.eE") == length) {
        number = parse_number(text, length, &end);
        if (end == text + length && number.type != SCALAR_NONE)
            return number;
    }
    return scalar_text(text, length);
}

/* ------------------------------------------------------------------- JSON */

enum { DEPTH_MAX = 16 };
struct walk {
    const char *at;
    char path[SCALAR_PATH_SIZE];
    size_t length;           /* of path */
    size_t outer[DEPTH_MAX]; /* length of path outside each object that is open */
    int depth;
};

/* The end of a string that begins at its quote: past the closing one, or at the NUL. */
static const char *skip_string(const char *at)
{
    for (at++; *at && *at != '"'; at++)
        if (*at == '\\' && at[1])
            at++;
    return *at ? at + 1 : at;
}

static const char *skip_list(const char *at)
{
    int depth = 0;

    while (*at) {
        if (*at == '"') {
            at = skip_string(at);
            continue;
        }
        depth += (*at == '[' || *at == '{') - (*at == ']' || *at == '}');
        at++;
        if (depth == 0)
            break;
    }
    return at;
}

/* \uXXXX of the plane that this program escapes: control characters. */
static void add_unicode(struct text *text, const char *digits)
{
    char hex[5] = "";
    unsigned long code;

    strncpy(hex, digits, 4);
    code = strtoul(hex, NULL, 16);
    if (code < 0x80)
        text_add_bytes(text, &(char){(char)code}, 1);
    else
        text_add_bytes(text, "\xEF\xBF\xBD", 3);
}

static struct scalar unescape(struct text *scratch, const char *from, size_t length)
{
    static const char names[] = "bfnrt", meant[] = "\b\f\n\r\t";

    scratch->size = 0;
    for (size_t i = 0; i < length; i++) {
        const char *name;

        if (from[i] != '\\' || i + 1 == length) {
            text_add_bytes(scratch, from + i, 1);
            continue;
        }
        i++;
        name = strchr(names, from[i]);
        if (from[i] == 'u' && i + 4 < length) {
            add_unicode(scratch, from + i + 1);
            i += 4;
        } else {
            text_add_bytes(scratch, name ? &meant[name - names] : from + i, 1);
        }
    }
    return scalar_text(scratch->bytes ? scratch->bytes : "", scratch->size);
}

struct scalar scalar_read(const char *token, size_t length, struct text *scratch)
{
    char *end;

    if (*token == '"') {
        length = length >= 2 ? length - 2 : 0;
        return memchr(token + 1, '\\', length) ? unescape(scratch, token + 1, length)
                                               : scalar_text(token + 1, length);
    }
    if (*token == 't' || *token == 'f')
        return scalar_text(token, length);
    return parse_number(token, length, &end);
}

static const char *skip_blanks(const char *at, char also)
{
    while (*at == also || *at == ' ' || *at == '\t' || *at == '\r' || *at == '\n')
        at++;
    return at;
}

static const char *skip_token(const char *at)
{
    if (*at == '"')
        return skip_string(at);
    while (*at && *at != ',' && *at != '}' && *at != ' ' && *at != '\n')
        at++;
    return at;
}

/* Appends a key, without its quotes; false when there is no room. */
static bool enter(struct walk *walk, const char *key, size_t length)
{
    size_t dot = walk->length > 0 && walk->path[walk->length - 1] != '.';

    if (walk->length + dot + length + 1 > sizeof walk->path)
        return false;
    if (dot)
        walk->path[walk->length] = '.';
    memcpy(walk->path + walk->length + dot, key, length);
    walk->length += dot + length;
    walk->path[walk->length] = '\0';
    return true;
}

/* One member: its key stands at walk->at. False = this is no JSON of ours. */
static bool read_member(struct walk *walk, scalar_visit *visit, void *context)
{
    const char *key = walk->at + 1;
    size_t outer = walk->length;
    const char *token;

    walk->at = skip_string(walk->at);
    if (walk->at - key < 1 || !enter(walk, key, (size_t)(walk->at - key) - 1))
        return false;
    walk->at = token = skip_blanks(walk->at, ':');
    if (*walk->at == '{' && walk->depth < DEPTH_MAX) {
        walk->outer[walk->depth++] = outer;
        walk->at++;
        return true;
    }
    if (*walk->at == '[' || *walk->at == '{') {
        walk->at = skip_list(walk->at);
    } else {
        walk->at = skip_token(token);
        if (*token != 'n')
            visit(context, walk->path, token, (size_t)(walk->at - token));
    }
    walk->length = outer;
    walk->path[outer] = '\0';
    return true;
}

void scalar_walk(const char *json, const char *prefix, scalar_visit *visit, void *context)
{
    struct walk walk = {.at = skip_blanks(json, ' ')};
    bool going = *walk.at == '{' && enter(&walk, prefix, strlen(prefix));

    walk.outer[walk.depth++] = walk.length;
    if (going)
        walk.at++;
    while (going && walk.depth > 0) {
        walk.at = skip_blanks(walk.at, ',');
        if (*walk.at == '"') {
            going = read_member(&walk, visit, context);
        } else if (*walk.at == '}') {
            walk.at++;
            walk.length = walk.outer[--walk.depth];
            walk.path[walk.length] = '\0';
        } else {
            going = false;
        }
    }
}
