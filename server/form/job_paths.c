/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "job_paths.h"
#include "bcd.h"
#include "outcome_facts.h"
#include "sample.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct job_path of_record[] = {
    {"owner", JOB_VALUES_OWNER, ""},       {"label", JOB_VALUES_TEXT, ""},
    {"priority", JOB_VALUES_NUMBER, ""},   {"submitted_at", JOB_VALUES_MOMENT, ""},
    {"started_at", JOB_VALUES_MOMENT, ""}, {"finished_at", JOB_VALUES_MOMENT, ""},
};

__attribute__((format(printf, 3, 4))) static struct job_path *
add(struct job_paths *paths, unsigned values, const char *format, ...)
{
    va_list arguments;
    if (paths->count == paths->room) {
        size_t room = paths->room ? 2 * paths->room : 128;
        struct job_path *more = realloc(paths->path, room * sizeof(*more));
        paths->failed = paths->failed || !more;
        if (paths->failed)
            return NULL;
        paths->path = more;
        paths->room = room;
    }
    struct job_path *path = &paths->path[paths->count++];
    *path = (struct job_path){.values = values};
    va_start(arguments, format);
    vsnprintf(path->name, sizeof(path->name), format, arguments);
    va_end(arguments);
    return path;
}

/* path may be NULL. */
static void add_word(struct job_path *path, const char *word)
{
    size_t length = path ? strlen(path->words) : 0;
    if (path && length + strlen(word) + 2 <= sizeof(path->words))
        snprintf(path->words + length, sizeof(path->words) - length, "%s%s", length ? " " : "",
                 word);
    else if (path)
        path->values = JOB_VALUES_TEXT; /* too many to be told */
}

static void add_row(struct job_paths *paths, const char *prefix, const struct bcd_param *row)
{
    struct job_path *path;
    const char *word;
    switch (row->type) {
    case BCD_PARAM_NUMBERS: /* a list is no scalar */
        break;
    case BCD_PARAM_INTEGER:
    case BCD_PARAM_NUMBER:
        add(paths, JOB_VALUES_NUMBER, "%s%s", prefix, row->name);
        break;
    case BCD_PARAM_AUTO:
        path = add(paths, JOB_VALUES_NUMBER | JOB_VALUES_WORD, "%s%s", prefix, row->name);
        add_word(path, "auto");
        break;
    case BCD_PARAM_CHOICE:
        path = add(paths, JOB_VALUES_WORD, "%s%s", prefix, row->name);
        for (size_t i = 0; (word = row->choice(i)); i++)
            add_word(path, word);
        break;
    case BCD_PARAM_TEXT:
        add(paths, JOB_VALUES_TEXT, "%s%s", prefix, row->name);
        break;
    }
}

static void add_rows(struct job_paths *paths, const char *prefix, const struct bcd_param *rows)
{
    for (; rows && rows->name; rows++)
        add_row(paths, prefix, rows);
}

static void add_outcome(struct job_paths *paths)
{
    static const unsigned values[] = {[OUTCOME_NUMBER] = JOB_VALUES_NUMBER,
                                      [OUTCOME_TEXT] = JOB_VALUES_TEXT,
                                      [OUTCOME_FLAG] = JOB_VALUES_WORD,
                                      [OUTCOME_STOP] = JOB_VALUES_WORD};
    const struct outcome_fact *fact;
    for (size_t i = 0; (fact = outcome_fact_at(i)); i++) {
        struct job_path *path = add(paths, values[fact->kind], "outcome.%s", fact->path);
        if (fact->kind == OUTCOME_FLAG)
            add_word(path, "true false");
        for (int stop = BCD_STOP_TARGET; fact->kind == OUTCOME_STOP && stop <= BCD_STOP_TIME_STEP;
             stop++)
            add_word(path, bcd_stop_name((enum bcd_stop)stop));
    }
}

static void add_plain(struct job_paths *paths)
{
    const struct bcd_part *part;
    add_rows(paths, "", bcd_job_params());
    for (int s = 0; s < BCD_SLOT_COUNT; s++) {
        enum bcd_slot slot = (enum bcd_slot)s;
        char prefix[JOB_PATH_SIZE];
        struct job_path *type = NULL;
        if (!bcd_slot_many(slot))
            type = add(paths, JOB_VALUES_WORD, "%s.type", bcd_slot_key(slot));
        for (size_t i = 0; type && (part = bcd_catalogue(slot, i)); i++)
            add_word(type, part->name);
        for (size_t i = 0; (part = bcd_catalogue(slot, i)); i++) {
            snprintf(prefix, sizeof(prefix), bcd_slot_many(slot) ? "%s.%s." : "%s.",
                     bcd_slot_key(slot), part->name);
            add_rows(paths, prefix, part->params);
        }
    }
    add_outcome(paths);
    for (size_t i = 0; i < sizeof(of_record) / sizeof(of_record[0]); i++)
        add(paths, of_record[i].values, "%s", of_record[i].name);
}

/* What stands beside a theory has the names that engine/reference.c gives it. */
static void add_results(struct job_paths *paths, const struct bcd_table *table)
{
    static const char *const compared[] = {"chi_square", "degrees_of_freedom", "p_value"};
    bool theory = false;
    for (size_t i = 0; i < table->columns; i++)
        theory = theory || table->column[i].role == BCD_ROLE_THEORY;
    if (theory && table->scalar)
        add(paths, JOB_VALUES_NUMBER, "results.%s.z", table->name);
    for (size_t i = 0; theory && i < sizeof(compared) / sizeof(compared[0]); i++)
        add(paths, JOB_VALUES_NUMBER, "results.%s.%s", table->name, compared[i]);
    for (size_t i = 0; table->scalar && i < table->columns; i++)
        add(paths, JOB_VALUES_NUMBER, "results.%s.%s", table->name, table->column[i].name);
    for (size_t i = 0; i < table->notes; i++)
        if (!table->note[i].text[0])
            add(paths, JOB_VALUES_NUMBER, "results.%s.%s", table->name, table->note[i].name);
}

void job_paths_init(struct job_paths *paths)
{
    struct sample sample;
    const struct bcd_fact *fact;
    *paths = (struct job_paths){0};
    add_plain(paths);
    if (!sample_init(&sample))
        return;
    for (size_t i = 0; (fact = bcd_scene_fact(sample.scene, i)); i++)
        add(paths, fact->kind == BCD_FACT_TEXT ? JOB_VALUES_TEXT : JOB_VALUES_NUMBER, "derived.%s",
            fact->name);
    for (size_t i = 0; bcd_catalogue(BCD_SLOT_OBSERVABLE, i); i++) {
        struct bcd_table *table = sample_table(&sample, i);
        if (table)
            add_results(paths, table);
        bcd_table_free(table);
    }
    sample_fini(&sample);
}

void job_paths_fini(struct job_paths *paths)
{
    free(paths->path);
    *paths = (struct job_paths){0};
}

bool job_paths_find(const struct job_paths *paths, const char *name, struct job_path *found)
{
    bool any = false;
    for (size_t i = 0; i < paths->count; i++) {
        const struct job_path *path = &paths->path[i];
        if (strcmp(path->name, name) != 0)
            continue;
        if (!any)
            *found = *path;
        else if (path->words[0] && strcmp(path->words, found->words) != 0)
            add_word(found, path->words);
        found->values |= path->values;
        any = true;
    }
    return any;
}

bool job_path_plain(const char *name, struct job_path *found)
{
    struct job_paths paths = {0};
    add_plain(&paths);
    bool any = job_paths_find(&paths, name, found);
    free(paths.path);
    return any;
}
