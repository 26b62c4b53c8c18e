/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "handle.h"
#include "iso_time.h"
#include "job_paths.h"
#include "job_request.h"
#include "limits.h"
#include "nearest.h"
#include "record_json.h"
#include "reply.h"
#include "route_query.h"
#include "store_find.h"
#include "store_watch.h"

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
    char bound[LIMIT_FILTERS_MAX][2][TEXT_SIZE];     /* numbers */
    struct bcd_errors errors;
};

/* "diameter>" as it came, what it is about, and the relation: one of = ! < >. */
struct filter {
    const char *name, *value;
    struct job_path path;
    char relation;
};

static void read_parameter(struct asked *asked, const char *name, const char *value);
static void read_state(struct asked *asked, const char *value);
static void read_sort(struct asked *asked, const char *value);
static void read_filter(struct asked *asked, const char *name, const char *value);
static bool read_moment(struct asked *asked, const char *name, const char *value);
static void check_sweep(struct asked *asked, const char *value);
static void read_relation(struct asked *asked, const struct filter *filter);
static void read_range(struct asked *asked, const struct filter *filter, const char *dots);
static bool read_number(const struct job_path *path, const char *value, char number[TEXT_SIZE]);
static bool is_word(const struct job_path *path, const char *value);
static void fault_value(struct asked *asked, const struct filter *filter);
static bool check_path(struct asked *asked, const char *name, struct job_path *path);
static void find_fact(const char *name, struct job_path *path);
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
    struct job_path path;
    bool descending = *value == '-';
    value += descending;
    bool moment = strcmp(value, "started") == 0 || strcmp(value, "finished") == 0;
    asked->query.ascending = !descending;
    asked->query.sort = NULL;
    if (strcmp(value, "submitted") == 0)
        return;
    snprintf(path.name, sizeof(path.name), "%s%s", value, moment ? "_at" : "");
    if (!check_path(asked, "sort", &path))
        return;
    memcpy(asked->path[LIMIT_FILTERS_MAX], path.name, sizeof(path.name));
    asked->query.sort = asked->path[LIMIT_FILTERS_MAX];
}

/* Everything else is a filter; ">", "<" or "!" at the end of a name stood before "=". */
static void read_filter(struct asked *asked, const char *name, const char *value)
{
    size_t count = asked->query.condition_count, length = strlen(name);
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
        check_sweep(asked, value);
    } else if (!read_moment(asked, name, value)) {
        struct filter filter = {.name = name, .value = value, .relation = '='};
        if (length > 0 && strchr("<>!", name[length - 1]))
            filter.relation = name[--length];
        if (strcspn(name, "<>") < length) {
            bcd_errors_add(&asked->errors, name, "must be compared with =, !=, >= or <=");
            return;
        }
        snprintf(filter.path.name, sizeof(filter.path.name), "%.*s", (int)length, name);
        if (check_path(asked, name, &filter.path))
            read_relation(asked, &filter);
    }
    asked->query.condition_count++;
}

