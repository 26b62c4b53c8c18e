/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "handle.h"
#include "iso_time.h"
#include "job_paths.h"
#include "job_request.h"
#include "limits.h"
#include "nearest.h"
#include "record_json.h"
#include "reply.h"
#include "store_find.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TEXT_SIZE = 64 };

/* What the query asks for, and the texts that its conditions borrow. */
struct asked {
    const struct service *service;
    struct find_query query;
    struct find_condition condition[LIMIT_FILTERS_MAX];
    char path[LIMIT_FILTERS_MAX + 1][JOB_PATH_SIZE]; /* the last one: what is sorted by */
    char bound[LIMIT_FILTERS_MAX][2][TEXT_SIZE];
    struct bcd_errors errors;
};

static void read_parameter(struct asked *asked, const char *name, const char *value);
static void read_state(struct asked *asked, const char *value);
static void read_sort(struct asked *asked, const char *value);
static void read_filter(struct asked *asked, const char *name, const char *value);
static bool read_moment(struct asked *asked, const char *name, const char *value);
static void read_bound(struct asked *asked, const char *name, const char *value, char relation);
static void read_equal(struct asked *asked, const char *value);
static bool check_path(struct asked *asked, const char *name, const char *path);
static void fault_unknown(struct asked *asked, const char *name, const char *path);
static void print_page(const struct service *service, const struct find_page *page,
                       struct reply *reply);

void handle_jobs_list(const struct service *service, const struct call *call, struct reply *reply)
{
    struct asked asked = {.service = service, .query.limit = LIMIT_LIST_ROWS_DEFAULT};
    struct find_page page = {0};
    asked.query.conditions = asked.condition;
    for (size_t i = 0; i < call->request->query_count; i++)
        read_parameter(&asked, call->request->query[i].name, call->request->query[i].value);
    if (asked.errors.count > 0) {
        reply_faults(reply, PROBLEM_QUERY, &asked.errors, NULL);
        return;
    }
    enum store_status status = store_find(service->store, &asked.query, &page);
    if (status == STORE_OK) {
        print_page(service, &page, reply);
    } else if (status == STORE_CONFLICT) {
        bcd_errors_add(&asked.errors, "cursor", "must be the \"next\" of a page with this sort");
        reply_faults(reply, PROBLEM_QUERY, &asked.errors, NULL);
    } else {
        reply_store(reply, status, "list of jobs");
    }
    find_page_fini(&page);
}

static void read_parameter(struct asked *asked, const char *name, const char *value)
{
    if (strcmp(name, "state") == 0)
        read_state(asked, value);
    else if (strcmp(name, "limit") == 0)
        asked->query.limit = strtoul(value, NULL, 10);
    else if (strcmp(name, "sort") == 0)
        read_sort(asked, value);
    else if (strcmp(name, "cursor") == 0)
        asked->query.cursor = value;
    else
        read_filter(asked, name, value);
}

static void read_state(struct asked *asked, const char *value)
{
    enum job_state state;
    if (job_state_parse(value, &state)) /* route_query.c has seen to that, and to the limit */
        asked->query.states |= 1U << state;
}

/* "submitted" and the like are the moments. */
static void read_sort(struct asked *asked, const char *value)
{
    char *path = asked->path[LIMIT_FILTERS_MAX];
    bool descending = *value == '-';
    value += descending;
    bool moment = strcmp(value, "started") == 0 || strcmp(value, "finished") == 0;
    asked->query.ascending = !descending;
    asked->query.sort = NULL;
    if (strcmp(value, "submitted") == 0)
        return;
    snprintf(path, JOB_PATH_SIZE, "%s%s", value, moment ? "_at" : "");
    if (check_path(asked, "sort", path))
        asked->query.sort = path;
}

/* Everything else is a filter; ">", "<" or "!" at the end of a name stood before "=". */
static void read_filter(struct asked *asked, const char *name, const char *value)
{
    size_t count = asked->query.condition_count, length = strlen(name);
    char relation = length > 0 && strchr("<>!", name[length - 1]) ? name[length - 1] : '=';
    if (count == LIMIT_FILTERS_MAX) {
        bcd_errors_add(&asked->errors, name, "is one filter too many; %d are possible",
                       LIMIT_FILTERS_MAX);
        return;
    }
    struct find_condition *condition = &asked->condition[count];
    *condition = (struct find_condition){.value = value};
    if (strcmp(name, "tag") == 0) {
        condition->relation = FIND_TAGGED;
    } else if (strcmp(name, "sweep") == 0) {
        condition->relation = FIND_SWEPT;
    } else if (!read_moment(asked, name, value)) {
        if (strcspn(name, "<>") < length - (relation != '=')) {
            bcd_errors_add(&asked->errors, name, "must be compared with =, !=, >= or <=");
            return;
        }
        snprintf(asked->path[count], JOB_PATH_SIZE, "%.*s", (int)(length - (relation != '=')),
                 name);
        condition->path = asked->path[count];
        if (!check_path(asked, name, condition->path))
            return;
        condition->relation = relation == '!' ? FIND_OTHER : FIND_EQUAL;
        if (relation == '<' || relation == '>')
            read_bound(asked, name, value, relation);
        else if (relation == '=')
            read_equal(asked, value);
    }
    asked->query.condition_count++;
}

