/* SPDX-License-Identifier: GPL-3.0-or-later
 * A struct answer is the JSON library's value by another name. */
#include "answer_json.h"
#include "dump_json.h"
#include "limits.h"

#include <jansson.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_SIZE = 256 };

static const json_t *value_of(const struct answer *answer)
{
    return (const json_t *)answer;
}

struct answer *answer_json_load(const char *text, size_t size)
{
    return (struct answer *)json_loadb(text, size, JSON_DECODE_ANY, NULL);
}

void answer_json_free(struct answer *answer)
{
    json_decref((json_t *)answer);
}

const struct answer *answer_json_at(const struct answer *answer, const char *path)
{
    const json_t *value = value_of(answer);
    while (value && *path) {
        size_t size = strcspn(path, ".");
        if (json_is_array(value))
            value = json_array_get(value, strtoul(path, NULL, 10));
        else
            value = json_object_getn(value, path, size);
        path += size + (path[size] == '.');
    }
    return (const struct answer *)value;
}

const char *answer_json_text(const struct answer *answer, const char *path)
{
    return json_string_value(value_of(answer_json_at(answer, path)));
}

double answer_json_number(const struct answer *answer, const char *path, double otherwise)
{
    const json_t *value = value_of(answer_json_at(answer, path));
    return json_is_number(value) ? json_number_value(value) : otherwise;
}

bool answer_json_true(const struct answer *answer, const char *path)
{
    return json_is_true(value_of(answer_json_at(answer, path)));
}

size_t answer_json_count(const struct answer *answer)
{
    const json_t *value = value_of(answer);
    return json_is_array(value) ? json_array_size(value) : json_object_size(value);
}

const struct answer *answer_json_item(const struct answer *answer, size_t i, const char **key)
{
    const json_t *value = value_of(answer);
    *key = "";
    if (!json_is_object(value))
        return (const struct answer *)json_array_get(value, i);
    json_t *object = (json_t *)value; /* iterators change nothing, but do not say so */
    void *member = json_object_iter(object);
    for (; member && i > 0; i--)
        member = json_object_iter_next(object, member);
    *key = member ? json_object_iter_key(member) : "";
    return member ? (const struct answer *)json_object_iter_value(member) : NULL;
}

void answer_json_add(struct text *text, const struct answer *answer)
{
    const json_t *value = value_of(answer);
    if (json_is_string(value))
        text_add(text, "%s", json_string_value(value));
    else if (value && !json_is_null(value))
        dump_json_add(text, value);
}

/* Depth first, without recursion: where it is at each depth. */
void answer_json_leaves(const struct answer *answer, void *context,
                        void (*take)(void *context, const char *path, const struct answer *value))
{
    struct {
        const struct answer *whole;
        size_t next, length; /* of the path */
    } at[LIMIT_JSON_DEPTH_MAX + 1] = {{answer, 0, 0}};
    char path[PATH_SIZE] = "";
    size_t depth = 1;
    while (depth > 0) {
        size_t d = depth - 1, length = at[d].length;
        const char *key;
        path[length] = '\0';
        if (at[d].next == answer_json_count(at[d].whole)) {
            depth--;
            continue;
        }
        const struct answer *item = answer_json_item(at[d].whole, at[d].next, &key);
        const json_t *value = value_of(item);
        snprintf(path + length, sizeof path - length, "%s%s", length ? "." : "", key);
        at[d].next++;
        if (!json_is_object(value)) {
            if (!json_is_null(value) && !(json_is_array(value) && json_array_size(value) == 0))
                take(context, path, item);
        } else if (depth <= LIMIT_JSON_DEPTH_MAX) {
            at[depth].whole = item;
            at[depth].next = 0;
            at[depth++].length = strlen(path);
        }
    }
}
