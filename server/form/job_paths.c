/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "job_paths.h"
#include "bcd.h"
#include "sample.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const of_record[] = {"owner",        "label",      "priority",
                                        "submitted_at", "started_at", "finished_at"};
enum { OF_RECORD = sizeof(of_record) / sizeof(of_record[0]) };

__attribute__((format(printf, 2, 3))) static void add(struct job_paths *paths, const char *format,
                                                      ...)
{
    va_list arguments;
    if (paths->count == paths->room) {
        size_t room = paths->room ? 2 * paths->room : 128;
        char(*more)[JOB_PATH_SIZE] = realloc(paths->path, room * sizeof(*more));
        paths->failed = paths->failed || !more;
        if (paths->failed)
            return;
        paths->path = more;
        paths->room = room;
    }
    va_start(arguments, format);
    vsnprintf(paths->path[paths->count++], JOB_PATH_SIZE, format, arguments);
    va_end(arguments);
}

/* A list is no scalar. */
static void add_rows(struct job_paths *paths, const char *prefix, const struct bcd_param *rows)
{
    for (; rows && rows->name; rows++)
        if (rows->type != BCD_PARAM_NUMBERS)
            add(paths, "%s%s", prefix, rows->name);
}

static void add_plain(struct job_paths *paths)
{
    const struct bcd_part *part;
    add_rows(paths, "", bcd_job_params());
    for (int s = 0; s < BCD_SLOT_COUNT; s++) {
        enum bcd_slot slot = (enum bcd_slot)s;
        char prefix[JOB_PATH_SIZE];
        if (!bcd_slot_many(slot))
            add(paths, "%s.type", bcd_slot_key(slot));
        for (size_t i = 0; (part = bcd_catalogue(slot, i)); i++) {
            snprintf(prefix, sizeof(prefix), bcd_slot_many(slot) ? "%s.%s." : "%s.",
                     bcd_slot_key(slot), part->name);
            add_rows(paths, prefix, part->params);
        }
    }
    for (size_t i = 0; i < OF_RECORD; i++)
        add(paths, "%s", of_record[i]);
}

/* What stands beside a theory has the names that engine/reference.c gives it. */
static void add_results(struct job_paths *paths, const struct bcd_table *table)
{
    static const char *const compared[] = {"chi_square", "degrees_of_freedom", "p_value"};
    bool theory = false;
    for (size_t i = 0; i < table->columns; i++)
        theory = theory || table->column[i].role == BCD_ROLE_THEORY;
    if (theory && table->scalar)
        add(paths, "results.%s.z", table->name);
    for (size_t i = 0; theory && i < sizeof(compared) / sizeof(compared[0]); i++)
        add(paths, "results.%s.%s", table->name, compared[i]);
    for (size_t i = 0; table->scalar && i < table->columns; i++)
        add(paths, "results.%s.%s", table->name, table->column[i].name);
    for (size_t i = 0; i < table->notes; i++)
        if (!table->note[i].text[0])
            add(paths, "results.%s.%s", table->name, table->note[i].name);
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
        add(paths, "derived.%s", fact->name);
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

bool job_path_is_plain(const char *path)
{
    struct job_paths paths = {0};
    bool found = false;
    add_plain(&paths);
    for (size_t i = 0; i < paths.count && !found; i++)
        found = strcmp(paths.path[i], path) == 0;
    free(paths.path);
    return found;
}
