/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nearest.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

enum { NAME_MAX_COMPARED = 64 };

static size_t edits(const char *a, const char *b);

void nearest_know(struct nearest *nearest, const char *name, const char *given)
{
    size_t n = given ? edits(given, name) : NAME_MAX_COMPARED;
    if (n <= 1 + strlen(name) / 4 && (!nearest->name || n < nearest->edits)) {
        nearest->name = name;
        nearest->edits = n;
    }
    if (nearest->used < sizeof nearest->list)
        nearest->used +=
            (size_t)snprintf(nearest->list + nearest->used, sizeof nearest->list - nearest->used,
                             "%s%s", nearest->used ? ", " : "", name);
}

static size_t least(size_t a, size_t b)
{
    return a < b ? a : b;
}

/* Edits (insert, delete, replace, swap of neighbours) that turn one name into the other. */
static size_t edits(const char *a, const char *b)
{
    size_t rows[3][NAME_MAX_COMPARED + 1];
    size_t m = strlen(a), n = strlen(b);
    if (m > NAME_MAX_COMPARED || n > NAME_MAX_COMPARED)
        return NAME_MAX_COMPARED;
    for (size_t i = 0; i <= m; i++) {
        size_t *now = rows[i % 3], *up = rows[(i + 2) % 3], *upper = rows[(i + 1) % 3];
        now[0] = i;
        for (size_t j = 1; j <= n; j++) {
            if (i == 0) {
                now[j] = j;
                continue;
            }
            int x = tolower((unsigned char)a[i - 1]), y = tolower((unsigned char)b[j - 1]);
            now[j] = least(least(up[j], now[j - 1]) + 1, up[j - 1] + (x != y));
            if (i > 1 && j > 1 && x == tolower((unsigned char)b[j - 2]) &&
                y == tolower((unsigned char)a[i - 2]))
                now[j] = least(now[j], upper[j - 2] + 1);
        }
    }
    return rows[m % 3][n];
}
