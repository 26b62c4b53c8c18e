/* SPDX-License-Identifier: GPL-3.0-or-later
 * report_stability_print.c - the verdicts as JSON and as CSV. */
#include "report_machine.h"
#include "report_run.h"
#include "report_stability.h"
#include "text.h"

#include <math.h>
#include <stdlib.h>

struct member {
    const char *name;
    double value;
};
enum { MEMBERS = 7 };

static void list_numbers(const struct stability_entry *entry, struct member members[MEMBERS])
{
    const struct stability_result *result = &entry->result;
    const struct member all[MEMBERS] = {
        {"off", result->off},
        {"stderr", result->stderror},
        {"time_step_error", result->time_step_error},
        {"bound", entry->extreme->bound},
        {"time_step", result->time_step},
        {"time", result->time},
        {"core_seconds", result->core_seconds},
    };
    for (size_t i = 0; i < MEMBERS; i++)
        members[i] = all[i];
}

static void add_entry(struct text *json, const struct stability_entry *entry)
{
    struct member members[MEMBERS];
    list_numbers(entry, members);
    text_add(json, "\n{\"extreme\":");
    text_add_json_string(json, entry->extreme->name);
    text_add(json, ",\"method\":\"%s\",\"verdict\":", entry->method);
    text_add_json_string(json, stability_verdict_name(entry->result.verdict));
    text_add(json, ",\"failed\":%s", stability_failed(entry->result.verdict) ? "true" : "false");
    for (size_t i = 0; i < MEMBERS; i++)
        report_add_member(json, members[i].name, members[i].value);
    text_add(json, ",\"reason\":");
    if (entry->result.words[0])
        text_add_json_string(json, entry->result.words);
    else
        text_add(json, "null");
    text_add(json, ",\"job\":{%s}}", entry->extreme->members);
}

char *stability_print_entries(const struct stability_entry *entries, size_t count)
{
    struct text json = {0};
    for (size_t i = 0; i < count; i++) {
        text_add(&json, "%s", i ? "," : "");
        add_entry(&json, &entries[i]);
    }
    return text_take(&json);
}

char *stability_print_begin(void)
{
    struct text json = {0};
    char *machine = report_machine_json();
    text_add(&json, "{\"machine\":%s,\"version\":\"%s\",\"result_version\":%d,\"entries\":[",
             machine ? machine : "null", BCD_VERSION, BCD_RESULT_VERSION);
    json.failed = json.failed || !machine;
    free(machine);
    return text_take(&json);
}

char *stability_print_end(size_t tried, size_t failed, bool interrupted)
{
    struct text json = {0};
    text_add(&json, "\n],\"tried\":%zu,\"failed\":%zu,\"interrupted\":%s}\n", tried, failed,
             interrupted ? "true" : "false");
    return text_take(&json);
}

char *stability_print_json(const struct stability *report)
{
    struct text json = {0};
    char *pieces[] = {
        stability_print_begin(),
        stability_print_entries(report->entry, report->count),
        stability_print_end(report->count, report->failed, report->count < report->planned),
    };
    for (size_t i = 0; i < sizeof pieces / sizeof *pieces; i++) {
        text_add(&json, "%s", pieces[i] ? pieces[i] : "");
        json.failed = json.failed || !pieces[i];
        free(pieces[i]);
    }
    return text_take(&json);
}

/* ---------------------------------------------------------------------- CSV */

/* RFC 4180: in quotes, which are doubled within. */
static void add_field(struct text *csv, const char *string)
{
    text_add(csv, "\"");
    for (const char *c = string; *c; c++) {
        if (*c == '"')
            text_add_bytes(csv, c, 1);
        text_add_bytes(csv, c, 1);
    }
    text_add(csv, "\"");
}

char *stability_print_csv(const struct stability *report)
{
    struct text csv = {0};
    text_add(&csv, "extreme,method,verdict,off,stderr,time_step_error,bound,time_step,time,"
                   "core_seconds,reason\r\n");
    for (size_t i = 0; i < report->count; i++) {
        const struct stability_entry *entry = &report->entry[i];
        struct member members[MEMBERS];
        list_numbers(entry, members);
        add_field(&csv, entry->extreme->name);
        text_add(&csv, ",%s,%s", entry->method, stability_verdict_name(entry->result.verdict));
        for (size_t m = 0; m < MEMBERS; m++) {
            text_add(&csv, ",");
            if (isfinite(members[m].value))
                text_add_number(&csv, members[m].value);
        }
        text_add(&csv, ",");
        if (entry->result.words[0])
            add_field(&csv, entry->result.words);
        text_add(&csv, "\r\n");
    }
    return text_take(&csv);
}
