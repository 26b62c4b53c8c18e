/* SPDX-License-Identifier: GPL-3.0-or-later
 * report_work_precision_print.c - the report as JSON, as CSV and as a table for people. */
#include "report_machine.h"
#include "report_run.h"
#include "report_work_precision.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void add_scene(struct text *json, const struct work_precision_result *result);

char *work_precision_print_json(const struct work_precision *report)
{
    struct text json = {0};
    char *machine = report_machine_json();
    bool first = true;
    text_add(&json, "{\"machine\":%s,\"version\":\"%s\",\"result_version\":%d",
             machine ? machine : "null", BCD_VERSION, BCD_RESULT_VERSION);
    json.failed = json.failed || !machine;
    free(machine);
    report_add_member(&json, "core_seconds_per_entry", report->options.core_seconds);
    report_add_member(&json, "tolerance", WORK_PRECISION_TOLERANCE);
    text_add(&json, ",\"tolerance_of\":\"density_l1\",\"scenes\":[");
    for (size_t i = 0; i < WORK_PRECISION_SCENES; i++) {
        if (!report->result[i].scene)
            continue;
        text_add(&json, first ? "\n" : ",\n");
        first = false;
        add_scene(&json, &report->result[i]);
    }
    text_add(&json, "\n]}\n");
    return text_take(&json);
}

/* ------------------------------------------------------------------- JSON */

static void add_entry(struct text *json, const struct work_precision_entry *entry)
{
    text_add(json, "{\"method\":\"%s\"", entry->method);
    report_add_member(json, "time_step", entry->time_step);
    report_add_member(json, "cost", entry->cost);
    for (int k = 0; k < WORK_PRECISION_KINDS; k++)
        report_add_member(json, work_precision_kind_name(k), entry->value[k].error);
    text_add(json, ",\"stderr\":{");
    for (int k = 0; k < WORK_PRECISION_KINDS; k++) {
        text_add(json, "%s\"%s\":", k ? "," : "", work_precision_kind_name(k));
        text_add_number(json, entry->value[k].stderror);
    }
    text_add(json, "}");
    report_add_member(json, "density_l1_noise", entry->density_noise);
    report_add_member(json, "time", entry->time);
    report_add_member(json, "drift_time", entry->drift_time);
    if (entry->reason[0]) {
        text_add(json, ",\"reason\":");
        text_add_json_string(json, entry->reason);
    }
    if (entry->drift_reason[0]) {
        text_add(json, ",\"drift_error_reason\":");
        text_add_json_string(json, entry->drift_reason);
    }
    text_add(json, "}");
}

/* The job as the first entry ran it: another entry has its own method, step and time. */
static void add_job(struct text *json, const struct work_precision_result *result)
{
    text_add(json, "\"job\":%s,\"theory\":{\"energy\":", result->job[0] ? result->job : "null");
    text_add_number(json, result->energy);
    report_add_member(json, "contact_density", result->contact);
    text_add(json, "},\"drift\":{\"method\":\"strang\"");
    report_add_member(json, "force", result->scene->drift_force);
    report_add_member(json, "velocity", result->reference.velocity);
    report_add_member(json, "stderr", result->reference.stderror);
    report_add_member(json, "time_step", result->reference.time_step);
    if (result->reference.reason[0]) {
        text_add(json, ",\"reason\":");
        text_add_json_string(json, result->reference.reason);
    }
    text_add(json, "}");
}

static void add_orders(struct text *json, const struct work_precision_method *method)
{
    text_add(json, "\"%s\":{", method->name);
    for (int k = 0; k < WORK_PRECISION_KINDS; k++) {
        const char *reason;
        text_add(json, "%s\"%s\":{\"order\":", k ? "," : "", work_precision_kind_name(k));
        text_add_number(json, work_precision_order(&method->fit[k], &reason));
        report_add_member(json, "stderr", reason ? NAN : method->fit[k].order_stderror);
        text_add(json, ",\"points\":%zu", method->fit[k].points);
        if (reason)
            text_add(json, ",\"reason\":\"%s\"", reason);
        text_add(json, "}");
    }
    text_add(json, "}");
}

enum list { ORDER, ORDERS, COST, HOW, REFUSED, LISTS };

/* One object with a member for each method that has something to say in it. */
static void add_list(struct text *json, const struct work_precision_result *result, enum list list)
{
    static const char *const names[LISTS] = {"order", "orders", "cost_at_tolerance",
                                             "cost_at_tolerance_how", "refused"};
    bool first = true;
    text_add(json, ",\n\"%s\":{", names[list]);
    for (size_t i = 0; i < result->method_count; i++) {
        const struct work_precision_method *method = &result->method[i];
        const char *reason;
        if ((method->count == 0) != (list == REFUSED))
            continue;
        text_add(json, first ? "" : ",");
        first = false;
        if (list == ORDERS) {
            add_orders(json, method);
        } else if (list == HOW || list == REFUSED) {
            text_add(json, "\"%s\":", method->name);
            text_add_json_string(json, list == HOW ? method->how : method->refused);
        } else {
            text_add(json, "\"%s\":", method->name);
            text_add_number(
                json, list == ORDER
                          ? work_precision_order(&method->fit[WORK_PRECISION_DENSITY], &reason)
                          : method->cost_at_tolerance);
        }
    }
    text_add(json, "}");
}

