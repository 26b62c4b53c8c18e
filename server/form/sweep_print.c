/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sweep_print.h"
#include "record_json.h"
#include "text.h"
#include "ticket_json.h"

#include <inttypes.h>

static void add_record(struct text *text, const struct sweep_record *record, bool whole);
static void add_counts(struct text *text, const struct sweep_record *record);

char *sweep_print(const struct sweep_view *view)
{
    struct text text = {0};
    text_add(&text, "{");
    add_record(&text, view->record, true);
    if (view->origin == SWEEP_NEW || view->origin == SWEEP_DEDUPLICATED)
        text_add(&text, ",\"deduplicated\":%s",
                 view->origin == SWEEP_DEDUPLICATED ? "true" : "false");
    if (view->origin == SWEEP_RETRIED)
        text_add(&text, ",\"retried\":%" PRId64, view->retried);
    text_add(&text, "}\n");
    return text_take(&text);
}

char *sweep_print_list(const struct sweep_record *records, size_t count, int64_t next)
{
    struct text text = {0};
    text_add(&text, "{\"sweeps\":[");
    for (size_t i = 0; i < count; i++) {
        text_add(&text, i ? ",\n{" : "{");
        add_record(&text, &records[i], false);
        text_add(&text, "}");
    }
    record_json_end_page_at(&text, next);
    return text_take(&text);
}

/* base, axes and zip are JSON already. */
static void add_record(struct text *text, const struct sweep_record *record, bool whole)
{
    text_add(text, "\"id\":\"%s\",", record->id);
    ticket_json_add(text, &record->ticket);
    record_json_add_time(text, "submitted_at", record->submitted_ms);
    record_json_add_time(text, "cancelled_at", record->cancelled_ms);
    add_counts(text, record);
    if (whole)
        text_add(text, ",\"base\":%s,\"axes\":%s,\"zip\":%s", record->base, record->axes,
                 record->zip);
    text_add(text,
             ",\"links\":{\"self\":\"/v1/sweeps/%s\",\"jobs\":\"/v1/jobs?sweep=%s\","
             "\"results\":\"/v1/sweeps/%s/results/{observable}\"}",
             record->id, record->id, record->id);
}

/* progress: the share of points that have ended, whichever way. */
static void add_counts(struct text *text, const struct sweep_record *record)
{
    int64_t ended =
        record->counts[JOB_DONE] + record->counts[JOB_FAILED] + record->counts[JOB_CANCELLED];
    text_add(text, ",\"jobs\":%" PRId64 ",\"states\":{", record->points);
    for (int s = 0; s < JOB_STATES; s++)
        text_add(text, "%s\"%s\":%" PRId64, s ? "," : "", job_state_name((enum job_state)s),
                 record->counts[s]);
    text_add(text, "},\"progress\":");
    text_add_number(text, record->points > 0 ? (double)ended / (double)record->points : 1);
}
