/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "schema_results.h"
#include "bcd.h"
#include "scene_json.h"

#include <stdlib.h>
#include <string.h>

static struct bcd_table *empty_table(const struct bcd_part *part);
static void add_table(struct text *text, const struct bcd_table *table);
static void add_column(struct text *text, const struct bcd_table *table, const char *name,
                       const char *doc);

static const struct bcd_part *part_at(size_t index)
{
    return bcd_catalogue(BCD_SLOT_OBSERVABLE, index);
}

void schema_results_add(struct text *text)
{
    const struct bcd_part *part;
    for (size_t i = 0; (part = part_at(i)) != NULL; i++) {
        struct bcd_table *table = empty_table(part);
        text_add(text, "\"%sResult\":{\"description\":", part->name);
        text_add_json_string(text, part->doc);
        text_add(text, ",\"type\":\"object\"");
        if (table)
            add_table(text, table);
        text->failed |= !table;
        text_add(text, ",\"additionalProperties\":{\"$ref\":\"#/components/schemas/Column\"}},");
        bcd_table_free(table);
    }
    text_add(text, "\"Result\":{\"description\":\"One observable\",\"anyOf\":[");
    for (size_t i = 0; (part = part_at(i)) != NULL; i++)
        text_add(text, "%s{\"$ref\":\"#/components/schemas/%sResult\"}", i ? "," : "", part->name);
    text_add(text, "]},\"Results\":{\"description\":\"What the job asked for, by name\","
                   "\"type\":\"object\",\"additionalProperties\":false,\"properties\":{");
    for (size_t i = 0; (part = part_at(i)) != NULL; i++)
        text_add(text, "%s\"%s\":{\"$ref\":\"#/components/schemas/%sResult\"}", i ? "," : "",
                 part->name, part->name);
    text_add(text, "}}");
}

/* The table of a small job that measured nothing yet: its columns are those of any other job. NULL
 * = no memory. */
static struct bcd_table *empty_table(const struct bcd_part *part)
{
    struct text job = {0};
    struct bcd_scene *scene = NULL;
    struct bcd_tally *tally = NULL;
    struct bcd_table *table = NULL;
    const char *separator = "";
    text_add(&job,
             "{\"particles\":4,\"length\":8,\"diameter\":0.5,\"time\":1,\"observables\":{"
             "\"%s\":{",
             part->name);
    for (const struct bcd_param *row = part->params; row->name; row++) {
        if (row->required) {
            text_add(&job, "%s\"%s\":1", separator, row->name);
            separator = ",";
        }
    }
    text_add(&job, "}}}");
    char *body = text_take(&job);
    if (body && !scene_json_parse(body, strlen(body), &scene, NULL) &&
        !bcd_tally_create(&tally, scene))
        bcd_tally_table(tally, scene, NULL, 0, &table);
    bcd_tally_free(tally);
    bcd_scene_free(scene);
    free(body);
    return table;
}

/* ,"required":[..],"properties":{..} */
static void add_table(struct text *text, const struct bcd_table *table)
{
    text_add(text, ",\"required\":[");
    for (size_t i = 0; i < table->columns; i++)
        text_add(text, "%s\"%s\"", i ? "," : "", table->column[i].name);
    text_add(text, "],\"properties\":{");
    for (size_t i = 0; i < table->columns; i++) {
        const struct bcd_column *column = &table->column[i];
        const char *doc = column->role == BCD_ROLE_X                 ? table->x_label
                          : column->role == BCD_ROLE_VALUE           ? table->y_label
                          : column->role == BCD_ROLE_STDERR          ? "one standard error"
                          : column->role == BCD_ROLE_TIME_STEP_ERROR ? "from the finite time step"
                                                                     : "";
        add_column(text, table, column->name, doc);
        text_add(text, ",");
    }
    if (!bcd_table_column(table, BCD_ROLE_THEORY)) {
        add_column(text, table, "theory", "exact values");
        text_add(text, ",");
    }
    text_add(text, "\"theory_reason\":{\"type\":\"string\"}}");
}

static void add_column(struct text *text, const struct bcd_table *table, const char *name,
                       const char *doc)
{
    text_add(text,
             table->scalar ? "\"%s\":{\"type\":[\"number\",\"null\"]"
                           : "\"%s\":{\"type\":[\"array\",\"null\"],\"items\":"
                             "{\"type\":[\"number\",\"null\"]}",
             name);
    if (doc[0]) {
        text_add(text, ",\"description\":");
        text_add_json_string(text, doc);
    }
    text_add(text, "}");
}
