/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "handle.h"
#include "plot_svg.h"
#include "reply.h"
#include "scene_json.h"
#include "store_results.h"
#include "table_csv.h"
#include "table_json.h"
#include "text.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool find_done(const struct service *service, const char *id, struct job_record *record,
                      struct reply *reply);
static struct bcd_table *load_table(const struct service *service, const char *id,
                                    const char *observable, struct reply *reply);
static struct bcd_table *load_named(const struct service *service, const struct call *call,
                                    struct job_record *record, struct reply *reply);
static char *caption(const struct job_record *record);
static void add_group(struct text *text, const struct bcd_group *group);
static bool is_default(const struct bcd_group *group, const struct bcd_param *row);

void handle_results_all(const struct service *service, const struct call *call, struct reply *reply)
{
    const char *id = call->arg[0];
    struct job_record record = {0};
    struct bcd_table **tables = NULL;
    char **names = NULL;
    size_t count = 0;
    if (!find_done(service, id, &record, reply))
        return;
    enum store_status status = store_results_names(service->store, id, &names, &count);
    if (status != STORE_OK) {
        reply_store(reply, status, "result");
        goto cleanup;
    }
    tables = calloc(count + 1, sizeof(struct bcd_table *));
    if (!tables) {
        reply_bcd(reply, BCD_NO_MEMORY, NULL);
        goto cleanup;
    }
    for (size_t i = 0; i < count; i++) {
        tables[i] = load_table(service, id, names[i], reply);
        if (!tables[i])
            goto cleanup;
    }
    reply_json_take(reply, table_json_print_all(tables, count));
    reply_immutable(reply);
cleanup:
    for (size_t i = 0; i < count; i++) {
        if (tables)
            bcd_table_free(tables[i]);
        free(names[i]);
    }
    free(tables);
    free(names);
    job_record_fini(&record);
}

void handle_results_json(const struct service *service, const struct call *call,
                         struct reply *reply)
{
    struct job_record record = {0};
    struct bcd_table *table = load_named(service, call, &record, reply);
    if (table) {
        reply_json_take(reply, table_json_print(table));
        reply_immutable(reply);
    }
    bcd_table_free(table);
    job_record_fini(&record);
}

void handle_results_csv(const struct service *service, const struct call *call, struct reply *reply)
{
    struct job_record record = {0};
    struct bcd_table *table = load_named(service, call, &record, reply);
    if (table) {
        reply_text_take(reply, "text/csv; charset=utf-8; header=present", table_csv_print(table));
        reply_immutable(reply);
    }
    bcd_table_free(table);
    job_record_fini(&record);
}

void handle_results_svg(const struct service *service, const struct call *call, struct reply *reply)
{
    struct job_record record = {0};
    struct bcd_table *table = load_named(service, call, &record, reply);
    if (table) {
        char *subtitle = caption(&record);
        reply_text_take(reply, "image/svg+xml", plot_svg_print(table, table->name, subtitle));
        reply_immutable(reply);
        free(subtitle);
    }
    bcd_table_free(table);
    job_record_fini(&record);
}

/* The record of a job that has results; else false, with the reply filled. */
static bool find_done(const struct service *service, const char *id, struct job_record *record,
                      struct reply *reply)
{
    enum store_status status = store_jobs_get(service->store, id, record);
    if (status != STORE_OK)
        reply_store(reply, status, "such job");
    else if (record->state == JOB_DONE)
        return true;
    else if (record->state == JOB_FAILED)
        reply_problem(reply, PROBLEM_STATE, "job %s has no results, it failed: %s", id,
                      record->error ? record->error : "");
    else if (record->state == JOB_CANCELLED)
        reply_problem(reply, PROBLEM_STATE, "job %s has no results, it was cancelled", id);
    else
        reply_problem(reply, PROBLEM_STATE, "job %s has no results yet, it is %s", id,
                      job_state_name(record->state));
    job_record_fini(record);
    *record = (struct job_record){0};
    return false;
}

static struct bcd_table *load_table(const struct service *service, const char *id,
                                    const char *observable, struct reply *reply)
{
    struct blob blob = {0};
    struct bcd_table *table = NULL;
    enum store_status status = store_results_get(service->store, id, observable, &blob);
    if (status != STORE_OK) {
        reply_store(reply, status, "such result: the job did not ask for it");
        return NULL;
    }
    enum bcd_status loaded = bcd_table_load(&table, blob.bytes, blob.size, NULL);
    if (loaded != BCD_OK)
        reply_bcd(reply, loaded, NULL);
    blob_fini(&blob);
    return table;
}

/* The table that the path asks for, and its job. NULL with the reply filled. */
static struct bcd_table *load_named(const struct service *service, const struct call *call,
                                    struct job_record *record, struct reply *reply)
{
    if (!find_done(service, call->arg[0], record, reply))
        return NULL;
    return load_table(service, call->arg[0], call->arg[1], reply);
}

/* The job's parameters in one line, from the engine's rows; NULL when it cannot be told. */
static char *caption(const struct job_record *record)
{
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    if (scene_json_parse(record->job, strlen(record->job), &scene, &errors) != BCD_OK)
        return NULL;
    struct text text = {0};
    add_group(&text, bcd_scene_job_view(scene));
    const struct bcd_group *potential = bcd_scene_part(scene, BCD_SLOT_POTENTIAL, 0);
    if (potential) {
        text_add(&text, ", %s potential", potential->type);
        add_group(&text, potential);
    }
    bcd_scene_free(scene);
    return text_take(&text);
}

/* What is not as it would be anyway: "particles 50, length 100, diameter 0.5". */
static void add_group(struct text *text, const struct bcd_group *group)
{
    for (size_t i = 0; group->rows[i].name; i++) {
        const struct bcd_param *row = &group->rows[i];
        if (is_default(group, row))
            continue;
        text_add(text, "%s%s ", text->size ? ", " : "", row->name);
        const char *word = row->type == BCD_PARAM_INTEGER || row->type == BCD_PARAM_NUMBER
                               ? NULL
                               : bcd_group_text(group, row);
        if (row->type == BCD_PARAM_INTEGER)
            text_add(text, "%" PRId64, bcd_group_integer(group, row));
        else if (word)
            text_add(text, "%s", word);
        else
            text_add_number(text, bcd_group_number(group, row));
    }
}

static bool is_default(const struct bcd_group *group, const struct bcd_param *row)
{
    if (row->required)
        return false;
    if (row->type == BCD_PARAM_INTEGER || row->type == BCD_PARAM_CHOICE)
        return (double)bcd_group_integer(group, row) == row->fallback;
    double value = bcd_group_number(group, row);
    return value == row->fallback || (isnan(value) && isnan(row->fallback));
}