/* One that is not there has no jobs: a mistake, and no empty list. */
static void check_sweep(struct asked *asked, const char *value)
{
    int64_t seq;
    if (store_watch_sweep(asked->service->store, value, &seq) == STORE_NOT_FOUND)
        bcd_errors_add(&asked->errors, "sweep",
                       "must be the id of a sweep; there is none with \"%.40s\"", value);
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

/* "diameter>=0.3", "diameter=0.3..0.5", "method!=tao": a value that no job can have is a mistake.
 */
static void read_relation(struct asked *asked, const struct filter *filter)
{
    size_t count = asked->query.condition_count;
    struct find_condition *condition = &asked->condition[count];
    char relation = filter->relation, *number = asked->bound[count][0];
    const char *dots = strstr(filter->value, "..");
    bool numbers = filter->path.values & (JOB_VALUES_NUMBER | JOB_VALUES_MOMENT);
    bool bound = relation == '<' || relation == '>';
    memcpy(asked->path[count], filter->path.name, sizeof(filter->path.name));
    condition->path = asked->path[count];
    condition->relation = bound ? FIND_WITHIN : relation == '!' ? FIND_OTHER : FIND_EQUAL;
    if (numbers && relation == '=' && dots) {
        read_range(asked, filter, dots);
    } else if (numbers && read_number(&filter->path, filter->value, number)) {
        condition->value = number;
        condition->least = relation == '>' ? number : NULL;
        condition->most = relation == '<' ? number : NULL;
    } else if (bound || !is_word(&filter->path, filter->value)) {
        fault_value(asked, filter);
    }
}

/* Either end may be left out, but not both. */
static void read_range(struct asked *asked, const struct filter *filter, const char *dots)
{
    size_t count = asked->query.condition_count;
    struct find_condition *condition = &asked->condition[count];
    char begin[TEXT_SIZE], *least = asked->bound[count][0], *most = asked->bound[count][1];
    snprintf(begin, sizeof(begin), "%.*s", (int)(dots - filter->value), filter->value);
    const char *end = dots + 2;
    condition->relation = FIND_WITHIN;
    condition->least = *begin ? least : NULL;
    condition->most = *end ? most : NULL;
    if ((!*begin && !*end) || (*begin && !read_number(&filter->path, begin, least)) ||
        (*end && !read_number(&filter->path, end, most)))
        fault_value(asked, filter);
    else if (*begin && *end && strtod(least, NULL) > strtod(most, NULL))
        bcd_errors_add(&asked->errors, filter->name, "is a range from %.40s down to %.40s: nothing",
                       begin, end);
}

/* A number as the store takes it; of a moment its milliseconds. */
static bool read_number(const struct job_path *path, const char *value, char number[TEXT_SIZE])
{
    int64_t ms;
    if (path->values & JOB_VALUES_MOMENT) {
        bool sound = iso_time_parse(value, &ms);
        if (sound)
            snprintf(number, TEXT_SIZE, "%" PRId64, ms);
        return sound;
    }
    if (strlen(value) >= TEXT_SIZE || !find_is_number(value))
        return false;
    snprintf(number, TEXT_SIZE, "%s", value);
    return true;
}

static bool is_word(const struct job_path *path, const char *value)
{
    if (path->values & JOB_VALUES_OWNER)
        return owner_sound(value);
    if (path->values & JOB_VALUES_TEXT)
        return value[0] != '\0';
    return (path->values & JOB_VALUES_WORD) && route_query_word(path->words, value);
}

/* What it could have been. */
static void fault_value(struct asked *asked, const struct filter *filter)
{
    const struct job_path *path = &filter->path;
    bool bound = filter->relation == '<' || filter->relation == '>';
    bool range = filter->relation == '=', words = path->words[0] && !bound;
    const char *value = filter->value;
    if (path->values & JOB_VALUES_MOMENT)
        bcd_errors_add(&asked->errors, filter->name,
                       "must be a time like 2026-11-26T12:00Z or milliseconds since 1970%s, not "
                       "\"%.40s\"",
                       range ? ", or a range of them: FROM..TO" : "", value);
    else if (path->values & JOB_VALUES_NUMBER)
        bcd_errors_add(&asked->errors, filter->name, "must be a number%s%s%s, not \"%.40s\"",
                       range ? ", a range like 0.3..0.5 or 0.3.." : "", words ? ", or " : "",
                       words ? path->words : "", value);
    else if (bound)
        bcd_errors_add(&asked->errors, filter->name,
                       "is no number: it can be compared with = and "
                       "!= alone");
    else if (path->values & JOB_VALUES_OWNER)
        bcd_errors_add(&asked->errors, filter->name, "must be 1 to %d of a-z 0-9 _ -",
                       OWNER_SIZE - 1);
    else if (path->values & JOB_VALUES_TEXT)
        bcd_errors_add(&asked->errors, filter->name, "must be a text, not nothing");
    else
        bcd_errors_add(&asked->errors, filter->name, "must be one of %s, not \"%.40s\"",
                       path->words, value);
}

/* Fills in what the path's values can be. A misspelt path must not look like a job that is not
 * there. */
static bool check_path(struct asked *asked, const char *name, struct job_path *path)
{
    char looked_for[JOB_PATH_SIZE];
    bool known = false;
    memcpy(looked_for, path->name, sizeof(looked_for));
    if (job_path_plain(looked_for, path))
        return asked->errors.count == 0;
    *path = (struct job_path){.values = JOB_VALUES_NUMBER};
    memcpy(path->name, looked_for, sizeof(looked_for));
    bool fact = strncmp(looked_for, "derived.", 8) == 0;
    if (fact || strncmp(looked_for, "results.", 8) == 0)
        store_find_known(asked->service->store, looked_for, &known);
    if (!known)
        fault_unknown(asked, name, looked_for);
    if (fact)
        find_fact(looked_for, path);
    return asked->errors.count == 0;
}

/* Facts that only some jobs have are warnings. */
static void find_fact(const char *name, struct job_path *path)
{
    struct job_paths paths;
    job_paths_init(&paths);
    if (!job_paths_find(&paths, name, path))
        path->values = JOB_VALUES_NUMBER | JOB_VALUES_TEXT;
    job_paths_fini(&paths);
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
        const char *candidate = paths.path[i].name;
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
                       "derived., results., outcome. and so on, and what has no dot");
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
