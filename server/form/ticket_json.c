/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "ticket_json.h"
#include "faults.h"
#include "limits.h"

#include <jansson.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void read_label(const json_t *value, struct ticket *ticket, struct bcd_errors *errors);
static void read_tags(const json_t *value, struct ticket *ticket, struct bcd_errors *errors);
static bool tag_sound(const json_t *value);
static void read_priority(const json_t *value, struct ticket *ticket, struct bcd_errors *errors);

void ticket_json_take(json_t *object, struct ticket *ticket, struct bcd_errors *errors)
{
    static const struct {
        const char *key;
        void (*read)(const json_t *, struct ticket *, struct bcd_errors *);
    } rows[] = {{"label", read_label}, {"tags", read_tags}, {"priority", read_priority}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        const json_t *value = json_object_get(object, rows[i].key);
        if (value && !json_is_null(value)) /* null is the same as leaving it out */
            rows[i].read(value, ticket, errors);
        json_object_del(object, rows[i].key);
    }
}

void ticket_json_add(struct text *text, const struct ticket *ticket)
{
    text_add(text, "\"owner\":\"%s\",\"label\":", ticket->owner);
    if (ticket->label)
        text_add_json_string(text, ticket->label);
    else
        text_add(text, "null");
    text_add(text, ",\"tags\":[");
    for (const char *tag = ticket->tags; tag;) {
        size_t length = strcspn(tag, " ");
        text_add(text, "\"%.*s\"", (int)length, tag);
        tag = tag[length] ? tag + length + 1 : NULL;
        text_add(text, tag ? "," : "");
    }
    text_add(text, "],\"priority\":%d", ticket->priority);
}

void ticket_json_add_schema(struct text *text)
{
    text_add(text,
             "\"label\":{\"type\":[\"string\",\"null\"],\"maxLength\":%d,"
             "\"pattern\":\"^[^\\u0000]*$\",\"default\":null,"
             "\"description\":\"how people call it; no part of the physics\"},",
             LIMIT_LABEL_CHARACTERS_MAX);
    text_add(text,
             "\"tags\":{\"type\":[\"array\",\"null\"],\"maxItems\":%d,\"items\":{"
             "\"type\":\"string\",\"pattern\":\"^[A-Za-z0-9._-]{1,%d}$\"},\"default\":[],"
             "\"description\":\"words to find it by; no part of the physics\"},",
             LIMIT_TAGS_MAX, LIMIT_TAG_BYTES_MAX);
    text_add(text,
             "\"priority\":{\"type\":[\"integer\",\"null\"],\"minimum\":-%d,\"maximum\":%d,"
             "\"default\":0,\"description\":\"among the jobs of its owner: the larger, the earlier;"
             " no part of the physics\"}",
             TICKET_PRIORITY_MAX, TICKET_PRIORITY_MAX);
}

static void read_label(const json_t *value, struct ticket *ticket, struct bcd_errors *errors)
{
    const char *label = json_string_value(value);
    size_t characters = 0;
    for (const char *c = label; c && *c; c++)
        characters += ((unsigned char)*c & 0xC0) != 0x80; /* not the rest of one */
    if (!label)
        bcd_errors_add(errors, "/label", "must be a text");
    else if (characters > LIMIT_LABEL_CHARACTERS_MAX)
        bcd_errors_add(errors, "/label", "has %zu characters; at most %d are possible", characters,
                       LIMIT_LABEL_CHARACTERS_MAX);
    else if (label[0] && !(ticket->label = strdup(label)))
        faults_no_memory(errors, "/label");
}

static int compare(const void *a, const void *b)
{
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

static void read_tags(const json_t *value, struct ticket *ticket, struct bcd_errors *errors)
{
    const char *tags[LIMIT_TAGS_MAX];
    size_t count = json_array_size(value), faults = errors->count + errors->dropped;
    struct text text = {0};
    if (!json_is_array(value) || count > LIMIT_TAGS_MAX) {
        bcd_errors_add(errors, "/tags", "must be a list of at most %d tags", LIMIT_TAGS_MAX);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        char pointer[32];
        snprintf(pointer, sizeof(pointer), "/tags/%zu", i);
        tags[i] = json_string_value(json_array_get(value, i));
        if (!tag_sound(json_array_get(value, i)))
            bcd_errors_add(errors, pointer, "a tag is 1 to %d of A-Z a-z 0-9 . _ -",
                           LIMIT_TAG_BYTES_MAX);
    }
    if (count == 0 || errors->count + errors->dropped > faults)
        return;
    qsort(tags, count, sizeof(tags[0]), compare);
    for (size_t i = 0; i < count; i++)
        if (i == 0 || strcmp(tags[i], tags[i - 1]) != 0)
            text_add(&text, "%s%s", i ? " " : "", tags[i]);
    ticket->tags = text_take(&text);
    if (!ticket->tags)
        faults_no_memory(errors, "/tags");
}

static bool tag_sound(const json_t *value)
{
    const char *tag = json_string_value(value);
    return tag && strlen(tag) == json_string_length(value) && ticket_tag_sound(tag);
}

static void read_priority(const json_t *value, struct ticket *ticket, struct bcd_errors *errors)
{
    double priority = json_number_value(value); /* 5.0 is whole too */
    if (json_is_number(value) && priority == rint(priority) &&
        fabs(priority) <= TICKET_PRIORITY_MAX)
        ticket->priority = (int)priority;
    else
        bcd_errors_add(errors, "/priority", "must be a whole number from -%d to %d",
                       TICKET_PRIORITY_MAX, TICKET_PRIORITY_MAX);
}
