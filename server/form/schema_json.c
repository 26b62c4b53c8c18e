/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "schema_json.h"
#include "bcd.h"
#include "json_lines.h"
#include "ticket_json.h"

#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static void add_row(struct text *text, const struct bcd_param *row);
static void add_default(struct text *text, const struct bcd_param *row);
static void add_words(struct text *text, const struct bcd_param *row);
static void add_description(struct text *text, const char *doc, const char *unit,
                            const char *pointer);
static void add_required(struct text *text, const struct bcd_param *rows, const char *also);
static void add_properties(struct text *text, const struct bcd_param *rows, const char *pointer);
static void add_slot(struct text *text, enum bcd_slot slot);
static void add_part(struct text *text, enum bcd_slot slot, const struct bcd_part *part);

/* What takes several fields together, by the pointer where the server tells of it. */
static const struct {
    const char *pointer, *rule;
} rules[] = {
    {"", "At least one observable is needed. Jobs beyond the server's limits of memory, disk and "
         "computing time are refused too: POST /v1/estimate tells."},
    {"/length", "A whole number of periods of the potential, unless there are walls"},
    {"/diameter", "particles * diameter must not exceed length"},
    {"/method", "The method must be able to do what is asked"},
    {"/time_step", "At most time; refused where it would melt the profile or silence the "
                   "interaction, with the largest one that works, unless stability is ignored"},
    {"/sample_every", "At most time"},
    {"/initial", "equilibrium needs an exact equilibrium: a potential at rest, no drag on a ring"},
    {"/potential/fourier", "cosine or sine or both"},
    {"/potential/expression/period", "0 needs walls"},
    {"/potential/expression/energy", "It must be a formula, finite wherever rods can be"},
    {"/interaction/expression/energy", "It must be a formula, finite wherever rods can be"},
    {"/interaction/table/first", "Below last"},
    {"/realizations", "With a target the most there may be: at least 2, and 1000 by default"},
    {"/target/observable", "One of the job's observables, with error bars"},
    {"/target/rod_steps", "At least what two realizations take"},
    {"/observables/msd/first", "From the time step to the measured time"},
    {"/observables/msd/last", "From first to the measured time"},
    {"/observables/contact_density/gap", "At most length - particles * diameter"},
    {"/observables/pair_distribution/last", "At most length - diameter"},
    {"/observables/trajectory/every", "From the time step to the measured time"},
    {"/observables/trajectory/first", "Below particles"},
    {"/observables/trajectory/rods", "At most particles - first"},
};

char *schema_json_job(void)
{
    struct text text = {0};
    text_add(&text, "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\","
                    "\"$id\":\"urn:bcdd:job\",\"title\":\"A job of bcdd\",");
    struct text job = {0};
    schema_json_add_job(&job);
    char *object = text_take(&job);
    if (object)
        text_add(&text, "%s", object + 1); /* its members, and the closing brace */
    else
        text.failed = true;
    free(object);
    return json_lines_take(text_take(&text));
}

void schema_json_add_job(struct text *text)
{
    const struct bcd_param *rows = bcd_job_params();
    text_add(text, "{\"description\":");
    add_description(text,
                    "Reduced units: the user's own length, time and energy. D = mobility * "
                    "temperature. Duplicate keys and numbers that no double holds are refused",
                    NULL, "");
    text_add(text, ",\"type\":\"object\",\"additionalProperties\":false,");
    add_required(text, rows, bcd_slot_key(BCD_SLOT_OBSERVABLE));
    text_add(text, ",\"properties\":{");
    add_properties(text, rows, "");
    for (int slot = 0; slot < BCD_SLOT_COUNT; slot++) {
        text_add(text, ",\"%s\":", bcd_slot_key(slot));
        add_slot(text, slot);
    }
    text_add(text, ",");
    ticket_json_add_schema(text);
    text_add(text, "}}");
}

/* ------------------------------------------------------------ rows and parts */

/* "name":{...},... of all rows of the object at `pointer`. */
static void add_properties(struct text *text, const struct bcd_param *rows, const char *pointer)
{
    for (const struct bcd_param *row = rows; row->name; row++) {
        struct text place = {0};
        text_add(&place, "%s/%s", pointer, row->name);
        char *at = text_take(&place);
        text_add(text, "%s\"%s\":{", row == rows ? "" : ",", row->name);
        add_row(text, row);
        text_add(text, ",\"description\":");
        add_description(text, row->doc, row->unit, at ? at : "");
        text_add(text, "}");
        free(at);
    }
}

static void add_range(struct text *text, const struct bcd_param *row)
{
    if (isfinite(row->min)) {
        text_add(text, ",\"%s\":", row->above_min ? "exclusiveMinimum" : "minimum");
        text_add_number(text, row->min);
    }
    if (isfinite(row->max)) {
        text_add(text, ",\"maximum\":");
        text_add_number(text, row->max);
    }
}

