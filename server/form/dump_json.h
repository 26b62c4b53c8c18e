/* SPDX-License-Identifier: GPL-3.0-or-later
 * dump_json.h - a tree as compact JSON with numbers as the service writes them: 0.1, not
 * 0.10000000000000001. */
#ifndef DUMP_JSON_H
#define DUMP_JSON_H

#include "text.h"

struct json_t;

void dump_json_add(struct text *text, const struct json_t *value);

#endif