static void add_scene(struct text *json, const struct work_precision_result *result)
{
    text_add(json, "{\"name\":\"%s\",", result->scene->name);
    add_job(json, result);
    text_add(json, ",\"entries\":[");
    for (size_t i = 0; i < result->entry_count; i++) {
        text_add(json, i ? ",\n" : "\n");
        add_entry(json, &result->entry[i]);
    }
    text_add(json, "]");
    for (int list = 0; list < LISTS; list++)
        add_list(json, result, list);
    text_add(json, "}");
}

/* -------------------------------------------------------------------- CSV */

/* An absent number is an empty field. */
static void add_field(struct text *csv, double value)
{
    text_add(csv, ",");
    if (isfinite(value))
        text_add_number(csv, value);
}

char *work_precision_print_csv(const struct work_precision *report)
{
    struct text csv = {0};
    text_add(&csv, "scene,method,time_step,cost");
    for (int k = 0; k < WORK_PRECISION_KINDS; k++)
        text_add(&csv, ",%s,%s_stderr", work_precision_kind_name(k), work_precision_kind_name(k));
    text_add(&csv, ",density_l1_noise\r\n");
    for (size_t s = 0; s < WORK_PRECISION_SCENES; s++) {
        const struct work_precision_result *result = &report->result[s];
        for (size_t i = 0; result->scene && i < result->entry_count; i++) {
            const struct work_precision_entry *entry = &result->entry[i];
            text_add(&csv, "%s,%s", result->scene->name, entry->method);
            add_field(&csv, entry->time_step);
            add_field(&csv, entry->cost);
            for (int k = 0; k < WORK_PRECISION_KINDS; k++) {
                add_field(&csv, entry->value[k].error);
                add_field(&csv, entry->value[k].stderror);
            }
            add_field(&csv, entry->density_noise);
            text_add(&csv, "\r\n");
        }
    }
    return text_take(&csv);
}

/* ------------------------------------------------------------------ table */

/* "+0.0123(45)"-like would be shorter, but cannot be read by programs: value and error apart. */
static void add_cell(struct text *text, double value, const char *format, int width)
{
    char cell[32];
    if (isnan(value))
        snprintf(cell, sizeof cell, "-");
    else
        snprintf(cell, sizeof cell, format, value);
    text_add(text, " %*s", width, cell);
}

static void add_rows(struct text *text, const struct work_precision_result *result)
{
    for (size_t i = 0; i < result->entry_count; i++) {
        const struct work_precision_entry *entry = &result->entry[i];
        text_add(text, "%-7s %-17s", result->scene->name, entry->method);
        add_cell(text, entry->time_step, "%.2e", 9);
        add_cell(text, entry->cost, "%.2e", 9);
        for (int k = 0; k < WORK_PRECISION_KINDS; k++) {
            bool density = k == WORK_PRECISION_DENSITY;
            add_cell(text, entry->value[k].error, density ? "%.4f" : "%+.4f", 9);
            add_cell(text, density ? entry->density_noise : entry->value[k].stderror, "%.4f", 7);
        }
        text_add(text, "\n");
    }
}

static void add_summary(struct text *text, const struct work_precision_result *result)
{
    for (size_t i = 0; i < result->method_count; i++) {
        const struct work_precision_method *method = &result->method[i];
        text_add(text, "%-7s %-17s", result->scene->name, method->name);
        if (method->count == 0) {
            text_add(text, " left out: %s\n", method->refused);
            continue;
        }
        for (int k = 0; k < WORK_PRECISION_KINDS; k++) {
            const char *reason;
            add_cell(text, work_precision_order(&method->fit[k], &reason), "%.2f", 8);
            add_cell(text, reason ? NAN : method->fit[k].order_stderror, "%.2f", 5);
        }
        add_cell(text, method->cost_at_tolerance, "%.2e", 11);
        text_add(text, "  %s\n", method->how);
    }
}

char *work_precision_print_table(const struct work_precision *report)
{
    struct text text = {0};
    text_add(&text, "%-7s %-17s %9s %9s %9s %7s %9s %7s %9s %7s %9s %7s\n", "scene", "method",
             "h", "cost ns", "energy", "+-", "L1", "noise", "contact", "+-", "drift", "+-");
    for (size_t s = 0; s < WORK_PRECISION_SCENES; s++)
        if (report->result[s].scene)
            add_rows(&text, &report->result[s]);
    text_add(&text,
             "\norders of the error in h (energy, L1, contact, drift), and cost at L1 = %g\n",
             WORK_PRECISION_TOLERANCE);
    for (size_t s = 0; s < WORK_PRECISION_SCENES; s++)
        if (report->result[s].scene)
            add_summary(&text, &report->result[s]);
    return text_take(&text);
}
