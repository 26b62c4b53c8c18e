/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * answer_json.h - what a server answered, for those who ask (the command line). A tree that is only
 * read; parts of it are borrowed from the whole. Paths are keys with dots between, "derived.steps",
 * counted in arrays: "jobs.0.id"; "" is the value itself.
 */
#ifndef ANSWER_JSON_H
#define ANSWER_JSON_H

#include "bcd.h"
#include "text.h"

struct answer;

/* NULL when it is not JSON or there is no memory. */
struct answer *answer_json_load(const char *text, size_t size);
void answer_json_free(struct answer *answer);

/* NULL when there is nothing, or when `answer` is NULL. */
const struct answer *answer_json_at(const struct answer *answer, const char *path);

/* A string; NULL when it is none. */
const char *answer_json_text(const struct answer *answer, const char *path);

/* A number, or `otherwise`. */
double answer_json_number(const struct answer *answer, const char *path, double otherwise);

bool answer_json_true(const struct answer *answer, const char *path);

/* Elements of an array or members of an object, 0 for all else; the i-th, in the order of the text,
 * with its key ("" in an array). */
size_t answer_json_count(const struct answer *answer);
const struct answer *answer_json_item(const struct answer *answer, size_t i, const char **key);

/* Compact JSON; a string without its quotes, null as nothing. */
void answer_json_add(struct text *text, const struct answer *answer);

/* Calls `take` for everything within its objects that is neither an object nor null nor empty, with
 * its path. */
void answer_json_leaves(const struct answer *answer, void *context,
                        void (*take)(void *context, const char *path, const struct answer *value));

#endif