/* submitted_after, finished_before, ...: true if the name is one of them. */
static bool read_moment(struct asked *asked, const char *name, const char *value)
{
    static const struct {
        const char *name, *path;
        bool before;
    } moments[] = {
        {"submitted_after", "submitted_at", false}, {"submitted_before", "submitted_at", true},
        {"started_after", "started_at", false},     {"started_before", "started_at", true},
        {"finished_after", "finished_at", false},   {"finished_before", "finished_at", true},
    };
    size_t count = asked->query.condition_count, i = 0;
    struct find_condition *condition = &asked->condition[count];
    int64_t ms = 0;
    while (i < sizeof(moments) / sizeof(moments[0]) && strcmp(moments[i].name, name) != 0)
        i++;
    if (i == sizeof(moments) / sizeof(moments[0]))
        return false;
    if (!iso_time_parse(value, &ms))
        bcd_errors_add(&asked->errors, name,
                       "must be a time like 2026-11-26T12:00Z or milliseconds since 1970, not "
                       "\"%.40s\"",
                       value);
    snprintf(asked->bound[count][0], TEXT_SIZE, "%" PRId64, ms - moments[i].before);
    condition->path = moments[i].path;
    condition->relation = FIND_WITHIN;
    condition->least = moments[i].before ? NULL : asked->bound[count][0];
    condition->most = moments[i].before ? asked->bound[count][0] : NULL;
    return true;
}

/* "diameter>=0.3": the value must be a number. */
static void read_bound(struct asked *asked, const char *name, const char *value, char relation)
{
    struct find_condition *condition = &asked->condition[asked->query.condition_count];
    if (!find_is_number(value))
        bcd_errors_add(&asked->errors, name, "must be compared with a number, not \"%.40s\"",
                       value);
    condition->relation = FIND_WITHIN;
    condition->least = relation == '>' ? value : NULL;
    condition->most = relation == '<' ? value : NULL;
}

/* "0.3..0.5", either end of which may be left out, is a range; all else must be met exactly. */
static void read_equal(struct asked *asked, const char *value)
{
    size_t count = asked->query.condition_count;
    struct find_condition *condition = &asked->condition[count];
    char *least = asked->bound[count][0], *most = asked->bound[count][1];
    const char *dots = strstr(value, "..");
    if (!dots || (size_t)(dots - value) >= TEXT_SIZE || strlen(dots + 2) >= TEXT_SIZE)
        return;
    snprintf(least, TEXT_SIZE, "%.*s", (int)(dots - value), value);
    snprintf(most, TEXT_SIZE, "%s", dots + 2);
    if ((*least && !find_is_number(least)) || (*most && !find_is_number(most)) ||
        (!*least && !*most))
        return;
    condition->relation = FIND_WITHIN;
    condition->least = *least ? least : NULL;
    condition->most = *most ? most : NULL;
}

/* A misspelt path must not look like a job that is not there. */
static bool check_path(struct asked *asked, const char *name, const char *path)
{
    bool usual = strcmp(path, "label") == 0 || strcmp(path, "owner") == 0;
    bool known = usual || job_path_is_plain(path);
    if (!known && (strncmp(path, "derived.", 8) == 0 || strncmp(path, "results.", 8) == 0))
        store_find_known(asked->service->store, path, &known);
    if (!known)
        fault_unknown(asked, name, path);
    return asked->errors.count == 0;
}

/* Unless it is one that no job has had yet. */
static void fault_unknown(struct asked *asked, const char *name, const char *path)
{
    struct nearest group = {0}, all = {0};
    struct job_paths paths;
    size_t dot = strcspn(path, ".");
    bool known = false;
    job_paths_init(&paths);
    for (size_t i = 0; i < paths.count && !known; i++) {
        const char *candidate = paths.path[i];
        known = strcmp(candidate, path) == 0;
        nearest_know(&all, candidate, path);
        bool beside = path[dot] ? strncmp(candidate, path, dot + 1) == 0 : !strchr(candidate, '.');
        if (beside)
            nearest_know(&group, candidate, path);
    }
    if (known)
        ;
    else if (all.name)
        bcd_errors_add(&asked->errors, name, "is unknown; did you mean \"%s\"?", all.name);
    else if (group.used > 0)
        bcd_errors_add(&asked->errors, name, "is unknown; known are %s", group.list);
    else
        bcd_errors_add(&asked->errors, name,
                       "is unknown; known are potential., observables., "
                       "derived., results. and so on, and what has no dot");
    job_paths_fini(&paths);
}

static void print_page(const struct service *service, const struct find_page *page,
                       struct reply *reply)
{
    struct record_view *views = calloc(page->count + 1, sizeof(*views));
    for (size_t i = 0; views && i < page->count; i++)
        views[i] =
            (struct record_view){.record = &page->records[i],
                                 .progress = job_request_progress(service, &page->records[i])};
    reply_json_take(reply, views ? record_json_print_list(views, page->count, page->next) : NULL);
    free(views);
}
