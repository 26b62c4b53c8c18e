/* SPDX-License-Identifier: GPL-3.0-or-later
 * handle_results.c - what a job has measured. Long tables take seconds to be printed: aside. */
#include "aside.h"
#include "caption.h"
#include "handle.h"
#include "limits.h"
#include "plot_svg.h"
#include "reply.h"
#include "scene_json.h"
#include "store_results.h"
#include "table_csv.h"
#include "table_json.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What a result is asked for as, by whom it is answered, and the tag of it. */
struct form {
    const char *name;
    handler *handle;
    char etag[ETAG_SIZE];
};

static bool find_done(const struct service *service, const char *id, struct job_record *record,
                      struct reply *reply);
static struct bcd_table *load_table(const struct service *service, const char *id,
                                    const char *observable, struct reply *reply);
static struct bcd_table *load_named(const struct service *service, const struct call *call,
                                    struct job_record *record, struct form *form,
                                    struct reply *reply);
static bool unchanged(const struct call *call, const struct job_record *record, const char *form,
                      char etag[ETAG_SIZE], struct reply *reply);
static bool goes_aside(const struct service *service, const struct call *call, handler *handle,
                       struct reply *reply);
static char *caption(const struct job_record *record);

void handle_results_all(const struct service *service, const struct call *call, struct reply *reply)
{
    const char *id = call->arg[0];
    struct job_record record = {0};
    struct bcd_table **tables = NULL;
    char **names = NULL;
    size_t count = 0;
    char etag[ETAG_SIZE];
    if (!find_done(service, id, &record, reply))
        return;
    if (unchanged(call, &record, "all", etag, reply) ||
        goes_aside(service, call, handle_results_all, reply)) {
        job_record_fini(&record);
        return;
    }
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
    reply_immutable(reply, etag);
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
    struct form form = {.name = "json", .handle = handle_results_json};
    struct job_record record = {0};
    struct bcd_table *table = load_named(service, call, &record, &form, reply);
    if (table) {
        reply_json_take(reply, table_json_print(table));
        reply_immutable(reply, form.etag);
    }
    bcd_table_free(table);
    job_record_fini(&record);
}

void handle_results_csv(const struct service *service, const struct call *call, struct reply *reply)
{
    struct form form = {.name = "csv", .handle = handle_results_csv};
    struct job_record record = {0};
    struct bcd_table *table = load_named(service, call, &record, &form, reply);
    if (table) {
        reply_text_take(reply, "text/csv; charset=utf-8; header=present", table_csv_print(table));
        reply_immutable(reply, form.etag);
    }
    bcd_table_free(table);
    job_record_fini(&record);
}

void handle_results_svg(const struct service *service, const struct call *call, struct reply *reply)
{
    struct form form = {.name = "svg", .handle = handle_results_svg};
    struct job_record record = {0};
    struct bcd_table *table = load_named(service, call, &record, &form, reply);
    if (table) {
        char *subtitle = caption(&record);
        reply_text_take(reply, "image/svg+xml",
                        subtitle ? plot_svg_print(table, table->name, subtitle[0] ? subtitle : NULL)
                                 : NULL);
        reply_immutable(reply, form.etag);
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
                                    struct job_record *record, struct form *form,
                                    struct reply *reply)
{
    if (!find_done(service, call->arg[0], record, reply) ||
        unchanged(call, record, form->name, form->etag, reply) ||
        goes_aside(service, call, form->handle, reply))
        return NULL;
    return load_table(service, call->arg[0], call->arg[1], reply);
}

/* True when the client has it: nothing is read then. Results of a job never change, but another
 * version of this program may print them in another way, and a store that was put back from a
 * backup may give a job's id away again. */
static bool unchanged(const struct call *call, const struct job_record *record, const char *form,
                      char etag[ETAG_SIZE], struct reply *reply)
{
    uint32_t observable = 2166136261; /* FNV-1a */
    for (const char *c = call->arg[1]; *c; c++)
        observable = (observable ^ (unsigned char)*c) * 16777619;
    snprintf(etag, ETAG_SIZE, "%s-%" PRIx64 "-%08" PRIx32 ".%s-" BCD_VERSION, record->id,
             record->finished_ms, observable, form);
    if (!reply_unchanged(reply, call->request, etag))
        return false;
    reply_immutable(reply, etag);
    return true;
}

/* True: what is asked for is long, and the thread that it is printed by has others to serve. */
static bool goes_aside(const struct service *service, const struct call *call, handler *handle,
                       struct reply *reply)
{
    struct aside *lane = service->lane[LANE_RESULTS];
    const char *observable = call->arg[1][0] ? call->arg[1] : NULL;
    int64_t bytes = 0;
    if (!call->request->held && (!lane || call->request->last))
        return false; /* there already */
    if (!call->request->held &&
        (store_results_bytes(service->store, call->arg[0], observable, &bytes) != STORE_OK ||
         bytes <= LIMIT_RESULT_AT_ONCE_BYTES))
        return false;
    aside_answer(lane, handle, service, call, reply);
    return true;
}

/* The job in one line, "" when it cannot be told; NULL = out of memory. */
static char *caption(const struct job_record *record)
{
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    enum bcd_status status =
        scene_json_complete(record->job, strlen(record->job), NULL, &scene, &errors);
    if (status != BCD_OK)
        return status == BCD_INVALID ? strdup("") : NULL;
    char *line = caption_print(scene);
    bcd_scene_free(scene);
    return line;
}
