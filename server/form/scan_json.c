/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "scan_json.h"
#include "limits.h"
#include "text.h"

#include <jansson.h>

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { DEPTH = LIMIT_JSON_DEPTH_MAX + 1 };

/* Where the scanner is. pointer[d] leads to the current value at depth d (0 = the whole text);
 * brackets deeper than DEPTH are counted only. */
struct scan {
    const char *text;
    size_t from, to; /* the current token */
    size_t depth;
    bool object[DEPTH];  /* else an array */
    size_t index[DEPTH]; /* element of the array */
    bool key_next;       /* a string here is a key */
    char pointer[DEPTH + 1][SCAN_POINTER_SIZE];
};

static bool next_token(struct scan *scan);
static void follow(struct scan *scan);
static void enter_key(struct scan *scan);
static bool number_fault(const struct scan *scan, struct bcd_errors *errors);

void scan_json_append(char *pointer, const char *key)
{
    size_t used = strlen(pointer), room = SCAN_POINTER_SIZE - sizeof "\xE2\x80\xA6";
    if (used > room)
        return; /* was cut before */
    pointer[used++] = '/';
    for (const char *c = key; *c;) {
        char piece[8] = "";
        size_t length = text_utf8(c);
        if (*c == '~' || *c == '/')
            snprintf(piece, sizeof piece, "~%c", *c == '~' ? '0' : '1');
        else if (length == 0)
            snprintf(piece, sizeof piece, "?");
        else
            memcpy(piece, c, length);
        if (used + strlen(piece) > room) {
            snprintf(pointer + used, SCAN_POINTER_SIZE - used, "\xE2\x80\xA6");
            memset(pointer + used + 3, '\0', SCAN_POINTER_SIZE - used - 3);
            return;
        }
        memcpy(pointer + used, piece, strlen(piece));
        used += strlen(piece);
        c += length ? length : 1;
    }
    pointer[used] = '\0';
}

size_t scan_json_depth(const char *text)
{
    struct scan scan = {.text = text};
    size_t depth = 0, deepest = 0;
    while (next_token(&scan)) {
        if (strchr("[{", text[scan.from]))
            depth++;
        else if (strchr("]}", text[scan.from]) && depth > 0)
            depth--;
        deepest = depth > deepest ? depth : deepest;
    }
    return deepest;
}

size_t scan_json_numbers(const char *text, size_t end, struct bcd_errors *errors)
{
    struct scan scan = {.text = text};
    size_t faults = 0;
    while (next_token(&scan) && scan.from < end) {
        follow(&scan);
        faults += number_fault(&scan, errors);
    }
    return faults;
}

bool scan_json_key(const char *text, size_t end, char pointer[SCAN_POINTER_SIZE])
{
    struct scan scan = {.text = text};
    while (next_token(&scan) && scan.to <= end) {
        bool key = scan.key_next && text[scan.from] == '"';
        follow(&scan);
        if (key && scan.to == end && scan.depth <= DEPTH) {
            memcpy(pointer, scan.pointer[scan.depth], SCAN_POINTER_SIZE);
            return true;
        }
    }
    return false;
}

/* A bracket, comma or colon; a string; or a run of anything else (a number or a word). */
static bool next_token(struct scan *scan)
{
    const char *text = scan->text;
    scan->from = scan->to + strspn(text + scan->to, " \t\r\n");
    scan->to = scan->from + 1;
    if (text[scan->from] == '\0')
        return false;
    if (strchr("[]{},:", text[scan->from]))
        return true;
    if (text[scan->from] != '"') {
        scan->to = scan->from + strcspn(text + scan->from, "[]{},:\" \t\r\n");
        return true;
    }
    while (text[scan->to] != '\0' && text[scan->to] != '"')
        scan->to += text[scan->to] == '\\' && text[scan->to + 1] ? 2 : 1;
    scan->to += text[scan->to] == '"';
    return true;
}

/* Keeps depth and pointers up with the current token. */
static void follow(struct scan *scan)
{
    char token = scan->text[scan->from];
    size_t d = scan->depth;
    bool known = d >= 1 && d <= DEPTH; /* inside brackets whose kind is remembered */
    if (token == '{' || token == '[') {
        scan->depth++;
        scan->key_next = token == '{';
        if (d < DEPTH) {
            scan->object[d] = token == '{';
            scan->index[d] = 0;
            memcpy(scan->pointer[d + 1], scan->pointer[d], SCAN_POINTER_SIZE);
            if (token == '[')
                scan_json_append(scan->pointer[d + 1], "0");
        }
    } else if (token == '}' || token == ']') {
        scan->depth -= d > 0;
        scan->key_next = false;
    } else if (token == ',' && known) {
        scan->key_next = scan->object[d - 1];
        memcpy(scan->pointer[d], scan->pointer[d - 1], SCAN_POINTER_SIZE);
        if (!scan->object[d - 1]) {
            char index[24];
            snprintf(index, sizeof index, "%zu", ++scan->index[d - 1]);
            scan_json_append(scan->pointer[d], index);
        }
    } else if (token == '"' && scan->key_next) {
        enter_key(scan);
    }
}

/* The current string is a key: the pointer leads to its value now. */
static void enter_key(struct scan *scan)
{
    size_t d = scan->depth;
    scan->key_next = false;
    if (d < 1 || d > DEPTH)
        return;
    json_t *key = json_loadb(scan->text + scan->from, scan->to - scan->from, JSON_DECODE_ANY, NULL);
    memcpy(scan->pointer[d], scan->pointer[d - 1], SCAN_POINTER_SIZE);
    scan_json_append(scan->pointer[d], key ? json_string_value(key) : "?");
    json_decref(key);
}

static bool number_fault(const struct scan *scan, struct bcd_errors *errors)
{
    const char *token = scan->text + scan->from;
    size_t size = scan->to - scan->from;
    const char *word = token + (*token == '-' || *token == '+');
    const char *pointer = scan->depth <= DEPTH ? scan->pointer[scan->depth] : "";
    int shown = size < 40 ? (int)size : 40;
    static const char *const words[] = {"nan", "inf", "infinity"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (size == strlen(words[i]) + (size_t)(word - token) &&
            strncasecmp(word, words[i], strlen(words[i])) == 0) {
            bcd_errors_add(errors, pointer, "must be a finite number, not %.*s", shown, token);
            return true;
        }
    if (!isdigit((unsigned char)*word) || size != strspn(token, "+-.eE0123456789"))
        return false;
    double value = strtod(token, NULL); /* ends with the token */
    bool mantissa = strcspn(token, "123456789") < strcspn(token, "eE,]} \t\r\n");
    errno = 0;
    if (size == strspn(token, "-0123456789"))
        (void)strtoll(token, NULL, 10);
    if (isinf(value) || errno == ERANGE)
        bcd_errors_add(errors, pointer, "%.*s is too large", shown, token);
    else if (value == 0 && mantissa)
        bcd_errors_add(errors, pointer, "%.*s is too close to 0 to be told from it", shown, token);
    else
        return false;
    return true;
}
