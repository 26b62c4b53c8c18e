/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_reports.h - reports kept in the database, one of each name. See store.h for threads, errors
 * and memory. */
#ifndef STORE_REPORTS_H
#define STORE_REPORTS_H

#include "store.h"

#include <stdint.h>

enum report_form { REPORT_JSON, REPORT_CSV, REPORT_SVG, REPORT_FORMS };

struct report_new {
    const char *name;
    const char *version, *machine; /* what it is valid for */
    const char *form[REPORT_FORMS];
};

/* Replaces the report of that name, whole or not at all. */
enum store_status store_reports_put(struct store *store, const struct report_new *report);

/* One form of a report that was measured by this version on this machine, malloc'ed;
 * STORE_NOT_FOUND when there is none, or one of another version or machine. */
enum store_status store_reports_get(struct store *store, const struct report_new *which,
                                    enum report_form form, char **text);

/* When that report was measured, ms since 1970; STORE_NOT_FOUND as above. */
enum store_status store_reports_when(struct store *store, const struct report_new *which,
                                     int64_t *created_ms);

#endif
