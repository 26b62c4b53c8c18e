/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "record_json.h"
#include "text.h"
#include "ticket_json.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

static void add_record(struct text *text, const struct record_view *view);

char *record_json_print(const struct record_view *view)
{
    struct text text = {0};
    add_record(&text, view);
    text_add(&text, "\n");
    return text_take(&text);
}

char *record_json_print_list(const struct record_view *views, size_t count, const char *next)
{
    struct text text = {0};
    text_add(&text, "{\"jobs\":[");
    for (size_t i = 0; i < count; i++) {
        if (i > 0)
            text_add(&text, ",\n");
        add_record(&text, &views[i]);
    }
    record_json_end_page(&text, next);
    return text_take(&text);
}

char *record_json_print_attempts(const struct attempt *attempts, size_t count)
{
    struct text text = {0};
    text_add(&text, "{\"attempts\":[");
    for (size_t i = 0; i < count; i++) {
        const struct attempt *attempt = &attempts[i];
        text_add(&text, "%s{\"number\":%" PRId64, i > 0 ? ",\n" : "", attempt->number);
        record_json_add_time(&text, "started_at", attempt->started_ms);
        record_json_add_time(&text, "ended_at", attempt->ended_ms);
        text_add(&text, ",\"ended\":");
        if (attempt->ended[0])
            text_add_json_string(&text, attempt->ended);
        else
            text_add(&text, "null");
        text_add(&text, ",\"saves\":%" PRId64 ",\"core_seconds\":", attempt->saves);
        text_add_number(&text, attempt->core_seconds);
        text_add(&text, ",\"reason\":");
        if (attempt->reason)
            text_add_json_string(&text, attempt->reason);
        else
            text_add(&text, "null");
        text_add(&text, "}");
    }
    text_add(&text, "]}\n");
    return text_take(&text);
}

static void add_ahead(struct text *text, const struct record_ahead *ahead)
{
    bool ends = isfinite(ahead->finishes_in) && ahead->finishes_in < 1e10;
    text_add(text, ",\"calibration\":{\"factor\":");
    text_add_number(text, ahead->factor);
    text_add(text, ",\"measured_core_seconds\":");
    text_add_number(text, ahead->measured_seconds);
    text_add(text, "},\"queue\":{\"jobs_before\":%" PRId64 ",\"core_seconds_before\":",
             ahead->jobs_before);
    text_add_number(text, ahead->core_seconds_before);
    text_add(text, "},\"finishes_in_seconds\":");
    if (ends)
        text_add_number(text, ahead->finishes_in);
    else
        text_add(text, "null");
    record_json_add_time(text, "finishes_at",
                         ends ? ahead->now_ms + (int64_t)(1000 * ahead->finishes_in) : 0);
    text_add(text, ",\"derived\":%s", ahead->derived);
}

char *record_json_estimate(const struct bcd_estimate *estimate, int64_t chunks,
                           const struct record_ahead *ahead)
{
    const struct {
        const char *name;
        double value;
    } rows[] = {
        {"memory_bytes", estimate->run_bytes},
        {"result_bytes", estimate->result_bytes},
        {"disk_bytes", estimate->tally_bytes + estimate->result_bytes},
        {"steps", estimate->steps},
        {"rod_steps", estimate->rod_steps},
        {"core_seconds", estimate->core_seconds},
        {"theory_core_seconds", estimate->theory_seconds},
    };
    struct text text = {0};
    text_add(&text, "{");
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        text_add(&text, "\"%s\":", rows[i].name);
        text_add_number(&text, rows[i].value);
        text_add(&text, ",");
    }
    text_add(&text, "\"chunks\":%" PRId64, chunks);
    if (ahead)
        add_ahead(&text, ahead);
    text_add(&text, "}\n");
    return text_take(&text);
}

/* job, derived and outcome are compact JSON already, made by scene_json.c when the job was accepted
 * and by outcome_json.c when it was done; they go out as they are, so that every number keeps every
 * digit. */
static void add_record(struct text *text, const struct record_view *view)
{
    const struct job_record *record = view->record;
    text_add(text, "{\"id\":\"%s\",", record->id);
    ticket_json_add(text, &record->ticket);
    text_add(text, ",\"state\":\"%s\",\"progress\":", job_state_name(record->state));
    text_add_number(text, view->progress);
    record_json_add_time(text, "submitted_at", record->submitted_ms);
    record_json_add_time(text, "started_at", record->started_ms);
    record_json_add_time(text, "finished_at", record->finished_ms);
    text_add(text, ",\"job\":"); /* they are long, and printf goes byte by byte */
    text_add_bytes(text, record->job, strlen(record->job));
    text_add(text, ",\"derived\":");
    text_add_bytes(text, record->derived, strlen(record->derived));
    text_add(text, ",\"error\":");
    if (record->error)
        text_add_json_string(text, record->error);
    else
        text_add(text, "null");
    text_add(text, ",\"outcome\":%s", record->outcome ? record->outcome : "null");
    text_add(text, ",\"attempts\":{\"lost\":%" PRId64 ",\"failed\":%" PRId64 "}",
             record->attempts_lost, record->attempts_failed);
    if (view->origin != RECORD_PLAIN)
        text_add(text, ",\"deduplicated\":%s",
                 view->origin == RECORD_DEDUPLICATED ? "true" : "false");
    text_add(text,
             ",\"links\":{\"self\":\"/v1/jobs/%s\",\"results\":\"/v1/jobs/%s/results\","
             "\"events\":\"/v1/jobs/%s/events\"}}",
             record->id, record->id, record->id);
}

void record_json_end_page(struct text *text, const char *next)
{
    if (next)
        text_add(text, "],\"next\":\"%s\"}\n", next);
    else
        text_add(text, "],\"next\":null}\n");
}

void record_json_end_page_at(struct text *text, int64_t next)
{
    char cursor[24];
    snprintf(cursor, sizeof(cursor), "%" PRId64, next);
    record_json_end_page(text, next > 0 ? cursor : NULL);
}

void record_json_add_time(struct text *text, const char *name, int64_t ms)
{
    text_add(text, ",\"%s\":", name);
    struct tm utc;
    time_t seconds = (time_t)(ms / 1000);
    if (ms <= 0 || !gmtime_r(&seconds, &utc)) {
        text_add(text, "null");
        return;
    }
    text_add(text, "\"%04d-%02d-%02dT%02d:%02d:%02d.%03dZ\"", utc.tm_year + 1900, utc.tm_mon + 1,
             utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, (int)(ms % 1000));
}