/* What may stand there, without braces. */
static void add_row(struct text *text, const struct bcd_param *row)
{
    switch (row->type) {
    case BCD_PARAM_INTEGER:
    case BCD_PARAM_NUMBER:
        text_add(text, "\"type\":\"%s\"", row->type == BCD_PARAM_INTEGER ? "integer" : "number");
        add_range(text, row);
        break;
    case BCD_PARAM_AUTO:
        text_add(text, "\"oneOf\":[{\"const\":\"auto\"},{\"type\":\"number\"");
        add_range(text, row);
        text_add(text, "}]");
        break;
    case BCD_PARAM_CHOICE:
        text_add(text, "\"enum\":[");
        add_words(text, row);
        text_add(text, "]");
        break;
    case BCD_PARAM_NUMBERS:
        text_add(text,
                 "\"type\":\"array\",\"minItems\":%zu,\"maxItems\":%zu,\"items\":{"
                 "\"type\":\"number\"",
                 row->least, row->most);
        add_range(text, row);
        text_add(text, "}");
        break;
    case BCD_PARAM_TEXT: /* printable ASCII */
        text_add(text,
                 "\"type\":\"string\",\"minLength\":%zu,\"maxLength\":%zu,"
                 "\"pattern\":\"^[ -~]*$\"",
                 row->least, row->most);
        break;
    }
    if (!row->required)
        add_default(text, row);
}

static void add_default(struct text *text, const struct bcd_param *row)
{
    if (row->type == BCD_PARAM_TEXT)
        return; /* nothing given is not a text */
    text_add(text, ",\"default\":");
    if (row->type == BCD_PARAM_NUMBERS)
        text_add(text, "[]");
    else if (row->type == BCD_PARAM_CHOICE)
        text_add_json_string(text, row->choice((size_t)row->fallback));
    else if (isnan(row->fallback))
        text_add(text, "\"auto\"");
    else
        text_add_number(text, row->fallback);
}

static void add_words(struct text *text, const struct bcd_param *row)
{
    for (size_t i = 0; row->choice(i); i++) {
        text_add(text, i ? "," : "");
        text_add_json_string(text, row->choice(i));
    }
}

static void add_required(struct text *text, const struct bcd_param *rows, const char *also)
{
    text_add(text, "\"required\":[");
    bool first = true;
    for (const struct bcd_param *row = rows; row->name; row++) {
        if (!row->required)
            continue;
        text_add(text, "%s\"%s\"", first ? "" : ",", row->name);
        first = false;
    }
    if (also)
        text_add(text, "%s\"%s\"", first ? "" : ",", also);
    text_add(text, "]");
}

static void add_slot(struct text *text, enum bcd_slot slot)
{
    const struct bcd_part *part;
    bool many = bcd_slot_many(slot);
    if (!many && !bcd_slot_typed(slot)) {
        text_add(text, "{\"default\":null,\"oneOf\":[{\"type\":\"null\"},");
        add_part(text, slot, bcd_catalogue(slot, 0));
        text_add(text, "]}");
        return;
    }
    text_add(text, many ? "{\"description\":\"what is measured, by name\",\"type\":\"object\","
                          "\"minProperties\":1,\"additionalProperties\":false,\"properties\":{"
                        : "{\"description\":\"none, or one of these by its type\","
                          "\"default\":null,\"oneOf\":[{\"type\":\"null\"}");
    for (size_t i = 0; (part = bcd_catalogue(slot, i)) != NULL; i++) {
        text_add(text, many && i == 0 ? "" : ",");
        if (many)
            text_add(text, "\"%s\":", part->name);
        add_part(text, slot, part);
    }
    text_add(text, many ? "}}" : "]}");
}

static void add_part(struct text *text, enum bcd_slot slot, const struct bcd_part *part)
{
    bool typed = bcd_slot_typed(slot);
    struct text place = {0};
    text_add(&place, typed || bcd_slot_many(slot) ? "/%s/%s" : "/%s", bcd_slot_key(slot),
             part->name);
    char *pointer = text_take(&place);
    text_add(text, "{\"description\":");
    add_description(text, part->doc, NULL, pointer ? pointer : "");
    text_add(text, ",\"type\":\"object\",\"additionalProperties\":false,");
    add_required(text, part->params, typed ? "type" : NULL);
    text_add(text, ",\"properties\":{");
    if (typed)
        text_add(text, "\"type\":{\"const\":\"%s\"}%s", part->name, part->params->name ? "," : "");
    add_properties(text, part->params, pointer ? pointer : "");
    text_add(text, "}}");
    free(pointer);
}

/* "doc; unit: length. Rule." */
static void add_description(struct text *text, const char *doc, const char *unit,
                            const char *pointer)
{
    struct text words = {0};
    text_add(&words, "%s", doc);
    if (unit && unit[0])
        text_add(&words, "; unit: %s", unit);
    for (size_t i = 0; i < sizeof(rules) / sizeof(rules[0]); i++)
        if (strcmp(rules[i].pointer, pointer) == 0)
            text_add(&words, ". %s", rules[i].rule);
    char *all = text_take(&words);
    text_add_json_string(text, all ? all : "");
    text->failed |= all == NULL;
    free(all);
}
